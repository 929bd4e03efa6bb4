// Normals to light a bone's surface by: those of its triangles show every slice of the CT as a terrace.
#pragma once
#include <cstdint>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/geometry/mesh/bone_surface.h"

namespace osteo::inline simulation {

/// The gradient of the bone's own density, smoothed: unlike the CT's it holds while the bone is drilled. Points of a
/// surface stay where they are, so what is felt and measured is untouched. Two widths: where the surface is flat over a
/// millimetre the wide one, whose gradient noise and terraces do not reach; near edges, thin walls and small cuts,
/// which it would round, one of a voxel; where even that sees both sides of a wall, the triangles' own normal. How it
/// decides: below a flat face half of what the wide kernel sees is bone, and its gradient has the height of a whole
/// step. A face that is curved, near an edge or backed by another face differs from that. Values are sums over cells of
/// 1, 2, 4 or 8 voxels along an edge, about as wide as the kernel. A normal depends on voxels up to reach() away.
/// Memory: 4 bytes a cell. Not thread-safe itself; it may read the bone while the servo writes it.
class ShadingField {
 public:
  static constexpr double kWideMm = 1;  ///< standard deviation of the wide kernel

  /// Of all bricks. The bone must outlive this.
  explicit ShadingField(const BrickGrid& bone, int threads = 0);
  /// From now on reads another grid of the same bricks; renew() what differs.
  void rebind(const BrickGrid& bone) { bone_ = &bone; }

  /// The voxels of this brick have changed. O(512).
  void renew(std::uint32_t brick);
  /// Puts new normals into a patch as extract_patch made it; a pure function of the voxels as of the last renew() and
  /// as they are now. About 10 us, and 0.5 us for each vertex that is not flat.
  void shade(std::uint32_t brick, SurfacePatch& patch) const;

  /// In bricks: a change in one may change normals in those around it.
  [[nodiscard]] int reach_bricks() const { return reach_bricks_; }
  [[nodiscard]] std::size_t memory_bytes() const { return cells_.capacity() * sizeof(float); }

 private:
  struct Kernel {
    int radius = 0;
    std::vector<float> value, slope;  // at whole cells, -radius to radius; slope for a mm
  };
  static Kernel kernel_of(double sigma_mm, double cell_mm);
  void sum_cells(std::uint32_t brick);

  const BrickGrid* bone_;
  int edge_;       // voxels along a cell's edge
  int per_brick_;  // cells along a brick's edge
  double voxel_mm_;
  Kernel wide_, narrow_;
  int reach_bricks_;
  std::vector<float> cells_;  // mean density, x fastest, brick after brick
};

}  // namespace osteo::inline simulation
