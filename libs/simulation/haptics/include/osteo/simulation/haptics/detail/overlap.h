// How much bone lies inside a tool, exactly.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/simulation/bone/round_cone.h"

namespace osteo::inline simulation {

class Grains;

/// A voxel under the tool: the share of it that is covered, 0 to 1, and the tool's efficiency at that latitude, 0 to 1.
struct Hit {
  VoxelKey voxel;
  float share, efficiency;
};

struct OverlapResult {
  double spread_mm3 =
      0;                ///< integral of density over the shape, taking the bone in a voxel as spread through all of it
  double bone_mm3 = 0;  ///< the same, but where a burr has covered a voxel in part, the bone lies where Grains have it
  double sharp_mm3 =
      0;  ///< the same again, taking the bone in the other voxels as ending at a plane: what contact begins with
  Vec3 area_mm2;  ///< integral of density times outward normal over its surface: the gradient of bone_mm3 for moves of
                  ///< the shape
  double surface_mm2 = 0;  ///< integral of density over the surface: how much of it touches bone
  Vec3 area_foot_mm3;  ///< the same times the foot on the axis: the torque of a uniform pressure is -cross(axis, this)
};

/// Sums over the voxels of bone near the shape: each contributes its density times the share of its cube that the shape
/// covers. The shape's surface is a plane within a voxel, moved for the mean of its curvature: volume within 0.1 % from
/// a radius of 2 voxels on, 1 % at one voxel. No samples, no steps: everything is continuous in the pose. The grid's
/// voxels must be cubes. Cost: about 8 ns for a row of 8 voxels at the surface, 2 ns inside; air costs nothing.
class Overlap {
 public:
  /// `most_hits`: room for that many, made once. Shapes longer than a few voxels are walked along their axis.
  explicit Overlap(std::size_t most_hits);
  ~Overlap();
  Overlap(const Overlap&) = delete;
  Overlap& operator=(const Overlap&) = delete;
  /// `start_mm`: the start of the shape's axis in the world, its own start_mm not counted; `axis` unit. With
  /// `want_hits` every `stride`-th row of voxels is listed, which ones depends on `phase`. `known`: where burrs have
  /// been in this bone; null: nowhere. It adds about 20 ns for each voxel at the surface that a burr has covered in
  /// part. No allocation.
  OverlapResult measure(const BrickGrid& bone, const RoundCone& shape, Vec3 start_mm, Vec3 axis,
                        const Grains* known = nullptr, bool want_hits = false, double falloff_per_rad = 0,
                        std::uint32_t stride = 1, std::uint32_t phase = 0) noexcept;
  /// Of the last measure(): ascending within a brick, each voxel once.
  [[nodiscard]] std::span<const Hit> hits() const { return {hits_.data(), count_}; }

 private:
  std::vector<Hit> hits_;
  std::size_t count_ = 0;
  struct PartialBuffer;
  std::unique_ptr<PartialBuffer> partial_;
};

}  // namespace osteo::inline simulation
