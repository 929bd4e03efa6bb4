// The middle line of a canal or a vessel that is given as voxels. Private to libs/imaging/segment.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline imaging::segment {

/// A part of a label map with its own grid: 1 where it is the structure.
struct MaskBox {
  Frame frame;
  std::array<int, 3> lo{0, 0, 0};  ///< of its first voxel, in the label map
  std::vector<std::uint8_t> in;

  [[nodiscard]] std::size_t at(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(frame.dims[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(frame.dims[0]) +
           static_cast<std::size_t>(i);
  }
  [[nodiscard]] std::array<int, 3> place(std::size_t v) const {
    const auto nx = static_cast<std::size_t>(frame.dims[0]), ny = static_cast<std::size_t>(frame.dims[1]);
    return {static_cast<int>(v % nx), static_cast<int>(v / nx % ny), static_cast<int>(v / nx / ny)};
  }
  [[nodiscard]] Vec3 world(std::size_t v) const {
    const auto p = place(v);
    return frame.world_from_index({static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])});
  }
  /// Calls `visit(index)` for the neighbours of v at most `reach` voxels away along each axis.
  template <class Visit>
  void around(std::size_t v, int reach, const Visit& visit) const {
    const auto p = place(v);
    for (int k = std::max(0, p[2] - reach); k <= std::min(frame.dims[2] - 1, p[2] + reach); ++k) {
      for (int j = std::max(0, p[1] - reach); j <= std::min(frame.dims[1] - 1, p[1] + reach); ++j) {
        for (int i = std::max(0, p[0] - reach); i <= std::min(frame.dims[0] - 1, p[0] + reach); ++i) visit(at(i, j, k));
      }
    }
  }
};

/// From one end of the voxels to the other, every mm, through their middle; over gaps of up to 6 mm where they are in
/// pieces. Pieces farther away, and those of less than a tenth of the largest, do not count. Empty where there are
/// none.
[[nodiscard]] std::vector<Vec3> middle_line(const MaskBox& mask, const Context& context);

}  // namespace osteo::inline imaging::segment
