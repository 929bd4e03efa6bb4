// A second scan of a phantom: moved, on other voxels, with other noise, drilled; or an MR. In tests and benchmarks.
#pragma once
#include <algorithm>
#include <cmath>
#include <random>

#include "osteo/core/data/rigid_transform.h"
#include "osteo/core/data/volume.h"
#include "osteo/imaging/image/detail/head_anatomy.h"

namespace osteo::test {

struct SecondScan {
  RigidTransform second_from_first;
  Vec3 spacing_mm{1, 1, 1};
  double noise = 30;
  double air = -1000;  ///< value outside, and of what was drilled
  Vec3 cavity_mm{};    ///< of the first scan: a ball of it is air
  double cavity_radius_mm = 0;
};

/// What an MR might make of the phantom's tissues: bone and air dark, marrow and soft tissue bright, and a coil's
/// shading over all.
inline Image as_mr(const Labels& tissues) {
  const auto v = make_voxels<std::int16_t>(tissues.frame.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < tissues.frame.dims[2]; ++k)
    for (int j = 0; j < tissues.frame.dims[1]; ++j)
      for (int i = 0; i < tissues.frame.dims[0]; ++i, ++at) {
        const auto t = static_cast<Tissue>(tissues.voxels[at]);
        double value = 600;
        if (is_bone(t)) value = t == Tissue::diploe || t == Tissue::jaw_marrow ? 350 : 60;
        if (t == Tissue::air || t == Tissue::air_cells || t == Tissue::ear_canal || t == Tissue::tympanic_cavity)
          value = 30;
        if (t == Tissue::sigmoid_sinus || t == Tissue::carotid) value = 150;
        const Vec3 p = tissues.frame.world_from_index({double(i), double(j), double(k)});
        v[at] = static_cast<std::int16_t>(std::lround(value * (1 + 0.2 * std::sin((p.x + 2 * p.y) / 90))));
      }
  return {tissues.frame, v};
}

/// `clean` has no noise: the second scan shall have noise of its own. Upright voxels that hold all of it; a voxel is
/// the mean over its height.
inline Image scanned_again(const Image& clean, const SecondScan& s) {
  const Frame& from = clean.frame;
  Vec3 lo{1e30, 1e30, 1e30}, hi{-1e30, -1e30, -1e30};
  for (int c = 0; c < 8; ++c) {
    const Vec3 p = s.second_from_first(from.world_from_index(
        {(c & 1) * (from.dims[0] - 1.0), (c >> 1 & 1) * (from.dims[1] - 1.0), (c >> 2) * (from.dims[2] - 1.0)}));
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], p[a]);
      hi[a] = std::max(hi[a], p[a]);
    }
  }
  Frame f;
  for (std::size_t a = 0; a < 3; ++a) f.dims[a] = static_cast<int>((hi[a] - lo[a]) / s.spacing_mm[a]) + 1;
  f.spacing_mm = s.spacing_mm;
  f.origin_mm = lo + Vec3{0.31, 0.17, 0.23};
  const RigidTransform back = s.second_from_first.inverse();
  const auto v = make_voxels<std::int16_t>(f.voxel_count());
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0, s.noise);
  const int layers = std::max(1, static_cast<int>(std::lround(s.spacing_mm.z / from.spacing_mm.z)));
  std::size_t at = 0;
  for (int k = 0; k < f.dims[2]; ++k)
    for (int j = 0; j < f.dims[1]; ++j)
      for (int i = 0; i < f.dims[0]; ++i) {
        double sum = 0;
        for (int n = 0; n < layers; ++n) {
          const Vec3 p = back(f.world_from_index({double(i), double(j), k + (n + 0.5) / layers - 0.5}));
          const Vec3 x = from.index_from_world(p);
          bool in = true;
          for (std::size_t a = 0; a < 3; ++a) in = in && x[a] > -0.5 && x[a] < from.dims[a] - 0.5;
          const bool drilled = s.cavity_radius_mm > 0 && length(p - s.cavity_mm) < s.cavity_radius_mm;
          const double hu = in && !drilled ? sample_linear(clean, x) : s.air;
          sum += hu / layers;
        }
        v[at++] = static_cast<std::int16_t>(std::lround(sum + normal(random)));
      }
  return {f, v};
}

/// How far `found` puts places within `reach_mm` of a centre from where they are: mean over 27 of them.
inline double target_error_mm(const RigidTransform& truth, const RigidTransform& found, Vec3 centre_mm,
                              double reach_mm) {
  double sum = 0;
  for (int c = 0; c < 27; ++c) {
    const Vec3 p = centre_mm + Vec3{c % 3 - 1.0, c / 3 % 3 - 1.0, c / 9 - 1.0} * reach_mm;
    sum += length(truth(p) - found(p)) / 27;
  }
  return sum;
}

}  // namespace osteo::test
