// A facial nerve by seed, in bone that is not the phantom's: bends, width and roughness vary, its canal may be open to
// the middle ear, and other dark tubes, cells and a large vessel lie beside it.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

#include "osteo/core/data/volume.h"
#include "osteo/imaging/segment/tube.h"

namespace osteo::test {

/// Numbers that are the same in every standard library.
class SeededNumbers {
 public:
  explicit SeededNumbers(std::uint64_t seed) : state_(seed * 0x9E3779B97F4A7C15ULL + 0x632BE59BD9B4E019ULL) {
    for (int i = 0; i < 8; ++i) (void)next();
  }
  std::uint64_t next() {  // xorshift64*
    state_ ^= state_ >> 12, state_ ^= state_ << 25, state_ ^= state_ >> 27;
    return state_ * 0x2545F4914F6CDD1DULL;
  }
  double unit() { return static_cast<double>(next() >> 11) / 9007199254740992.0; }
  double between(double a, double b) { return a + (b - a) * unit(); }
  bool chance(double p) { return unit() < p; }
  double normal() {
    double g = -6;
    for (int q = 0; q < 12; ++q) g += unit();
    return g;
  }
  Vec3 direction() {
    for (;;) {
      const Vec3 d{between(-1, 1), between(-1, 1), between(-1, 1)};
      if (length(d) > 0.1 && length(d) < 1) return normalized(d);
    }
  }

 private:
  std::uint64_t state_;
};

struct NerveShape {
  Image ct;
  std::vector<Vec3> line;      ///< every 0.1 mm
  std::vector<double> radius;  ///< of the circle of equal area, at each point of the line
  std::vector<Vec3> clicks;    ///< three to five on the nerve, up to 0.3 mm off its centre
  double volume_mm3 = 0;
};

/// Nearest point of the line to p.
inline std::size_t nearest_on(const NerveShape& s, Vec3 p) {
  std::size_t best = 0;
  for (std::size_t i = 0; i < s.line.size(); ++i)
    if (length(s.line[i] - p) < length(s.line[best] - p)) best = i;
  return best;
}

inline NerveShape make_nerve_shape(std::uint64_t seed) {
  SeededNumbers r(seed);
  NerveShape s;
  // The line: from a short part before the first bend (60 to 100 degrees) along the middle ear, then down.
  const double bend1 = r.between(1.1, 1.75), bend2 = r.between(0.9, 1.7), turn1 = r.between(0.8, 1.6),
               turn2 = r.between(1.5, 3.5);
  const double part1 = r.between(2, 4), part2 = r.between(6, 11), part3 = r.between(8, 14);
  const double twist = r.between(1.0, 2.2);
  Vec3 at, along{1, 0, 0}, side{0, 1, 0};
  const auto rotated = [](Vec3 v, Vec3 axis, double a) {
    return v * std::cos(a) + cross(axis, v) * std::sin(a) + axis * (dot(axis, v) * (1 - std::cos(a)));
  };
  constexpr double kStep = 0.1;
  const Vec3 sway1 = r.direction(), sway2 = r.direction();
  const double sway_mm = r.between(0, 0.6), sway_a = r.between(4, 9), sway_b = r.between(3, 7);
  double arc = 0;
  std::vector<double> arcs;
  const auto go = [&](double mm, double turn, Vec3 axis) {
    const int n = std::max(1, static_cast<int>(mm / kStep));
    for (int i = 0; i < n; ++i) {
      s.line.push_back(at + sway1 * (sway_mm * std::sin(arc / sway_a * 2 * std::numbers::pi)) +
                       sway2 * (0.5 * sway_mm * std::sin(arc / sway_b * 2 * std::numbers::pi)));
      arcs.push_back(arc);
      along = normalized(rotated(along, axis, turn / n));
      at = at + along * kStep;
      arc += kStep;
    }
  };
  go(part1, 0, side);
  go(turn1 * bend1, bend1, side);
  const std::size_t begin2 = s.line.size();
  go(part2, r.between(-0.3, 0.3), side);
  const std::size_t end2 = s.line.size();
  const Vec3 axis2 = normalized(rotated(side, along, twist));
  go(turn2 * bend2, bend2, axis2);
  const std::size_t begin3 = s.line.size();
  go(part3, r.between(-0.4, 0.4), normalized(rotated(axis2, along, 1)));
  // Any way up.
  const Vec3 spin = r.direction();
  const double angle = r.between(0, std::numbers::pi);
  for (Vec3& p : s.line) p = rotated(p, spin, angle);
  const std::size_t n = s.line.size();
  const auto tangent = [&](std::size_t i) {
    return normalized(s.line[std::min(i + 3, n - 1)] - s.line[i > 3 ? i - 3 : 0]);
  };
  // Width: 0.5 to 1.1 mm of radius, wider at the first bend, narrower before it.
  const double base = r.between(0.55, 1.05), ganglion = r.between(1.0, 1.6), wave = r.between(0, 0.18),
               wave_mm = r.between(2, 6), flat = r.between(0.65, 1), rough = r.between(0, 0.14);
  for (std::size_t i = 0; i < n; ++i) {
    const double d = (static_cast<double>(i) - 0.5 * static_cast<double>(begin2)) * kStep;
    const double bulge = 1 + (ganglion - 1) * std::exp(-d * d / 2);
    const double narrow = i < begin2 / 2 ? 0.75 : 1;
    s.radius.push_back(base * bulge * narrow * (1 + wave * std::sin(arcs[i] / wave_mm * 2 * std::numbers::pi)));
  }
  Vec3 lo{1e9, 1e9, 1e9}, hi{-1e9, -1e9, -1e9};
  for (const Vec3 p : s.line)
    for (std::size_t a = 0; a < 3; ++a) lo[a] = std::min(lo[a], p[a] - 5), hi[a] = std::max(hi[a], p[a] + 5);
  // A fine grid, then the scanner's blur, then its voxels.
  constexpr double kFine = 0.25;
  std::array<int, 3> d{};
  for (std::size_t a = 0; a < 3; ++a) d[a] = static_cast<int>((hi[a] - lo[a]) / kFine) + 1;
  const auto nx = static_cast<std::size_t>(d[0]), nxy = nx * static_cast<std::size_t>(d[1]);
  const std::size_t total = nxy * static_cast<std::size_t>(d[2]);
  const auto place = [&](std::size_t i) {
    return lo +
           Vec3{static_cast<double>(i % nx), static_cast<double>(i / nx % (nxy / nx)), static_cast<double>(i / nxy)} *
               kFine;
  };
  const auto within = [&](Vec3 c, double reach, const auto& each) {  // voxels of a box around c
    std::array<int, 3> a{}, b{};
    for (std::size_t x = 0; x < 3; ++x) {
      a[x] = std::clamp(static_cast<int>(std::ceil((c[x] - reach - lo[x]) / kFine)), 0, d[x]);
      b[x] = std::clamp(static_cast<int>(std::floor((c[x] + reach - lo[x]) / kFine)) + 1, 0, d[x]);
    }
    for (int k = a[2]; k < b[2]; ++k)
      for (int j = a[1]; j < b[1]; ++j)
        for (int i = a[0]; i < b[0]; ++i)
          each(static_cast<std::size_t>(k) * nxy + static_cast<std::size_t>(j) * nx + static_cast<std::size_t>(i));
  };
  // How far outside of the nerve each voxel lies.
  constexpr float kFar = 1e6F;
  std::vector<float> gap(total, kFar);
  std::array<double, 6> lumps{};
  for (double& l : lumps) l = r.between(0, 2 * std::numbers::pi);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 t = tangent(i), u = normalized(cross(t, any_perpendicular(spin))), v = cross(t, u);
    within(s.line[i], s.radius[i] + 2.2, [&](std::size_t at_voxel) {
      const Vec3 x = place(at_voxel) - s.line[i];
      if (length(x) > s.radius[i] + 2.2 || 0.8 * length(x) - s.radius[i] * 1.3 > static_cast<double>(gap[at_voxel]))
        return;
      const double a = dot(x, u) / std::sqrt(flat), b = dot(x, v) * std::sqrt(flat), c = dot(x, t);
      const double phi = std::atan2(b, a);
      const double edge = s.radius[i] * (1 + rough * (std::sin(3 * phi + lumps[0] + 2.1 * arcs[i]) +
                                                      0.7 * std::sin(5 * phi + lumps[1] - 3.3 * arcs[i])));
      gap[at_voxel] = std::min(gap[at_voxel], static_cast<float>(std::sqrt(a * a + b * b + c * c) - edge));
    });
  }
  // Bone: dense, with patches of marrow.
  const double dense = r.between(800, 1700), marrow = r.chance(0.3) ? r.between(300, 700) : dense * 0.8,
               share = r.between(-0.6, 0.9);
  std::array<Vec3, 5> waves;
  std::array<double, 5> phase{};
  for (std::size_t q = 0; q < 5; ++q)
    waves[q] = r.direction() * (2 * std::numbers::pi / r.between(2, 7)), phase[q] = r.between(0, 6.28);
  std::vector<float> hu(total);
  for (std::size_t i = 0; i < total; ++i) {
    const Vec3 p = place(i);
    double w = 0;
    for (std::size_t q = 0; q < 5; ++q) w += std::sin(dot(waves[q], p) + phase[q]);
    const double near = std::clamp(static_cast<double>(gap[i]) / 0.6, 0.0, 1.0);  // the canal's own wall is dense
    const double m = std::clamp(2 * (w / 2.2 - share) + 0.5, 0.0, 1.0) * near;
    hu[i] = static_cast<float>(dense + (marrow - dense) * m);
  }
  // Cells of air, or full; as many as there is room for.
  const double how_many = r.unit(), cell_gap = r.between(0.2, 1.2);
  const double filled = r.chance(0.15) ? r.between(0.3, 1) : 0;
  const int cells = static_cast<int>(how_many * how_many * 400);
  for (int c = 0; c < cells; ++c) {
    const Vec3 m{r.between(lo.x, hi.x), r.between(lo.y, hi.y), r.between(lo.z, hi.z)};
    const double radius = r.between(0.6, 2.4);
    const auto v = static_cast<float>(r.chance(filled) ? r.between(10, 60) : -1000);
    within(m, radius, [&](std::size_t i) {
      const double q = length(place(i) - m);
      if (q<radius&& static_cast<double>(gap[i])> cell_gap) hu[i] = v;
    });
  }
  // A line beside the nerve: along points a to b, so far from its surface.
  const auto beside = [&](std::size_t a, std::size_t b, double away, double radius, double turn, float v,
                          double least) {
    for (std::size_t i = a; i < b; ++i) {
      const Vec3 t = tangent(i), u = normalized(cross(t, any_perpendicular(spin))), w = cross(t, u);
      const double phi = turn + 0.02 * static_cast<double>(i - a);
      const Vec3 c = s.line[i] + (u * std::cos(phi) + w * std::sin(phi)) * (s.radius[i] + away + radius);
      within(c, radius, [&](std::size_t q) {
        if (length(place(q) - c) < radius && static_cast<double>(gap[q]) > least) hu[q] = v;
      });
    }
  };
  const double turn = r.between(0, 6.28);
  // The labyrinth's canals on one side, the middle ear on the other with a wall of 0 to 0.6 mm, which may be open.
  beside(begin2, end2, r.between(0.7, 2), r.between(0.4, 0.7), turn + r.between(2.4, 3.8),
         static_cast<float>(r.between(0, 30)), 0.3);
  const bool full_ear = r.chance(0.15);
  if (r.chance(0.85)) {
    const double wall = r.between(-0.15, 0.7);
    beside(begin2, end2, std::max(0.0, wall), r.between(1.8, 3.2), turn, full_ear ? 35.0F : -1000.0F,
           std::max(0.0, wall));
  }
  // The stapedius and its like beside the part that goes down; a large vein.
  if (r.chance(0.5)) {
    const std::size_t from = end2 + static_cast<std::size_t>(r.between(0, 20));
    beside(from, std::min(n - 1, from + static_cast<std::size_t>(r.between(30, 70))), r.between(0.3, 1),
           r.between(0.4, 0.9), turn + r.between(-1, 1), 50.0F, 0.1);
  }
  if (r.chance(0.3))
    beside(begin3, n - 1, r.between(0.8, 3), 4, turn + r.between(2, 4), static_cast<float>(r.between(40, 80)), 0.5);
  const auto content = static_cast<float>(r.between(20, 70));
  for (std::size_t i = 0; i < total; ++i) {
    if (gap[i] > 0) continue;
    hu[i] = content;
    s.volume_mm3 += kFine * kFine * kFine;
  }
  const double sigma = r.between(0.3, 0.55) / kFine;
  const int reach = static_cast<int>(3 * sigma) + 1;
  std::vector<float> kernel;
  float sum = 0;
  for (int q = -reach; q <= reach; ++q) kernel.push_back(static_cast<float>(std::exp(-0.5 * q * q / (sigma * sigma))));
  for (const float k : kernel) sum += k;
  for (float& k : kernel) k /= sum;
  for (std::size_t a = 0; a < 3; ++a) {
    const std::size_t stride = a == 0 ? 1 : a == 1 ? nx : nxy;
    std::vector<float> out(total);
    for (std::size_t i = 0; i < total; ++i) {
      const int x = static_cast<int>(i / stride % static_cast<std::size_t>(d[a]));
      float w = 0;
      for (int q = -reach; q <= reach; ++q) {
        const int step = std::clamp(x + q, 0, d[a] - 1) - x;
        w += kernel[static_cast<std::size_t>(q + reach)] *
             hu[static_cast<std::size_t>(static_cast<std::ptrdiff_t>(i) + step * static_cast<std::ptrdiff_t>(stride))];
      }
      out[i] = w;
    }
    hu = std::move(out);
  }
  const double spacing = r.between(0.3, 0.6), noise = r.between(15, 80);
  Frame f;
  f.spacing_mm = {spacing, spacing, r.chance(0.3) ? std::min(0.8, 1.5 * spacing) : spacing};
  f.origin_mm = lo;
  for (std::size_t a = 0; a < 3; ++a) f.dims[a] = static_cast<int>((hi[a] - lo[a]) / f.spacing_mm[a]);
  const auto voxels = make_voxels<std::int16_t>(f.voxel_count());
  std::size_t out = 0;
  for (int k = 0; k < f.dims[2]; ++k)
    for (int j = 0; j < f.dims[1]; ++j)
      for (int i = 0; i < f.dims[0]; ++i, ++out) {
        const std::array<double, 3> x{i * f.spacing_mm.x / kFine, j * f.spacing_mm.y / kFine,
                                      k * f.spacing_mm.z / kFine};
        double v = 0;
        for (std::size_t c = 0; c < 8; ++c) {
          double w = 1;
          std::size_t at_voxel = 0;
          for (std::size_t a = 0; a < 3; ++a) {
            const int low = std::min(static_cast<int>(x[a]), d[a] - 2);
            const double t = x[a] - low;
            const bool high = ((c >> a) & 1U) != 0;
            w *= high ? t : 1 - t;
            at_voxel += static_cast<std::size_t>(low + (high ? 1 : 0)) * (a == 0 ? 1 : a == 1 ? nx : nxy);
          }
          v += w * static_cast<double>(hu[at_voxel]);
        }
        voxels[out] = static_cast<std::int16_t>(std::clamp(std::lround(v + noise * r.normal()), -1024L, 3071L));
      }
  s.ct = {f, voxels};
  const int clicks = 3 + static_cast<int>(r.between(0, 3));
  for (int c = 0; c < clicks; ++c) {
    const double share_of = c / (clicks - 1.0);
    const auto i = static_cast<std::size_t>(5 + share_of * static_cast<double>(n - 11));
    s.clicks.push_back(s.line[i] + r.direction() * r.between(0, 0.3));
  }
  return s;
}

/// What a station must be to count as right: within the true nerve (or half a millimetre from the middle of a thinner
/// one), and its radius not more than half a millimetre off.
inline bool is_right(const NerveShape& s, const TubeStation& t) {
  const std::size_t i = nearest_on(s, t.at_mm);
  return length(s.line[i] - t.at_mm) <= std::max(0.5, s.radius[i]) && std::abs(t.radius_mm - s.radius[i]) <= 0.5;
}

}  // namespace osteo::test
