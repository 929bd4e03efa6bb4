#include "osteo/geometry/grid/sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "osteo/geometry/grid/vdb.h"

namespace osteo::inline geometry {

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
  return impl_->accessor.getValue(openvdb::Coord(static_cast<int>(std::floor(i.x + 0.5)),
                                                 static_cast<int>(std::floor(i.y + 0.5)),
                                                 static_cast<int>(std::floor(i.z + 0.5))));
}

const Frame& GridSampler::frame() const {
  return impl_->grid.frame;
}

namespace {

// add(corner, value, whether it is stored, weight) for the eight voxels around a point.
template <class F>
void around(const openvdb::FloatGrid::ConstAccessor& accessor, Vec3 index, F&& add) {
  const double fi = std::floor(index.x), fj = std::floor(index.y), fk = std::floor(index.z);
  const double u = index.x - fi, v = index.y - fj, w = index.z - fk;
  const openvdb::Coord low(static_cast<int>(fi), static_cast<int>(fj), static_cast<int>(fk));
  for (int c = 0; c < 8; ++c) {
    float value = 0;
    const bool stored = accessor.probeValue(low.offsetBy(c & 1, c >> 1 & 1, c >> 2), value);
    add(value, stored, ((c & 1) != 0 ? u : 1 - u) * ((c & 2) != 0 ? v : 1 - v) * ((c & 4) != 0 ? w : 1 - w));
  }
}
bool in_range(Vec3 index) {
  return std::abs(index.x) < 1e6 && std::abs(index.y) < 1e6 && std::abs(index.z) < 1e6;
}

}  // namespace

float GridSampler::linear_at(Vec3 index) const {
  if (!in_range(index)) return static_cast<float>(impl_->grid.background);
  double sum = 0;
  around(impl_->accessor, index, [&](float value, bool, double weight) { sum += weight * static_cast<double>(value); });
  return static_cast<float>(sum);
}

float GridSampler::linear_stored_at(Vec3 index) const {
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  const auto round = [](double v) { return static_cast<int>(std::floor(v + 0.5)); };
  if (!in_range(index) || !impl_->accessor.isValueOn(openvdb::Coord(round(index.x), round(index.y), round(index.z))))
    return kNone;
  double sum = 0, weights = 0;
  around(impl_->accessor, index, [&](float value, bool stored, double weight) {
    if (!stored) return;
    sum += weight * static_cast<double>(value);
    weights += weight;
  });
  return static_cast<float>(sum / weights);
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

}  // namespace osteo::inline geometry
