#include "osteo/geometry/grid/brick_places.h"

#include "osteo/geometry/grid/vdb.h"

namespace osteo::inline geometry {

SparseGrid to_sparse(const Frame& frame, const std::string& name, std::span<const Ijk> bricks,
                     std::span<const std::uint64_t> stored, std::span<const float> values, double background) {
  grid::initialize_vdb();
  auto vdb = openvdb::FloatGrid::create(static_cast<float>(background));
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    const Ijk o = bricks[b];
    auto* leaf = vdb->tree().touchLeaf(openvdb::Coord(o.i * 8, o.j * 8, o.k * 8));
    for (int v = 0; v < 512; ++v) {
      if ((stored[8 * b + static_cast<std::size_t>(v >> 6)] >> (v & 63) & 1U) == 0) continue;
      // OpenVDB's leaves run z fastest.
      leaf->setValueOn(openvdb::Coord(o.i * 8 + (v & 7), o.j * 8 + (v >> 3 & 7), o.k * 8 + (v >> 6)),
                       values[512 * b + static_cast<std::size_t>(v)]);
    }
  }
  return grid::wrap(vdb, frame, name);
}

}  // namespace osteo::inline geometry
