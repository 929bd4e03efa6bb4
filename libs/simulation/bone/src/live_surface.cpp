#include "osteo/simulation/bone/live_surface.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "osteo/core/base/files.h"
#include "osteo/core/base/parallel.h"

namespace osteo::inline simulation {

LiveSurface::LiveSurface(const BrickGrid& bone, const Context& context)
    : bone_(&bone),
      patches_(bone.brick_count()),
      is_dirty_(bone.brick_count()),
      is_changed_(bone.brick_count()),
      is_stale_(bone.brick_count()) {
  dirty_.reserve(bone.brick_count());
  parallel_for(patches_.size(), 64, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    for (std::size_t b = begin; b < end; ++b) make(static_cast<std::uint32_t>(b));
  });
}

LiveSurface::LiveSurface(const BrickGrid& piece, LiveSurface& whole, const PieceOrigin& origin)
    : bone_(&piece),
      patches_(piece.brick_count()),
      is_dirty_(piece.brick_count()),
      is_changed_(piece.brick_count()),
      is_stale_(piece.brick_count()) {
  if (whole.shading_) shading_ = std::make_unique<ShadingField>(piece);
  for (std::uint32_t b = 0; b < patches_.size(); ++b) {
    if (origin.unchanged[b] != 0) {
      patches_[b] = std::exchange(whole.patches_[origin.brick[b]], {});
      whole.note_change(origin.brick[b]);
    } else {
      dirty_.push_back(b);
      note_change(b);
    }
  }
  update();
}

void LiveSurface::shade(const Context& context) {
  if (shading_) return;
  shading_ = std::make_unique<ShadingField>(*bone_, context.threads);
  parallel_for(patches_.size(), 64, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) shading_->shade(static_cast<std::uint32_t>(b), patches_[b]);
  });
}

void LiveSurface::take_back(LiveSurface& piece, const PieceOrigin& origin) {
  for (std::uint32_t b = 0; b < origin.brick.size(); ++b) {
    if (origin.unchanged[b] == 0) continue;
    patches_[origin.brick[b]] = std::exchange(piece.patches_[b], {});
    note_change(origin.brick[b]);
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

void LiveSurface::make(std::uint32_t brick) {
  extract_patch(*bone_, brick, 0.5F, patches_[brick]);
  if (shading_) shading_->shade(brick, patches_[brick]);
}

void LiveSurface::note_change(std::uint32_t brick) {
  if (!shading_ || is_changed_[brick]) return;
  is_changed_[brick] = true;
  changed_.push_back(brick);
}

void LiveSurface::renew_shading() {
  for (const std::uint32_t b : changed_) {
    is_changed_[b] = false;
    shading_->renew(b);
    const Ijk o = bone_->brick_coordinate(b);
    const int reach = shading_->reach_bricks();
    for (int k = o.k - reach; k <= o.k + reach; ++k) {
      for (int j = o.j - reach; j <= o.j + reach; ++j) {
        for (int i = o.i - reach; i <= o.i + reach; ++i) {
          const std::uint32_t near = bone_->find_brick(i, j, k);
          if (near == BrickGrid::kNone || is_stale_[near]) continue;
          is_stale_[near] = true;
          stale_.push_back(near);
        }
      }
    }
  }
  changed_.clear();
}

void LiveSurface::mark(VoxelKey voxel) {
  note_change(voxel / BrickGrid::kVoxels);
  const Ijk c = bone_->coordinate(voxel);
  // A patch depends on voxels up to 2 away: at most two bricks along each axis.
  constexpr int kReach = 2;
  mark_box({(c.i - kReach) >> 3, (c.j - kReach) >> 3, (c.k - kReach) >> 3},
           {(c.i + kReach) >> 3, (c.j + kReach) >> 3, (c.k + kReach) >> 3});
}

void LiveSurface::mark_brick(std::uint32_t brick) {
  note_change(brick);
  const Ijk o = bone_->brick_coordinate(brick);
  mark_box({o.i - 1, o.j - 1, o.k - 1}, {o.i + 1, o.j + 1, o.k + 1});
}

std::span<const std::uint32_t> LiveSurface::update() {
  done_.swap(dirty_);
  dirty_.clear();
  std::sort(done_.begin(), done_.end());
  for (const std::uint32_t b : done_) is_dirty_[b] = false;
  if (shading_) renew_shading();
  // By threads only where it is worth waking them: an edit changes a few bricks, a split thousands.
  parallel_for(done_.size(), done_.size() > 200 ? 32 : done_.size() + 1, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) make(done_[i]);
  });
  return done_;
}

std::span<const std::uint32_t> LiveSurface::settle() {
  done_.clear();
  // Those that hold no surface have no normals either.
  for (const std::uint32_t b : stale_) {
    is_stale_[b] = false;
    if (!patches_[b].vertices.empty()) done_.push_back(b);
  }
  stale_.clear();
  std::sort(done_.begin(), done_.end());
  parallel_for(done_.size(), done_.size() > 200 ? 32 : done_.size() + 1, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) make(done_[i]);
  });
  return done_;
}

void shade_mesh(TriMesh& mesh, const BrickGrid& bone, const Context& context) {
  if (mesh.normals.size() != mesh.points_mm.size()) return;
  const ShadingField field(bone, context.threads);
  const Frame& frame = bone.frame();
  const Mat3 to_index = transposed(frame.direction);
  // The brick that a place is in, or the next one where there is none: bone ends at its border.
  const auto brick_at = [&](const Vec3& x) {
    for (const double aside : {0.0, -1.0, 1.0}) {
      for (int n = 0; n < 8; ++n) {
        const auto cell = [&](double at, int bit) {
          constexpr double kFar = 1e9;  // beyond any grid
          return static_cast<int>(std::clamp(std::floor(at + ((n >> bit & 1) != 0 ? aside : 0.0)), -kFar, kFar)) >> 3;
        };
        const std::uint32_t b = bone.find_brick(cell(x.x, 0), cell(x.y, 1), cell(x.z, 2));
        if (b != BrickGrid::kNone) return b;
      }
    }
    return BrickGrid::kNone;
  };
  std::vector<std::uint32_t> brick(mesh.points_mm.size());
  std::vector<std::array<float, 3>> place(brick.size());
  for (std::size_t p = 0; p < brick.size(); ++p) {
    const Vec3 x = frame.index_from_world(from_floats(mesh.points_mm[p]));
    place[p] = to_floats(x);
    brick[p] = brick_at(x);
  }
  std::vector<std::uint32_t> order(brick.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return brick[a] < brick[b]; });
  std::vector<std::size_t> first;  // of each brick's points, in that order
  for (std::size_t n = 0; n < order.size(); ++n) {
    if (brick[order[n]] == BrickGrid::kNone) break;  // last: the largest number there is
    if (n == 0 || brick[order[n]] != brick[order[n - 1]]) first.push_back(n);
    if (n + 1 == order.size() || brick[order[n + 1]] == BrickGrid::kNone) first.push_back(n + 1);
  }
  if (first.size() < 2) return;
  parallel_for(first.size() - 1, 64, context.threads, [&](std::size_t begin, std::size_t end) {
    SurfacePatch patch;
    for (std::size_t b = begin; b < end; ++b) {
      patch.vertices.clear();
      for (std::size_t n = first[b]; n < first[b + 1]; ++n)
        patch.vertices.push_back({place[order[n]], to_floats(to_index * from_floats(mesh.normals[order[n]])), 0});
      field.shade(brick[order[first[b]]], patch);
      for (std::size_t n = first[b]; n < first[b + 1]; ++n)
        mesh.normals[order[n]] = to_floats(frame.direction * from_floats(patch.vertices[n - first[b]].normal));
    }
  });
}

std::string surface_hash(const TriMesh& mesh) {
  Hasher h;
  h.add(mesh.points_mm.data(), mesh.points_mm.size() * sizeof mesh.points_mm[0]);
  h.add(mesh.triangles.data(), mesh.triangles.size() * sizeof mesh.triangles[0]);
  return h.hex();
}

}  // namespace osteo::inline simulation
