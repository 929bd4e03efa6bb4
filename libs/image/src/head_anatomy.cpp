#include "osteo/image/head_anatomy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include "osteo/base/portable_math.h"

namespace osteo {
namespace {

// Bone and what lies around it have their mean near 500, so that one threshold finds unbiased boundaries; cancellous bone, which lies
// within a cortex, is above it.
constexpr std::array<double, kTissueCount> kHu{-1000, 40,   960, 960, 960, 1200, 60, 50,    2600,  700,
                                               700,   1500, 30,  50,  50,  50,   60, -1000, -1000, -1000};
constexpr std::array<std::string_view, kTissueCount> kNames{
    "air",         "soft tissue", "cortical bone", "cellular bone",  "mandible",  "ossicle",        "facial nerve",   "sigmoid sinus",
    "left marker", "diploe",      "jaw marrow",    "tooth",          "labyrinth", "chorda tympani", "alveolar nerve", "carotid artery",
    "dura",        "air cells",   "ear canal",     "tympanic cavity"};

// Distances are signed, negative inside, and grow by at most kLipschitz a mm: ellipsoids and sheared bodies are first-order.
constexpr double kLipschitz = 1.6;

// Union and intersection with a fillet of about k mm: polynomial, exact where the two are further apart than k.
double smin(double a, double b, double k) {
  const double h = std::max(k - std::abs(a - b), 0.0);
  return std::min(a, b) - h * h / (4 * k);
}
double smax(double a, double b, double k) {
  return -smin(-a, -b, k);
}
double ramp(double x, double from, double to) {  // 0 to 1, smooth
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}
double mix(double a, double b, double t) {
  return a + (b - a) * t;
}

double ellipsoid(Vec3 p, Vec3 c, Vec3 r) {
  const Vec3 d = p - c;
  const Vec3 u{d.x / r.x, d.y / r.y, d.z / r.z};
  const Vec3 v{u.x / r.x, u.y / r.y, u.z / r.z};
  const double k0 = length(u), k1 = length(v);
  // First order; within flat ones not above 1.5 times what is sure.
  const double least = std::min({r.x, r.y, r.z});
  return k0 < 1 ? std::max(k1 > 1e-9 ? k0 * (k0 - 1) / k1 : -least, 1.5 * (k0 - 1) * least) : k0 * (k0 - 1) / k1;
}
double cone(Vec3 p, Vec3 a, Vec3 b, double ra, double rb) {  // round cone
  const Vec3 ab = b - a;
  const double t = std::clamp(dot(p - a, ab) / dot(ab, ab), 0.0, 1.0);
  return length(p - (a + ab * t)) - mix(ra, rb, t);
}
double box(Vec3 p, Vec3 c, Vec3 half, double round) {
  const Vec3 q{std::abs(p.x - c.x) - half.x + round, std::abs(p.y - c.y) - half.y + round, std::abs(p.z - c.z) - half.z + round};
  const Vec3 o{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
  return length(o) + std::min(std::max({q.x, q.y, q.z}), 0.0) - round;
}
double torus(Vec3 p, Vec3 c, Vec3 axis, double ring, double tube) {
  const Vec3 d = p - c;
  const double h = dot(d, axis), r = length(d - axis * h);
  return portable::hypot(r - ring, h) - tube;
}
double segment2(double x, double y, double ax, double ay, double bx, double by) {
  const double ux = bx - ax, uy = by - ay;
  const double t = std::clamp(((x - ax) * ux + (y - ay) * uy) / (ux * ux + uy * uy), 0.0, 1.0);
  return portable::hypot(x - ax - ux * t, y - ay - uy * t);
}
// Distance in the axial plane from an ellipse around (0, y0), to first order.
double arch(Vec3 p, double rx, double y0, double ry) {
  const double u = p.x / rx, v = (p.y - y0) / ry, f = portable::hypot(u, v);
  return std::abs(f - 1) / std::max(portable::hypot(u / rx, v / ry) / std::max(f, 1e-9), 1e-9);
}

// splitmix64.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15ULL;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }
  double uniform() { return (static_cast<double>(next() >> 11) + 0.5) * 0x1p-53; }
  double uniform(double lo, double hi) { return mix(lo, hi, uniform()); }
  /// Near normal (the sum of twelve), cut at two standard deviations.
  double normal() {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return std::clamp(sum, -2.0, 2.0);
  }

 private:
  std::uint64_t state_;
};

// A tube along a smooth line through given points (Catmull-Rom), as short straight pieces in chunks with boxes.
class Tube {
 public:
  Tube() = default;
  explicit Tube(const std::vector<TubePoint>& control) {
    constexpr int kSteps = 6;
    const auto n = static_cast<int>(control.size());
    const auto at = [&](int i) { return control[static_cast<std::size_t>(std::clamp(i, 0, n - 1))]; };
    points_.push_back(control.front());
    for (int i = 0; i + 1 < n; ++i) {
      const TubePoint a = at(i - 1), b = at(i), c = at(i + 1), d = at(i + 2);
      Chunk chunk{{1e30, 1e30, 1e30}, {-1e30, -1e30, -1e30}, points_.size() - 1, 0};
      for (int s = 1; s <= kSteps; ++s) {
        const double t = static_cast<double>(s) / kSteps, t2 = t * t, t3 = t2 * t;
        const double wa = -0.5 * t3 + t2 - 0.5 * t, wb = 1.5 * t3 - 2.5 * t2 + 1, wc = -1.5 * t3 + 2 * t2 + 0.5 * t,
                     wd = 0.5 * t3 - 0.5 * t2;
        points_.push_back({a.at_mm * wa + b.at_mm * wb + c.at_mm * wc + d.at_mm * wd, mix(b.radius_mm, c.radius_mm, t)});
      }
      chunk.last = points_.size() - 1;
      for (std::size_t k = chunk.first; k <= chunk.last; ++k) {
        for (std::size_t x = 0; x < 3; ++x) {
          chunk.lo[x] = std::min(chunk.lo[x], points_[k].at_mm[x] - points_[k].radius_mm);
          chunk.hi[x] = std::max(chunk.hi[x], points_[k].at_mm[x] + points_[k].radius_mm);
        }
      }
      chunks_.push_back(chunk);
    }
  }
  /// Exact up to `reach`; beyond, the distance of the nearest box, which is more than `reach` and less than exact.
  [[nodiscard]] double distance(Vec3 p, double reach) const {
    double best = 1e30;
    for (const Chunk& c : chunks_) {
      const Vec3 o{std::max({c.lo.x - p.x, p.x - c.hi.x, 0.0}), std::max({c.lo.y - p.y, p.y - c.hi.y, 0.0}),
                   std::max({c.lo.z - p.z, p.z - c.hi.z, 0.0})};
      const double away = length(o);
      if (away > reach || away > std::max(best, 0.0)) {
        best = std::min(best, away);
        continue;
      }
      for (std::size_t k = c.first; k < c.last; ++k) {
        best = std::min(best, cone(p, points_[k].at_mm, points_[k + 1].at_mm, points_[k].radius_mm, points_[k + 1].radius_mm));
      }
    }
    return best;
  }
  [[nodiscard]] const std::vector<TubePoint>& points() const { return points_; }

 private:
  struct Chunk {
    Vec3 lo, hi;
    std::size_t first = 0, last = 0;
  };
  std::vector<TubePoint> points_;
  std::vector<Chunk> chunks_;
};

// What differs between individuals, as sizes in mm or factors.
struct Build {
  Vec3 vault{1, 1, 1};    // factors of the cranium
  double sinus_back = 0;  // sigmoid sinus
  double bulb_up = 0;     // jugular bulb
  double nerve_back = 0, nerve_out = 0, nerve_long = 0, nerve_thick = 1;
  double canal_wide = 1;
  double tegmen_up = 0;
  double tip_down = 0, mastoid_out = 0;
  double pneumatisation = 1, cell_size = 1;
  double cochlea = 1, canals = 1;
  double gonion_out = 0, jaw_height = 0;
};

Build build_of(std::uint64_t individual) {
  Build b;
  if (individual == 0) return b;
  Random r(individual * 0x9e6c63d0876a9a47ULL + 1);
  b.vault = {1 + 0.015 * r.normal(), 1 + 0.025 * r.normal(), 1 + 0.02 * r.normal()};
  b.sinus_back = 1.4 * r.normal();
  b.bulb_up = 0.8 * r.normal();
  b.nerve_back = 0.35 * r.normal();
  b.nerve_out = 0.3 * r.normal();
  b.nerve_long = 0.8 * r.normal();
  b.nerve_thick = 1 + 0.06 * r.normal();
  b.canal_wide = 1 + 0.05 * r.normal();
  b.tegmen_up = 0.6 * (r.normal() + 1.5);
  b.tip_down = 2 * r.normal();
  b.mastoid_out = 0.8 * r.normal();
  b.pneumatisation = 1 + 0.06 * r.normal();
  b.cell_size = 1 + 0.1 * r.normal();
  b.cochlea = 1 + 0.03 * r.normal();
  b.canals = 1 + 0.03 * r.normal();
  b.gonion_out = 1.5 * r.normal();
  b.jaw_height = 1.2 * r.normal();
  return b;
}

struct Tooth {
  Vec3 centre, along;  // middle of the crown; direction of the row
  Vec3 half;           // along the row, across it, height
  double root = 0, up = 0;
};

constexpr Vec3 kMarker{72, -8, 46};
constexpr double kMarkerRadius = 6;

}  // namespace

struct HeadAnatomy::Model {
  explicit Model(std::uint64_t individual);
  [[nodiscard]] Sample sample(Vec3 p) const;

  Build build;
  Tube nerve, chorda, sinus, alveolar, carotid, cochlea, auditory_tube, arch_tube, meatus, canal;
  NerveMarks marks{};
  std::array<Tooth, 16> teeth;
  std::vector<AirCell> cells;
  std::vector<TubePoint> jaw_line;  // of the body, from above; no radius

 private:
  // What is needed of a point more than once.
  struct Ear {
    double canal = 1e9, drum = 1e9, cavity = 1e9, labyrinth = 1e9, nerve = 1e9, chorda = 1e9, meatus = 1e9, carotid = 1e9;
  };
  [[nodiscard]] Ear ear(Vec3 p) const;
  [[nodiscard]] double outer_vault(Vec3 p) const;
  [[nodiscard]] double orbit(Vec3 p) const;
  [[nodiscard]] double ossicles(Vec3 p) const;
  [[nodiscard]] double tooth(Vec3 p) const;
  [[nodiscard]] double brain(Vec3 p, double vault, double sinus, const Ear& e, double orbit, double air) const;
  [[nodiscard]] double skin(Vec3 p, double vault) const;
  [[nodiscard]] double mandible(Vec3 p) const;
  [[nodiscard]] double nasal(Vec3 p) const;
  [[nodiscard]] double face(Vec3 p, double orbit, double nasal) const;
  [[nodiscard]] double cell_region(Vec3 p, double bone, double brain, double sinus, const Ear& e) const;
  [[nodiscard]] double in_cell(Vec3 p) const;
  [[nodiscard]] double in_duct(Vec3 p) const;
  [[nodiscard]] std::optional<std::size_t> lattice_index(Vec3 p) const;
  [[nodiscard]] double skull(Vec3 p, double vault, double brain, double orbit, double nasal, double air, double sinus, const Ear& e) const;
  void place_cells(std::uint64_t seed);

  // Cells that can matter in each box of a lattice, and the openings between them.
  static constexpr double kPitch = 2;
  Vec3 lattice_lo{};
  std::array<int, 3> lattice{};
  std::vector<std::vector<std::uint16_t>> near_cells, near_ducts;
  struct Duct {
    Vec3 a, b;
    double radius;
  };
  std::vector<Duct> ducts;
};

HeadAnatomy::Model::Model(std::uint64_t individual) : build(build_of(individual)) {
  const Build& b = build;
  // The canal's axis: out to the skin through cartilage, S-shaped; the drum cuts it.
  const double w = b.canal_wide;
  canal = Tube({{{39, -1.5, -20.6}, 3.3 * w},
                {{45, 0.4, -20}, 3.6 * w},
                {{51, 2.1, -18.9}, 3.4 * w},
                {{57, 3.1, -18.6}, 3.7 * w},
                {{63, 3.7, -19.2}, 4.0 * w},
                {{70, 4.8, -19.6}, 3.8},
                {{84, 8, -20}, 4.5}});
  // Facial nerve.
  const double t = b.nerve_thick, y = b.nerve_back, x = b.nerve_out, z = -b.nerve_long;
  nerve = Tube({{{14, 5.6, -15.2}, 0.75 * t},
                {{20, 4.2, -15.0}, 0.7 * t},
                {{27, 2.6, -14.4}, 0.6 * t},
                {{33.2, 1.2, -13.6}, 0.5 * t},
                {{36.4, -2.0, -12.4}, 0.85 * t},
                {{39.7, 2.5, -14.4}, 0.65 * t},
                {{41.3, 6.6, -16.2}, 0.7 * t},
                {{42.5 + 0.5 * x, 7.5 + 0.6 * y, -18.3}, 0.75 * t},
                {{43.2 + x, 7.8 + y, -22}, 0.8 * t},
                {{43.8 + x, 8.8 + y, -27}, 0.85 * t},
                {{44.6 + x, 9.6 + y, -32.5 + z}, 0.9 * t},
                {{46 + x, 7.5, -38.5 + z}, 0.9 * t},
                {{51, -3, -45}, 0.9 * t}});
  {
    const auto& line = nerve.points();
    double arc = 0;
    for (std::size_t i = 0; i < line.size(); ++i) {
      if (i > 0) arc += length(line[i].at_mm - line[i - 1].at_mm);
      if (i == 3 * 6) marks.fundus_mm = arc;
      if (i == 4 * 6) marks.geniculate_mm = arc;
      if (i == 6 * 6 + 3) marks.second_genu_mm = arc;
      if (i == 10 * 6) marks.foramen_mm = arc;
    }
  }
  meatus = Tube({{{14, 6.2, -16.4}, 2.9}, {{21, 4.2, -15.9}, 2.5}, {{28, 2.6, -15.3}, 2.1}, {{32.6, 1.7, -14.8}, 1.6}});
  chorda = Tube({{{43.6 + x, 8.6 + y, -25.5}, 0.3},
                 {{44.6, 7.0 + 0.5 * y, -22.2}, 0.25},
                 {{45.2, 5.0, -18.4}, 0.25},
                 {{44.2, 2.0, -15.6}, 0.25},
                 {{43.6, -2.2, -15.4}, 0.25},
                 {{42.6, -6.5, -17}, 0.25},
                 {{42, -10, -20}, 0.25}});
  const double s = b.sinus_back, u = b.bulb_up;
  sinus = Tube({{{3, 79.5 * b.vault.y, -8}, 4.5},
                {{22, 74.5 * b.vault.y, -6}, 4.5},
                {{41, 57.5 * b.vault.y, -4}, 4.6},
                {{53.5, 38 + s, -6.5}, 4.8},
                {{54, 28 + s, -13}, 5},
                {{51.5, 23.6 + s, -21}, 5},
                {{48, 24 + s, -28}, 5},
                {{43, 24.5 + 0.5 * s, -34}, 4.8},
                {{38, 18, -34.5}, 4.6},
                {{34.6, 10, -28.2 + u}, 4.6},
                {{34, 8, -36}, 4.5},
                {{35, 6, -52}, 5},
                {{37, 4, -90}, 5.5},
                {{38, 4, -140}, 5.5}});
  carotid = Tube({{{32, -2, -140}, 2.8},
                  {{31, -3, -80}, 2.8},
                  {{31.5, -4.5, -44}, 2.7},
                  {{32.5, -6.5, -32}, 2.6},
                  {{32.0, -8.5, -26.5}, 2.5},
                  {{26, -12.5, -23.5}, 2.5},
                  {{17, -19, -19}, 2.4},
                  {{11, -22, -11}, 2.3},
                  {{10.5, -30, -6}, 2.2}});
  auditory_tube =
      Tube({{{41.2, -4.2, -17.6}, 1.6}, {{38.5, -9.5, -19.6}, 1.1}, {{33, -18, -23}, 0.8}, {{24, -30, -28.5}, 0.8}, {{13, -44, -34}, 1.6}});
  arch_tube = Tube({{{47, -68, -19}, 6.0},
                    {{55, -60, -19.5}, 4.2},
                    {{61.5, -46, -19.5}, 3.2},
                    {{65, -30, -18}, 3.0},
                    {{64, -16, -15}, 3.6},
                    {{62, -4, -12}, 3.8},
                    {{60, 6, -10.5}, 3}});
  alveolar = Tube({{{43.5 + 0.7 * b.gonion_out, -26, -58}, 1.5},
                   {{43 + 0.7 * b.gonion_out, -30, -70}, 1.4},
                   {{41.2 + 0.5 * b.gonion_out, -40, -84}, 1.3},
                   {{36.5, -56, -92}, 1.3},
                   {{29.5, -70, -95}, 1.3},
                   {{25.5, -77.2, -94}, 1.3},
                   {{27.5, -82, -91}, 1.4}});
  const double g = b.gonion_out;
  jaw_line =
      Tube({{{-7, -88.7, 0}}, {{7, -88.7, 0}}, {{20, -82, 0}}, {{31, -67, 0}}, {{39.5 + 0.4 * g, -45, 0}}, {{45.5 + g, -22, 0}}}).points();
  // Cochlea: 2.5 turns about the modiolus, which points forward and outward. The radius shrinks as the spiral rises.
  {
    const Vec3 base{34.2, -2.4, -19.0}, axis = normalized({0.66, -0.72, -0.2});
    const Vec3 e1 = normalized(Vec3{0.73, 0.68, 0} - axis * dot(axis, Vec3{0.73, 0.68, 0})), e2 = cross(axis, e1);
    std::vector<TubePoint> spiral{{{36.8, 2.9, -17.0}, 1.1}};
    constexpr int kPoints = 30;
    for (int i = 0; i <= kPoints; ++i) {
      const double turns = 2.5 * i / kPoints, f = turns / 2.5;
      const portable::SinCos a = portable::sin_cos_turns(turns);
      const double r = b.cochlea * (3.6 * (1 - f) * (1 - 0.25 * f) + 0.7);
      spiral.push_back({base + axis * (3.4 * f * b.cochlea) + e1 * (r * a.cos) - e2 * (r * a.sin), mix(1.0, 0.55, f)});
    }
    cochlea = Tube(spiral);
  }
  // Teeth: widths along the row, across, crown height (Wheeler), root lengths.
  constexpr std::array<std::array<double, 4>, 16> kTeeth{{{8.5, 7, 10.5, 13},
                                                          {6.5, 6, 9, 13},
                                                          {7.5, 8, 10, 17},
                                                          {7, 9, 8.5, 14},
                                                          {7, 9, 8.5, 14},
                                                          {10, 11, 7.5, 12},
                                                          {9, 11, 7, 11},
                                                          {8.5, 10, 6.5, 11},
                                                          {5, 6, 9, 12.5},
                                                          {5.5, 6.5, 9.5, 14},
                                                          {7, 7.5, 11, 16},
                                                          {7, 7.5, 8.5, 14},
                                                          {7, 8, 8, 14.5},
                                                          {11, 10.5, 7.5, 14},
                                                          {10.5, 10, 7, 13},
                                                          {10, 9.5, 7, 11}}};
  for (int row = 0; row < 2; ++row) {
    const double rx = row == 0 ? 28.5 : 26.5, ry = row == 0 ? 44 : 41, y0 = -46;
    double angle = 0.25, total = 0;  // in turns from the front: x = rx sin, y = y0 - ry cos
    for (int i = 0; i < 8; ++i) total += kTeeth[static_cast<std::size_t>(row * 8 + i)][0];
    double quarter = 0;
    constexpr int kSteps = 400;
    for (int i = 0; i < kSteps; ++i) {
      const portable::SinCos a = portable::sin_cos_turns((i + 0.5) * 0.25 / kSteps);
      quarter += portable::hypot(rx * a.cos, ry * a.sin) * 0.25 * 6.283185307179586 / kSteps;
    }
    const double fit = std::min(1.0, quarter / total);
    double done = 0, walked = 0;
    angle = 0;
    for (int i = 0; i < 8; ++i) {
      const auto& d = kTeeth[static_cast<std::size_t>(row * 8 + i)];
      const double middle = done + 0.5 * d[0] * fit;
      for (; walked < middle && angle < 0.25; angle += 0.25 / kSteps) {
        const portable::SinCos a = portable::sin_cos_turns(angle);
        walked += portable::hypot(rx * a.cos, ry * a.sin) * 0.25 * 6.283185307179586 / kSteps;
      }
      done += d[0] * fit;
      const portable::SinCos a = portable::sin_cos_turns(angle);
      const double ty = y0 - ry * a.cos, occlusal = -69 + 0.1 * (ty + 90);
      Tooth& tooth = teeth[static_cast<std::size_t>(row * 8 + i)];
      tooth.up = row == 0 ? 1 : -1;
      tooth.half = {0.5 * d[0] * fit - 0.12, 0.5 * d[1], 0.5 * d[2]};
      tooth.centre = {rx * a.sin, ty + (row == 0 ? 0.0 : 1.0), occlusal + tooth.up * ((row == 0 ? 1.2 : 2.4) + 0.5 * d[2])};
      tooth.along = normalized({rx * a.cos, ry * a.sin, 0});
      tooth.root = d[3];
    }
  }
  place_cells(individual);
}

// The cranium's outside: four ellipsoids, egg-shaped from above, widest behind the ears.
double HeadAnatomy::Model::outer_vault(Vec3 p) const {
  const Vec3 q{p.x / build.vault.x, p.y / build.vault.y, p.z > 0 ? p.z / build.vault.z : p.z};
  double d = ellipsoid(q, {0, 8, 22}, {68, 82, 74});
  d = smin(d, ellipsoid(q, {0, -33, 26}, {54, 57, 58}), 14);
  d = smin(d, ellipsoid(q, {0, 36, 4}, {61, 52, 49}), 14);
  return smin(d, ellipsoid(q, {0, 6, -8}, {61.5, 58, 34}), 10);
}

double HeadAnatomy::Model::orbit(Vec3 p) const {
  return smin(cone(p, {30, -82, 2}, {14, -44, 3}, 17.5, 4), ellipsoid(p, {31, -80, 2}, {19, 14, 17}), 3);
}

double HeadAnatomy::Model::nasal(Vec3 p) const {
  const double wide = mix(12.5, 4.5, ramp(p.z, -30, 2));
  return smax(smax(std::abs(p.x) - wide, std::abs(p.z + 20.5) - 21.5, 4), std::abs(p.y + 68) - 26, 4);
}

HeadAnatomy::Model::Ear HeadAnatomy::Model::ear(Vec3 p) const {
  Ear e;
  // The drum: a plane that faces outward, forward and down; the lateral part of the tube is the canal, the medial the cavity.
  const Vec3 centre{45, 0, -20}, out = normalized({0.78, -0.34, -0.52});
  const double drum = dot(p - centre, out);
  const Vec3 tall{p.x, p.y, -20 + (p.z + 20) * 0.86};
  const double tube = canal.distance(tall, 8);
  e.canal = std::max(tube, 0.12 - drum);
  e.drum = std::max(tube, std::abs(drum) - 0.12);
  // Labyrinth.
  const Vec3 ridge = normalized({0.72, 0.69, 0}), back = normalized({-0.69, 0.72, 0}), level = normalized({0, 0.5, 0.87});
  const double k = build.canals;
  double l = ellipsoid(p, {36.4, 3.5, -16.1}, {1.6, 2.7, 2.3});
  l = smin(l, torus(p, {35.5, 4.3, -12.3}, ridge, 3.2 * k, 0.55), 0.5);
  l = smin(l, torus(p, {38.5, 8.6, -16.9}, back, 3.1 * k, 0.55), 0.5);
  l = smin(l, torus(p, {39.3, 6.5, -14.4}, level, 2.7 * k, 0.55), 0.5);
  l = smin(l, cochlea.distance(p, 5), 0.5);
  e.labyrinth = l;
  e.nerve = nerve.distance(p, 6);
  // Tympanic cavity, sheared along the drum, with attic, aditus and antrum.
  const Vec3 sheared{p.x - 0.2 * (p.z + 19.5), p.y, p.z};
  double d = box(sheared, {42.1, -0.3, -19.2}, {2.9, 6.0, 6.2}, 2.2);
  d = std::max(d, drum + 0.12);
  d = smin(d, ellipsoid(p, {43.7, 1.4, -12.6}, {3.3, 5.0, 3.8}), 1.2);
  d = smin(d, cone(p, {44.2, 5.0, -12.4}, {46.2, 10, -12.3}, 2.2, 2.6), 1.5);
  d = smin(d, ellipsoid(p, {47.6, 14.2, -12.9}, {3.5, 6.3, 4.4}), 2);
  d = smin(d, auditory_tube.distance(p, 5), 1.2);
  d = smin(d, ellipsoid(p, {39.8, 3.2, -17.1}, {1.3, 1.8, 1.1}), 0.4);  // niche of the oval window
  // The promontory covers the labyrinth, the facial canal's thin wall the nerve.
  e.cavity = smax(smax(d, 0.6 - e.labyrinth, 0.4), 0.35 - e.nerve, 0.3);
  e.chorda = chorda.distance(p, 4);
  e.meatus = meatus.distance(p, 5);
  e.carotid = carotid.distance(p, 6);
  return e;
}

double HeadAnatomy::Model::ossicles(Vec3 p) const {
  if (length(p - Vec3{43, 2.5, -15.5}) > 14) return length(p - Vec3{43, 2.5, -15.5}) - 9;
  // Malleus: head, neck, short process, handle to the umbo.
  double malleus = length(p - Vec3{43.9, -0.1, -12.7}) - 1.2;
  malleus = smin(malleus, cone(p, {44.0, -0.2, -13.4}, {44.4, -0.4, -15.6}, 0.75, 0.6), 0.5);
  malleus = smin(malleus, cone(p, {44.4, -0.4, -15.6}, {45.5, 0.2, -16.1}, 0.5, 0.4), 0.3);
  malleus = smin(malleus, cone(p, {44.4, -0.4, -15.6}, {43.5, 0.3, -19.6}, 0.6, 0.4), 0.3);
  // Incus: body, short process towards the antrum, long process to the stapes.
  double incus = ellipsoid(p, {44.1, 2.5, -12.6}, {1.15, 1.3, 1.45});
  incus = smin(incus, cone(p, {44.2, 3.2, -12.9}, {44.9, 6.5, -13.6}, 0.9, 0.4), 0.5);
  incus = smin(incus, cone(p, {44.0, 2.9, -13.5}, {42.7, 3.5, -17.0}, 0.75, 0.4), 0.4);
  incus = smin(incus, cone(p, {42.7, 3.5, -17.0}, {41.9, 3.3, -17.3}, 0.4, 0.35), 0.2);
  // Stapes: head, two crura, footplate in the oval window.
  double stapes = length(p - Vec3{41.2, 3.2, -17.3}) - 0.42;
  stapes = std::min(stapes, cone(p, {41.1, 3.2, -17.3}, {39.1, 4.4, -17.0}, 0.25, 0.22));
  stapes = std::min(stapes, cone(p, {41.1, 3.2, -17.3}, {38.9, 2.0, -17.2}, 0.25, 0.22));
  stapes = std::min(stapes, ellipsoid(p, {38.8, 3.2, -17.1}, {0.35, 1.5, 0.75}));
  return std::min({malleus, incus, stapes});
}

double HeadAnatomy::Model::brain(Vec3 p, double vault, double sinus_d, const Ear& e, double orbit_d, double air) const {
  // Thin squama above the ear, thick elsewhere.
  const double dy = (p.y + 2) / 34, dz = (p.z - 4) / 26, r2 = dy * dy + dz * dz;
  const double thick = 6.5 - 3.4 * ramp(r2, 1.3, 0.1) * ramp(p.x, 30, 45);
  const double inner = vault + thick;
  // Floors of the anterior and the middle fossa; the tegmen rises to the petrous ridge.
  const double across = (p.x - 54) * -0.69 + (p.y - 31) * 0.72;  // behind the ridge above 0
  double middle = mix(-3, -13, ramp(p.x, 9, 22));
  middle = mix(middle, -6.5 + build.tegmen_up, ramp(across, -27, -10));
  const double ax = p.x - 35.7, ay = p.y - 4.3, bulge = std::max(0.0, 1 - (ax * ax + ay * ay) / 49);
  middle += 1.9 * bulge * bulge + 1.2 * ramp(across, -7, -1);
  const double floor = mix(4, middle, ramp(p.y, -60, -40));
  const double above = (floor - p.z) * 0.75;
  // Posterior fossa: behind the petrous bone and the clivus.
  const Vec3 back = normalized({-0.69, 0.72, 0.17}), clivus = normalized({0, 0.85, 0.53});
  const double behind = smax(-dot(p - Vec3{54, 31, -4.5}, back), -dot(p - Vec3{0, -21, -5}, clivus), 6);
  double d = smax(inner, smin(above, behind, 2.5), 4);
  // The sinus lies in a groove of the bone, open to the inside.
  d = smin(d, sinus_d, 3);
  if (p.z < -30) d = smax(d, (-44.5 - p.z), 3);
  // Walls to what is hollow on the other side: at least the tegmen's 0.8 mm.
  d = smax(d, 0.8 - e.cavity, 0.6);
  d = smax(d, 1.2 - e.labyrinth, 0.6);
  d = smax(d, 1.5 - orbit_d, 1.5);
  return smax(d, 1.2 - air, 1.5);
}

double HeadAnatomy::Model::skin(Vec3 p, double vault) const {
  double d = vault - 6;
  d = smin(d, ellipsoid(p, {0, -48, -40}, {58, 50, 66}), 14);
  d = smin(d, ellipsoid(p, {0, -80, -86}, {33, 27, 35}), 12);
  d = smin(d, cone(p, {46, -24, -82}, {14, -80, -95}, 16, 16), 10);
  d = smin(d, ellipsoid(p, {45, -70, -16}, {17, 16, 22}), 8);
  d = smin(d, cone(p, {58, -56, -19}, {64, -14, -16}, 11, 10), 6);
  d = smin(d, cone(p, {0, -86, 14}, {44, -70, 16}, 13, 11), 8);
  d = smin(d, cone(p, {55, 17, -18}, {57, 14, -44}, 15, 10), 8);
  d = smin(d, cone(p, {0, 12, -40}, {0, 22, -160}, 56, 58), 22);
  d = smin(d, cone(p, {0, -97, -2}, {0, -113, -26}, 6, 8), 9);
  d = smin(d, cone(p, {46, -18, -30}, {45, -26, -82}, 18, 17), 12);
  // The auricle.
  d = smin(d, ellipsoid(p, {73, 12, -14}, {4, 17, 30}), 5);
  return d;
}

double HeadAnatomy::Model::tooth(Vec3 p) const {
  if (p.y > -38 || p.z > -34 || p.z < -100 || p.x > 42) {
    return std::max({p.y + 40, -36 - p.z < 0 ? p.z + 36 : -1e9, -98 - p.z, p.x - 38, 2.0});
  }
  double best = 1e9;
  for (const Tooth& t : teeth) {
    const Vec3 d = p - t.centre;
    const double away = length(d);
    if (away > 24 || away - 22 > best) {
      best = std::min(best, std::max(away - 22, 1.0));
      continue;
    }
    const Vec3 across{t.along.y, -t.along.x, 0};
    const Vec3 q{dot(d, t.along), dot(d, across), d.z * t.up};
    // The crown narrows to the neck and, in front teeth, to the edge.
    const bool molar = t.half.x > 4 && t.half.y > 4.5;
    const double blade = molar || t.half.y > 4 ? 1 : mix(0.45, 1, ramp(q.z, -t.half.z, t.half.z));
    const double neck = mix(1, 0.78, ramp(q.z, 0, t.half.z));
    double crown =
        box({q.x / neck, q.y / (blade * neck), q.z}, {}, {t.half.x, t.half.y, t.half.z}, std::min(t.half.x, t.half.y) * 0.62) * 0.7;
    double root = 1e9;
    if (molar) {
      for (const double side : {-1.0, 1.0}) {
        root = std::min(root, cone(q, {side * t.half.x * 0.4, 0, t.half.z * 0.6}, {side * t.half.x * 0.55, 0, t.half.z + t.root},
                                   t.half.x * 0.45, 1.0));
      }
    } else {
      root = cone(q, {0, 0, t.half.z * 0.6}, {0, 0, t.half.z + t.root}, std::min(t.half.x, t.half.y) * 0.72, 0.9);
    }
    best = std::min(best, smin(crown, root, 1));
  }
  return best;
}

double HeadAnatomy::Model::mandible(Vec3 p) const {
  if (p.y > 8 || p.z > -10) return std::max(p.y, p.z + 16);
  const double g = build.gonion_out;
  // Body: an upright plate along the arch, its upper part leaning inward to the teeth.
  const double low = -107 - build.jaw_height + 21 * std::clamp((p.y + 88) / 70, 0.0, 1.0);
  const double high = -77.5 + 0.1 * (p.y + 90) * 1.1;
  const double lean = 4.5 * ramp(p.y, -88, -62) * ramp(p.z, low + 6, high + 2);
  const double x = p.x + lean;
  double way = 1e9;
  for (std::size_t i = 0; i + 1 < jaw_line.size(); ++i) {
    way = std::min(way, segment2(x, p.y, jaw_line[i].at_mm.x, jaw_line[i].at_mm.y, jaw_line[i + 1].at_mm.x, jaw_line[i + 1].at_mm.y));
  }
  const double thick = mix(5.2, 5.8, ramp(p.z, -86, -98)) + 0.8 * ramp(p.y, -80, -90);
  double body = smax(way - thick, std::abs(p.z - 0.5 * (low + high)) - 0.5 * (high - low), 6) * 0.85;
  // What holds the teeth.
  double holder = smax(arch(p, 26.5, -45, 41) - 5, std::abs(p.z - 0.5 * (high - 95)) - 0.5 * (high + 95), 4);
  body = smin(body, smax(holder, p.y + 44, 6) * 0.8, 7);
  body = smin(body, ellipsoid(p, {0, -92, -103 - build.jaw_height}, {15, 5, 6}), 5);
  // Ramus: posterior border with the condyle's neck, anterior border with the coronoid process, a notch between.
  double sheet = segment2(p.y, p.z, -23, -76, -15.5, -40) - 7;
  sheet = smin(sheet, segment2(p.y, p.z, -48, -70, -43.5, -37) - 4.5, 9);
  sheet = smin(sheet, segment2(p.y, p.z, -35, -74, -31, -55) - 12, 6);
  const double at = mix(45 + g, 48.5, ramp(p.z, -80, -30));
  const double ramus = smax(sheet, std::abs(p.x - at) - mix(4.4, 3.2, ramp(p.z, -80, -40)), 4) * 0.95;
  double condyle = ellipsoid(p, {50.5, -13.5, -23.7}, {9.5, 4.4, 5});
  condyle = smin(condyle, cone(p, {50, -14, -25}, {48.5, -15, -42}, 4.2, 4.6), 5);
  return smin(smin(body, ramus, 8), condyle, 4);
}

double HeadAnatomy::Model::face(Vec3 p, double orbit_d, double nasal_d) const {
  // Brow, root of the nose, nasal bones.
  double d = ellipsoid(p, {0, -84, 13}, {19, 8.5, 10});
  d = smin(d, cone(p, {8, -87, 17}, {44, -74, 17}, 4.5, 4.5), 6);
  d = smin(d, cone(p, {0, -90, 8}, {0, -97, -9}, 4.4, 3.6), 5);
  d = smin(d, cone(p, {7, -89, 6}, {16, -85, -28}, 3.4, 4.2), 7);
  // Shells of orbit, nose and the maxilla's sinus; the rim of the orbit.
  const double rim_y = -81 + 0.42 * (p.x - 30);
  d = smin(d, smax(orbit_d - 1.9, (rim_y - p.y) * 0.9, 2), 2);
  const double ring = portable::hypot(p.x - 31, (p.z - 2) * 1.1) - 20.2;
  d = smin(d, portable::hypot(ring, (p.y - rim_y) * 0.9) * 0.95 - 3.0, 3);
  d = smin(d, smax(nasal_d - 1.8, -85.5 - p.y, 2), 2);
  d = smin(d, ellipsoid(p, {27, -64, -30}, {14.5, 18, 15.5}), 3);
  // Zygoma with its frontal process and the arch.
  d = smin(d, cone(p, {49.5, -71, 13}, {49, -71, -12}, 3.8, 4.5), 4);
  d = smin(d, ellipsoid(p, {44, -72, -20}, {10, 6.5, 9}), 5);
  const Vec3 flat{64 + (p.x - 64) * 1.0, p.y, p.z};
  d = smin(d, arch_tube.distance(flat, 9), 3);
  // Upper jaw: the arch that holds the teeth, the palate.
  const double low = -60 + 0.1 * (p.y + 90);
  double jaw = smax(arch(p, 28, -46, 43.5) - 5.6, std::abs(p.z - 0.5 * (low - 32)) - 0.5 * (-32 - low), 8);
  jaw = smax(jaw, p.y + 42, 4);
  d = smin(d, jaw * 0.8, 10);
  d = smin(d, cone(p, {15, -84, -28}, {13, -86, -46}, 4.5, 5), 8);
  const double fy = (p.y + 46) / 44, fx = p.x / 28, within = (std::sqrt(fx * fx + fy * fy) - 1) * 26;
  d = smin(d, smax(smax(within, std::abs(p.z + 43.5) - 1.6, 1), p.y + 42, 2) * 0.9, 4);
  // Sphenoid body and pterygoid plates.
  d = smin(d, box(p, {0, -38, -13}, {15, 16, 11}, 7), 4);
  d = smin(d, cone(p, {14, -40, -20}, {15, -44, -46}, 4, 2.2), 4);
  d = smin(d, cone(p, {14, -40, -20}, {20, -36, -44}, 4, 1.8), 3);
  // Lateral wall of the orbit to the temporal fossa: greater wing.
  return smin(d, cone(p, {46, -66, 4}, {36, -46, -4}, 3, 4), 6);
}

double HeadAnatomy::Model::skull(Vec3 p, double vault, double brain_d, double orbit_d, double nasal_d, double air, double sinus_d,
                                 const Ear& e) const {
  // Underside of the base.
  double under = mix(-24 - 0.42 * (p.y + 40), -17.5, ramp(p.x, 14, 26));
  under = mix(under, -32.2, ramp(p.y, -14, -2));
  const double behind = (p.x - 54) * -0.69 + (p.y - 31) * 0.72 - 5.7;  // the posterior fossa at the base
  under = mix(under, -50, ramp(behind, -12, 1) * ramp(p.y, -32, -10));
  under = mix(1, under, ramp(p.y, -56, -44));
  double d = smax(vault, (under - p.z) * 0.55, 4);
  // Temporal bone: mastoid with its tip, ring of the ear canal, styloid process, eminence before the joint.
  const double o = build.mastoid_out;
  d = smin(d, ellipsoid(p, {52.8 + 0.5 * o, 20.5, -16}, {11.2, 17, 17}), 6);
  d = smin(d, cone(p, {54 + o, 16.5, -24}, {56.8 + o, 12, -42 - build.tip_down}, 11.2, 5.2), 5);
  const Vec3 tall{p.x, p.y, -20 + (p.z + 20) * 0.86};
  d = smin(d, smax(canal.distance(tall, 8) - 2.4, smax(p.x - 60 - 0.3 * (p.z + 20), 43 - p.x, 1.5), 1.5), 3);
  d = smin(d, cone(p, {44, 4, -31}, {37.5, -6, -59}, 2.8, 1.2), 2);
  d = smin(d, ellipsoid(p, {53, -25, -17.5}, {9, 5, 5}), 4);
  d = smin(d, face(p, orbit_d, nasal_d), 4);
  d = smin(d, ellipsoid(p, {0, 84 * build.vault.y, -10}, {9, 5, 6}), 6);
  // The plate under the sigmoid sinus, to where it leaves for the jugular foramen.
  d = smin(d, smax(sinus_d - 1.4, 20 - p.y, 1), 2);
  // Occipital condyles.
  d = smin(d, ellipsoid(p, {17, 4, -40}, {6, 11, 6}), 3);
  // What is hollow.
  d = smax(d, -brain_d, 1);
  d = smax(d, -orbit_d, 1);
  d = smax(d, -nasal_d, 1);
  d = smax(d, -ellipsoid(p, {50.5, -13, -24.2}, {13, 7.8, 8.6}), 3);           // joint
  d = smax(d, -cone(p, {48.5, 28, -46.5}, {46.8, 14.5, -38.8}, 3.4, 3.0), 2);  // digastric groove
  const double mx = p.x / 15, my = (p.y - 17) / 18;
  d = smax(d, -smax((std::sqrt(mx * mx + my * my) - 1) * 14, p.z + 26, 4), 3);  // foramen magnum
  return std::max({d, -sinus_d, -e.carotid, -air});
}

double HeadAnatomy::Model::cell_region(Vec3 p, double bone, double brain_d, double sinus_d, const Ear& e) const {
  const double f = build.pneumatisation;
  double d = ellipsoid(p, {52.5, 19, -24}, Vec3{14, 18, 23} * f);
  d = smin(d, ellipsoid(p, {54, 3, -10}, Vec3{9, 8, 4} * f), 4);
  d = smax(d, bone + 1.7, 1.5);
  d = smax(d, 1.2 - e.canal, 1);
  d = smax(d, 0.6 - e.cavity, 0.5);
  d = smax(d, 1.5 - e.labyrinth, 1);
  d = smax(d, 1.0 - e.nerve, 0.5);
  d = smax(d, 0.4 - e.chorda, 0.3);
  d = smax(d, 1.0 - sinus_d, 1);
  d = smax(d, 0.9 - brain_d, 1);
  return smax(d, 43 - p.x, 1);
}

std::optional<std::size_t> HeadAnatomy::Model::lattice_index(Vec3 p) const {
  const Vec3 q = (p - lattice_lo) / kPitch;
  const std::array<int, 3> i{static_cast<int>(std::floor(q.x)), static_cast<int>(std::floor(q.y)), static_cast<int>(std::floor(q.z))};
  for (std::size_t a = 0; a < 3; ++a)
    if (i[a] < 0 || i[a] >= lattice[a]) return std::nullopt;
  return static_cast<std::size_t>((i[2] * lattice[1] + i[1]) * lattice[0] + i[0]);
}

// Where the difference of the distances to the two nearest balls exceeds the wall: a foam of round cells of all sizes.
double HeadAnatomy::Model::in_cell(Vec3 p) const {
  const auto at = lattice_index(p);
  if (!at) return 1;
  double first = 1e9, second = 1e9;
  const AirCell* in = nullptr;
  for (const auto c : near_cells[*at]) {
    const AirCell& cell = cells[c];
    const double f = length(p - cell.centre_mm) - cell.radius_mm;
    if (f < first) {
      second = in != nullptr ? smin(first, second, 0.4) : 1e9;
      first = f;
      in = &cell;
    } else {
      second = smin(second, f, 0.4);
    }
  }
  if (in == nullptr) return 1;
  return smax(0.5 * (in->wall_mm - (second - first)), first - 0.8 * in->radius_mm - 1.0, 0.4);
}

double HeadAnatomy::Model::in_duct(Vec3 p) const {
  const auto at = lattice_index(p);
  double d = 0.8;
  if (!at) return d;
  for (const auto c : near_ducts[*at]) d = std::min(d, cone(p, ducts[c].a, ducts[c].b, ducts[c].radius, ducts[c].radius));
  return d;
}

void HeadAnatomy::Model::place_cells(std::uint64_t seed) {
  Random random(seed * 0xd1342543de82ef95ULL + 77);
  const Vec3 lo{40, -8, -50}, hi{70, 40, -4};
  const auto region = [&](Vec3 p) {
    const double vault = outer_vault(p), sinus_d = sinus.distance(p, 8), orbit_d = orbit(p), nasal_d = nasal(p);
    const Ear e = ear(p);
    const double brain_d = brain(p, vault, sinus_d, e, orbit_d, 1e9);
    return cell_region(p, skull(p, vault, brain_d, orbit_d, nasal_d, 1e9, sinus_d, e), brain_d, sinus_d, e);
  };
  // Large ones first; each try smaller. Sizes are log-normal about their place's: small around the antrum, large in the tip and behind.
  const Vec3 antrum{47.6, 14.2, -12.9};
  for (int i = 0; i < 14000; ++i) {
    const Vec3 p{random.uniform(lo.x, hi.x), random.uniform(lo.y, hi.y), random.uniform(lo.z, hi.z)};
    const double shrink = mix(1.5, 0.42, std::min(1.0, i / 9000.0)), draw = portable::exp(0.28 * random.normal()),
                 wall = random.uniform(0.35, 0.7);
    const double local = mix(0.85, 1.6, std::clamp((length(p - antrum) - 8) / 22, 0.0, 1.0));
    const double r = std::clamp(1.4 * build.cell_size * local * draw * shrink, 0.55, 3.2);
    bool free = true;
    for (const AirCell& c : cells) {
      if (length(p - c.centre_mm) < 0.86 * (r + c.radius_mm) + 0.2) {
        free = false;
        break;
      }
    }
    if (!free || region(p) > -0.3 * r) continue;
    cells.push_back({p, r, wall});
  }
  // Openings: each cell to the neighbour that is one step nearer to the antrum, so that all air is one.
  const std::size_t n = cells.size();
  std::vector<double> cost(n);
  std::vector<int> to(n, -1);
  std::vector<char> done(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double gap = std::max(0.0, ear(cells[i].centre_mm).cavity - cells[i].radius_mm);
    cost[i] = gap < 2.2 ? gap * gap : 1e6 + gap;
  }
  for (std::size_t round = 0; round < n; ++round) {
    std::size_t best = n;
    for (std::size_t i = 0; i < n; ++i)
      if (done[i] == 0 && (best == n || cost[i] < cost[best])) best = i;
    done[best] = 1;
    for (std::size_t i = 0; i < n; ++i) {
      const double gap = length(cells[i].centre_mm - cells[best].centre_mm) - cells[i].radius_mm - cells[best].radius_mm;
      const double c = cost[best] + (0.5 + std::max(0.0, gap)) * (0.5 + std::max(0.0, gap));
      if (done[i] == 0 && gap < 2.5 && c < cost[i]) {
        cost[i] = c;
        to[i] = static_cast<int>(best);
      }
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 from = cells[i].centre_mm;
    Vec3 end = antrum + (from - antrum) * 0.5;
    double other = 1;
    if (to[i] >= 0) {
      end = cells[static_cast<std::size_t>(to[i])].centre_mm;
      other = cells[static_cast<std::size_t>(to[i])].radius_mm;
    }
    ducts.push_back({from, end, std::clamp(0.42 * std::min(cells[i].radius_mm, other), 0.35, 0.8)});
  }
  // Lattice: a cell matters in a box if it can be among the nearest two anywhere in it.
  lattice_lo = lo - Vec3{4, 4, 4};
  for (std::size_t a = 0; a < 3; ++a) lattice[a] = static_cast<int>(std::ceil((hi[a] - lo[a] + 8) / kPitch));
  near_cells.resize(static_cast<std::size_t>(lattice[0]) * static_cast<std::size_t>(lattice[1]) * static_cast<std::size_t>(lattice[2]));
  near_ducts.resize(near_cells.size());
  const double half = 0.5 * kPitch * std::sqrt(3.0);
  std::vector<double> f(n);
  std::size_t at = 0;
  for (int k = 0; k < lattice[2]; ++k)
    for (int j = 0; j < lattice[1]; ++j)
      for (int i = 0; i < lattice[0]; ++i, ++at) {
        const Vec3 centre = lattice_lo + Vec3{i + 0.5, j + 0.5, k + 0.5} * kPitch;
        double first = 1e9, second = 1e9;
        for (std::size_t c = 0; c < n; ++c) {
          f[c] = length(centre - cells[c].centre_mm) - cells[c].radius_mm;
          if (f[c] < first) {
            second = first;
            first = f[c];
          } else {
            second = std::min(second, f[c]);
          }
        }
        if (first > 6) continue;
        for (std::size_t c = 0; c < n; ++c)
          if (f[c] <= second + 2 * half + 0.8) near_cells[at].push_back(static_cast<std::uint16_t>(c));
        for (std::size_t c = 0; c < n; ++c)
          if (cone(centre, ducts[c].a, ducts[c].b, ducts[c].radius, ducts[c].radius) < half + 0.8)
            near_ducts[at].push_back(static_cast<std::uint16_t>(c));
      }
}

HeadAnatomy::Sample HeadAnatomy::Model::sample(Vec3 world) const {
  double margin = 1e9;
  const auto inside = [&](double d, double level = 0) {
    margin = std::min(margin, std::abs(d - level));
    return d < level;
  };
  const auto is = [&](Tissue t) { return Sample{t, margin / kLipschitz}; };
  if (inside(length(world - kMarker) - kMarkerRadius)) return is(Tissue::left_marker);
  const Vec3 p{std::abs(world.x), world.y, world.z};
  const double vault = outer_vault(p);
  const double skin_d = skin(p, vault);
  if (!inside(skin_d)) return is(Tissue::air);
  // The ear's parts lie in a box; beyond it and a rim they decide nothing.
  const Vec3 lo{8, -50, -70}, hi{80, 40, -2};
  const double away = length(
      Vec3{std::max({lo.x - p.x, p.x - hi.x, 0.0}), std::max({lo.y - p.y, p.y - hi.y, 0.0}), std::max({lo.z - p.z, p.z - hi.z, 0.0})});
  constexpr double kRim = 4;
  const bool near_ear = away < kRim;
  Ear e;
  if (near_ear) {
    e = ear(p);
  } else {
    margin = std::min(margin, away);
    if (p.z < -60 || p.y < -14) e.carotid = carotid.distance(p, 4);
  }
  const double sinus_d = sinus.distance(p, 8);
  if (near_ear) {
    if (inside(e.nerve)) return is(Tissue::facial_nerve);
    if (inside(e.chorda)) return is(Tissue::chorda_tympani);
    if (inside(ossicles(p))) return is(Tissue::ossicle);
    if (inside(e.cavity)) return is(Tissue::tympanic_cavity);
    if (inside(e.canal)) return is(Tissue::ear_canal);
    if (inside(e.drum)) return is(Tissue::soft);
    if (inside(e.labyrinth)) return is(Tissue::labyrinth);
    if (inside(e.meatus)) return is(Tissue::soft);
  }
  if (inside(sinus_d)) return is(Tissue::sigmoid_sinus);
  if (inside(e.carotid)) return is(Tissue::carotid);
  // Air of the nose and its sinuses.
  const double orbit_d = orbit(p), nasal_d = nasal(p);
  double air = 1e9;
  if (p.y < -10 && p.z < 40) {
    air = ellipsoid(p, {27, -64, -30}, {12.7, 16, 13.5});
    air = std::min(air, ellipsoid(p, {8.5, -84.5, 19}, {7, 4, 7}));
    air = std::min(air, ellipsoid(p, {6.5, -38, -12}, {5.6, 11, 7.5}));
    air = std::min(air, box(p, {8.2, -68, -3}, {3.2, 12, 6}, 2.5));
  } else {
    margin = std::min(margin, std::max({p.y + 10, p.z - 40, 0.0}) + 10);
  }
  const double brain_d = brain(p, vault, sinus_d, e, orbit_d, air);
  if (inside(brain_d)) return inside(brain_d, -0.8) ? is(Tissue::soft) : is(Tissue::dura);
  if (inside(air)) return is(Tissue::air);
  if (inside(nasal_d)) {
    // Septum and conchae: bone within mucosa.
    const double septum = smax(p.x - 0.7, -84 - p.y, 1);
    const double concha = std::min(cone(p, {9, -84, -30}, {9, -54, -30}, 2.6, 2.6), cone(p, {6.5, -80, -16}, {6.5, -52, -16}, 2.2, 2.2));
    if (inside(septum) || inside(concha, -1.8)) return is(Tissue::cortical);
    if (inside(septum, 1.0) || inside(concha) || inside(nasal_d, 0) == false || !inside(nasal_d, -1.2)) return is(Tissue::soft);
    return is(Tissue::air);
  }
  const double tooth_d = tooth(p);
  if (inside(tooth_d)) return is(Tissue::tooth);
  const double jaw = mandible(p);
  if (inside(jaw)) {
    if (inside(alveolar.distance(p, 4))) return is(Tissue::alveolar_nerve);
    const double wall = alveolar.distance(p, 4);
    if (inside(jaw, -2.2) && !inside(wall, 0.5) && !inside(tooth_d, 0.6)) return is(Tissue::jaw_marrow);
    return is(Tissue::mandible);
  }
  const double bone = skull(p, vault, brain_d, orbit_d, nasal_d, air, sinus_d, e);
  if (!inside(bone)) {
    const double throat = smax(smax(portable::hypot(p.x, p.y + 32) - 9, p.z + 36, 4), -150 - p.z, 4);
    const double mouth = smax(ellipsoid(p, {0, -62, -56}, {19, 22, 3}), -85 - p.y, 2);
    return inside(smin(throat, mouth, 3)) ? is(Tissue::air) : is(Tissue::soft);
  }
  if (near_ear) {
    // Openings between the cells and to the antrum go through any wall but those to what must not be opened.
    const double kept =
        std::min({e.nerve - 0.8, e.chorda - 0.3, e.labyrinth - 1.3, e.canal - 1.0, sinus_d - 0.9, brain_d - 0.8, -bone - 1.5});
    if (inside(in_duct(p)) && !inside(kept)) return is(Tissue::air_cells);
    const double region = cell_region(p, bone, brain_d, sinus_d, e);
    if (inside(region, 0.5)) {
      if (inside(region)) {
        if (inside(in_cell(p))) return is(Tissue::air_cells);
      }
      return is(Tissue::cellular);
    }
    // The petrous bone is dense around what it holds.
    if (inside(e.labyrinth, 2.0) || inside(e.nerve, 0.9) || inside(e.canal, 1.2) || inside(e.cavity, 1.0) || inside(e.meatus, 1.0) ||
        inside(e.carotid, 1.0))
      return is(Tissue::cortical);
  }
  if (inside(bone, -1.6) && !inside(sinus_d, 1.2)) return is(Tissue::diploe);
  return is(Tissue::cortical);
}

HeadAnatomy::HeadAnatomy(std::uint64_t individual) : model_(std::make_shared<const Model>(individual)) {}
HeadAnatomy::Sample HeadAnatomy::sample(Vec3 p) const {
  return model_->sample(p);
}
std::span<const TubePoint> HeadAnatomy::facial_nerve() const {
  return model_->nerve.points();
}
HeadAnatomy::NerveMarks HeadAnatomy::facial_nerve_marks() const {
  return model_->marks;
}
std::span<const TubePoint> HeadAnatomy::chorda_tympani() const {
  return model_->chorda.points();
}
std::span<const TubePoint> HeadAnatomy::sigmoid_sinus() const {
  return model_->sinus.points();
}
std::span<const TubePoint> HeadAnatomy::alveolar_nerve() const {
  return model_->alveolar.points();
}
std::span<const AirCell> HeadAnatomy::air_cells() const {
  return model_->cells;
}

std::string_view tissue_name(Tissue tissue) {
  return kNames[static_cast<std::size_t>(tissue)];
}
double tissue_hu(Tissue tissue) {
  return kHu[static_cast<std::size_t>(tissue)];
}

}  // namespace osteo
