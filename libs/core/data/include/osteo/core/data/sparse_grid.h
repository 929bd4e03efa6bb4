// A sparse scalar grid (OpenVDB inside, but not in this header: including OpenVDB costs 11 s a source file).
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "osteo/core/data/frame.h"

namespace osteo {

/// An immutable value; copies share the voxels. libs/geometry/grid makes, reads and converts them.
struct SparseGrid {
  struct Impl;  ///< defined in libs/geometry/grid

  std::string name;                 ///< "density" (share of the voxel filled with bone, 0 to 1), "hu", ...
  Frame frame;                      ///< dims = the box that holds all stored voxels, which start at index (0,0,0)
  double background = 0;            ///< the value of every voxel that is not stored
  std::uint64_t active_voxels = 0;  ///< voxels that are stored
  std::uint64_t memory_bytes = 0;   ///< of the grid's tree
  std::shared_ptr<const Impl> impl;
};

}  // namespace osteo
