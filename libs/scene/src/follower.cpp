#include "osteo/scene/follower.h"

#include <algorithm>
#include <cmath>

#include "osteo/base/files.h"
#include "osteo/bone/instrument.h"

namespace osteo {

Follower::Follower(const World& world, const FollowerParts& parts, double rate_hz, const Context& context)
    : parts_(parts), rate_hz_(rate_hz), ticks_(1024), changes_(1 << 20) {
  for (const PlacedBody& placed : world.bodies()) {
    auto f = std::make_unique<Followed>();
    f->body = placed.body;
    f->world_from_body = placed.world_from_body;
    f->of_region = placed.of_region;
    const BrickGrid& bone = placed.body->bone;
    if (parts.surface) f->surface = std::make_unique<LiveSurface>(bone, context);
    if (parts.pieces) f->components = std::make_unique<LiveComponents>(bone);
    bodies_.emplace(placed.body->id, std::move(f));
  }
  if (!parts.dust) return;
  for (const PlacedBody& placed : world.bodies())
    dusty_.emplace(placed.body->id,
                   Dusty{BrickGrid(placed.body->bone), placed.body->first_brick, placed.world_from_body, placed.of_region});
  // Dust lies in the first body's grid: a finer region counts there as the bone it holds.
  for (const auto& [id, d] : dusty_) {
    for (VoxelKey v = 0; d.of_region && v < d.bone.brick_count() * BrickGrid::kVoxels; ++v) {
      if (d.bone.value(v) > 0) lose(d, v, -d.bone.value(v));
    }
  }
  dust_ = std::make_unique<Dust>(dusty_.begin()->second.bone);
}

Follower::~Follower() = default;

Follower::Followed* Follower::owner(VoxelKey name) {
  const std::uint32_t brick = name / BrickGrid::kVoxels;
  for (const auto& [id, f] : bodies_) {
    if (brick >= f->body->first_brick && brick - f->body->first_brick < f->body->bone.brick_count()) return f.get();
  }
  return nullptr;
}

Follower::Dusty* Follower::dusty_owner(VoxelKey name) {
  const std::uint32_t brick = name / BrickGrid::kVoxels;
  for (auto& [id, d] : dusty_) {
    if (brick >= d.first_brick && brick - d.first_brick < d.bone.brick_count()) return &d;
  }
  return nullptr;
}

Vec3 Follower::place_of(const Dusty& body, VoxelKey own) {
  const Ijk c = body.bone.coordinate(own);
  return body.world_from_body(body.bone.frame().world_from_index({double(c.i), double(c.j), double(c.k)}));
}

// A region's voxel counts in the coarse grid too, whose density falls by as much.
void Follower::lose(const Dusty& from, VoxelKey own, float density) {
  BrickGrid& coarse = dusty_.begin()->second.bone;
  const Ijk c = from.bone.coordinate(own);
  const Vec3 x = coarse.frame().index_from_world(from.bone.frame().world_from_index({double(c.i), double(c.j), double(c.k)}));
  const VoxelKey there =
      coarse.find(static_cast<int>(std::lround(x.x)), static_cast<int>(std::lround(x.y)), static_cast<int>(std::lround(x.z)));
  const double share = from.bone.frame().voxel_volume_mm3() / coarse.frame().voxel_volume_mm3();
  if (there != BrickGrid::kNone)
    coarse.set(there, std::clamp(coarse.value(there) - static_cast<float>(static_cast<double>(density) * share), 0.0F, 1.0F));
}

// An action's tick has come: the dust learns of it.
void Follower::happen(const SceneAction& action) {
  if (action.is(ActionKind::suction)) sucker_ = action;
  if (action.is(ActionKind::irrigate)) water_ = action;
  if (!row_of(action).changes_world) return;
  if (happened_before_ > 0) {
    --happened_before_;
  } else if (!awaited_.empty()) {
    happen_next();
  }
}

void Follower::happen_next() {
  Awaited a = std::move(awaited_.front());
  awaited_.pop_front();
  for (auto& [id, made] : a.made) dusty_.emplace(id, std::move(made));
  for (const auto& c : a.changed) {
    Dusty& d = dusty_.at(c.body);
    std::size_t n = 0;
    for (const std::uint32_t b : c.bricks) {
      for (VoxelKey v = b * BrickGrid::kVoxels; v < (b + 1) * BrickGrid::kVoxels; ++v, ++n) {
        if (d.of_region) lose(d, v, d.bone.value(v) - c.values[n]);
        d.bone.set(v, c.values[n]);
      }
      if (c.body == dusty_.begin()->first) dust_->bone_changed(b);
    }
  }
  for (const auto& [name, density] : a.dust) {
    const Dusty& d = *dusty_owner(name);
    const VoxelKey own = name - d.first_brick * BrickGrid::kVoxels;
    dust_->add_at(place_of(d, own), static_cast<double>(density) * d.bone.frame().voxel_volume_mm3());
  }
  for (const std::uint32_t id : a.gone) dusty_.erase(id);
  for (const auto& [id, pose] : a.poses) dusty_.at(id).world_from_body = pose;
}

void Follower::make_dust(std::span<const VoxelChange> changes) {
  const Dusty& first = dusty_.begin()->second;
  for (const VoxelChange& c : changes) {
    Dusty* const d = dusty_owner(c.voxel);
    if (d == nullptr) continue;
    const VoxelKey own = c.voxel - d->first_brick * BrickGrid::kVoxels;
    const float gone = d->bone.value(own) - c.density;
    const double mm3 = static_cast<double>(gone) * d->bone.frame().voxel_volume_mm3();
    d->bone.set(own, c.density);
    if (d == &first) {
      dust_->add(own, mm3);
    } else {
      if (d->of_region) lose(*d, own, gone);
      dust_->add_at(place_of(*d, own), mm3);
    }
  }
}

void Follower::dust_tick(const TickRecord& tick, std::span<const VoxelChange> changes) {
  for (; !actions_.empty() && actions_.front().tick <= tick.tick; actions_.pop_front()) happen(actions_.front());
  make_dust(changes);
  // A hundred steps a second: 50 mm/s at half-millimetre voxels.
  const auto every = static_cast<std::uint64_t>(std::max(1.0, std::round(rate_hz_ / 100)));
  if (tick.tick % every != 0) return;
  const double seconds = static_cast<double>(every) / rate_hz_;
  if ((tick.flags & (kPlateInHand | kPoseInvalid)) == 0) {
    const Instrument& held = instrument_of(tick.device.tool);
    const Vec3 tip = from_floats(tick.device.position_mm) + from_floats(tick.shown_offset_mm);
    const double amount = held.rate * seconds * tick.device.pedal / 255;
    dust_->push(held.head, tip, normalized(from_floats(tick.device.axis)));
    if (held.kind == InstrumentKind::sucker && amount > 0) dust_->suck(tip, held.reach_mm, amount);
    if (held.kind == InstrumentKind::irrigator && amount > 0) dust_->irrigate(tip, held.reach_mm, std::min(1.0, amount));
  }
  if (tick.hand > 0) return;  // once for all hands
  const auto place = [](const SceneAction& a) { return Vec3{a.values[0], a.values[1], a.values[2]}; };
  if (sucker_.values[4] > 0) dust_->suck(place(sucker_), sucker_.values[3], sucker_.values[4] * seconds);
  if (water_.values[4] > 0) dust_->irrigate(place(water_), water_.values[3], std::min(1.0, water_.values[4] * seconds));
  dust_->step();
}

// Ticks are missing: what follows from the bone alone is made again, and what is gone since has become dust.
void Follower::catch_up() {
  for (const auto& [id, f] : bodies_) {
    for (std::uint32_t b = 0; b < f->body->bone.brick_count(); ++b) {
      if (f->surface) f->surface->mark_brick(b);
      if (f->components) f->components->mark_brick(b);
    }
  }
  if (!dust_) return;
  for (; !awaited_.empty(); ++happened_before_) happen_next();
  std::vector<VoxelChange> changes;
  for (const auto& [id, d] : dusty_) {
    const auto live = bodies_.find(id);
    if (live == bodies_.end()) continue;
    const BrickGrid& bone = live->second->body->bone;
    for (VoxelKey v = 0; v < bone.brick_count() * BrickGrid::kVoxels; ++v) {
      if (bone.value(v) == d.bone.value(v)) continue;
      // What the coarse grid holds of a finer region is counted there.
      const Vec3 at =
          bone.frame().world_from_index({double(bone.coordinate(v).i), double(bone.coordinate(v).j), double(bone.coordinate(v).k)});
      const bool of_region = !d.of_region && std::any_of(dusty_.begin(), dusty_.end(), [&](const auto& other) {
        const Vec3 x = other.second.bone.frame().index_from_world(at);
        return other.second.of_region && other.second.bone.find(static_cast<int>(std::lround(x.x)), static_cast<int>(std::lround(x.y)),
                                                                static_cast<int>(std::lround(x.z))) != BrickGrid::kNone;
      });
      if (!of_region) changes.push_back({v + d.first_brick * BrickGrid::kVoxels, bone.value(v)});
    }
  }
  make_dust(changes);
}

void Follower::end(StreamReader& reader, std::uint64_t ticks) {
  for (SceneAction a; reader.actions.pop({&a, 1}) == 1;) actions_.push_back(a);
  for (; !actions_.empty(); actions_.pop_front()) {
    if (dust_) happen(actions_.front());
  }
  if (ticks <= next_tick_) return;
  ticks_lost_ += ticks - next_tick_;
  next_tick_ = ticks;
  catch_up();
  update();
}

void Follower::update() {
  for (const auto& [id, f] : bodies_) {
    if (f->surface) {
      for (const std::uint32_t b : f->surface->update()) f->changed_bricks.insert(b);
    }
    if (f->components) f->components->update();
  }
}

std::size_t Follower::drain(StreamReader& reader) {
  std::size_t total = 0;
  const std::uint64_t lost_before = ticks_lost_;
  while (const std::size_t n = reader.ticks.pop(ticks_)) {
    std::size_t wanted = 0;
    for (std::size_t t = 0; t < n; ++t) {
      const TickRecord& r = ticks_[t];
      wanted += r.voxels_changed;
      if (r.hand == 0) ticks_lost_ += r.tick - next_tick_;
      next_tick_ = r.tick + 1;
      latest_[r.hand] = r;
      if (r.voxels_changed > 0) burrs_used_.insert(r.device.tool);
      ticks_without_room_ += (r.flags & kNoRoom) != 0 ? 1 : 0;
      unusable_poses_ += (r.flags & kPoseInvalid) != 0 ? 1 : 0;  // of any hand
    }
    if (wanted > changes_.size()) changes_.resize(wanted);
    const std::size_t got = reader.changes.pop({changes_.data(), wanted});
    for (SceneAction a; reader.actions.pop({&a, 1}) == 1;) {
      if (dust_) actions_.push_back(a);
    }
    std::size_t used = 0;
    for (std::size_t t = 0; t < n && dust_; ++t) {
      const std::size_t changed = std::min<std::size_t>(ticks_[t].voxels_changed, got - used);
      dust_tick(ticks_[t], {changes_.data() + used, changed});
      used += changed;
    }
    for (std::size_t c = 0; c < got && (parts_.surface || parts_.pieces); ++c) {
      Followed* const f = owner(changes_[c].voxel);
      if (f == nullptr) continue;
      const VoxelKey own = changes_[c].voxel - f->body->name_of(0);
      if (f->surface) f->surface->mark(own);
      if (f->components) f->components->mark(own);
    }
    total += n;
  }
  if (total == 0) return 0;
  if (ticks_lost_ > lost_before) catch_up();
  update();
  return total;
}

void Follower::follow(const World& world, const World::Effect& effect) {
  // Bricks that went from one body to another as they are: what is known of them goes with them.
  std::map<std::uint32_t, std::vector<std::uint8_t>> known;
  const auto note = [&](std::uint32_t body, const PieceOrigin& origin) {
    Followed& whole = *bodies_.at(body);
    auto& bricks = known[body];
    bricks.resize(whole.body->bone.brick_count());
    for (std::size_t b = 0; b < origin.brick.size(); ++b) {
      if (origin.unchanged[b] == 0) continue;
      bricks[origin.brick[b]] = 1;
      if (whole.surface) whole.changed_bricks.insert(origin.brick[b]);
    }
  };
  for (const auto& made : effect.made) {
    const PlacedBody& placed = *world.find(made.body);
    Followed& whole = *bodies_.at(made.from);
    auto f = std::make_unique<Followed>();
    f->body = placed.body;
    f->from = made.from;
    f->origin = made.origin;
    const BrickGrid& bone = placed.body->bone;
    if (parts_.surface) f->surface = std::make_unique<LiveSurface>(bone, *whole.surface, made.origin);
    if (parts_.pieces) f->components = std::make_unique<LiveComponents>(bone, *whole.components, made.origin);
    for (std::uint32_t b = 0; b < bone.brick_count() && parts_.surface; ++b) f->changed_bricks.insert(f->changed_bricks.end(), b);
    note(made.from, made.origin);
    bodies_.emplace(made.body, std::move(f));
  }
  for (const std::uint32_t id : effect.gone) {
    Followed& piece = *bodies_.at(id);
    Followed& whole = *bodies_.at(piece.from);
    if (whole.surface) whole.surface->take_back(*piece.surface, piece.origin);
    if (whole.components) whole.components->take_back(*piece.components, piece.origin);
    note(piece.from, piece.origin);
    bodies_.erase(id);
  }
  for (const auto& changed : effect.changed) {
    Followed& f = *bodies_.at(changed.body);
    f.body = world.find(changed.body)->body;
    const BrickGrid& bone = f.body->bone;
    const auto& skip = known[changed.body];
    const auto unknown = [&](std::uint32_t b) { return skip.empty() || skip[b] == 0; };
    if (f.surface) {
      f.surface->rebind(bone);
      for (const std::uint32_t b : changed.bricks) {
        if (unknown(b)) f.surface->mark_brick(b);
      }
      for (const std::uint32_t b : f.surface->update()) f.changed_bricks.insert(b);
    }
    if (f.components) {
      f.components->rebind(bone);
      for (const std::uint32_t b : changed.bricks) {
        if (unknown(b)) f.components->mark_brick(b);
      }
      f.components->update();
    }
  }
  for (const PlacedBody& placed : world.bodies()) bodies_.at(placed.body->id)->world_from_body = placed.world_from_body;
  for (const auto& [name, density] : effect.dust) {
    sawn_mm3_ += static_cast<double>(density) * owner(name)->body->bone.frame().voxel_volume_mm3();
  }
  if (parts_.dust) await(world, effect);
}

void Follower::await(const World& world, const World::Effect& effect) {
  Awaited a;
  for (const PlacedBody& placed : world.bodies()) a.poses.emplace_back(placed.body->id, placed.world_from_body);
  for (const auto& made : effect.made) {
    const PlacedBody& placed = *world.find(made.body);
    a.made.emplace_back(made.body, Dusty{BrickGrid(placed.body->bone), placed.body->first_brick, placed.world_from_body, false});
  }
  a.gone = effect.gone;
  a.dust = effect.dust;
  for (const auto& changed : effect.changed) {
    const BrickGrid& bone = world.find(changed.body)->body->bone;
    Awaited::Bricks bricks{changed.body, changed.bricks, {}};
    bricks.values.reserve(changed.bricks.size() * BrickGrid::kVoxels);
    for (const std::uint32_t b : changed.bricks) {
      for (VoxelKey v = b * BrickGrid::kVoxels; v < (b + 1) * BrickGrid::kVoxels; ++v) bricks.values.push_back(bone.value(v));
    }
    a.changed.push_back(std::move(bricks));
  }
  awaited_.push_back(std::move(a));
}

const LiveComponents* Follower::components(std::uint32_t body) const {
  const auto it = bodies_.find(body);
  return it == bodies_.end() ? nullptr : it->second->components.get();
}
const LiveSurface* Follower::surface(std::uint32_t body) const {
  const auto it = bodies_.find(body);
  return it == bodies_.end() ? nullptr : it->second->surface.get();
}

std::vector<std::uint32_t> Follower::take_changed_bricks(std::uint32_t body) {
  const auto it = bodies_.find(body);
  if (it == bodies_.end()) return {};
  std::vector<std::uint32_t> bricks(it->second->changed_bricks.begin(), it->second->changed_bricks.end());
  it->second->changed_bricks.clear();
  return bricks;
}

std::string Follower::surface_hash() const {
  if (!parts_.surface) return {};
  Hasher all;
  std::string last;
  for (const auto& [id, f] : bodies_) {
    last = osteo::surface_hash(f->surface->joined().mesh);
    all.add(last.data(), last.size());
  }
  return bodies_.size() == 1 ? last : all.hex();
}

std::vector<LiveComponents::Component> Follower::large_pieces() const {
  std::vector<LiveComponents::Component> large;
  for (const auto& [id, f] : bodies_) {
    if (!f->components || f->of_region) continue;
    const double voxel_mm3 = f->body->bone.frame().voxel_volume_mm3();
    for (LiveComponents::Component c : f->components->components()) {
      if (c.mass * voxel_mm3 < kLeastPieceMm3) continue;
      c.centre_mm = f->world_from_body(c.centre_mm);
      large.push_back(c);
    }
  }
  std::stable_sort(large.begin(), large.end(), [](const auto& a, const auto& b) { return a.mass > b.mass; });
  return large;
}

}  // namespace osteo
