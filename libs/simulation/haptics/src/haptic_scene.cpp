#include "osteo/simulation/haptics/haptic_scene.h"

#include <algorithm>
#include <cmath>

#include "osteo/simulation/haptics/renderer.h"

namespace osteo::inline simulation {

TouchedBone::TouchedBone(std::shared_ptr<Body> body) : TouchedBone(body->bone, body->hardness) {
  body_ = std::move(body);
}

TouchedBone::TouchedBone(BrickGrid& bone, std::shared_ptr<const Hardness> hardness)
    : bone_(bone), hardness_(std::move(hardness)), removal_(bone), voxels_(most_hits(bone.frame().spacing_mm.x)) {
  Vec3 lo{1e9, 1e9, 1e9}, hi{-1e9, -1e9, -1e9};
  for (std::uint32_t b = 0; b < bone.brick_count(); ++b) {
    const Ijk o = bone.brick_coordinate(b);
    const Vec3 first{o.i * 8.0, o.j * 8.0, o.k * 8.0};
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], first[a] - 0.5);
      hi[a] = std::max(hi[a], first[a] + 7.5);
    }
  }
  middle_index_ = (lo + hi) * 0.5;
  half_index_ = (hi - lo) * 0.5;
}

std::span<const VoxelKey> TouchedBone::voxels_of(std::span<const VoxelChange> changes) noexcept {
  const std::size_t n = std::min(changes.size(), voxels_.size());
  for (std::size_t c = 0; c < n; ++c) voxels_[c] = changes[c].voxel;
  return {voxels_.data(), n};
}

void TouchedBone::inherit(const TouchedBone& before) {
  removal_.grains().inherit(bone_, before.bone_, before.removal_.grains());
}

bool TouchedBone::near(Vec3 own_mm, double radius_mm) const noexcept {
  const Vec3 x = bone_.frame().index_from_world(own_mm) - middle_index_;
  const double r = radius_mm / bone_.frame().spacing_mm.x;
  // So that what is not finite counts as near: the models know what to do with it.
  return !(std::abs(x.x) > half_index_.x + r || std::abs(x.y) > half_index_.y + r || std::abs(x.z) > half_index_.z + r);
}

PlateInHand::PlateInHand(const PlateModel& plate, int count) {
  // A tenth of a millimetre, so that what lies on bone touches it.
  constexpr double kExtrudeMm = 0.1;
  samples = sample_plate(plate, plate.moving.triangles.empty() ? count : count / 2, kExtrudeMm);
  if (!plate.moving.triangles.empty()) {
    const auto more = sample_plate(plate, count - count / 2, kExtrudeMm, true);
    samples.insert(samples.end(), more.begin(), more.end());
  }
  for (const PlateSample& s : samples) {
    if (s.outwards.z < -0.9) side_mm2 += s.area_mm2;
    radius_mm = std::max(radius_mm, length(s.at_mm));
  }
}

namespace {

// By method, the instruments that use it.
std::array<std::vector<std::size_t>, EnumNames<ContactMethod>::values.size()> tools_by_method(
    const HapticSetup& setup) {
  std::array<std::vector<std::size_t>, EnumNames<ContactMethod>::values.size()> tools;
  for (std::size_t tool = 0; tool < instrument_library().size(); ++tool)
    tools[static_cast<std::size_t>(method_of(setup, tool))].push_back(tool);
  return tools;
}

// Whatever of an item follows from the setup; `before`: the same body's until now.
void fit(HapticScene::Item& item, const HapticSetup& setup, const HapticScene::Item* before) {
  const BrickGrid& bone = item.bone->bone();
  if (setup.params.effects.fail_safe)
    item.depth_map = before != nullptr && before->depth_map ? before->depth_map : std::make_shared<DepthMap>(bone);
  for (std::size_t h = 0; h < setup.hands(); ++h) {
    auto known = before != nullptr && h < before->hands.size() ? before->hands[h] : nullptr;
    item.hands.push_back(known && known->serves(setup)
                             ? known
                             : std::make_shared<HandContact>(setup, bone.frame().spacing_mm.x, known.get()));
  }
}

void make_room(HapticScene& scene, const HapticSetup& setup) {
  if (setup.params.effects.shaft && !setup.params.effects.held_shaft)
    static_cast<void>(shaft_cut_depth(0));  // not in the servo
  std::size_t room = 0;
  for (const HapticScene::Item& i : scene.items) room = std::max(room, most_hits(i.bone->bone().frame().spacing_mm.x));
  scene.changes.resize(room * std::min(HapticRenderer::kMaxTouched, scene.items.size()) * setup.hands());
}

}  // namespace

ContactMethod method_of(const HapticSetup& setup, ContactMethod usual, std::size_t tool) noexcept {
  const auto it = setup.tool_methods.find(static_cast<int>(tool));
  if (it != setup.tool_methods.end()) return it->second;
  const InstrumentKind kind = instrument_library()[tool].kind;
  const bool held = setup.params.effects.held_shaft && kind != InstrumentKind::burr;
  return kind == InstrumentKind::saw || held ? ContactMethod::proxy : usual;
}

HandContact::HandContact(const HapticSetup& setup, double spacing_mm, const HandContact* before)
    : tools(tools_by_method(setup)) {
  for (std::size_t m = 0; m < models.size(); ++m) {
    if (before != nullptr && before->models[m]) {
      // What is for more instruments than before is another; one that nobody uses now may be used again.
      const bool enough =
          std::includes(before->tools[m].begin(), before->tools[m].end(), tools[m].begin(), tools[m].end());
      if (enough) {
        models[m] = before->models[m];
        tools[m] = before->tools[m];
        continue;
      }
    }
    if (tools[m].empty()) continue;
    ContactParams p = setup.params.contact;
    p.method = static_cast<ContactMethod>(m);
    models[m] = make_contact_model(p, spacing_mm, tools[m]);
  }
}

bool HandContact::serves(const HapticSetup& setup) const {
  const auto wanted = tools_by_method(setup);
  for (std::size_t m = 0; m < models.size(); ++m) {
    if (!std::includes(tools[m].begin(), tools[m].end(), wanted[m].begin(), wanted[m].end())) return false;
  }
  return true;
}

void HapticScene::add(std::shared_ptr<TouchedBone> bone, const RigidTransform& world_from_body,
                      const HapticSetup& setup) {
  items.push_back({std::move(bone), nullptr, {}, world_from_body, world_from_body.inverse()});
  fit(items.back(), setup, nullptr);
  make_room(*this, setup);
}

bool HapticScene::needs_bone_held(const HapticSetup& setup) const {
  return setup.params.effects.fail_safe &&
         std::any_of(items.begin(), items.end(), [](const Item& i) { return !i.depth_map; });
}

HapticScene HapticScene::of(const World& world, const HapticSetup& setup, const HapticScene* before) {
  HapticScene scene;
  const std::span<const Item> known =
      before != nullptr ? std::span<const Item>(before->items) : std::span<const Item>();
  for (const PlacedBody& placed : world.bodies()) {
    Item item{nullptr, nullptr, {}, placed.world_from_body, placed.world_from_body.inverse()};
    const auto same =
        std::find_if(known.begin(), known.end(), [&](const Item& i) { return i.bone->body() == placed.body.get(); });
    if (same != known.end()) {
      item.bone = same->bone;
    } else {
      item.bone = std::make_shared<TouchedBone>(placed.body);
      // Of those that are gone: another has their place, they came apart, or were put together again.
      for (const Item& old : known) {
        const auto& bodies = world.bodies();
        if (std::none_of(bodies.begin(), bodies.end(),
                         [&](const PlacedBody& b) { return b.body.get() == old.bone->body(); }))
          item.bone->inherit(*old.bone);
      }
    }
    fit(item, setup, same != known.end() ? &*same : nullptr);
    scene.items.push_back(std::move(item));
  }
  for (std::uint32_t hand = 0; hand < kMaxHands; ++hand) {
    const World::Grip& grip = world.grip(hand);
    if (grip.plate != SceneAction::kNobody)
      scene.held[hand].plate = std::make_shared<const PlateInHand>(plate_library()[grip.plate]);
    scene.held[hand].grip = grip.hand_from_plate;
    scene.guides[hand] = world.cutting_guide(hand);
  }
  make_room(scene, setup);
  return scene;
}

}  // namespace osteo::inline simulation
