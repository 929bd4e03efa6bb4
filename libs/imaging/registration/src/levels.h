// A scan on ever coarser isotropic voxels.
#pragma once
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/rigid_transform.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline imaging::registration {

struct Level {
  Frame frame;
  std::vector<float> values;
  [[nodiscard]] float at(int i, int j, int k) const {
    return values[(static_cast<std::size_t>(k) * static_cast<std::size_t>(frame.dims[1]) +
                   static_cast<std::size_t>(j)) *
                      static_cast<std::size_t>(frame.dims[0]) +
                  static_cast<std::size_t>(i)];
  }
};

struct Levels {
  std::vector<Level> levels;  // finest first, each twice as coarse as the one before
  float lo = 0, hi = 1;       // values that one in 200 and one in 500 voxels lie beyond
};

/// `wanted_mm`, or the finest that both scans have, or what keeps a level of either scan below 40 million voxels.
[[nodiscard]] double finest_of(const Frame& a, const Frame& b, double wanted_mm);

/// Means over voxels of `finest_mm` (linear between voxels where the scan is coarser), then of 2^3 of them, down to 8
/// mm or more.
[[nodiscard]] Levels make_levels(const Image& image, double finest_mm, const Context& context);

/// From points of one frame's world to index coordinates of a level.
struct IndexMap {
  std::array<std::array<float, 3>, 3> row{};
  std::array<float, 3> shift{};
};
[[nodiscard]] IndexMap index_map(const Frame& to, const RigidTransform& to_from, Vec3 centre_mm);

/// Trilinear; false outside the centres of the outermost voxels.
inline bool sample(const Level& level, float x, float y, float z, float& value) {
  const auto& d = level.frame.dims;
  if (!(x >= 0 && y >= 0 && z >= 0 && x <= static_cast<float>(d[0] - 1) && y <= static_cast<float>(d[1] - 1) &&
        z <= static_cast<float>(d[2] - 1)))
    return false;
  const int i = x >= static_cast<float>(d[0] - 1) && d[0] > 1 ? d[0] - 2 : static_cast<int>(x);
  const int j = y >= static_cast<float>(d[1] - 1) && d[1] > 1 ? d[1] - 2 : static_cast<int>(y);
  const int k = z >= static_cast<float>(d[2] - 1) && d[2] > 1 ? d[2] - 2 : static_cast<int>(z);
  const float fx = x - static_cast<float>(i), fy = y - static_cast<float>(j), fz = z - static_cast<float>(k);
  const auto nx = static_cast<std::size_t>(d[0]), nxy = nx * static_cast<std::size_t>(d[1]);
  const float* const p = level.values.data() + static_cast<std::size_t>(k) * nxy + static_cast<std::size_t>(j) * nx +
                         static_cast<std::size_t>(i);
  // An axis of one voxel has no neighbour.
  const std::size_t sx = d[0] > 1 ? 1 : 0, sy = d[1] > 1 ? nx : 0, sz = d[2] > 1 ? nxy : 0;
  const auto row = [&](const float* q) { return q[0] + fx * (q[sx] - q[0]); };
  const auto plane = [&](const float* q) {
    const float a = row(q);
    return a + fy * (row(q + sy) - a);
  };
  const float a = plane(p);
  value = a + fz * (plane(p + sz) - a);
  return true;
}

}  // namespace osteo::inline imaging::registration
