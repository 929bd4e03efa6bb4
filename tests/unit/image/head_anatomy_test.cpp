// The anatomy against what is published of sizes and distances (docs/validation/phantom.md names the sources), for ten
// individuals.
#include "osteo/imaging/image/detail/head_anatomy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include "osteo/imaging/image/phantom.h"

namespace osteo {
namespace {

constexpr int kIndividuals = 10;

const HeadAnatomy& individual(int i) {
  static const std::vector<HeadAnatomy> all = [] {
    std::vector<HeadAnatomy> v;
    for (int n = 0; n < kIndividuals; ++n) v.emplace_back(static_cast<std::uint64_t>(n));
    return v;
  }();
  return all[static_cast<std::size_t>(i)];
}

// How far along a ray from `p` the tissue is met.
std::optional<double> along(const HeadAnatomy& head, Vec3 p, Vec3 direction, Tissue tissue, double most_mm) {
  const Vec3 d = normalized(direction);
  for (double s = 0; s < most_mm;) {
    const HeadAnatomy::Sample at = head.sample(p + d * s);
    if (at.tissue == tissue) return s;
    s += std::max(at.margin_mm, 0.02);
  }
  return std::nullopt;
}

// Thickness of bone along a ray, from the first bone to what is none.
double wall(const HeadAnatomy& head, Vec3 p, Vec3 direction, double most_mm = 40) {
  const Vec3 d = normalized(direction);
  double from = -1;
  for (double s = 0; s < most_mm; s += 0.02) {
    const bool bone = is_bone(head.tissue(p + d * s));
    if (bone && from < 0) from = s;
    if (!bone && from >= 0) return s - from;
  }
  return 0;
}

// Distance of `p` to the nearest point of a tissue, by rays in 200 directions.
double nearest(const HeadAnatomy& head, Vec3 p, Tissue tissue, double most_mm) {
  double best = most_mm;
  for (int i = 0; i < 200; ++i) {
    const double z = 1 - 2 * (i + 0.5) / 200, r = std::sqrt(1 - z * z), a = i * std::numbers::pi * (3 - std::sqrt(5.0));
    if (const auto s = along(head, p, {r * std::cos(a), r * std::sin(a), z}, tissue, best)) best = *s;
  }
  return best;
}

// The gap between two tubes.
double gap(std::span<const TubePoint> a, std::span<const TubePoint> b) {
  double best = 1e9;
  for (const TubePoint& p : a)
    for (const TubePoint& q : b) best = std::min(best, length(p.at_mm - q.at_mm) - p.radius_mm - q.radius_mm);
  return best;
}

double arc(std::span<const TubePoint> line) {
  double sum = 0;
  for (std::size_t i = 1; i < line.size(); ++i) sum += length(line[i].at_mm - line[i - 1].at_mm);
  return sum;
}

// The part of the nerve within the bone.
std::vector<TubePoint> nerve_between(const HeadAnatomy& head, double from_mm, double to_mm) {
  std::vector<TubePoint> out;
  double s = 0;
  const auto line = head.facial_nerve();
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (i > 0) s += length(line[i].at_mm - line[i - 1].at_mm);
    if (s >= from_mm - 1e-9 && s <= to_mm + 1e-9) out.push_back(line[i]);
  }
  return out;
}

// A point of the nerve's vertical part at a height.
TubePoint nerve_at_height(const HeadAnatomy& head, double z) {
  const auto m = head.facial_nerve_marks();
  TubePoint best;
  double least = 1e9;
  for (const TubePoint& p : nerve_between(head, m.second_genu_mm, m.foramen_mm)) {
    if (std::abs(p.at_mm.z - z) < least) least = std::abs(p.at_mm.z - z), best = p;
  }
  return best;
}

TEST(HeadAnatomy, EveryPointWithinTheMarginHasTheSameTissue) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> one(-1, 1);
  for (const int who : {0, 4}) {
    const HeadAnatomy& head = individual(who);
    for (int n = 0; n < 60000; ++n) {
      // The whole head, and more of the ear.
      const Vec3 p = n % 2 == 0 ? Vec3{95 * one(random), -9 + 115 * one(random), -7 + 115 * one(random)}
                                : Vec3{46 + 20 * one(random), 12 + 25 * one(random), -24 + 22 * one(random)};
      const HeadAnatomy::Sample s = head.sample(p);
      ASSERT_GE(s.margin_mm, 0);
      const Vec3 d = normalized({one(random), one(random), one(random)});
      const Vec3 q = p + d * (s.margin_mm * 0.999 * (n % 3 == 0 ? std::abs(one(random)) : 1));
      ASSERT_EQ(head.tissue(q), s.tissue)
          << tissue_name(head.tissue(q)) << " beside " << tissue_name(s.tissue) << " with margin " << s.margin_mm
          << " at " << p.x << ", " << p.y << ", " << p.z << " of " << who;
    }
  }
}

TEST(HeadAnatomy, SidesAreMirrorImagesButForTheMarker) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> one(-1, 1);
  for (int n = 0; n < 20000; ++n) {
    const Vec3 p{90 * one(random), 100 * one(random), -7 + 110 * one(random)};
    const Tissue a = individual(0).tissue(p), b = individual(0).tissue({-p.x, p.y, p.z});
    if (a != Tissue::left_marker && b != Tissue::left_marker) {
      EXPECT_EQ(a, b);
    }
  }
}

TEST(HeadAnatomy, FacialNerveHasPublishedLengthsAndLiesWhereItsLineSays) {
  for (int i = 0; i < kIndividuals; ++i) {
    const HeadAnatomy& head = individual(i);
    const auto m = head.facial_nerve_marks();
    EXPECT_NEAR(m.geniculate_mm - m.fundus_mm, 4, 1.5) << i;        // labyrinthine 3 to 5
    EXPECT_NEAR(m.second_genu_mm - m.geniculate_mm, 11, 2.5) << i;  // tympanic 8 to 13
    EXPECT_NEAR(m.foramen_mm - m.second_genu_mm, 14, 3) << i;       // mastoid 10 to 18
    const auto line = head.facial_nerve();
    EXPECT_GT(arc(line), 45);
    double walked = 0;
    for (std::size_t n = 0; n + 1 < line.size(); ++n) {
      const Vec3 at = line[n].at_mm, way = normalized(line[n + 1].at_mm - at);
      EXPECT_EQ(head.tissue(at), Tissue::facial_nerve);
      EXPECT_GT(2 * line[n].radius_mm, 0.8);
      EXPECT_LT(2 * line[n].radius_mm, 2.1);
      walked += length(line[n + 1].at_mm - at);
      if (std::abs(walked - m.geniculate_mm) < 3) continue;  // the hairpin, where the nerve lies beside itself
      const Vec3 side = any_perpendicular(way), other = cross(way, side);
      for (const Vec3 d :
           {side, -side, other, -other}) {  // across the line the label ends at the radius; bends and tapers aside
        EXPECT_EQ(head.tissue(at + d * (line[n].radius_mm * 0.9)), Tissue::facial_nerve);
        EXPECT_NE(head.tissue(at + d * (line[n].radius_mm * 1.25 + 0.1)), Tissue::facial_nerve);
      }
    }
  }
}

TEST(HeadAnatomy, TubesAreOnePieceInTheLabels) {
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 0.6;
  p.noise_hu = 0;
  for (const int who : {0, 6}) {
    p.individual = who;
    const Phantom phantom = make_phantom(p);
    for (const Tissue t :
         {Tissue::facial_nerve, Tissue::sigmoid_sinus, Tissue::labyrinth, Tissue::tympanic_cavity, Tissue::ear_canal}) {
      // Pieces of the label, joined by corners.
      const Frame& f = phantom.labels.frame;
      std::vector<std::uint8_t> left(f.voxel_count());
      std::size_t all = 0, first = 0;
      for (std::size_t v = 0; v < left.size(); ++v) {
        left[v] = phantom.labels.span()[v] == static_cast<std::uint8_t>(t);
        if (left[v] != 0) first = v, ++all;
      }
      ASSERT_GT(all, 100u) << tissue_name(t);
      std::vector<std::size_t> open{first};
      std::size_t reached = 0;
      left[first] = 0;
      while (!open.empty()) {
        const std::size_t v = open.back();
        open.pop_back();
        ++reached;
        const auto nx = static_cast<std::size_t>(f.dims[0]), ny = static_cast<std::size_t>(f.dims[1]);
        const int x = static_cast<int>(v % nx), y = static_cast<int>(v / nx % ny), z = static_cast<int>(v / nx / ny);
        for (int n = 0; n < 27; ++n) {
          const int i = x + n % 3 - 1, j = y + n / 3 % 3 - 1, k = z + n / 9 - 1;
          if (i < 0 || j < 0 || k < 0 || i >= f.dims[0] || j >= f.dims[1] || k >= f.dims[2]) continue;
          const std::size_t at =
              (static_cast<std::size_t>(k) * ny + static_cast<std::size_t>(j)) * nx + static_cast<std::size_t>(i);
          if (left[at] == 0) continue;
          left[at] = 0;
          open.push_back(at);
        }
      }
      // The jugular vein leaves the block at no side: all of it is one. The auditory tube is thinner than two voxels.
      EXPECT_GE(static_cast<double>(reached), (t == Tissue::tympanic_cavity ? 0.9 : 1.0) * static_cast<double>(all))
          << tissue_name(t) << " of " << who;
    }
  }
}

TEST(HeadAnatomy, StructuresLieAsFarFromEachOtherAsPublished) {
  for (int i = 0; i < kIndividuals; ++i) {
    const HeadAnatomy& head = individual(i);
    const auto m = head.facial_nerve_marks();
    const auto mastoid = nerve_between(head, m.second_genu_mm, m.foramen_mm);
    const auto tympanic = nerve_between(head, m.geniculate_mm, m.second_genu_mm);
    const auto vessel = head.sigmoid_sinus();  // sigmoid part: from the petrous ridge down; then the bulb
    const double nerve_sinus = gap(mastoid, vessel.subspan(18, 24));
    EXPECT_GT(nerve_sinus, 3.5) << i;  // 7.2 and 8.1 with 1.8 and 2.3 standard deviation
    EXPECT_LT(nerve_sinus, 12.5) << i;
    const TubePoint umbo = nerve_at_height(head, -20);
    EXPECT_NEAR(nearest(head, umbo.at_mm, Tissue::ear_canal, 12) - umbo.radius_mm, 3.66, 2 * 0.76) << i;
    // Back from the canal's middle to the sinus.
    const auto sinus = along(head, {50, 1.5, -19.5}, {0.1, 1, 0}, Tissue::sigmoid_sinus, 40);
    ASSERT_TRUE(sinus) << i;
    EXPECT_NEAR(*sinus - 3.3, 13.7, 2 * 3.4) << i;
    const double bulb = gap(nerve_between(head, m.second_genu_mm - 0.1, m.second_genu_mm + 0.1), vessel.subspan(48));
    EXPECT_NEAR(bulb, 9.5, 2 * 2.6) << i;  // 8.7 and 11.2
    EXPECT_GT(gap(mastoid, vessel.subspan(48)), 1.5) << i;
    EXPECT_NEAR(gap(nerve_between(head, m.foramen_mm - 0.1, m.foramen_mm + 0.1), vessel.subspan(48)), 5.4, 2 * 2.2)
        << i;
    // Under the horizontal canal, clear of it by a wall.
    double lateral = 1e9;
    for (const TubePoint& p : tympanic)
      lateral = std::min(lateral, nearest(head, p.at_mm, Tissue::labyrinth, 6) - p.radius_mm);
    EXPECT_GT(lateral, 0.2) << i;
    EXPECT_LT(lateral, 2.5) << i;
    // The chorda leaves the nerve at an acute angle, and between the two a burr of 2 mm finds its way to the middle
    // ear.
    const auto chorda = head.chorda_tympani();
    const Vec3 up = normalized(nerve_at_height(head, -21).at_mm - nerve_at_height(head, -25.5).at_mm);
    const double angle = std::acos(dot(up, normalized(chorda[6].at_mm - chorda[0].at_mm))) * 180 / std::numbers::pi;
    EXPECT_NEAR(angle, 23.6, 2 * 6.8) << i;
    EXPECT_LT(nearest(head, chorda[0].at_mm, Tissue::facial_nerve, 3), 0.7) << i;
    const Vec3 recess = (umbo.at_mm + chorda[12].at_mm) * 0.5;
    EXPECT_GT(length(umbo.at_mm - chorda[12].at_mm) - umbo.radius_mm, 2.0) << i << ": " << recess.x;
  }
}

TEST(HeadAnatomy, PlatesAndTablesAreAsThickAsPublished) {
  for (int i = 0; i < kIndividuals; ++i) {
    const HeadAnatomy& head = individual(i);
    const double vault = wall(head, {0, 10, 60}, {0.25, 0.1, 1}, 80);
    EXPECT_NEAR(vault, 6.5, 1.5) << i;
    // Cortex, diploe, cortex.
    const auto diploe = along(head, {0, 10, 60}, {0.25, 0.1, 1}, Tissue::diploe, 80);
    ASSERT_TRUE(diploe) << i;
    const double tegmen = wall(head, {47.6, 14.2, -12.9}, {0, 0, 1});
    EXPECT_GT(tegmen, 0.5) << i;
    EXPECT_LT(tegmen, 5) << i;
    // Cortex over the mastoid's cells, from outside.
    const auto cortex = along(head, {80, 20, -28}, {-1, 0, 0}, Tissue::cortical, 40);
    const auto cells = along(head, {80, 20, -28}, {-1, 0, 0}, Tissue::air_cells, 40);
    ASSERT_TRUE(cortex && cells) << i;
    EXPECT_GT(*cells - *cortex, 1.2) << i;
    EXPECT_LT(*cells - *cortex, 6) << i;
    // No cell opens the nerve's canal, the sinus, the skull or the labyrinth.
    std::mt19937 random(static_cast<unsigned>(i));
    std::uniform_real_distribution<double> one(-1, 1);
    int air = 0;
    for (int n = 0; n < 40000; ++n) {
      const Vec3 p{54 + 13 * one(random), 17 + 22 * one(random), -26 + 22 * one(random)};
      if (head.tissue(p) != Tissue::air_cells) continue;
      ++air;
      const Vec3 q = p + normalized({one(random), one(random), one(random)}) * 0.45;
      const Tissue t = head.tissue(q);
      EXPECT_TRUE(t == Tissue::air_cells || t == Tissue::cellular || t == Tissue::cortical ||
                  t == Tissue::tympanic_cavity || t == Tissue::diploe)
          << tissue_name(t) << " of " << i;
    }
    EXPECT_GT(air, 2000) << i;
  }
}

TEST(HeadAnatomy, AirCellsHaveRandomSizesAndAreOneAir) {
  std::vector<double> first;
  for (int i = 0; i < kIndividuals; ++i) {
    const auto cells = individual(i).air_cells();
    EXPECT_GT(cells.size(), 150u) << i;
    double sum = 0, squares = 0;
    for (const AirCell& c : cells) {
      sum += 2 * c.radius_mm;
      squares += 4 * c.radius_mm * c.radius_mm;
      EXPECT_GE(c.wall_mm, 0.35);
      EXPECT_LE(c.wall_mm, 0.7);
    }
    const double mean = sum / static_cast<double>(cells.size()),
                 deviation = std::sqrt(squares / static_cast<double>(cells.size()) - mean * mean);
    EXPECT_NEAR(mean, 2.8, 1.0) << i;
    EXPECT_GT(deviation / mean, 0.2) << i;  // no lattice
    first.push_back(cells.front().centre_mm.x);
  }
  std::sort(first.begin(), first.end());
  EXPECT_EQ(std::adjacent_find(first.begin(), first.end()), first.end());
}

TEST(HeadAnatomy, VolumesAreInPublishedRanges) {
  for (int i = 0; i < kIndividuals; i += 3) {
    PhantomParams p;
    p.region = PhantomRegion::temporal;
    p.spacing_mm = 0.8;
    p.noise_hu = 0;
    p.individual = i;
    const Phantom phantom = make_phantom(p);
    std::array<double, kTissueCount> ml{};
    for (const auto l : phantom.labels.span()) ml[l] += phantom.labels.frame.voxel_volume_mm3() / 1000;
    const auto of = [&](Tissue t) { return ml[static_cast<std::size_t>(t)]; };
    std::printf(
        "%d: cells %.2f mL, walls %.2f, cavity and antrum %.2f, canal %.2f, labyrinth %.3f, ossicles %.3f, nerve "
        "%.3f\n",
        i, of(Tissue::air_cells), of(Tissue::cellular), of(Tissue::tympanic_cavity), of(Tissue::ear_canal),
        of(Tissue::labyrinth), of(Tissue::ossicle), of(Tissue::facial_nerve));
    EXPECT_GT(of(Tissue::air_cells), 3) << i;
    EXPECT_LT(of(Tissue::air_cells), 10) << i;
    EXPECT_GT(of(Tissue::tympanic_cavity), 0.8) << i;
    EXPECT_LT(of(Tissue::tympanic_cavity), 2.5) << i;
    EXPECT_GT(of(Tissue::ear_canal), 0.7) << i;
    EXPECT_LT(of(Tissue::ear_canal), 2.5) << i;
    EXPECT_GT(of(Tissue::labyrinth), 0.14) << i;
    EXPECT_LT(of(Tissue::labyrinth), 0.3) << i;
    EXPECT_GT(of(Tissue::ossicle), 0.015) << i;
    EXPECT_LT(of(Tissue::ossicle), 0.08) << i;
  }
}

TEST(HeadAnatomy, JawHoldsItsNerveAndTheTeethStandInBone) {
  for (int i = 0; i < kIndividuals; i += 3) {
    const HeadAnatomy& head = individual(i);
    const auto line = head.alveolar_nerve();
    std::size_t within = 0;
    for (std::size_t n = 6; n + 9 < line.size(); ++n) {
      EXPECT_EQ(head.tissue(line[n].at_mm), Tissue::alveolar_nerve) << i << ": " << n;
      const double cover = nearest(head, line[n].at_mm, Tissue::soft, 20) - line[n].radius_mm;
      within += cover > 1;
    }
    EXPECT_GT(within, (line.size() - 15) * 3 / 4) << i;
    for (const double side : {1.0, -1.0}) {
      // 16 teeth on a side of both jaws: met from outside along the row.
      int teeth = 0;
      for (const double z : {-63.5, -75.0}) {
        Tissue before = Tissue::soft;
        for (double a = 0; a < 1.62; a += 0.001) {
          const Vec3 p{side * (z > -70 ? 28.5 : 26.5) * std::sin(a),
                       -46 + (z > -70 ? 0 : 1) - (z > -70 ? 44 : 41) * std::cos(a), z};
          const Tissue t = head.tissue(p);
          teeth += t == Tissue::tooth && before != Tissue::tooth;
          before = t;
        }
      }
      EXPECT_GE(teeth, 14) << i;
      EXPECT_LE(teeth, 18) << i;
    }
    // Joint: a gap between condyle and fossa.
    const double joint = wall(head, {50.5, -13.5, -23}, {0, 0, 1}, 10);
    EXPECT_GT(joint, 0.5) << i;
  }
}

}  // namespace
}  // namespace osteo
