// The steps around a network, as nnU-Net 2.x takes them: grids resampled, windows placed and weighted.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/imaging/neural/detail/network.h"

namespace osteo::inline imaging {

/// Where a value of a resampled axis comes from: `low` and `high`, in parts 1 - share and share.
struct LinearTap {
  int low = 0, high = 0;
  double share = 0;
};

/// The axis along which slices are resampled each by itself; -1: none. Spacings before and after.
[[nodiscard]] int separate_axis(const std::array<double, 3>& from_mm, const std::array<double, 3>& to_mm);
/// Cubic B-splines, edges repeated, held to the range of what came in; nearest along `separate`.
[[nodiscard]] std::vector<float> resample_cubic(std::vector<float> values, const Axes& size, const Axes& to,
                                                int separate, const Context& context);
/// Labels: of the labels around a voxel the one with the largest linear weight; of equal ones the nearest voxel's, else
/// the smallest. Slice by slice, and then nearest, along `separate`. As batchgenerators does from 0.25.4 on.
[[nodiscard]] std::vector<std::int16_t> resample_labels(const std::vector<std::int16_t>& labels, const Axes& size,
                                                        const Axes& to, int separate, const Context& context);
[[nodiscard]] std::vector<LinearTap> linear_taps(int size, int to, bool nearest);
/// First voxels of the windows along one axis.
[[nodiscard]] std::vector<int> window_starts(int size, int window, double step);
/// Weights of a window's voxels, 16-bit numbers.
[[nodiscard]] std::vector<std::uint16_t> window_weights(const Axes& window, bool flat);

}  // namespace osteo::inline imaging
