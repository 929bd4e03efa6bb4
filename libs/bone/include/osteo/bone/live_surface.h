// The surface that follows the drill: only the bricks around changed voxels are made again.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "osteo/bone/live_components.h"
#include "osteo/mesh/bone_surface.h"

namespace osteo {

/// Not thread-safe itself; it may read the bone while the servo writes it.
class LiveSurface {
 public:
  /// Extracts every brick. The bone must outlive this.
  LiveSurface(const BrickGrid& bone, const Context& context);

  /// A piece of a bone whose surface is known: takes over what went to it as it was, where the whole then has none; the rest is made. `whole`
  /// as it was before the piece was taken out.
  LiveSurface(const BrickGrid& piece, LiveSurface& whole, const PieceOrigin& origin);
  /// The other way round: a piece is part of the whole again.
  void take_back(LiveSurface& piece, const PieceOrigin& origin);
  /// From now on reads another grid of the same bricks; mark what differs.
  void rebind(const BrickGrid& bone) { bone_ = &bone; }

  /// Notes that a voxel changed. O(1).
  void mark(VoxelKey voxel);
  /// Notes that a brick changed, anywhere in it.
  void mark_brick(std::uint32_t brick);
  /// Makes the patches of the marked bricks again; returns those bricks, ascending. Cost: about 30 us a brick.
  std::span<const std::uint32_t> update();  // valid until the next update()

  [[nodiscard]] const SurfacePatch& patch(std::uint32_t brick) const { return patches_[brick]; }
  [[nodiscard]] const BrickGrid& bone() const { return *bone_; }
  /// The whole surface; equals surface_nets(bone) once all changes were marked and update() was called.
  [[nodiscard]] BoneSurface joined() const { return join_patches(*bone_, patches_); }

 private:
  void mark_box(Ijk lo, Ijk hi);  // of bricks
  const BrickGrid* bone_;
  std::vector<SurfacePatch> patches_;
  std::vector<std::uint32_t> dirty_, done_;
  std::vector<bool> is_dirty_;
};

/// Content hash of points and triangles.
[[nodiscard]] std::string surface_hash(const TriMesh& mesh);

}  // namespace osteo
