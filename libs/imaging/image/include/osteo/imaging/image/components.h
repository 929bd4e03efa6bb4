// Connected components of a mask, as runs of voxels.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "osteo/core/base/param.h"

namespace osteo::inline imaging {

/// face: 6 neighbours; full: 26 neighbours.
enum class Connectivity : int { face, full };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(Connectivity) {
  return {"face", "full"};
}

struct Run {
  std::uint32_t begin, end;  ///< x range [begin, end) in row `row`
  std::uint32_t row;         ///< y + z * dims[1]
};

struct Components {
  std::vector<Run> runs;
  std::vector<std::uint32_t> component;  ///< one a run; numbered by first voxel in scan order
  std::vector<std::uint64_t> voxels;     ///< one a component
};

/// Components of the voxels equal to `value` (0: background, 1: mask). O(voxels); memory O(runs).
[[nodiscard]] Components connected_components(std::span<const std::uint8_t> mask, std::array<int, 3> dims,
                                              std::uint8_t value, Connectivity connectivity);

/// The same for runs that are at hand, in scan order.
[[nodiscard]] Components connected_components(std::vector<Run> runs, std::array<int, 3> dims,
                                              Connectivity connectivity);

/// Which components to drop: those below `min_voxels`, and those beyond the `keep_largest` largest (0 keeps all). One a
/// component.
[[nodiscard]] std::vector<bool> components_to_drop(const Components& components, double min_voxels, int keep_largest);

}  // namespace osteo::inline imaging
