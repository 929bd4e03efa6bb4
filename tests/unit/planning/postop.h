// A CT after surgery of which everything is known: fragments anywhere, sawn anywhere, noise, metal, a grid of its own.
#pragma once
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "osteo/core/data/volume.h"
#include "osteo/core/statistics/basics.h"
#include "osteo/geometry/distance/distance_map.h"
#include "osteo/session/planning/detail/plan.h"

namespace osteo::testing_planning {

/// Signed distances of a bone on voxels of half a millimetre, 4 mm beyond it.
class BoneField {
 public:
  explicit BoneField(const TriangleSoup& bone) {
    const BoxMm box = bounds_of(bone);
    frame_.spacing_mm = {0.5, 0.5, 0.5};
    frame_.origin_mm = box.lo - Vec3{4, 4, 4};
    for (std::size_t a = 0; a < 3; ++a) frame_.dims[a] = static_cast<int>((box.hi[a] - box.lo[a] + 8) / 0.5) + 1;
    const DistanceMap map = DistanceMapper(bone, frame_).map({});
    values_.resize(frame_.voxel_count(), 4);
    std::size_t n = 0;
    for (int k = 0; k < frame_.dims[2]; ++k)
      for (int j = 0; j < frame_.dims[1]; ++j)
        for (int i = 0; i < frame_.dims[0]; ++i, ++n)
          if (const auto at = map.find(i, j, k); at >= 0)
            values_[n] = static_cast<float>(map.distance_mm[static_cast<std::size_t>(at)]);
  }
  [[nodiscard]] double at(Vec3 p) const {
    const Vec3 q = (p - frame_.origin_mm) / 0.5;
    std::array<int, 3> i{};
    Vec3 t;
    for (std::size_t a = 0; a < 3; ++a) {
      if (!(q[a] >= 0 && q[a] < frame_.dims[a] - 1)) return 4;
      i[a] = static_cast<int>(q[a]);
      t[a] = q[a] - i[a];
    }
    double sum = 0;
    for (int c = 0; c < 8; ++c) {
      double w = 1;
      std::size_t at = 0;
      for (std::size_t a = 3; a-- > 0;) {
        const int up = (c >> a) & 1;
        w *= up ? t[a] : 1 - t[a];
        at = at * static_cast<std::size_t>(frame_.dims[a]) + static_cast<std::size_t>(i[a] + up);
      }
      sum += w * values_[at];
    }
    return sum;
  }

 private:
  Frame frame_;
  std::vector<float> values_;
};

struct TrueFragment {
  const BoneField* bone = nullptr;
  RigidTransform postop_from_ct;
  std::vector<std::pair<Vec3, Vec3>> faces;  ///< where it really was sawn: a place, and the direction to the waste
  /// The planes go on to where the bone comes back: there is no bone of this fragment on that side.
  Vec3 guard_at, guard_normal;
};

struct PostopCt {
  double noise_hu = 40, blur_mm = 0.45;
  Vec3 spacing_mm{0.6, 0.6, 0.75};
  bool marrow = true;
  std::vector<RigidTransform> plates;  ///< each a bar of metal, 24 x 5 x 1.6 mm, with streaks
};

inline double normal_share(double x) {
  return 0.5 * std::erfc(-x / std::sqrt(2.0));
}

/// That two normal variables of this correlation are below x and y; the tetrachoric series, for what is below 0.6 in
/// it.
inline double both_below(double x, double y, double correlation) {
  const double p = normal_share(x), q = normal_share(y), r = correlation;
  const double at = std::exp(-(x * x + y * y) / 2) / (2 * 3.14159265358979323846);
  return p * q + at * (r + r * r / 2 * x * y + r * r * r / 6 * (x * x - 1) * (y * y - 1));
}

inline double gaussian(statistics::Random& random) {
  double sum = 0;  // twelve uniform ones: variance 1
  for (int n = 0; n < 12; ++n) sum += static_cast<double>(random.bits() >> 11U) * 0x1p-53;
  return sum - 6;
}

/// Noise is of neighbouring voxels together, as a scanner's.
inline std::vector<float> noise_of(const Frame& f, double sd, std::uint64_t seed) {
  statistics::Random random(seed);
  std::vector<float> v(f.voxel_count());
  for (float& x : v) x = static_cast<float>(gaussian(random));
  const std::size_t nx = static_cast<std::size_t>(f.dims[0]), nxy = nx * static_cast<std::size_t>(f.dims[1]);
  for (const std::size_t step : {std::size_t{1}, nx})
    for (std::size_t n = 0; n + step < v.size(); ++n) v[n] = (v[n] + v[n + step]) * 0.70710678F;
  static_cast<void>(nxy);
  for (float& x : v) x *= static_cast<float>(sd);
  return v;
}

inline Image postop_ct(const std::vector<TrueFragment>& fragments, BoxMm box, const PostopCt& how, std::uint64_t seed) {
  Image ct;
  ct.frame.spacing_mm = how.spacing_mm;
  ct.frame.direction = rotation_about({}, normalized({1, 2, -1}), 0.07).rotation;
  const Vec3 middle = (box.lo + box.hi) / 2, half = (box.hi - box.lo) / 2 + Vec3{10, 10, 10};
  for (std::size_t a = 0; a < 3; ++a) ct.frame.dims[a] = static_cast<int>(2 * half[a] / how.spacing_mm[a]);
  ct.frame.origin_mm = middle - ct.frame.direction * half;
  const auto voxels = make_voxels<std::int16_t>(ct.frame.voxel_count());
  const std::vector<float> noise = noise_of(ct.frame, how.noise_hu, seed);
  std::vector<RigidTransform> back, plate_back;
  for (const TrueFragment& f : fragments) back.push_back(f.postop_from_ct.inverse());
  for (const RigidTransform& p : how.plates) plate_back.push_back(p.inverse());
  std::size_t n = 0;
  for (int k = 0; k < ct.frame.dims[2]; ++k) {
    for (int j = 0; j < ct.frame.dims[1]; ++j) {
      for (int i = 0; i < ct.frame.dims[0]; ++i, ++n) {
        const Vec3 x = ct.frame.world_from_index(Vec3(i, j, k));
        double hu = 40, solid = 0;
        for (std::size_t f = 0; f < fragments.size(); ++f) {
          const Vec3 p = back[f](x);
          if (dot(p - fragments[f].guard_at, fragments[f].guard_normal) < 0) continue;
          const double skin = fragments[f].bone->at(p);
          if (skin >= 3) continue;
          double cut = -100;
          Vec3 across;
          for (const auto& [at, e] : fragments[f].faces) {
            if (dot(p - at, e) <= cut) continue;
            cut = dot(p - at, e);
            across = e;
          }
          if (cut >= 3) continue;
          // Blur goes over cortex, marrow and face together: for planes exactly this, by the angle between them.
          double r = 0;
          if (cut > -3 && std::abs(skin + 1.25) < 3.25)
            r = std::clamp(fragments[f].bone->at(p + across * 0.5) - fragments[f].bone->at(p - across * 0.5), -0.6,
                           0.6);
          const double b = how.blur_mm, bone = both_below(-skin / b, -cut / b, r);
          const double core = how.marrow ? 900 * both_below((-skin - 2.5) / b, -cut / b, r) : 0;
          solid += 1160 * bone - core;
        }
        hu += std::min(solid, 1160.0);  // bones that touch add up; where they would be in one another, they are bone
        for (const RigidTransform& to_plate : plate_back) {
          const Vec3 p = to_plate(x);
          const double sd = std::max({std::abs(p.x) - 12, std::abs(p.y) - 2.5, std::abs(p.z) - 0.8});
          if (sd < 2) hu += 5000 * normal_share(-sd / how.blur_mm);
          const double r = length(p);
          if (r > 3) hu += 250 * std::sin(9 * std::atan2(p.z, p.x)) * std::exp(-r / 15);
        }
        voxels[n] =
            static_cast<std::int16_t>(std::lround(std::clamp(hu + static_cast<double>(noise[n]), -1000.0, 3071.0)));
      }
    }
  }
  ct.voxels = voxels;
  return ct;
}

inline double uniform(statistics::Random& random, double from, double to) {
  return from + (to - from) * (static_cast<double>(random.bits() >> 11U) * 0x1p-53);
}
inline Vec3 uniform_vector(statistics::Random& random, double most) {
  return {uniform(random, -most, most), uniform(random, -most, most), uniform(random, -most, most)};
}
inline RigidTransform motion(Vec3 about, Vec3 shift, Vec3 turn_deg) {
  const double angle = length(turn_deg) * 3.14159265358979323846 / 180;
  RigidTransform r = angle > 0 ? rotation_about(about, normalized(turn_deg), angle) : RigidTransform{};
  r.shift_mm += shift;
  return r;
}

}  // namespace osteo::testing_planning
