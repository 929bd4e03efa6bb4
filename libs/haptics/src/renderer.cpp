#include "osteo/haptics/renderer.h"

#include <algorithm>
#include <cmath>

#include "contact_models.h"
#include "osteo/base/error.h"
#include "osteo/bone/thickness.h"

namespace osteo {
namespace {

// Above this share of the head in bone the pushes begin to cancel; at the second the map alone gives the direction.
constexpr double kEscapeFrom = 0.6, kEscapeAll = 0.9;
constexpr double kFarthestMm = 1e6;  // no pose of a hand: broken, as is what is not a number
constexpr int kMapBudget = 48;       // blocks of the distance map a tick, 5 us

HapticSetup made_safe(HapticSetup setup, double dt_s) {
  HapticsParams& p = setup.params;
  const double most = safe_stiffness_n_per_mm(setup.device, p.guard.contact_damping_n_s_per_m, dt_s);
  p.contact.stiffness_n_per_mm = std::min(p.contact.stiffness_n_per_mm, most);
  p.contact.soft_stiffness_n_per_mm = std::min(p.contact.soft_stiffness_n_per_mm, most);
  return setup;
}

OverlapResult turned(const OverlapResult& o, const Mat3& r) {
  OverlapResult t = o;
  t.area_mm2 = r * o.area_mm2;
  t.area_foot_mm3 = r * o.area_foot_mm3;
  return t;
}
void add(OverlapResult& sum, const OverlapResult& o) {
  sum.bone_mm3 += o.bone_mm3;
  sum.sharp_mm3 += o.sharp_mm3;
  sum.area_mm2 += o.area_mm2;
  sum.surface_mm2 += o.surface_mm2;
  sum.area_foot_mm3 += o.area_foot_mm3;
}

}  // namespace

HapticRenderer::HapticRenderer(const HapticSetup& setup, const Anatomy& anatomy, double dt_s)
    : setup_(made_safe(setup, dt_s)),
      anatomy_(anatomy),
      dt_s_(dt_s),
      vibration_(setup.vibration_json.empty() ? default_vibration() : parse_vibration(setup.vibration_json, "the session's vibration")),
      guard_(setup_.params.guard, setup.device) {
  if (!(dt_s > 0) || !(dt_s <= 1)) throw Error(ExitCode::usage, "the servo's rate must be a number from 1 Hz on");
  if (anatomy_.structures) {
    clearances_.resize(anatomy_.structures->values().size());
    events_.assign(clearances_.size(), {anatomy_.structures->reach_mm(), 0, 0});
  }
  if (setup.curve.size() >= 2) {
    curve_.emplace(setup.curve);
    constraint_.emplace(*curve_, setup.curve_params);
  }
}

HapticRenderer::HapticRenderer(const HapticSetup& setup, BrickGrid& bone, const Anatomy& anatomy, double dt_s)
    : HapticRenderer(setup, anatomy, dt_s) {
  own_.items.push_back({std::make_shared<TouchedBone>(setup_, bone, anatomy.hardness), {}, {}});
  own_.make_room();
  scene_ = &own_;
}

HapticRenderer::~HapticRenderer() = default;

void HapticRenderer::feel(const SceneAction& a) noexcept {
  // Not a number: nothing is felt, rather than nothing of the bone either.
  if (!std::all_of(a.values.begin(), a.values.begin() + 8, [](double v) { return std::isfinite(v); })) {
    soft_ = {};
    return;
  }
  soft_.at_mm = {a.values[0], a.values[1], a.values[2]};
  soft_.normal = {a.values[3], a.values[4], a.values[5]};
  soft_.force_n = a.values[6];
  soft_.stiffness_n_per_mm = std::min(a.values[7], setup_.params.contact.stiffness_n_per_mm);
}

// The head in each body near it.
void HapticRenderer::touch(const DeviceSample& pose) noexcept {
  const Burr& burr = burr_library()[pose.tool];
  const RoundCone head = burr.head();
  const double reach = head.length_mm + head.largest_radius_mm() + 2;  // and where a proxy may be
  for (HapticScene::Item& item : scene_->items) {
    TouchedBone& bone = *item.bone;
    ContactModel* const model = bone.models_[static_cast<std::size_t>(bone.method_of_tool_[pose.tool])].get();
    if (bone.model_ != nullptr && model != bone.model_) bone.model_->rest();
    bone.model_ = model;
    const Vec3 at = item.body_from_world(position_of(pose));
    // A body alone is always asked: it may be nowhere near, but what its proxy remembers has to follow.
    if (touched_count_ == kMostTouched || (scene_->items.size() > 1 && !bone.near(at, reach))) {
      model->rest();
      continue;
    }
    DeviceSample own = pose;
    own.position_mm = to_floats(at);
    own.axis = to_floats(item.body_from_world.rotation * axis_of(pose));
    Touch& t = touched_[touched_count_++];
    t = {&item, model->contact(bone.bone_, own)};
    const Mat3& turn = item.world_from_body.rotation;
    for (Vec3* const v : {&t.contact.force_n, &t.contact.torque_n_mm, &t.contact.normal, &t.contact.shown_offset_mm}) *v = turn * *v;
  }
}

// One contact of several.
void HapticRenderer::combine(Vec3 axis) noexcept {
  std::size_t in_bone = 0, most = 0;
  for (std::size_t i = 0; i < touched_count_; ++i) {
    in_bone += touched_[i].contact.bone_mm3 > 0 ? 1 : 0;
    if (touched_[i].contact.bone_mm3 > touched_[most].contact.bone_mm3) most = i;
  }
  if (touched_count_ == 0) return;
  loaded_ = touched_[most].item;
  contact_ = touched_[most].contact;
  if (in_bone < 2) return;
  OverlapResult sum;
  bool may_add = true;
  std::uint32_t immersed = 0;
  Vec3 force{}, torque{};
  double bone_mm3 = 0;
  for (std::size_t i = 0; i < touched_count_; ++i) {
    const Touch& t = touched_[i];
    const OverlapResult* const o = t.item->bone->model_->overlapped();
    may_add = may_add && o != nullptr;
    if (may_add) add(sum, turned(*o, t.item->world_from_body.rotation));
    immersed += t.contact.immersed;
    force += t.contact.force_n;
    torque += t.contact.torque_n_mm;
    bone_mm3 += t.contact.bone_mm3;
  }
  if (may_add) {
    contact_ = contact_of_overlap(setup_.params.contact, last_good_.tool, sum, axis);
  } else {
    contact_.force_n = force;
    contact_.torque_n_mm = torque;
    contact_.bone_mm3 = bone_mm3;
    contact_.normal = normalized(force);
    contact_.normal_force_n = length(force);
  }
  contact_.immersed = immersed;
}

void HapticRenderer::escape(Vec3 at_mm, double radius_mm, double full_mm3) noexcept {
  const double full = contact_.bone_mm3 / full_mm3;
  const double share = std::clamp((full - kEscapeFrom) / (kEscapeAll - kEscapeFrom), 0.0, 1.0);
  if (share <= 0 || loaded_ == nullptr || !loaded_->bone->depth_map_) return;
  DepthMap::Answer out = loaded_->bone->depth_map_->at(loaded_->body_from_world(at_mm));
  if (out.outwards == Vec3{}) return;
  out.outwards = loaded_->world_from_body.rotation * out.outwards;
  const double law = setup_.params.contact.force_n(out.depth_mm + radius_mm);
  contact_.force_n = contact_.force_n * (1 - share) + out.outwards * (law * share);
  contact_.normal = normalized(contact_.normal * (1 - share) + out.outwards * share);
  contact_.shown_offset_mm = contact_.shown_offset_mm * (1 - share) + out.outwards * (share * (out.depth_mm + radius_mm));
  contact_.normal_force_n = std::max(0.0, dot(contact_.force_n, contact_.normal));
  contact_.depth_mm = std::max(contact_.depth_mm, share * (out.depth_mm + radius_mm));
  flags_ |= kEscape;
}

void HapticRenderer::shaft(Vec3 at, Vec3 axis, Vec3& elastic, Vec3& torque) noexcept {
  const RoundCone shape = burr_library()[last_good_.tool].shaft();
  OverlapResult o;
  for (const HapticScene::Item& item : scene_->items) {
    TouchedBone& bone = *item.bone;
    const Vec3 own = item.body_from_world(at), own_axis = item.body_from_world.rotation * axis;
    if (scene_->items.size() > 1 &&
        !bone.near(own + own_axis * (shape.start_mm + 0.5 * shape.length_mm), 0.5 * shape.length_mm + shape.largest_radius_mm() + 1))
      continue;
    add(o, turned(bone.shaft_.measure(bone.bone_, shape, own, own_axis), item.world_from_body.rotation));
  }
  const double pressed = length(o.area_mm2);
  if (!(pressed > 0)) return;
  const Vec3 normal = o.area_mm2 * (-1 / pressed);
  const double depth = shaft_cut_depth(last_good_.tool)(o.sharp_mm3, -dot(normal, axis));
  const double push = push_left(o, depth, shape) * setup_.params.contact.force_n(depth);
  elastic += normal * push;
  torque += cross(axis, o.area_foot_mm3) * (-push / pressed);
  if (push > 0) flags_ |= kShaftContact;
}

// Under the deepest point of the head.
double HapticRenderer::thickness(Vec3 at, Vec3 axis) const noexcept {
  const BrickGrid& bone = loaded_->bone->bone_;
  const RoundCone head = burr_library()[last_good_.tool].head();
  const Vec3 away = contact_.normal;
  const double foot = dot(away, axis) < 0 ? head.length_mm : 0;
  const Vec3 deepest = at + contact_.shown_offset_mm + axis * foot - away * head.radius_at_mm(foot);
  const RigidTransform& own = loaded_->body_from_world;
  return thickness_mm(bone, own(deepest + away * bone.frame().spacing_mm.x), own.rotation * -away);
}

// What is at risk belongs to the patient: it goes with the first body.
void HapticRenderer::watch(const RoundCone& head, Vec3 at, Vec3 axis, bool cuts, TickRecord& r) noexcept {
  const RigidTransform& own = scene_->items.front().body_from_world;
  const auto nearest = anatomy_.structures->clearance(head, own(at), own.rotation * axis, clearances_);
  r.clearance_mm = static_cast<float>(nearest.distance_mm);
  r.structure = nearest.structure;
  for (std::size_t s = 0; s < events_.size(); ++s) {
    StructureEvents& e = events_[s];
    e.least_clearance_mm = std::min(e.least_clearance_mm, clearances_[s]);
    if (clearances_[s] > 0) continue;
    flags_ |= kStructureTouched;
    ++e.ticks_touched;
    if (!cuts) continue;
    flags_ |= kStructureInjured;
    ++e.ticks_injured;
  }
}

std::map<std::uint32_t, StructureEvents> HapticRenderer::structure_events() const {
  std::map<std::uint32_t, StructureEvents> by_value;
  for (std::size_t s = 0; s < events_.size(); ++s) {
    if (events_[s].least_clearance_mm < anatomy_.structures->reach_mm()) by_value.emplace(anatomy_.structures->values()[s], events_[s]);
  }
  return by_value;
}

std::span<const VoxelChange> HapticRenderer::remove(double& removed_mm3) noexcept {
  std::size_t count = 0;
  for (std::size_t i = 0; i < touched_count_; ++i) {
    Touch& t = touched_[i];
    TouchedBone& bone = *t.item->bone;
    // What presses into this body: its share of what the burr is in.
    const double share = contact_.bone_mm3 > 0 ? t.contact.bone_mm3 / contact_.bone_mm3 : 1;
    double removed = 0;
    const auto changes = bone.removal_.remove(bone.bone_, bone.model_->cut(bone.bone_), burr_library()[last_good_.tool],
                                              touched_count_ == 1 ? contact_.normal_force_n : share * contact_.normal_force_n,
                                              setup_.params.effects.speed_rpm, dt_s_, bone.hardness_.get(), removed);
    removed_mm3 += removed;
    if (bone.removal_.grains().overflowed()) flags_ |= kNoRoom;
    const VoxelKey first = bone.body_ ? bone.body_->name_of(0) : 0;
    for (const VoxelChange& c : changes) scene_->changes[count++] = {c.voxel + first, c.density, c.before};
    if (bone.depth_map_) {
      const std::size_t n = std::min(changes.size(), bone.changed_.size());
      for (std::size_t c = 0; c < n; ++c) bone.changed_[c] = changes[c].voxel;
      bone.depth_map_->update(bone.bone_, {bone.changed_.data(), n}, 0);
    }
  }
  return {scene_->changes.data(), count};
}

HapticRenderer::Step HapticRenderer::step(const DeviceSample& sample) noexcept {
  Step result;
  flags_ = 0;
  DeviceSample pose = sample;
  pose.tool = static_cast<std::uint8_t>(tool_of(sample));
  bool jumped = false;
  Guard::Input in;
  in.age_ms = sample.age_ms;
  if (!(length(position_of(sample)) < kFarthestMm)) {
    flags_ |= kPoseInvalid;
    pose.position_mm = last_good_.position_mm;
    pose.axis = last_good_.axis;
    pose.drill_on = 0;
    in.age_ms = 255;  // as if the device had gone silent
  } else if (has_last_ && length(position_of(sample) - position_of(last_good_)) > setup_.params.guard.jump_mm) {
    jumped = true;
  }
  const EffectParams& with = setup_.params.effects;
  if (sample.age_ms > setup_.params.guard.stale_ms || scene_->plate) pose.drill_on = 0;
  const bool usable = has_last_ || (flags_ & kPoseInvalid) == 0;
  if ((flags_ & kPoseInvalid) == 0) {
    last_good_ = pose;
    has_last_ = true;
  }
  last_good_.tool = pose.tool;
  const Vec3 at = position_of(pose), axis = axis_of(pose);
  const Burr& burr = burr_library()[pose.tool];
  contact_ = {};
  touched_count_ = 0;
  loaded_ = nullptr;
  if (scene_->plate && usable) {
    flags_ |= kPlateInHand;
    contact_ = plate_contact(*scene_->plate, plate_pose(at, axis, scene_->grip), scene_->items, setup_.params.contact);
  } else if (usable) {
    touch(pose);
    combine(axis);
    const RoundCone head = burr.head();
    const bool proxy = loaded_ != nullptr && loaded_->bone->method_of_tool_[pose.tool] == ContactMethod::proxy;
    if (contact_.bone_mm3 > 0 && !proxy) escape(at, head.largest_radius_mm(), head.volume_mm3());
  }

  Vec3 elastic = contact_.force_n, torque = contact_.torque_n_mm;
  if (with.shaft && usable && !scene_->plate) shaft(at, axis, elastic, torque);
  if (usable && !(soft_.normal == Vec3{})) {
    const double push =
        std::clamp(soft_.force_n + soft_.stiffness_n_per_mm * dot(soft_.at_mm - at, soft_.normal), 0.0, setup_.params.contact.max_force_n);
    elastic += soft_.normal * push;
    if (push > 0) flags_ |= kSoftContact;
  }
  Vec3 effects{};
  if (pose.drill_on != 0 && usable) {
    const double running = with.speed_rpm > 0 ? 1 : 0;
    const double turn = with.left_handed ? -1 : 1;
    effects += cross(contact_.normal, axis) * (turn * running * with.drag * contact_.normal_force_n);
    if (with.vibration && running > 0) {
      const auto v = vibration_.step(burr.kind, contact_.normal_force_n, dt_s_);
      const Vec3 u = any_perpendicular(axis);
      effects += u * v[0] + cross(axis, u) * v[1];
    }
  }
  if (constraint_ && usable) {
    const auto held = constraint_->update(at);
    if (held.engaged) {
      elastic += held.force_n;
      flags_ |= kCurveHeld;
    }
  }

  in.position_mm = at;
  in.elastic_n = elastic;
  in.normal = contact_.normal == Vec3{} ? normalized(elastic) : contact_.normal;
  in.effects_n = effects;
  in.jumped = jumped;
  const Guard::Output out = guard_.limit(in, dt_s_);

  TickRecord& r = result.record;
  if (usable && contact_.normal_force_n > 0 && loaded_ != nullptr) r.thickness_mm = static_cast<float>(thickness(at, axis));
  // A hand whose force is not back yet, or that is not heard of, neither removes nor injures; nor does a burr that stands still.
  const bool cuts = pose.drill_on != 0 && with.speed_rpm > 0 && !held_ && (out.flags & (kPoseJumped | kPoseStale)) == 0;
  if (anatomy_.structures && usable && !scene_->plate && !scene_->items.empty())
    watch(burr.head(), at + contact_.shown_offset_mm, axis, cuts, r);

  double removed = 0;
  if (held_) flags_ |= kHeld;
  if (cuts) result.changes = remove(removed);
  for (const HapticScene::Item& item : scene_->items) {
    if (item.bone->depth_map_) item.bone->depth_map_->update(item.bone->bone_, {}, kMapBudget);
  }

  r.device = sample;
  r.force_n = to_floats(out.force_n);
  r.torque_n_mm = to_floats(std::isfinite(dot(torque, torque)) ? torque : Vec3{});
  r.shown_offset_mm = to_floats(contact_.shown_offset_mm);
  r.normal_force_n = static_cast<float>(contact_.normal_force_n);
  r.depth_mm = static_cast<float>(contact_.depth_mm);
  r.removed_mm3 = static_cast<float>(removed);
  r.voxels_changed = static_cast<std::uint32_t>(result.changes.size());
  r.immersed = contact_.immersed;
  r.flags = flags_ | out.flags;
  r.energy_mj = static_cast<float>(guard_.energy_mj());
  return result;
}

}  // namespace osteo
