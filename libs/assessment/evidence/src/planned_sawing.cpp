#include "osteo/assessment/evidence/detail/planned_sawing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "osteo/core/base/portable_math.h"
#include "osteo/geometry/grid/brick_places.h"

namespace osteo::inline assessment {
namespace {

constexpr double kReachMm = 5, kReachDeg = 20, kStepDeg = 2, kAroundMm = 40, kBinMm = 0.25;
constexpr double kLeastShare = 0.05;  // of a voxel, that went from it: less is no cut
constexpr double kLeastMm2 = 5;       // of a slot, or it is a scratch
// Beside a slot is bone; where as much is gone beside it as in it, it is a hole.
constexpr double kBesideMm = 1.5, kMostBeside = 0.5;
constexpr double kLeastAcrossMm = 0.8;  // root mean square of a slot along its shorter side, for a plane to be known
constexpr double kDeg = std::numbers::pi / 180;

struct Lost {
  Vec3 at_mm;
  double mm3 = 0, edge_mm = 0;
};

std::vector<Lost> lost_bone(const World& whole, const World& left) {
  std::vector<Lost> out;
  for (const PlacedBody& before : whole.bodies()) {
    const BrickGrid& bone = before.body->bone;
    std::vector<const BrickGrid*> after;  // its pieces
    for (const PlacedBody& b : left.bodies())
      if (b.body->bone.frame() == bone.frame()) after.push_back(&b.body->bone);
    const double volume = bone.frame().voxel_volume_mm3();
    for (VoxelKey v = 0; v < bone.brick_count() * BrickGrid::kVoxels; ++v) {
      const double had = static_cast<double>(bone.value(v));
      if (had < kLeastShare) continue;
      const Ijk at = bone.coordinate(v);
      double has = 0;
      for (const BrickGrid* piece : after)
        if (const VoxelKey own = piece->find(at.i, at.j, at.k); own != BrickGrid::kNone)
          has += static_cast<double>(piece->value(own));
      if (had - has > kLeastShare * had)
        out.push_back({place_of_voxel_mm(bone, v), (had - has) * volume, std::cbrt(volume)});
    }
  }
  return out;
}

// In the planned plane's axes: z across it.
struct Near {
  Vec3 at;
  double mm3, edge_mm;
  std::size_t index;
};

// Height over the planned plane: z = rise . (1, x, y).
struct Slot {
  std::array<double, 3> rise{};
  double half_mm = 0;
  [[nodiscard]] double off(Vec3 p) const {
    return (p.z - rise[0] - rise[1] * p.x - rise[2] * p.y) / std::sqrt(1 + rise[1] * rise[1] + rise[2] * rise[2]);
  }
};

bool solved(std::array<std::array<double, 4>, 3> m, std::array<double, 3>& x) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (m[k][k] < 1e-9) return false;
    for (std::size_t r = 0; r < 3; ++r) {
      if (r == k) continue;
      const double f = m[r][k] / m[k][k];
      for (std::size_t c = k; c < 4; ++c) m[r][c] -= f * m[k][c];
    }
  }
  for (std::size_t k = 0; k < 3; ++k) x[k] = m[k][3] / m[k][k];
  return true;
}

// The plane that most of what is gone lies along; of two, rather the nearer one.
Slot likeliest(const std::vector<Near>& near, double kerf_mm) {
  const auto bins = static_cast<std::size_t>(2 * kReachMm / kBinMm) + 1,
             wide = static_cast<std::size_t>(std::max(1.0, std::round(kerf_mm / kBinMm)));
  Slot best;
  double most = 0;
  const int steps = static_cast<int>(kReachDeg / kStepDeg);
  std::vector<double> sum(bins);
  for (int a = -steps; a <= steps; ++a) {
    for (int b = -steps; b <= steps; ++b) {
      const double deg = std::hypot(a, b) * kStepDeg;
      if (deg > kReachDeg) continue;
      const auto [sin_a, cos_a] = portable::sin_cos(a * kStepDeg * kDeg);
      const auto [sin_b, cos_b] = portable::sin_cos(b * kStepDeg * kDeg);
      Slot s;
      s.rise = {0, sin_a / cos_a, sin_b / cos_b};
      std::fill(sum.begin(), sum.end(), 0);
      for (const Near& n : near) {
        const double off = s.off(n.at) + kReachMm;
        if (off >= 0 && off < 2 * kReachMm) sum[static_cast<std::size_t>(off / kBinMm)] += n.mm3;
      }
      for (std::size_t from = 0; from + wide <= bins; ++from) {
        double in = 0;
        for (std::size_t k = from; k < from + wide; ++k) in += sum[k];
        const double off = (static_cast<double>(from) + static_cast<double>(wide) / 2) * kBinMm - kReachMm;
        const double score = in / (1 + off * off / 4 + deg * deg / 100);
        if (score <= most) continue;
        most = score;
        best = s;
        best.rise[0] = off * std::sqrt(1 + s.rise[1] * s.rise[1] + s.rise[2] * s.rise[2]);
      }
    }
  }
  return best;
}

// One planned cut, with the bone that no other has.
struct Found {
  SawnPlane plane;
  std::vector<std::size_t> used;
  [[nodiscard]] double far() const { return plane.off_mm * plane.off_mm / 4 + plane.angle_deg * plane.angle_deg / 100; }
};

Found found(const std::vector<Lost>& lost, const std::vector<bool>& taken, const PlannedCut& planned) {
  Found out;
  out.plane.why = "not made: nothing is sawn within 5 mm and 20 degrees of it";
  const Vec3 z = normalized(planned.cut.normal), x = any_perpendicular(z), y = cross(z, x);
  std::vector<Near> near;
  for (std::size_t n = 0; n < lost.size(); ++n) {
    const Vec3 p = lost[n].at_mm - planned.cut.at_mm;
    if (taken[n] || dot(p, p) > kAroundMm * kAroundMm) continue;
    near.push_back({{dot(p, x), dot(p, y), dot(p, z)}, lost[n].mm3, lost[n].edge_mm, n});
  }
  if (near.empty()) return out;
  const double kerf = planned.cut.kerf_mm;
  Slot slot = likeliest(near, kerf);
  double mm3 = 0, beside = 0;
  Vec3 middle;
  for (int round = 0; round < 20; ++round) {
    const double more = std::max(0.0, 1 - 0.2 * round);  // wide at first: the search is coarse
    std::array<std::array<double, 4>, 3> m{};
    mm3 = beside = 0;
    middle = {};
    out.used.clear();
    out.plane.voxels = 0;
    for (const Near& n : near) {
      const double off = std::abs(slot.off(n.at)), half = kerf / 2 + n.edge_mm;
      if (off <= half) out.used.push_back(n.index);
      if (off > half && off <= half + kBesideMm) beside += n.mm3;
      if (off > half + more) continue;
      const std::array<double, 3> f{1, n.at.x, n.at.y};
      for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 3; ++c) m[r][c] += n.mm3 * f[r] * f[c];
        m[r][3] += n.mm3 * f[r] * n.at.z;
      }
      mm3 += n.mm3;
      middle += n.at * n.mm3;
      ++out.plane.voxels;
    }
    if (mm3 < kLeastMm2 * kerf || !solved(m, slot.rise)) return out;
  }
  middle = middle / mm3;
  if (beside > kMostBeside * mm3) {
    out.plane.why = "more is gone there than a saw takes: no plane can be measured";
    return out;
  }
  double xx = 0, xy = 0, yy = 0;
  for (const Near& n : near) {
    if (std::abs(slot.off(n.at)) > kerf / 2 + n.edge_mm) continue;
    const Vec3 d = n.at - middle;
    xx += n.mm3 * d.x * d.x / mm3;
    xy += n.mm3 * d.x * d.y / mm3;
    yy += n.mm3 * d.y * d.y / mm3;
  }
  const double shorter = (xx + yy) / 2 - std::sqrt((xx - yy) * (xx - yy) / 4 + xy * xy);
  if (shorter < kLeastAcrossMm * kLeastAcrossMm) {
    out.plane.why = "too little is sawn: no plane can be measured";
    return out;
  }
  const double slope = portable::hypot(slot.rise[1], slot.rise[2]);
  middle.z = slot.rise[0] + slot.rise[1] * middle.x + slot.rise[2] * middle.y;
  out.plane.off_mm = middle.z;
  out.plane.angle_deg = portable::atan2(slope, 1) / kDeg;
  out.plane.at_mm = planned.cut.at_mm + x * middle.x + y * middle.y + z * middle.z;
  out.plane.normal = normalized(z - x * slot.rise[1] - y * slot.rise[2]);
  if (std::abs(out.plane.off_mm) <= kReachMm && out.plane.angle_deg <= kReachDeg) out.plane.why.clear();
  return out;
}

}  // namespace

std::vector<SawnPlane> sawn_planes(const World& whole, const World& left, std::span<const PlannedCut> cuts) {
  const std::vector<Lost> lost = lost_bone(whole, left);
  std::vector<bool> taken(lost.size());
  std::vector<SawnPlane> out(cuts.size());
  std::vector<bool> settled(cuts.size());
  // The nearest of all pairs first: what is sawn for one cut is not there for another.
  for (std::size_t round = 0; round < cuts.size(); ++round) {
    std::optional<Found> nearest;
    std::size_t of = 0;
    for (std::size_t n = 0; n < cuts.size(); ++n) {
      if (settled[n]) continue;
      Found f = found(lost, taken, cuts[n]);
      out[n] = f.plane;
      if (!f.plane.why.empty() || (nearest && nearest->far() <= f.far())) continue;
      nearest = std::move(f);
      of = n;
    }
    if (!nearest) break;
    settled[of] = true;
    for (const std::size_t n : nearest->used) taken[n] = true;
  }
  return out;
}

std::vector<Measured> planned_cut_values(const World& whole, const World& left, std::span<const PlannedCut> cuts) {
  std::vector<Measured> values;
  const std::vector<SawnPlane> planes = sawn_planes(whole, left, cuts);
  for (std::size_t n = 0; n < cuts.size(); ++n) {
    if (!planes[n].why.empty()) {
      not_measured_all(values, MetricPlace::plan, {MetricWhen::planned}, planes[n].why, cuts[n].name);
      continue;
    }
    values.push_back(measured("plan_off_mm", std::abs(planes[n].off_mm), cuts[n].name));
    values.push_back(measured("plan_angle_deg", planes[n].angle_deg, cuts[n].name));
    values.push_back(measured("plan_voxels", static_cast<double>(planes[n].voxels), cuts[n].name));
  }
  return values;
}

}  // namespace osteo::inline assessment
