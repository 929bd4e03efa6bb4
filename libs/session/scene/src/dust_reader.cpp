#include "osteo/session/scene/detail/dust_reader.h"

#include <algorithm>
#include <cmath>

#include "osteo/geometry/grid/brick_places.h"
#include "osteo/simulation/bone/instrument.h"

namespace osteo::inline session {
namespace {

// The voxel that a point of the grid's own world lies in.
VoxelKey voxel_at(const BrickGrid& grid, Vec3 at_mm) {
  const Vec3 x = grid.frame().index_from_world(at_mm);
  return grid.find(static_cast<int>(std::lround(x.x)), static_cast<int>(std::lround(x.y)),
                   static_cast<int>(std::lround(x.z)));
}

}  // namespace

DustReader::DustReader(const World& world, double rate_hz) : rate_hz_(rate_hz) {
  begin(world);
}

void DustReader::begin(const World& world) {
  bones_.clear();
  for (const PlacedBody& placed : world.bodies())
    bones_.emplace(placed.body->id, Bone{BrickGrid(placed.body->bone), placed.body->first_brick, placed.world_from_body,
                                         placed.of_region});
  // Dust lies in the first body's grid: a finer region counts there as the bone it holds.
  for (const auto& [id, d] : bones_) {
    for (VoxelKey v = 0; d.of_region && v < d.bone.brick_count() * BrickGrid::kVoxels; ++v) {
      if (d.bone.value(v) > 0) remove_from_coarse(d, v, -d.bone.value(v));
    }
  }
  dust_ = std::make_unique<Dust>(bones_.begin()->second.bone);
  if (posture_.is(ActionKind::posture))
    dust_->set_gravity({posture_.values[0], posture_.values[1], posture_.values[2]});
}

DustReader::Bone* DustReader::owner(VoxelKey name) {
  const std::uint32_t brick = name / BrickGrid::kVoxels;
  for (auto& [id, d] : bones_) {
    if (brick >= d.first_brick && brick - d.first_brick < d.bone.brick_count()) return &d;
  }
  return nullptr;
}

Vec3 DustReader::place_of(const Bone& body, VoxelKey own) {
  return body.world_from_body(place_of_voxel_mm(body.bone, own));
}

// A region's voxel counts in the coarse grid too, whose density falls by as much.
void DustReader::remove_from_coarse(const Bone& from, VoxelKey own, float density) {
  BrickGrid& coarse = bones_.begin()->second.bone;
  const VoxelKey there = voxel_at(coarse, place_of_voxel_mm(from.bone, own));
  const double share = from.bone.frame().voxel_volume_mm3() / coarse.frame().voxel_volume_mm3();
  if (there != BrickGrid::kNone)
    coarse.set(there,
               std::clamp(coarse.value(there) - static_cast<float>(static_cast<double>(density) * share), 0.0F, 1.0F));
}

// An action's tick has come: the dust learns of it.
void DustReader::action(const SceneAction& action) {
  if (action.is(ActionKind::suction)) sucker_ = action;
  if (action.is(ActionKind::irrigate)) water_ = action;
  if (action.is(ActionKind::posture)) {
    posture_ = action;
    dust_->set_gravity({action.values[0], action.values[1], action.values[2]});
  }
  if (!row_of(action).changes_world) return;
  if (applied_early_ > 0) {
    --applied_early_;
  } else if (!pending_.empty()) {
    apply_next();
  }
}

void DustReader::apply_next() {
  Pending a = std::move(pending_.front());
  pending_.pop_front();
  for (auto& [id, made] : a.made) bones_.emplace(id, std::move(made));
  for (const auto& c : a.changed) {
    Bone& d = bones_.at(c.body);
    std::size_t n = 0;
    for (const std::uint32_t b : c.bricks) {
      for (VoxelKey v = b * BrickGrid::kVoxels; v < (b + 1) * BrickGrid::kVoxels; ++v, ++n) {
        if (d.of_region) remove_from_coarse(d, v, d.bone.value(v) - c.values[n]);
        d.bone.set(v, c.values[n]);
      }
      if (c.body == bones_.begin()->first) dust_->bone_changed(b);
    }
  }
  for (const auto& [name, density] : a.dust) {
    const Bone& d = *owner(name);
    const VoxelKey own = name - d.first_brick * BrickGrid::kVoxels;
    dust_->add_at(place_of(d, own), static_cast<double>(density) * d.bone.frame().voxel_volume_mm3());
  }
  for (const std::uint32_t id : a.gone) bones_.erase(id);
  for (const auto& [id, pose] : a.poses) bones_.at(id).world_from_body = pose;
}

void DustReader::make_dust(std::span<const VoxelChange> changes) {
  const Bone& first = bones_.begin()->second;
  for (const VoxelChange& c : changes) {
    Bone* const d = owner(c.voxel);
    if (d == nullptr) continue;
    const VoxelKey own = c.voxel - d->first_brick * BrickGrid::kVoxels;
    const float gone = d->bone.value(own) - c.density;  // not of c.before: that counts twice what resync() saw already
    const double mm3 = static_cast<double>(gone) * d->bone.frame().voxel_volume_mm3();
    d->bone.set(own, c.density);
    if (d == &first) {
      dust_->add(own, mm3);
    } else {
      if (d->of_region) remove_from_coarse(*d, own, gone);
      dust_->add_at(place_of(*d, own), mm3);
    }
  }
}

void DustReader::tick(const TickRecord& tick, std::span<const VoxelChange> changes) {
  make_dust(changes);
  // A hundred steps a second: 50 mm/s at half-millimetre voxels.
  const auto every = static_cast<std::uint64_t>(std::max(1.0, std::round(rate_hz_ / 100)));
  if (tick.tick % every != 0) return;
  const double seconds = static_cast<double>(every) / rate_hz_;
  if ((tick.flags & (kPlateInHand | kPoseInvalid)) == 0) {
    const Instrument& held = instrument_of(tick.device.tool);
    const Vec3 tip = from_floats(tick.device.position_mm) + from_floats(tick.shown_offset_mm);
    const double amount = held.rate * seconds * tick.device.pedal / 255;
    const Vec3 axis = normalized(from_floats(tick.device.axis));
    dust_->push(held.head, tip, axis);
    if (held.kind == InstrumentKind::sucker && amount > 0) dust_->suck(tip, held.reach_mm, amount);
    if (held.kind == InstrumentKind::irrigator && amount > 0) dust_->irrigate(tip, axis * -1, held.reach_mm, amount);
  }
  if (tick.hand > 0) return;  // once for all hands
  const auto place = [](const SceneAction& a) { return Vec3{a.values[0], a.values[1], a.values[2]}; };
  if (sucker_.values[4] > 0) dust_->suck(place(sucker_), sucker_.values[3], sucker_.values[4] * seconds);
  if (water_.values[4] > 0) dust_->irrigate(place(water_), {}, water_.values[3], water_.values[4] * seconds);
  dust_->step();
}

void DustReader::resync(const World& world) {
  for (; !pending_.empty(); ++applied_early_) apply_next();
  // It was not told of pieces that came or went: it joined behind them, and where their bone is now is not dust.
  const bool reported =
      bones_.size() == world.bodies().size() &&
      std::all_of(bones_.begin(), bones_.end(), [&](const auto& b) { return world.find(b.first) != nullptr; });
  if (!reported) return begin(world);
  std::vector<VoxelChange> changes;
  for (const auto& [id, d] : bones_) {
    const BrickGrid& bone = world.find(id)->body->bone;
    for (VoxelKey v = 0; v < bone.brick_count() * BrickGrid::kVoxels; ++v) {
      if (bone.value(v) == d.bone.value(v)) continue;
      // What the coarse grid holds of a finer region is counted there.
      const Vec3 at = place_of_voxel_mm(bone, v);
      const bool of_region = !d.of_region && std::any_of(bones_.begin(), bones_.end(), [&](const auto& other) {
        return other.second.of_region && voxel_at(other.second.bone, at) != BrickGrid::kNone;
      });
      if (!of_region) changes.push_back({v + d.first_brick * BrickGrid::kVoxels, bone.value(v)});
    }
  }
  make_dust(changes);
}

void DustReader::scene_changed(const World& world, const World::Effect& effect) {
  Pending a;
  for (const PlacedBody& placed : world.bodies()) a.poses.emplace_back(placed.body->id, placed.world_from_body);
  for (const auto& made : effect.made) {
    const PlacedBody& placed = *world.find(made.body);
    a.made.emplace_back(made.body,
                        Bone{BrickGrid(placed.body->bone), placed.body->first_brick, placed.world_from_body, false});
  }
  a.gone = effect.gone;
  a.dust = effect.dust;
  a.changed = changed_bricks(world, effect);
  pending_.push_back(std::move(a));
}

}  // namespace osteo::inline session
