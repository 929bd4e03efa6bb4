#include "osteo/bone/live_surface.h"

#include <algorithm>

#include "osteo/base/files.h"
#include "osteo/base/parallel.h"

namespace osteo {

LiveSurface::LiveSurface(const BrickGrid& bone, const Context& context)
    : bone_(bone), patches_(bone.brick_count()), is_dirty_(bone.brick_count()) {
  dirty_.reserve(bone.brick_count());
  parallel_for(patches_.size(), 64, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    for (std::size_t b = begin; b < end; ++b) extract_patch(bone_, static_cast<std::uint32_t>(b), 0.5F, patches_[b]);
  });
}

void LiveSurface::mark(VoxelKey voxel) {
  const Ijk c = bone_.coordinate(voxel);
  // A patch depends on voxels up to 2 away: at most two bricks along each axis.
  constexpr int kReach = 2;
  for (int k = (c.k - kReach) >> 3; k <= (c.k + kReach) >> 3; ++k) {
    for (int j = (c.j - kReach) >> 3; j <= (c.j + kReach) >> 3; ++j) {
      for (int i = (c.i - kReach) >> 3; i <= (c.i + kReach) >> 3; ++i) {
        const std::uint32_t b = bone_.find_brick(i, j, k);
        if (b == BrickGrid::kNone || is_dirty_[b]) continue;
        is_dirty_[b] = true;
        dirty_.push_back(b);
      }
    }
  }
}

std::span<const std::uint32_t> LiveSurface::update() {
  done_.swap(dirty_);
  dirty_.clear();
  std::sort(done_.begin(), done_.end());
  for (const std::uint32_t b : done_) {
    is_dirty_[b] = false;
    extract_patch(bone_, b, 0.5F, patches_[b]);
  }
  return done_;
}

std::string surface_hash(const TriMesh& mesh) {
  Hasher h;
  h.add(mesh.points_mm.data(), mesh.points_mm.size() * sizeof mesh.points_mm[0]);
  h.add(mesh.triangles.data(), mesh.triangles.size() * sizeof mesh.triangles[0]);
  return h.hex();
}

}  // namespace osteo
