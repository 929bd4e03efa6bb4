#include "osteo/haptics/haptic_scene.h"

#include <algorithm>
#include <cmath>

#include "osteo/haptics/renderer.h"

namespace osteo {

TouchedBone::TouchedBone(const HapticSetup& setup, std::shared_ptr<Body> body) : TouchedBone(setup, body->bone, body->hardness) {
  body_ = std::move(body);
}

TouchedBone::TouchedBone(const HapticSetup& setup, BrickGrid& bone, std::shared_ptr<const Hardness> hardness)
    : bone_(bone), hardness_(std::move(hardness)), removal_(bone) {
  const double spacing = bone.frame().spacing_mm.x;
  const HapticsParams& params = setup.params;
  method_of_tool_.assign(burr_library().size(), params.contact.method);
  for (const auto& [tool, method] : setup.tool_methods) {
    if (tool >= 0 && tool < static_cast<int>(method_of_tool_.size())) method_of_tool_[static_cast<std::size_t>(tool)] = method;
  }
  for (const ContactMethod method : method_of_tool_) {
    auto& model = models_[static_cast<std::size_t>(method)];
    if (model) continue;
    ContactParams p = params.contact;
    p.method = method;
    model = make_contact_model(p, spacing);
  }
  if (params.effects.fail_safe) {
    depth_map_ = std::make_unique<DepthMap>(bone);
    changed_.resize(most_hits(spacing));
  }
  if (params.effects.shaft) static_cast<void>(shaft_cut_depth(0));  // not in the servo
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

TouchedBone::~TouchedBone() = default;

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

void HapticScene::make_room() {
  std::size_t room = 0;
  for (const Item& i : items) room = std::max(room, most_hits(i.bone->bone().frame().spacing_mm.x));
  changes.resize(room * HapticRenderer::kMostTouched);
}

HapticScene HapticScene::of(const World& world, const HapticSetup& setup, const HapticScene* before) {
  HapticScene scene;
  for (const PlacedBody& placed : world.bodies()) {
    Item item{nullptr, placed.world_from_body, placed.world_from_body.inverse()};
    for (std::size_t i = 0; before != nullptr && i < before->items.size(); ++i) {
      if (before->items[i].bone->body() == placed.body.get()) item.bone = before->items[i].bone;
    }
    if (!item.bone) {
      item.bone = std::make_shared<TouchedBone>(setup, placed.body);
      // Of those that are gone: another has their place, they came apart, or were put together again.
      for (std::size_t i = 0; before != nullptr && i < before->items.size(); ++i) {
        const Body* const old = before->items[i].bone->body();
        const auto& bodies = world.bodies();
        if (std::none_of(bodies.begin(), bodies.end(), [&](const PlacedBody& b) { return b.body.get() == old; }))
          item.bone->inherit(*before->items[i].bone);
      }
    }
    scene.items.push_back(std::move(item));
  }
  if (const std::uint32_t plate = world.grip().plate; plate != SceneAction::kNobody)
    scene.plate = std::make_shared<const PlateInHand>(plate_library()[plate]);
  scene.grip = world.grip().hand_from_plate;
  scene.make_room();
  return scene;
}

}  // namespace osteo
