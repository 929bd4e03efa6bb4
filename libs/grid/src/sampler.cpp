#include "osteo/grid/sampler.h"

#include <algorithm>
#include <cmath>

#include "osteo/grid/vdb.h"

namespace osteo {

struct GridSampler::Impl {
  explicit Impl(const SparseGrid& g) : grid(g), accessor(g.impl->grid->getConstAccessor()) {}
  SparseGrid grid;
  mutable openvdb::FloatGrid::ConstAccessor accessor;
};

GridSampler::GridSampler(const SparseGrid& grid) : impl_(std::make_unique<Impl>(grid)) {}
GridSampler::~GridSampler() = default;
GridSampler::GridSampler(GridSampler&&) noexcept = default;

float GridSampler::nearest(Vec3 world_mm) const {
  const Vec3 i = impl_->grid.frame.index_from_world(world_mm);
  return impl_->accessor.getValue(openvdb::Coord(static_cast<int>(std::floor(i.x + 0.5)), static_cast<int>(std::floor(i.y + 0.5)),
                                                 static_cast<int>(std::floor(i.z + 0.5))));
}

std::pair<Vec3, Vec3> GridSampler::bounds_mm(const SparseGrid& grid) {
  const auto box = grid.impl->grid->evalActiveVoxelBoundingBox();
  Vec3 lo{1e30, 1e30, 1e30}, hi{-1e30, -1e30, -1e30};
  for (int c = 0; c < 8; ++c) {
    const Vec3 p = grid.frame.world_from_index({double((c & 1) != 0 ? box.max().x() : box.min().x()),
                                                double((c & 2) != 0 ? box.max().y() : box.min().y()),
                                                double((c & 4) != 0 ? box.max().z() : box.min().z())});
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], p[a]);
      hi[a] = std::max(hi[a], p[a]);
    }
  }
  return {lo, hi};
}

}  // namespace osteo
