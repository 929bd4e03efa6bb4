// The surface that follows the drill: only the bricks around changed voxels are made again.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "osteo/geometry/mesh/bone_surface.h"
#include "osteo/simulation/bone/detail/shading.h"
#include "osteo/simulation/bone/live_components.h"

namespace osteo::inline simulation {

/// Not thread-safe itself; it may read the bone while the servo writes it.
class LiveSurface {
 public:
  /// Extracts every brick. The bone must outlive this.
  LiveSurface(const BrickGrid& bone, const Context& context);

  /// A piece of a bone whose surface is known: takes over what went to it as it was, where the whole then has none; the
  /// rest is made. `whole` as it was before the piece was taken out.
  LiveSurface(const BrickGrid& piece, LiveSurface& whole, const PieceOrigin& origin);
  /// The other way round: a piece is part of the whole again.
  void take_back(LiveSurface& piece, const PieceOrigin& origin);
  /// From now on with the normals of a ShadingField, not of the triangles: for whoever draws it. Pieces of it too.
  void shade(const Context& context);
  /// From now on reads another grid of the same bricks; mark what differs.
  void rebind(const BrickGrid& bone) {
    bone_ = &bone;
    if (shading_) shading_->rebind(bone);
  }

  /// Notes that a voxel changed. O(1).
  void mark(VoxelKey voxel);
  /// Notes that a brick changed, anywhere in it.
  void mark_brick(std::uint32_t brick);
  /// Makes the patches of the marked bricks again; returns those bricks, ascending. Cost: about 30 us a brick,
  /// shaded 45.
  std::span<const std::uint32_t> update();  // valid until the next update() or settle()
  /// Shaded: makes the patches again whose points stayed when something a few bricks away was marked, but whose normals
  /// may be others; returns those bricks, ascending. After it all is as if made again. What update() left for it can
  /// wait: it is hardly seen.
  std::span<const std::uint32_t> settle();  // valid until the next update() or settle()
  [[nodiscard]] bool settled() const { return stale_.empty(); }

  [[nodiscard]] const SurfacePatch& patch(std::uint32_t brick) const { return patches_[brick]; }
  [[nodiscard]] const BrickGrid& bone() const { return *bone_; }
  /// The whole surface; equals surface_nets(bone) once all changes were marked and update() was called.
  [[nodiscard]] BoneSurface joined() const { return join_patches(*bone_, patches_); }

 private:
  void mark_box(Ijk lo, Ijk hi);  // of bricks
  void note_change(std::uint32_t brick);
  void renew_shading();
  void make(std::uint32_t brick);
  const BrickGrid* bone_;
  std::vector<SurfacePatch> patches_;
  std::vector<std::uint32_t> dirty_, done_;
  std::vector<bool> is_dirty_;
  // Of shading: bricks whose voxels changed since the last update(), bricks whose normals may be others.
  std::unique_ptr<ShadingField> shading_;
  std::vector<std::uint32_t> changed_, stale_;
  std::vector<bool> is_changed_, is_stale_;
};

/// Normals as those of a shaded LiveSurface, for a mesh of the bone's surface or of some of its points, which has
/// normals of its own: one without is left alone. Those stay where the bone has no surface to shade by. Costs less than
/// half of making the surface again.
void shade_mesh(TriMesh& mesh, const BrickGrid& bone, const Context& context);

/// Content hash of points and triangles.
[[nodiscard]] std::string surface_hash(const TriMesh& mesh);

}  // namespace osteo::inline simulation
