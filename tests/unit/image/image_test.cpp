#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

#include "osteo/core/base/error.h"
#include "osteo/geometry/distance/binary_distance.h"
#include "osteo/imaging/image/components.h"
#include "osteo/imaging/image/crop.h"
#include "osteo/imaging/image/phantom.h"
#include "osteo/imaging/image/structures.h"
#include "osteo/imaging/image/threshold.h"

namespace osteo {
namespace {

std::vector<std::uint8_t> random_mask(std::size_t n, double share, unsigned seed) {
  std::mt19937 random(seed);
  std::bernoulli_distribution on(share);
  std::vector<std::uint8_t> mask(n);
  for (auto& v : mask) v = on(random) ? 1 : 0;
  return mask;
}

// Flood fill, the obvious way.
std::vector<int> brute_components(const std::vector<std::uint8_t>& mask, std::array<int, 3> d, bool full,
                                  std::uint8_t value) {
  std::vector<int> label(mask.size(), -1);
  int next = 0;
  for (std::size_t s = 0; s < mask.size(); ++s) {
    if (mask[s] != value || label[s] >= 0) continue;
    std::vector<std::size_t> stack{s};
    label[s] = next;
    while (!stack.empty()) {
      const std::size_t at = stack.back();
      stack.pop_back();
      const int i = at % d[0], j = at / d[0] % d[1], k = at / d[0] / d[1];
      for (int n = 0; n < 27; ++n) {
        const int di = n % 3 - 1, dj = n / 3 % 3 - 1, dk = n / 9 - 1;
        if (!full && std::abs(di) + std::abs(dj) + std::abs(dk) != 1) continue;
        const int x = i + di, y = j + dj, z = k + dk;
        if (x < 0 || y < 0 || z < 0 || x >= d[0] || y >= d[1] || z >= d[2]) continue;
        const std::size_t to = (static_cast<std::size_t>(z) * d[1] + y) * d[0] + x;
        if (mask[to] != value || label[to] >= 0) continue;
        label[to] = next;
        stack.push_back(to);
      }
    }
    ++next;
  }
  return label;
}

TEST(Components, EqualFloodFill) {
  const std::array<int, 3> d{13, 9, 11};
  for (unsigned seed = 0; seed < 24; ++seed) {
    const bool full = seed % 2 == 0;
    const auto value = static_cast<std::uint8_t>(seed / 2 % 2);
    const auto mask = random_mask(13 * 9 * 11, 0.1 + 0.03 * seed, seed);
    const auto expected = brute_components(mask, d, full, value);
    const auto found = connected_components(mask, d, value, full ? Connectivity::full : Connectivity::face);
    std::uint64_t voxels = 0;
    for (std::size_t r = 0; r < found.runs.size(); ++r) {
      for (std::uint32_t x = found.runs[r].begin; x < found.runs[r].end; ++x, ++voxels) {
        EXPECT_EQ(expected[found.runs[r].row * 13 + x], static_cast<int>(found.component[r]));
      }
    }
    EXPECT_EQ(voxels, static_cast<std::uint64_t>(std::count(mask.begin(), mask.end(), value)));
  }
}

TEST(Distance, EqualsBruteForceWithAnisotropicVoxels) {
  Frame f;
  f.dims = {11, 7, 9};
  f.spacing_mm = {0.7, 1.3, 2.1};
  const auto mask = random_mask(f.voxel_count(), 0.04, 5);
  const auto d = squared_distance_mm2(mask, f, 1);
  for (int s = 0; s < static_cast<int>(mask.size()); ++s) {
    double best = 1e30;
    for (int t = 0; t < static_cast<int>(mask.size()); ++t) {
      if (mask[t] == 0) continue;
      const double x = (s % 11 - t % 11) * 0.7, y = (s / 11 % 7 - t / 11 % 7) * 1.3, z = (s / 77 - t / 77) * 2.1;
      best = std::min(best, x * x + y * y + z * z);
    }
    EXPECT_NEAR(d[s], best, 1e-4);
  }
}

TEST(Distance, WithinAWindowItIsTheSame) {
  for (const Vec3 h : {Vec3{0.7, 1.3, 2.1}, Vec3{2.1, 0.3, 0.7}, Vec3{0.5, 0.5, 0.5}}) {
    Frame f;
    f.dims = {31, 27, 19};
    f.spacing_mm = h;
    const auto mask = random_mask(f.voxel_count(), 0.004, 5);
    for (const std::uint8_t value : {0, 1}) {
      const auto whole = squared_distance_mm2(mask, f, value);
      for (const double within : {0.2, 0.5, 2.1, 3.9}) {
        const auto near = squared_distance_within_mm2(mask, f, value, within);
        std::size_t reported = 0;
        for (std::size_t v = 0; v < mask.size(); ++v) {
          if (whole[v] <= within * within) {
            ++reported;
            EXPECT_NEAR(near[v], whole[v], 1e-6 * whole[v]);
          } else {
            EXPECT_TRUE(near[v] == std::numeric_limits<float>::infinity() || whole[v] < within * within * (1 + 1e-5))
                << near[v];
          }
        }
        EXPECT_GT(reported, 0U);
      }
    }
  }
  Frame f;
  f.dims = {1, 1, 1};
  const std::vector<std::uint8_t> one(1, 1);
  for (const double bad :
       {0.0, -1.0, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW((void)squared_distance_within_mm2(one, f, 1, bad), Error);
}

TEST(Distance, InfiniteWithoutAnySite) {
  Frame f;
  f.dims = {3, 3, 3};
  const std::vector<std::uint8_t> mask(27, 0);
  for (const float v : squared_distance_mm2(mask, f, 1)) EXPECT_EQ(v, std::numeric_limits<float>::infinity());
}

Image image_of(std::array<int, 3> dims, const std::function<int(int, int, int)>& f) {
  Frame frame;
  frame.dims = dims;
  const auto v = make_voxels<std::int16_t>(frame.voxel_count());
  for (int k = 0; k < dims[2]; ++k)
    for (int j = 0; j < dims[1]; ++j)
      for (int i = 0; i < dims[0]; ++i)
        v[(static_cast<std::size_t>(k) * dims[1] + j) * dims[0] + i] = static_cast<std::int16_t>(f(i, j, k));
  return {frame, v};
}

std::size_t count(const Labels& l) {
  return static_cast<std::size_t>(std::count(l.span().begin(), l.span().end(), 1));
}

TEST(Threshold, BoundsAreInclusive) {
  const auto ct = image_of({4, 1, 1}, [](int i, int, int) { return std::array{299, 300, 500, 501}[i]; });
  ThresholdParams p;
  p.upper = 500;
  p.min_volume_mm3 = 0;
  const auto m = threshold(ct, p);
  EXPECT_EQ(std::vector<int>(m.span().begin(), m.span().end()), (std::vector<int>{0, 1, 1, 0}));
}

TEST(Threshold, HysteresisKeepsOnlyPiecesWithACore) {
  // Two bars of 400 HU, one of them with a voxel of 900.
  const auto ct = image_of({20, 3, 3}, [](int i, int j, int k) {
    return j == 1 && k == 1 && i < 8 ? (i == 3 ? 900 : 400) : j == 1 && k == 1 && i > 10 ? 400 : 0;
  });
  ThresholdParams p;
  p.min_volume_mm3 = 0;
  EXPECT_EQ(count(threshold(ct, p)), 17u);
  p.core = 800;
  EXPECT_EQ(count(threshold(ct, p)), 8u);
}

TEST(Threshold, ClosingBridgesGapsAndFillingFillsCavities) {
  const auto gap =
      image_of({21, 9, 9}, [](int i, int j, int k) { return i != 10 && j > 1 && j < 7 && k > 1 && k < 7 ? 500 : 0; });
  ThresholdParams p;
  p.keep_largest = 1;
  EXPECT_EQ(count(threshold(gap, p)), 250u);
  p.close_mm = 1;
  EXPECT_GT(count(threshold(gap, p)), 500u);
  const auto shell = image_of({9, 9, 9}, [](int i, int j, int k) {
    return std::max({std::abs(i - 4), std::abs(j - 4), std::abs(k - 4)}) == 2 ? 500 : 0;
  });
  ThresholdParams q;
  EXPECT_EQ(count(threshold(shell, q)), 125u - 27u);
  q.fill_mm3 = 26;
  EXPECT_EQ(count(threshold(shell, q)), 125u - 27u);
  q.fill_mm3 = 27;
  EXPECT_EQ(count(threshold(shell, q)), 125u);
}

TEST(Threshold, KeepsTheLargestAndDropsTheSmall) {
  const auto ct =
      image_of({30, 3, 3}, [](int i, int, int) { return i < 10 || (i > 12 && i < 18) || i == 25 ? 500 : 0; });
  ThresholdParams p;
  EXPECT_EQ(count(threshold(ct, p)), 90u + 45u);  // the slab of 9 mm3 goes
  p.keep_largest = 1;
  EXPECT_EQ(count(threshold(ct, p)), 90u);
  p.lower = 3000;
  EXPECT_THROW(static_cast<void>(threshold(ct, p)), Error);
  p.lower = 600;
  p.upper = 500;
  EXPECT_THROW(static_cast<void>(threshold(ct, p)), Error);
}

TEST(Phantom, SameBytesForAnyThreadCount) {
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 1.5;
  Context one, two;
  one.threads = 1;
  two.threads = 2;
  const auto a = make_phantom(p, one), b = make_phantom(p, two);
  EXPECT_TRUE(std::equal(a.ct.span().begin(), a.ct.span().end(), b.ct.span().begin()));
  EXPECT_EQ(a.bone_mm3, b.bone_mm3);
}

TEST(Phantom, HoldsEveryTissueAndTheMarkerOnlyAtTheLeft) {
  std::map<int, int> seen;
  for (const PhantomRegion region : {PhantomRegion::head, PhantomRegion::temporal, PhantomRegion::mandible}) {
    PhantomParams p;
    p.region = region;
    p.spacing_mm = region == PhantomRegion::temporal ? 0.8 : 2;
    const auto phantom = make_phantom(p);
    const Frame& f = phantom.labels.frame;
    for (int k = 0; k < f.dims[2]; ++k)
      for (int j = 0; j < f.dims[1]; ++j)
        for (int i = 0; i < f.dims[0]; ++i) {
          const int l = phantom.labels.at(i, j, k);
          ++seen[l];
          if (l != static_cast<int>(Tissue::left_marker)) continue;
          EXPECT_GT(f.world_from_index({double(i), double(j), double(k)}).x, 0);
        }
  }
  for (int t = 0; t < kTissueCount; ++t) EXPECT_GT(seen[t], 0) << tissue_name(static_cast<Tissue>(t));
}

// The donor bone: a shaft with cortex about a canal, as long as it says, and its margins are safe.
TEST(Phantom, AFibulaIsAShaftWithACanal) {
  PhantomParams p;
  p.region = PhantomRegion::fibula;
  p.spacing_mm = 1.25;
  p.noise_hu = 0;
  double before = 0;
  for (const int individual : {0, 7}) {
    p.individual = individual;
    const Phantom phantom = make_phantom(p);
    const Frame& f = phantom.labels.frame;
    // By slice: area of cortex, of what it encloses, and of spongy bone.
    int slices = 0, with_canal = 0, spongy_slices = 0;
    for (int k = 0; k < f.dims[2]; ++k) {
      int cortex = 0, spongy = 0, canal = 0;
      for (int j = 0; j < f.dims[1]; ++j) {
        int first = -1, last = -1;
        for (int i = 0; i < f.dims[0]; ++i) {
          const auto t = static_cast<Tissue>(phantom.labels.at(i, j, k));
          cortex += t == Tissue::cortical;
          spongy += t == Tissue::diploe;
          if (is_bone(t)) (first < 0 ? first : last) = i;
        }
        for (int i = first; first >= 0 && i <= last; ++i)
          canal += !is_bone(static_cast<Tissue>(phantom.labels.at(i, j, k)));
      }
      slices += cortex > 0;
      with_canal += canal > 4;
      spongy_slices += spongy > 4;
      if (cortex > 0 && canal > 4) {
        EXPECT_GT(cortex, 25) << k;
        EXPECT_LT(canal, 40) << k;
      }
    }
    EXPECT_GT(slices * p.spacing_mm, 315);
    EXPECT_LT(slices * p.spacing_mm, 385);
    EXPECT_GT(with_canal, 0.7 * slices);
    EXPECT_GT(spongy_slices, 0.1 * slices);
    EXPECT_NE(phantom.bone_mm3, before) << "another individual";
    before = phantom.bone_mm3;
    // Voxels that a margin calls uniform are: the finer one says the same where it has a voxel there.
    PhantomParams fine = p;
    fine.spacing_mm = 0.625;
    if (individual != 7) continue;
    const Phantom twice = make_phantom(fine);
    EXPECT_NEAR(twice.bone_mm3 / phantom.bone_mm3, 1, 0.005);
    for (int k = 0; k < f.dims[2]; k += 3)
      for (int j = 0; j < f.dims[1]; ++j)
        for (int i = 0; i < f.dims[0]; ++i)
          ASSERT_EQ(phantom.labels.at(i, j, k), twice.labels.at(2 * i, 2 * j, 2 * k)) << i << ' ' << j << ' ' << k;
  }
}

TEST(Phantom, LabelsAreTheExactTissue) {
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 2;
  p.individual = 3;
  const auto phantom = make_phantom(p);
  const HeadAnatomy head(3);
  for (int k = 0; k < phantom.labels.frame.dims[2]; ++k)
    for (int j = 0; j < phantom.labels.frame.dims[1]; ++j)
      for (int i = 0; i < phantom.labels.frame.dims[0]; ++i) {
        EXPECT_EQ(
            phantom.labels.at(i, j, k),
            static_cast<int>(head.tissue(phantom.labels.frame.world_from_index({double(i), double(j), double(k)}))));
      }
}

// The CT without noise against a mean of many random points a voxel, spread as the scanner does.
TEST(Phantom, VoxelsHoldTheMeanOverTheirVolume) {
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 2;
  p.noise_hu = 0;
  const auto phantom = make_phantom(p);
  const HeadAnatomy head;
  const Frame& f = phantom.ct.frame;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> in(-0.5, 0.5);
  double sum = 0, squares = 0;
  int voxels = 0;
  for (; voxels < 200; ++voxels) {
    const std::array<int, 3> v{10 + static_cast<int>(random() % 10), 12 + static_cast<int>(random() % 20),
                               6 + static_cast<int>(random() % 24)};
    double mean = 0;
    for (int n = 0; n < 27; ++n) {
      const double weight = (n % 3 == 1 ? 4 : 1) * (n / 3 % 3 == 1 ? 4 : 1) * (n / 9 == 1 ? 4 : 1) / 216.0;
      constexpr int kPoints = 60;
      for (int s = 0; s < kPoints; ++s) {
        const Vec3 at{v[0] + n % 3 - 1 + in(random), v[1] + n / 3 % 3 - 1 + in(random), v[2] + n / 9 - 1 + in(random)};
        mean += weight * tissue_hu(head.tissue(f.world_from_index(at))) / kPoints;
      }
    }
    const double error = phantom.ct.at(v[0], v[1], v[2]) - mean;
    sum += error;
    squares += error * error;
  }
  EXPECT_NEAR(sum / voxels, 0, 12);
  EXPECT_LT(std::sqrt(squares / voxels), 60);  // of 27 regular and 60 random points a voxel
}

TEST(Phantom, AnotherIndividualIsAnotherHead) {
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 2;
  const auto a = make_phantom(p), again = make_phantom(p);
  p.individual = 1;
  const auto b = make_phantom(p);
  EXPECT_TRUE(std::equal(a.labels.span().begin(), a.labels.span().end(), again.labels.span().begin()));
  EXPECT_FALSE(std::equal(a.labels.span().begin(), a.labels.span().end(), b.labels.span().begin()));
}

// A bent tube, and what is said of it by name.
TEST(Structures, AShapeThatItsNameCannotHaveIsTold) {
  const auto tube = [](double radius, double length_mm, double gap_mm, const std::string& name, double spacing = 0.5) {
    Labels l;
    l.frame = {{60, 90, 100}, {spacing, spacing, spacing}, {-10, 3, 7}, {}};
    const auto v = make_voxels<std::uint8_t>(l.frame.voxel_count());
    std::size_t n = 0;
    for (int k = 0; k < l.frame.dims[2]; ++k)
      for (int j = 0; j < l.frame.dims[1]; ++j)
        for (int i = 0; i < l.frame.dims[0]; ++i, ++n) {
          const Vec3 p = Vec3{double(i) - 30, double(j) - 6, double(k) - 6} * spacing;
          // Up, and half of it back: an L of two straight parts.
          const double leg = length_mm / 2, z = std::clamp(p.z, 0.0, leg), y = std::clamp(p.y, 0.0, leg);
          const bool in = std::min(length(p - Vec3{0, 0, z}), length(p - Vec3{0, y, leg})) <= radius;
          v[static_cast<std::ptrdiff_t>(n)] = in && !(p.z > leg / 2 && p.z < leg / 2 + gap_mm) ? 3 : 0;
        }
    l.voxels = v;
    l.structures = {{.value = 3, .name = name}};
    return l;
  };
  const auto said = [](const Labels& l) { return implausible_shape(l, l.structures.front()); };
  const StructureShape shape = shape_of(tube(0.9, 34, 0, "facial nerve"), 3);
  EXPECT_NEAR(shape.length_mm, 34, 3);
  EXPECT_NEAR(shape.width_mm, 1.8, 0.25);
  EXPECT_EQ(shape.largest_share, 1);
  EXPECT_FALSE(shape.cut_off);
  EXPECT_EQ(said(tube(0.9, 34, 0, "facial nerve")), "");
  EXPECT_NE(said(tube(0.9, 16, 0, "facial nerve")).find("mm of length"), std::string::npos);
  EXPECT_NE(said(tube(1.4, 34, 0, "Left_Facial-Nerve")).find("mm of width"), std::string::npos);
  EXPECT_NE(said(tube(0.9, 34, 3, "facial nerve")).find("in one piece"), std::string::npos);
  EXPECT_NE(said(tube(0.9, 34, 0, "sigmoid sinus")).find("less than 500"), std::string::npos);
  EXPECT_EQ(said(tube(0.9, 16, 3, "some tumour")), "");
  // Where the image ends it may be short.
  Labels cut = tube(0.9, 16, 0, "facial nerve");
  const auto v = make_voxels<std::uint8_t>(cut.frame.voxel_count());
  constexpr std::size_t kDown = 6U * 60 * 90;  // its lower end lies at the lowest slice then
  for (std::size_t n = 0; n < cut.frame.voxel_count(); ++n)
    v[static_cast<std::ptrdiff_t>(n)] = n + kDown < cut.frame.voxel_count() ? cut.voxels[n + kDown] : 0;
  cut.voxels = v;
  EXPECT_TRUE(shape_of(cut, 3).cut_off);
  EXPECT_EQ(said(cut), "");
}

// One label of both inner ears, which lie 80 mm apart: neither is taken for the other's half that came off.
TEST(Structures, ALabelOfBothSidesIsLookedAtSideBySide) {
  const auto rods = [](double right_mm, double left_mm, double apart_mm, const std::string& name) {
    Labels l;
    l.frame = {{200, 20, 90}, {0.5, 0.5, 0.5}, {-50, 3, 7}, {}};
    const auto v = make_voxels<std::uint8_t>(l.frame.voxel_count());
    std::size_t n = 0;
    for (int k = 0; k < l.frame.dims[2]; ++k)
      for (int j = 0; j < l.frame.dims[1]; ++j)
        for (int i = 0; i < l.frame.dims[0]; ++i, ++n) {
          const Vec3 p = Vec3{double(i) - 100, double(j) - 10, double(k) - 5} * 0.5;
          const double off = std::hypot(std::abs(p.x) - apart_mm / 2, p.y);
          v[static_cast<std::ptrdiff_t>(n)] = off < 1.6 && p.z >= 0 && p.z < (p.x < 0 ? right_mm : left_mm) ? 3 : 0;
        }
    l.voxels = v;
    l.structures = {{.value = 3, .name = name}};
    return l;
  };
  const auto said = [](const Labels& l) { return implausible_shape(l, l.structures.front()); };
  EXPECT_EQ(said(rods(22, 22, 76, "labyrinth")), "");
  EXPECT_EQ(said(rods(22, 18, 70, "labyrinth")), "");
  EXPECT_NE(said(rods(22, 10, 76, "labyrinth")).find("mm of length"), std::string::npos) << "the left is short";
  EXPECT_NE(said(rods(22, 22, 20, "labyrinth")).find("50 % of its volume"), std::string::npos) << "one ear's";
}

TEST(Structures, NamesAreTakenWordByWord) {
  for (const char* const name : {"labyrinth", "Labyrinth_L", "left labyrinth", "labyrinth, right"})
    EXPECT_TRUE(is_called(name, "labyrinth")) << name;
  EXPECT_TRUE(is_called("Ossicles", "ossicle"));
  EXPECT_TRUE(is_called("external ear canal", "ear canal"));
  for (const char* const name : {"labyrinthine artery", "artery of labyrinth", "labyrinth segment of a nerve"})
    EXPECT_FALSE(is_called(name, "labyrinth")) << name;
  EXPECT_FALSE(is_called("internal ear canal", "ear canal"));
  EXPECT_FALSE(structure_limits("facial nerve labyrinthine segment").has_value());
  EXPECT_FALSE(structure_limits("labyrinthine artery").has_value());
  EXPECT_TRUE(structure_limits("Facial_Nerve-L").has_value());
}

TEST(Structures, AVolumeThatItsNameCannotHaveIsTold) {
  EXPECT_EQ(implausible_volume("facial nerve", 80), "");
  EXPECT_NE(implausible_volume("Left Facial_Nerve", 4000).find("look at it"), std::string::npos);
  EXPECT_EQ(implausible_volume("sigmoid sinus", 4000), "");
  EXPECT_EQ(structure_limits("facial nerve")->radius_mm, 1.5);
  EXPECT_FALSE(structure_limits("tumour").has_value());
  Labels l;
  l.frame.dims = {20, 20, 20};
  const auto v = make_voxels<std::uint8_t>(8000);
  std::fill(v.get(), v.get() + 8000, std::uint8_t{1});
  l.voxels = v;
  std::string warned;
  Context context;
  context.on_log([&](LogLevel, std::string_view text) { warned += text; });
  (void)name_structures(l, {.names = "1=facial nerve"}, nullptr, context);
  EXPECT_NE(warned.find("8000 mm3"), std::string::npos) << warned;
}

// A temporal bone of a scan that begins in the mastoid is told, and on which side; air at the scan's end is not.
TEST(Crop, BoneBeyondTheScanIsTold) {
  Image ct;
  ct.frame.dims = {40, 40, 30};
  ct.frame.origin_mm = {-20, -20, 100};
  auto voxels = make_voxels<std::int16_t>(ct.frame.voxel_count());
  for (int k = 0; k < 30; ++k) {
    for (int j = 0; j < 40; ++j) {
      for (int i = 0; i < 40; ++i)
        voxels[ct.offset(i, j, k)] = k < 20 && std::abs(i - 20) < 5 && std::abs(j - 20) < 5 ? 900 : -1000;
    }
  }
  ct.voxels = voxels;
  EXPECT_EQ(bone_beyond_scan(ct, {{-10, -10, 78}, {10, 10, 150}}), "below by 22 mm") << "above lies air";
  EXPECT_EQ(bone_beyond_scan(ct, {{-10, -10, 97}, {10, 10, 150}}), "") << "3 mm are no loss to speak of";
  EXPECT_EQ(bone_beyond_scan(ct, {{-40, -40, 101}, {10, 10, 110}}), "") << "beside it is air";
  // Upside down in the file, it is below all the same.
  ct.frame.direction.column[2] = {0, 0, -1};
  ct.frame.origin_mm.z = 129;
  auto turned = make_voxels<std::int16_t>(ct.frame.voxel_count());
  for (int k = 0; k < 30; ++k)
    std::copy_n(ct.voxels.get() + ct.offset(0, 0, k), 1600, turned.get() + ct.offset(0, 0, 29 - k));
  ct.voxels = turned;
  EXPECT_EQ(bone_beyond_scan(ct, {{-10, -10, 78}, {10, 10, 150}}), "below by 22 mm");
}

}  // namespace
}  // namespace osteo
