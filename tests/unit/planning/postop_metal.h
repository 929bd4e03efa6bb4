// Screws, holes and plates in a CT after surgery, of which everything is known.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "postop.h"

namespace osteo::testing_planning {

/// Metal, or with 40 HU a hole. Blurred by sums over what is inside it, not by the model that outcomes are found with.
struct TrueSolid {
  std::function<bool(Vec3)> inside;  ///< in the CT after surgery
  BoxMm box;
  double hu = 6000;
  Vec3 streaks_from;
};

struct TrueRod {
  Vec3 entry, tip;
  double diameter = 2;
  double head_mm = 0;   ///< height of a head twice as wide, which begins at the entry
  double point_mm = 0;  ///< a cone at its tip
};

inline TrueSolid solid_of(const TrueRod& rod, double hu = 6000) {
  const Vec3 w = normalized(rod.tip - rod.entry);
  const double length = osteo::length(rod.tip - rod.entry);
  TrueSolid s;
  s.inside = [=](Vec3 p) {
    const double along = dot(p - rod.entry, w);
    const double r = osteo::length(p - rod.entry - w * along);
    if (along < 0) return along > -rod.head_mm && r < rod.diameter;
    double radius = rod.diameter / 2;
    if (rod.point_mm > 0) radius *= std::min(1.0, (length - along) / rod.point_mm);
    return along < length && r < radius;
  };
  for (const Vec3& p : {rod.entry - w * rod.head_mm, rod.tip})
    for (const double d : {-rod.diameter, rod.diameter}) s.box.include(p + Vec3{d, d, d});
  s.hu = hu;
  s.streaks_from = (rod.entry + rod.tip) / 2;
  return s;
}

/// A bar bent in its middle, in a frame of its own: x along it, z away from the bone.
struct BentBar {
  double half_length = 14, half_width = 2.5, half_height = 0.8, rise = 0.25;  ///< z = rise * |x|
  [[nodiscard]] bool inside(Vec3 p) const {
    return std::abs(p.x) < half_length && std::abs(p.y) < half_width &&
           std::abs(p.z - rise * std::abs(p.x)) < half_height;
  }
  [[nodiscard]] TriangleSoup surface(const RigidTransform& to) const {
    TriangleSoup s;
    for (int n = -1; n <= 1; ++n) {
      const double x = n * half_length, z = rise * std::abs(x);
      for (const auto& [y, h] : {std::pair{-half_width, -half_height}, std::pair{half_width, -half_height},
                                 std::pair{half_width, half_height}, std::pair{-half_width, half_height}})
        s.points_mm.push_back(to({x, y, z + h}));
    }
    const auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
      s.triangles.push_back({a, b, c});
      s.triangles.push_back({a, c, d});
    };
    for (std::uint32_t n = 0; n < 2; ++n)
      for (std::uint32_t k = 0; k < 4; ++k) {
        const std::uint32_t next = (k + 1) % 4;
        quad(4 * n + k, 4 * n + 4 + k, 4 * n + 4 + next, 4 * n + next);
      }
    quad(0, 1, 2, 3);
    quad(8, 11, 10, 9);
    // Outwards: by the sign of the volume.
    double volume = 0;
    for (const auto& t : s.triangles) volume += dot(s.points_mm[t[0]], cross(s.points_mm[t[1]], s.points_mm[t[2]]));
    if (volume < 0)
      for (auto& t : s.triangles) std::swap(t[1], t[2]);
    return s;
  }
};

inline TrueSolid solid_of(const BentBar& bar, const RigidTransform& to, double hu = 6000) {
  TrueSolid s;
  s.inside = [bar, back = to.inverse()](Vec3 p) { return bar.inside(back(p)); };
  for (const Vec3& p : bar.surface(to).points_mm) s.box.include(p);
  s.hu = hu;
  s.streaks_from = to(Vec3{});
  return s;
}

/// Into a CT that is made already. Holes first: what comes later replaces what is there.
inline void put(Image& ct, const std::vector<TrueSolid>& solids, const PostopCt& how, double streak_hu,
                std::uint64_t seed) {
  constexpr int kHalf = 4;
  std::vector<std::pair<Vec3, double>> kernel;
  double sum = 0;
  for (int k = -kHalf; k <= kHalf; ++k)
    for (int j = -kHalf; j <= kHalf; ++j)
      for (int i = -kHalf; i <= kHalf; ++i) {
        const Vec3 o = Vec3(i, j, k) * (3.0 / kHalf / 1.1);
        kernel.emplace_back(o * how.blur_mm, std::exp(-dot(o, o) / 2));
        sum += kernel.back().second;
      }
  const auto voxels = make_voxels<std::int16_t>(ct.frame.voxel_count());
  const std::vector<float> noise = noise_of(ct.frame, how.noise_hu, seed + 77);
  std::size_t n = 0;
  for (int k = 0; k < ct.frame.dims[2]; ++k) {
    for (int j = 0; j < ct.frame.dims[1]; ++j) {
      for (int i = 0; i < ct.frame.dims[0]; ++i, ++n) {
        double hu = static_cast<double>(ct.voxels[n]);
        const Vec3 x = ct.frame.world_from_index(Vec3(i, j, k));
        for (const TrueSolid& s : solids) {
          const double reach = 3 * how.blur_mm;
          bool near = true;
          for (std::size_t a = 0; a < 3; ++a) near = near && x[a] > s.box.lo[a] - reach && x[a] < s.box.hi[a] + reach;
          if (near) {
            double share = 0;
            for (const auto& [o, w] : kernel)
              if (s.inside(x + o)) share += w / sum;
            hu += (s.hu + static_cast<double>(noise[n]) - hu) * share;
          }
          const Vec3 d = x - s.streaks_from;
          if (s.hu > 1000 && std::abs(d.z) < 8 && length(d) > 3)
            hu += streak_hu * std::sin(7 * std::atan2(d.y, d.x) + d.z) * std::exp(-length(d) / 12);
        }
        voxels[n] = static_cast<std::int16_t>(std::lround(std::clamp(hu, -1000.0, 3071.0)));
      }
    }
  }
  ct.voxels = voxels;
}

}  // namespace osteo::testing_planning
