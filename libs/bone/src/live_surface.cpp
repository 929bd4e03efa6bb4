#include "osteo/bone/live_surface.h"

#include <algorithm>
#include <utility>

#include "osteo/base/files.h"
#include "osteo/base/parallel.h"

namespace osteo {

LiveSurface::LiveSurface(const BrickGrid& bone, const Context& context)
    : bone_(&bone), patches_(bone.brick_count()), is_dirty_(bone.brick_count()) {
  dirty_.reserve(bone.brick_count());
  parallel_for(patches_.size(), 64, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    for (std::size_t b = begin; b < end; ++b) extract_patch(*bone_, static_cast<std::uint32_t>(b), 0.5F, patches_[b]);
  });
}

LiveSurface::LiveSurface(const BrickGrid& piece, LiveSurface& whole, const PieceOrigin& origin)
    : bone_(&piece), patches_(piece.brick_count()), is_dirty_(piece.brick_count()) {
  for (std::uint32_t b = 0; b < patches_.size(); ++b) {
    if (origin.unchanged[b] != 0) {
      patches_[b] = std::exchange(whole.patches_[origin.brick[b]], {});
    } else {
      dirty_.push_back(b);
    }
  }
  update();
}

void LiveSurface::take_back(LiveSurface& piece, const PieceOrigin& origin) {
  for (std::uint32_t b = 0; b < origin.brick.size(); ++b) {
    if (origin.unchanged[b] != 0) patches_[origin.brick[b]] = std::exchange(piece.patches_[b], {});
  }
}

void LiveSurface::mark_box(Ijk lo, Ijk hi) {
  for (int k = lo.k; k <= hi.k; ++k) {
    for (int j = lo.j; j <= hi.j; ++j) {
      for (int i = lo.i; i <= hi.i; ++i) {
        const std::uint32_t b = bone_->find_brick(i, j, k);
        if (b == BrickGrid::kNone || is_dirty_[b]) continue;
        is_dirty_[b] = true;
        dirty_.push_back(b);
      }
    }
  }
}

void LiveSurface::mark(VoxelKey voxel) {
  const Ijk c = bone_->coordinate(voxel);
  // A patch depends on voxels up to 2 away: at most two bricks along each axis.
  constexpr int kReach = 2;
  mark_box({(c.i - kReach) >> 3, (c.j - kReach) >> 3, (c.k - kReach) >> 3}, {(c.i + kReach) >> 3, (c.j + kReach) >> 3, (c.k + kReach) >> 3});
}

void LiveSurface::mark_brick(std::uint32_t brick) {
  const Ijk o = bone_->brick_coordinate(brick);
  mark_box({o.i - 1, o.j - 1, o.k - 1}, {o.i + 1, o.j + 1, o.k + 1});
}

std::span<const std::uint32_t> LiveSurface::update() {
  done_.swap(dirty_);
  dirty_.clear();
  std::sort(done_.begin(), done_.end());
  for (const std::uint32_t b : done_) is_dirty_[b] = false;
  // By threads only where it is worth waking them: an edit changes a few bricks, a split thousands.
  parallel_for(done_.size(), done_.size() > 200 ? 32 : done_.size() + 1, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) extract_patch(*bone_, done_[i], 0.5F, patches_[done_[i]]);
  });
  return done_;
}

std::string surface_hash(const TriMesh& mesh) {
  Hasher h;
  h.add(mesh.points_mm.data(), mesh.points_mm.size() * sizeof mesh.points_mm[0]);
  h.add(mesh.triangles.data(), mesh.triangles.size() * sizeof mesh.triangles[0]);
  return h.hex();
}

}  // namespace osteo
