#include "osteo/session/scene/detail/pieces_reader.h"

#include <algorithm>

#include "body_names.h"

namespace osteo::inline session {

PiecesReader::PiecesReader(const World& world) {
  PiecesReader::resync(world);
}

void PiecesReader::resync(const World& world) {
  std::erase_if(bodies_, [&](const auto& b) { return world.find(b.first) == nullptr; });
  for (const PlacedBody& placed : world.bodies()) {
    const auto [it, is_new] = bodies_.try_emplace(placed.body->id);
    Followed& f = it->second;
    const BrickGrid& bone = placed.body->bone;
    f.body = placed.body;
    f.world_from_body = placed.world_from_body;
    f.of_region = placed.of_region;
    if (is_new) {
      f.components = std::make_unique<LiveComponents>(bone);
      continue;
    }
    f.components->rebind(bone);
    for (std::uint32_t b = 0; b < bone.brick_count(); ++b) f.components->mark_brick(b);
  }
}

void PiecesReader::tick(const TickRecord& /*record*/, std::span<const VoxelChange> changes) {
  for (const VoxelChange& c : changes) {
    if (Followed* const f = owner_of(bodies_, c.voxel)) f->components->mark(c.voxel - f->body->name_of(0));
  }
}

void PiecesReader::update() {
  for (auto& [id, f] : bodies_) f.components->update();
}

void PiecesReader::scene_changed(const World& world, const World::Effect& effect) {
  KnownBricks known;
  for (const auto& made : effect.made) {
    const Followed& whole = bodies_.at(made.from);
    Followed f;
    f.body = world.find(made.body)->body;
    f.from = made.from;
    f.origin = made.origin;
    f.components = std::make_unique<LiveComponents>(f.body->bone, *whole.components, made.origin);
    known.note(made.from, whole.body->bone, made.origin);
    bodies_.emplace(made.body, std::move(f));
  }
  for (const std::uint32_t id : effect.gone) {
    const Followed& piece = bodies_.at(id);
    if (const auto whole = bodies_.find(piece.from); whole != bodies_.end()) {
      whole->second.components->take_back(*piece.components, piece.origin);
      known.note(piece.from, whole->second.body->bone, piece.origin);
    }
    bodies_.erase(id);
  }
  for (const auto& changed : effect.changed) {
    Followed& f = bodies_.at(changed.body);
    f.body = world.find(changed.body)->body;
    f.components->rebind(f.body->bone);
    for (const std::uint32_t b : changed.bricks) {
      if (!known.has(changed.body, b)) f.components->mark_brick(b);
    }
    f.components->update();
  }
  for (const PlacedBody& placed : world.bodies()) bodies_.at(placed.body->id).world_from_body = placed.world_from_body;
}

const LiveComponents* PiecesReader::components(std::uint32_t body) const {
  const auto it = bodies_.find(body);
  return it == bodies_.end() ? nullptr : it->second.components.get();
}

std::vector<LiveComponents::Component> PiecesReader::large_pieces() const {
  std::vector<LiveComponents::Component> large;
  for (const auto& [id, f] : bodies_) {
    if (f.of_region) continue;
    const double voxel_mm3 = f.body->bone.frame().voxel_volume_mm3();
    for (LiveComponents::Component c : f.components->components()) {
      if (c.mass * voxel_mm3 < kMinPieceMm3) continue;
      c.centre_mm = f.world_from_body(c.centre_mm);
      large.push_back(c);
    }
  }
  std::stable_sort(large.begin(), large.end(), [](const auto& a, const auto& b) { return a.mass > b.mass; });
  return large;
}

}  // namespace osteo::inline session
