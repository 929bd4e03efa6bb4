#include "osteo/geometry/grid/grid_io.h"

#include <openvdb/tools/Dense.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "osteo/core/base/error.h"
#include "osteo/geometry/grid/vdb.h"

namespace osteo::inline geometry {
namespace {

using Dense = openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ>;

openvdb::CoordBBox box_of(std::array<int, 3> lo, std::array<int, 3> n) {
  const openvdb::Coord first(lo[0], lo[1], lo[2]);
  return {first, first.offsetBy(n[0] - 1, n[1] - 1, n[2] - 1)};
}

}  // namespace

Volume<float> to_dense(const SparseGrid& grid, std::array<int, 3> lo, std::array<int, 3> n) {
  for (std::size_t a = 0; a < 3; ++a) {
    // OpenVDB aligns nodes of 4096 voxels around a box.
    constexpr std::int64_t most = std::numeric_limits<int>::max() - 4096;
    if (n[a] < 1 || lo[a] < -most || std::int64_t{lo[a]} + n[a] > most)
      throw Error(ExitCode::usage,
                  "a box of " + std::to_string(n[a]) + " voxels from " + std::to_string(lo[a]) + " on is not valid",
                  "give at least one voxel along each axis");
  }
  Volume<float> v;
  v.frame = grid.frame;
  v.frame.dims = n;
  v.frame.origin_mm =
      grid.frame.world_from_index({static_cast<double>(lo[0]), static_cast<double>(lo[1]), static_cast<double>(lo[2])});
  require_valid(v.frame);
  const auto voxels = make_voxels<float>(v.frame.voxel_count());
  Dense dense(box_of(lo, n), voxels.get());
  openvdb::tools::copyToDense(*grid.impl->grid, dense);
  v.voxels = voxels;
  return v;
}

SparseGrid to_sparse(const Volume<float>& volume, const std::string& name, double background) {
  require_valid(volume.frame);
  const auto values = volume.span();
  if (!std::isfinite(background) ||
      !std::all_of(values.begin(), values.end(), [](float f) { return std::isfinite(f); }))
    throw Error(ExitCode::usage, "a value of the grid is not finite",
                "numpy.nan_to_num puts numbers in place of those");
  grid::initialize_vdb();
  auto vdb = openvdb::FloatGrid::create(static_cast<float>(background));
  // It is only read, but OpenVDB has no view of values that are const.
  const Dense dense(box_of({0, 0, 0}, volume.frame.dims), const_cast<float*>(volume.voxels.get()));
  openvdb::tools::copyFromDense(dense, *vdb, 0.0F);
  return grid::wrap(vdb, volume.frame, name);
}

}  // namespace osteo::inline geometry
