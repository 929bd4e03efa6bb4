// CT values on an isotropic grid along the body's axes, in which everything here is looked for. Private to
// libs/imaging/segment.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline imaging::segment {

/// x to the left, y to the back, z to the head, as LPS has it; `v` x fastest.
struct Field {
  Vec3 origin_mm;  ///< centre of voxel (0,0,0)
  double h_mm = 1;
  std::array<int, 3> n{0, 0, 0};
  std::vector<float> v;

  [[nodiscard]] std::size_t size() const {
    return static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]);
  }
  [[nodiscard]] std::size_t at(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(n[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(n[0]) +
           static_cast<std::size_t>(i);
  }
  [[nodiscard]] bool inside(int i, int j, int k) const {
    return i >= 0 && j >= 0 && k >= 0 && i < n[0] && j < n[1] && k < n[2];
  }
  [[nodiscard]] Vec3 world(int i, int j, int k) const {
    return origin_mm + Vec3{static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)} * h_mm;
  }
  [[nodiscard]] std::array<int, 3> nearest(Vec3 world_mm) const;
  [[nodiscard]] std::array<int, 3> place(std::size_t index) const {
    const auto nx = static_cast<std::size_t>(n[0]), ny = static_cast<std::size_t>(n[1]);
    return {static_cast<int>(index % nx), static_cast<int>(index / nx % ny), static_cast<int>(index / nx / ny)};
  }
  /// Trilinear; outside, the value at the border.
  [[nodiscard]] double sample(Vec3 world_mm) const;
  /// As a frame, for functions of other libraries.
  [[nodiscard]] Frame frame() const { return {n, {h_mm, h_mm, h_mm}, origin_mm, {}}; }
};

/// The CT between lo and hi, cut to where there is a CT (an axis-aligned box around it), by trilinear interpolation.
/// Voxels outside of an oblique CT hold the value at its border. When the CT is straight and its spacing is h, its own
/// voxels are taken.
[[nodiscard]] Field make_field(const Image& ct, Vec3 lo_mm, Vec3 hi_mm, double h_mm, int threads);
/// The axis-aligned box around the CT's voxel centres.
void bounds_of(const Frame& frame, Vec3& lo_mm, Vec3& hi_mm);

/// Gaussian, to 3.5 standard deviations; the border is repeated.
[[nodiscard]] std::vector<float> smoothed(const std::vector<float>& v, std::array<int, 3> n, double sigma_voxels,
                                          int threads);

/// Standard deviation of the noise, from the least fifth of the differences of neighbours along x: edges are not among
/// them.
[[nodiscard]] double noise_of(const Image& ct);

/// Trilinear in a CT at world points, without a division a point.
class Sampler {
 public:
  explicit Sampler(const Image& ct);
  [[nodiscard]] double operator()(Vec3 world_mm) const {
    return sample_linear(*ct_, to_index_ * (world_mm - ct_->frame.origin_mm));
  }

 private:
  const Image* ct_;
  Mat3 to_index_;
};

}  // namespace osteo::inline imaging::segment
