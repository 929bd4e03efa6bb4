#include "osteo/session/scene/detail/surface_reader.h"

#include <algorithm>
#include <utility>

#include "body_names.h"
#include "osteo/core/base/files.h"

namespace osteo::inline session {
namespace {

// Marks what of a brick is not as it was. A cut is thinner than a brick: most of what is around it stays.
void mark_difference(LiveSurface& surface, const BrickGrid& before, std::uint32_t brick) {
  const BrickGrid& now = surface.bone();
  const VoxelKey first = brick * BrickGrid::kVoxels;
  int lo[3] = {8, 8, 8}, hi[3] = {-1, -1, -1};
  for (int v = 0; v < BrickGrid::kVoxels; ++v) {
    const VoxelKey key = first + static_cast<VoxelKey>(v);
    if (now.value(key) == before.value(key)) continue;
    const int at[3] = {v & 7, v >> 3 & 7, v >> 6};
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], at[a]);
      hi[a] = std::max(hi[a], at[a]);
    }
  }
  if (hi[0] < 0) return;
  // What the corners of a box within one brick reach is what all of it reaches.
  for (unsigned corner = 0; corner < 8; ++corner) {
    const auto side = [&](std::size_t a) { return (corner >> a & 1) != 0 ? hi[a] : lo[a]; };
    surface.mark(first + BrickGrid::offset_in_brick(side(0), side(1), side(2)));
  }
}

}  // namespace

SurfaceReader::SurfaceReader(const World& world, const Context& context) : threads_(context.threads) {
  for (const PlacedBody& placed : world.bodies()) {
    Followed& f = bodies_[placed.body->id];
    f.body = placed.body;
    f.surface = std::make_unique<LiveSurface>(placed.body->bone, context);
  }
}

void SurfaceReader::resync(const World& world) {
  Context context;  // who made this may have ended
  context.threads = threads_;
  std::erase_if(bodies_, [&](const auto& b) { return world.find(b.first) == nullptr; });
  for (const PlacedBody& placed : world.bodies()) {
    const auto [it, is_new] = bodies_.try_emplace(placed.body->id);
    Followed& f = it->second;
    const BrickGrid& bone = placed.body->bone;
    f.body = placed.body;
    if (is_new) {
      f.surface = std::make_unique<LiveSurface>(bone, context);
      if (shaded_) f.surface->shade(context);
    } else {
      f.surface->rebind(bone);
    }
    for (std::uint32_t b = 0; b < bone.brick_count(); ++b) {
      f.changed_bricks.insert(f.changed_bricks.end(), b);
      if (!is_new) f.surface->mark_brick(b);
    }
  }
}

void SurfaceReader::tick(const TickRecord& /*record*/, std::span<const VoxelChange> changes) {
  for (const VoxelChange& c : changes) {
    if (Followed* const f = owner_of(bodies_, c.voxel)) f->surface->mark(c.voxel - f->body->name_of(0));
  }
}

void SurfaceReader::update(Followed& f) {
  for (const std::uint32_t b : f.surface->update()) f.changed_bricks.insert(b);
}
void SurfaceReader::update() {
  for (auto& [id, f] : bodies_) update(f);
}

void SurfaceReader::shade() {
  if (std::exchange(shaded_, true)) return;
  Context context;
  context.threads = threads_;
  for (auto& [id, f] : bodies_) {
    f.surface->shade(context);
    for (std::uint32_t b = 0; b < f.surface->bone().brick_count(); ++b)
      f.changed_bricks.insert(f.changed_bricks.end(), b);
  }
}

void SurfaceReader::settle() {
  for (auto& [id, f] : bodies_) {
    for (const std::uint32_t b : f.surface->settle()) f.changed_bricks.insert(b);
  }
}

void SurfaceReader::scene_changed(const World& world, const World::Effect& effect) {
  KnownBricks known;
  const auto exchanged = [&](std::uint32_t whole, const PieceOrigin& origin) {
    Followed& f = bodies_.at(whole);
    known.note(whole, f.body->bone, origin);
    for (std::size_t b = 0; b < origin.brick.size(); ++b) {
      if (origin.unchanged[b] != 0) f.changed_bricks.insert(origin.brick[b]);
    }
  };
  for (const auto& made : effect.made) {
    Followed f;
    f.body = world.find(made.body)->body;
    f.from = made.from;
    f.origin = made.origin;
    const BrickGrid& bone = f.body->bone;
    f.surface = std::make_unique<LiveSurface>(bone, *bodies_.at(made.from).surface, made.origin);
    for (std::uint32_t b = 0; b < bone.brick_count(); ++b) f.changed_bricks.insert(f.changed_bricks.end(), b);
    exchanged(made.from, made.origin);
    bodies_.emplace(made.body, std::move(f));
  }
  for (const std::uint32_t id : effect.gone) {
    const Followed& piece = bodies_.at(id);
    if (const auto whole = bodies_.find(piece.from); whole != bodies_.end()) {
      whole->second.surface->take_back(*piece.surface, piece.origin);
      exchanged(piece.from, piece.origin);
    }
    bodies_.erase(id);
  }
  for (const auto& changed : effect.changed) {
    Followed& f = bodies_.at(changed.body);
    const std::shared_ptr<const Body> before = std::exchange(f.body, world.find(changed.body)->body);
    f.surface->rebind(f.body->bone);
    for (const std::uint32_t b : changed.bricks) {
      if (!known.has(changed.body, b)) mark_difference(*f.surface, before->bone, b);
    }
    update(f);
  }
}

const LiveSurface* SurfaceReader::surface(std::uint32_t body) const {
  const auto it = bodies_.find(body);
  return it == bodies_.end() ? nullptr : it->second.surface.get();
}

std::vector<std::uint32_t> SurfaceReader::take_changed_bricks(std::uint32_t body) {
  const auto it = bodies_.find(body);
  if (it == bodies_.end()) return {};
  std::vector<std::uint32_t> bricks(it->second.changed_bricks.begin(), it->second.changed_bricks.end());
  it->second.changed_bricks.clear();
  return bricks;
}

std::string SurfaceReader::hash() const {
  Hasher all;
  std::string last;
  for (const auto& [id, f] : bodies_) {
    last = surface_hash(f.surface->joined().mesh);
    all.add(last.data(), last.size());
  }
  return bodies_.size() == 1 ? last : all.hex();
}

}  // namespace osteo::inline session
