#include "hand_renderer.h"

#include <algorithm>
#include <cmath>

#include "osteo/simulation/bone/depth_map.h"

namespace osteo::inline simulation {
namespace {

// Above this share of the head in bone the pushes begin to cancel; at the second the map alone gives the direction.
constexpr double kEscapeFrom = 0.6, kEscapeAll = 0.9;
constexpr double kFarthestMm = 1e6;   // no pose of a hand: broken, as is what is not a number
constexpr double kMaxShellMm = 0.25;  // of a held shaft
constexpr double kThereRpm = 60;      // a lag never ends: so near, the burr has the pedal's speed

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

HandRenderer::HandRenderer(const HapticRenderer::Common& common, const HapticSetup& setup, std::size_t number,
                           const Curve* curve)
    : common_(common),
      number_(number),
      device_(setup.device_of(number)),
      vibration_(setup.vibration_json.empty() ? default_vibration()
                                              : parse_vibration(setup.vibration_json, "the session's vibration")),
      guard_(setup.params.guard, device_),
      instrument_(&instrument_library().front()) {
  if (!setup.texture_json.empty())
    texture_.emplace(parse_texture(setup.texture_json, "the session's texture"), number + 1, common.dt_s);
  if (curve != nullptr) constraint_.emplace(*curve, setup.curve_params);
  set();
}

void HandRenderer::set() noexcept {
  const HapticsParams& p = common_.params;
  const double most = safe_stiffness_n_per_mm(device_, p.guard.contact_damping_n_s_per_m, common_.dt_s);
  law_ = p.contact;
  law_.stiffness_n_per_mm = std::min(law_.stiffness_n_per_mm, most);
  law_.soft_stiffness_n_per_mm = std::min(law_.soft_stiffness_n_per_mm, most);
  soft_.stiffness_n_per_mm = std::min(soft_.stiffness_n_per_mm, law_.stiffness_n_per_mm);
  guard_.set(p.guard);
}

void HandRenderer::push(const SceneAction& a) noexcept {
  // Not a number: nothing is felt, rather than nothing of the bone either.
  if (!std::all_of(a.values.begin(), a.values.begin() + 8, [](double v) { return std::isfinite(v); })) {
    soft_ = {};
    return;
  }
  soft_.at_mm = {a.values[0], a.values[1], a.values[2]};
  soft_.normal = {a.values[3], a.values[4], a.values[5]};
  soft_.force_n = a.values[6];
  soft_.stiffness_n_per_mm = std::min(a.values[7], law_.stiffness_n_per_mm);
}

// A hand that leads, and whose time stands still: what it remembers stays for when it goes on.
void HandRenderer::rest(const DeviceSample& sample) noexcept {
  const auto force_n = record_.force_n;
  record_ = {};
  record_.device = sample;
  record_.hand = static_cast<std::uint32_t>(number_);
  record_.force_n = force_n;
  contact_ = {};
  touched_count_ = 0;
  loaded_ = nullptr;
  flags_ = 0;
  cuts_ = false;
  resting_ = true;
}

void HandRenderer::feel(const DeviceSample& sample) noexcept {
  if (leads_ && (sample.buttons & kLeadStill) != 0) return rest(sample);
  resting_ = false;
  const GuideLaw::Hand before{record_.structure != 0 ? record_.clearance_mm : 1e9F};
  record_ = {};
  record_.device = sample;
  record_.hand = static_cast<std::uint32_t>(number_);
  flags_ = 0;
  Guard::Input in;
  place(sample, in);
  const bool led = guide_.guide().on();
  contact_ = {};
  touched_count_ = 0;
  loaded_ = nullptr;
  const bool meets = !led || guide_.guide().own_contact;
  Vec3 elastic, torque;
  // A jump has no way that a shaft could have been stopped on. Another tool is where the one before was let be.
  const bool shaft = common_.params.effects.shaft && has_head() && meets;
  const bool keeps = shaft && common_.params.effects.held_shaft;
  if (!keeps || in.jumped) shaft_.forget();
  if (keeps) hold_shaft(elastic, torque);
  if (meets) meet();
  elastic += contact_.force_n;
  torque += contact_.torque_n_mm;
  if (shaft && !keeps) press_shaft(elastic, torque);
  if (usable_ && !(soft_.normal == Vec3{})) {
    const double push = std::clamp(soft_.force_n + soft_.stiffness_n_per_mm * dot(soft_.at_mm - at_, soft_.normal), 0.0,
                                   law_.max_force_n);
    elastic += soft_.normal * push;
    if (push > 0) flags_ |= kSoftContact;
  }
  if ((flags_ & kInSlot) != 0) elastic += slot_.force_n(law_.stiffness_n_per_mm, law_.max_force_n);
  Vec3 driven = effects();
  if (led && usable_) {
    const Vec3 pull = guide_.step(hand_at_, before, leader_, leader_force_n_, common_.dt_s);
    driven += pull;
    if (!(pull == Vec3{})) flags_ |= kGuided;
  }
  if (constraint_ && usable_) {
    const auto held = constraint_->update(hand_at_);
    if (held.engaged) {
      elastic += held.force_n;
      flags_ |= kCurveHeld;
    }
  }

  in.position_mm = hand_at_;
  in.elastic_n = elastic;
  in.normal = contact_.normal == Vec3{} ? normalized(elastic) : contact_.normal;
  in.effects_n = driven;
  in.drag_n = drag_n_;
  in.stored_mj = elastic == contact_.force_n ? contact_.stored_mj : 0;
  const Guard::Output out = guard_.limit(in, common_.dt_s);
  flags_ |= out.flags;
  if (common_.held) flags_ |= kHeld;
  if (usable_ && contact_.normal_force_n > 0 && loaded_ != nullptr)
    record_.thickness_mm = static_cast<float>(thickness());
  // A hand whose force is not back yet, or that is not heard of, neither removes nor injures; nor does a burr that
  // stands still.
  cuts_ = pose_.pedal != 0 && !common_.held && (out.flags & (kPoseJumped | kPoseStale)) == 0;
  record_.force_n = to_floats(out.force_n);
  record_.torque_n_mm = to_floats(std::isfinite(dot(torque, torque)) ? torque : Vec3{});
}

// The pose to go on with; pose_.pedal: whether the burr turns.
void HandRenderer::place(const DeviceSample& sample, Guard::Input& in) noexcept {
  const GuardParams& guard = common_.params.guard;
  pose_ = sample;
  pose_.tool = static_cast<std::uint8_t>(tool_of(sample));
  instrument_ = &instrument_library()[pose_.tool];
  in.age_ms = sample.age_ms;
  if (!(length(position_of(sample)) < kFarthestMm)) {
    flags_ |= kPoseInvalid;
    pose_.position_mm = last_good_.position_mm;
    pose_.axis = last_good_.axis;
    pose_.pedal = 0;
    in.age_ms = 255;  // as if the device had gone silent
  } else if (has_last_ && length(position_of(sample) - position_of(last_good_)) > guard.jump_mm) {
    in.jumped = true;
  }
  if (sample.age_ms > guard.stale_ms || plate() != nullptr) pose_.pedal = 0;
  usable_ = has_last_ || (flags_ & kPoseInvalid) == 0;
  spin(pose_.pedal);
  pose_.pedal = usable_ && plate() == nullptr && speed_rpm_ > 0 ? 255 : 0;
  if ((flags_ & kPoseInvalid) == 0) {
    last_good_ = pose_;
    has_last_ = true;
  }
  hand_at_ = at_ = position_of(pose_);
  axis_ = axis_of(pose_);
  const bool saw = usable_ && plate() == nullptr && instrument_->kind == InstrumentKind::saw;
  if (slot_.step(common_.scene->guides[number_], saw, at_, axis_, common_.dt_s)) flags_ |= kInSlot;
}

void HandRenderer::spin(std::uint8_t pedal) noexcept {
  if (pose_.tool != last_tool_) speed_rpm_ = 0;
  last_tool_ = pose_.tool;
  const double wanted = instrument_->cutter() != nullptr ? common_.params.effects.speed_rpm * pedal / 255 : 0;
  speed_rpm_ += (wanted - speed_rpm_) * (wanted > speed_rpm_ ? common_.up_share : common_.down_share);
  if (std::abs(wanted - speed_rpm_) < kThereRpm) speed_rpm_ = wanted;
}

// What the instrument or the plate meets.
void HandRenderer::meet() noexcept {
  if (!usable_) return;
  if (const PlateInHand* const held = plate()) {
    flags_ |= kPlateInHand;
    contact_ =
        plate_contact(*held, plate_pose(at_, axis_, common_.scene->held[number_].grip), common_.scene->items, law_);
    return;
  }
  touch();
  combine();
  const bool proxy = loaded_ != nullptr && common_.method_of_tool[pose_.tool] == ContactMethod::proxy;
  if (contact_.bone_mm3 > 0 && !proxy) escape();
}

// The head in each body near it.
void HandRenderer::touch() noexcept {
  HapticScene& scene = *common_.scene;
  const RoundCone& head = instrument_->head;
  const double reach = head.length_mm + head.largest_radius_mm() + 2;  // and where a proxy may be
  const auto method = static_cast<std::size_t>(common_.method_of_tool[pose_.tool]);
  for (HapticScene::Item& item : scene.items) {
    HandContact& mine = *item.hands[number_];
    ContactModel* const model = mine.models[method].get();
    if (mine.in_use == nullptr) {  // new; its models may have been another's
      for (const auto& any : mine.models) {
        if (any) any->rest();
      }
    } else if (model != mine.in_use) {
      mine.in_use->rest();
    }
    mine.in_use = model;
    const Vec3 at = item.body_from_world(at_);
    // A body alone is always asked: it may be nowhere near, but what its proxy remembers has to follow.
    if (touched_count_ == touched_.size() || (scene.items.size() > 1 && !item.bone->near(at, reach))) {
      model->rest();
      continue;
    }
    DeviceSample own = pose_;
    own.position_mm = to_floats(at);
    own.axis = to_floats(item.body_from_world.rotation * axis_);
    model->set(law_);
    model->know(&item.bone->grains());
    const bool held = (flags_ & kInSlot) != 0 && common_.params.guard.law > 3;
    model->hold(held ? item.body_from_world.rotation * slot_.across() : Vec3{});
    Touch& t = touched_[touched_count_++];
    t = {&item, model, model->contact(item.bone->bone(), own)};
    const Mat3& turn = item.world_from_body.rotation;
    for (Vec3* const v : {&t.contact.force_n, &t.contact.torque_n_mm, &t.contact.normal, &t.contact.shown_offset_mm})
      *v = turn * *v;
  }
}

// One contact of several.
void HandRenderer::combine() noexcept {
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
  double bone_mm3 = 0, stored_mj = 0;
  for (std::size_t i = 0; i < touched_count_; ++i) {
    const Touch& t = touched_[i];
    const OverlapResult* const o = t.model->overlapped();
    may_add = may_add && o != nullptr;
    if (may_add) add(sum, turned(*o, t.item->world_from_body.rotation));
    immersed += t.contact.immersed;
    force += t.contact.force_n;
    torque += t.contact.torque_n_mm;
    bone_mm3 += t.contact.bone_mm3;
    stored_mj += t.contact.stored_mj;
  }
  if (may_add) {
    contact_ = contact_of_overlap(law_, pose_.tool, sum, axis_);
  } else {
    contact_.force_n = force;
    contact_.torque_n_mm = torque;
    contact_.bone_mm3 = bone_mm3;
    contact_.stored_mj = stored_mj;
    contact_.normal = normalized(force);
    contact_.normal_force_n = length(force);
  }
  contact_.immersed = immersed;
}

void HandRenderer::escape() noexcept {
  const double radius_mm = instrument_->head.largest_radius_mm(),
               full = contact_.bone_mm3 / instrument_->head.volume_mm3();
  const double share = std::clamp((full - kEscapeFrom) / (kEscapeAll - kEscapeFrom), 0.0, 1.0);
  if (share <= 0 || loaded_ == nullptr || !loaded_->depth_map) return;
  DepthMap::Answer out = loaded_->depth_map->at(loaded_->body_from_world(at_));
  if (out.outwards == Vec3{}) return;
  out.outwards = loaded_->world_from_body.rotation * out.outwards;
  const double push = law_.force_n(out.depth_mm + radius_mm);
  contact_.force_n = contact_.force_n * (1 - share) + out.outwards * (push * share);
  contact_.normal = normalized(contact_.normal * (1 - share) + out.outwards * share);
  contact_.shown_offset_mm =
      contact_.shown_offset_mm * (1 - share) + out.outwards * (share * (out.depth_mm + radius_mm));
  contact_.normal_force_n = std::max(0.0, dot(contact_.force_n, contact_.normal));
  contact_.stored_mj = 0;
  contact_.depth_mm = std::max(contact_.depth_mm, share * (out.depth_mm + radius_mm));
  flags_ |= kEscape;
}

// The tool is where its shaft can be, and the hand is pulled there: no offset is without its force. Behind bone the
// hand pulls at it, but what is at its tip goes by where it is.
void HandRenderer::hold_shaft(Vec3& elastic, Vec3& torque) noexcept {
  const RoundCone& shape = instrument_->shaft;
  const HapticScene& scene = *common_.scene;
  std::array<HeldShaft::Body, HeldShaft::kMaxBodies> bodies;
  std::size_t count = 0;
  // A burr's shaft follows it into what it cuts, so its shell must not touch the walls; and coarse voxels make no wide
  // gap a narrow one.
  const double gap = instrument_->head.end_radius_mm - shape.start_radius_mm;
  double shell = instrument_->kind == InstrumentKind::burr && gap > 0 ? std::min(kMaxShellMm, 0.5 * gap) : kMaxShellMm;
  for (const HapticScene::Item& item : scene.items) {
    if (count == bodies.size()) break;
    if (scene.items.size() > 1 &&
        !item.bone->near(item.body_from_world(at_ + axis_ * (shape.start_mm + 0.5 * shape.length_mm)),
                         0.5 * shape.length_mm + shape.largest_radius_mm() + 2 + length(shaft_.offset_mm())))
      continue;
    bodies[count++] = {&item.bone->bone(), &item.bone->grains(), item.bone->first_name(), item.world_from_body,
                       item.body_from_world};
    shell = std::min(shell, 0.5 * item.bone->bone().frame().spacing_mm.x);
  }
  const bool slot = (flags_ & kInSlot) != 0 && common_.params.guard.law > 4;
  const HeldShaft::Answer held =
      shaft_.follow({bodies.data(), count}, shape, shell, at_, axis_, slot ? slot_.across() : Vec3{});
  const double far = length(held.offset_mm);
  if (!(far > 0)) return;
  const double push = law_.force_n(far);
  elastic += held.offset_mm * (push / far);
  torque += held.torque_mm * push;
  flags_ |= kShaftContact;
  at_ += held.offset_mm;
}

// By what of the shaft lies in bone: areas on opposite sides cancel, so it goes through what is thinner than it.
void HandRenderer::press_shaft(Vec3& elastic, Vec3& torque) noexcept {
  const RoundCone& shape = instrument_->shaft;
  HapticScene& scene = *common_.scene;
  OverlapResult o;
  for (const HapticScene::Item& item : scene.items) {
    const Vec3 own = item.body_from_world(at_), own_axis = item.body_from_world.rotation * axis_;
    if (scene.items.size() > 1 && !item.bone->near(own + own_axis * (shape.start_mm + 0.5 * shape.length_mm),
                                                   0.5 * shape.length_mm + shape.largest_radius_mm() + 1))
      continue;
    add(o, turned(item.hands[number_]->pressed_shaft.measure(item.bone->bone(), shape, own, own_axis),
                  item.world_from_body.rotation));
  }
  const double pressed = length(o.area_mm2);
  if (!(pressed > 0)) return;
  const Vec3 normal = o.area_mm2 * (-1 / pressed);
  const double depth = shaft_cut_depth(pose_.tool)(o.sharp_mm3, -dot(normal, axis_));
  const double push = push_left(o, depth, shape) * law_.force_n(depth);
  elastic += normal * push;
  torque += cross(axis_, o.area_foot_mm3) * (-push / pressed);
  if (push > 0) flags_ |= kShaftContact;
}

// Of a burr that turns; of all else what it slides over.
Vec3 HandRenderer::effects() noexcept {
  const Burr* const edge = instrument_->cutter();
  const bool turns = pose_.pedal != 0 && edge != nullptr;
  drag_n_ = {};
  Vec3 shaken{};
  if (texture_ && usable_)
    shaken = texture_->step(at_, contact_.normal, turns || plate() ? 0 : contact_.normal_force_n);
  if (!turns) return shaken;
  const EffectParams& with = common_.params.effects;
  const double speed = speed_rpm_ / Burr::kNominalRpm, turn = with.left_handed ? -1 : 1;
  // Teeth that go to and fro drag neither way.
  Vec3 driven;
  if (instrument_->kind == InstrumentKind::burr)
    driven = cross(contact_.normal, axis_) * (turn * std::min(1.0, speed) * with.drag * contact_.normal_force_n);
  drag_n_ = driven;
  if (with.vibration) {
    const auto v = vibration_.step(edge->kind, contact_.normal_force_n, common_.dt_s, speed * instrument_->speed_share);
    const Vec3 u = any_perpendicular(axis_);
    driven += u * v[0] + cross(axis_, u) * v[1];
  }
  return driven;
}

// Under the deepest point of the head.
double HandRenderer::thickness() const noexcept {
  const BrickGrid& bone = loaded_->bone->bone();
  const RoundCone& head = instrument_->head;
  const Vec3 away = contact_.normal;
  const double foot = dot(away, axis_) < 0 ? head.length_mm : 0;
  const Vec3 deepest = at_ + contact_.shown_offset_mm + axis_ * foot - away * head.radius_at_mm(foot);
  const RigidTransform& own = loaded_->body_from_world;
  return thickness_mm(bone, own(deepest + away * bone.frame().spacing_mm.x), own.rotation * -away);
}

void HandRenderer::remove(std::size_t& count) noexcept {
  const Burr* const edge = instrument_->cutter();
  if (!cuts_ || edge == nullptr) return;
  double removed_mm3 = 0;
  const std::size_t first_change = count;
  for (std::size_t i = 0; i < touched_count_; ++i) {
    Touch& t = touched_[i];
    TouchedBone& bone = *t.item->bone;
    // What presses into this body: its share of what the burr is in.
    const double share = contact_.bone_mm3 > 0 ? t.contact.bone_mm3 / contact_.bone_mm3 : 1;
    double removed = 0;
    const auto changes =
        bone.removal().remove(bone.bone(), t.model->cut(bone.bone()), *edge,
                              touched_count_ == 1 ? contact_.normal_force_n : share * contact_.normal_force_n,
                              speed_rpm_, common_.dt_s, bone.hardness(), removed, number_);
    removed_mm3 += removed;
    if (bone.removal().grains().overflowed()) flags_ |= kNoRoom;
    if (t.item->depth_map) t.item->depth_map->update(bone.bone(), bone.voxels_of(changes), 0);
    const VoxelKey first = bone.first_name();
    for (const VoxelChange& c : changes) common_.scene->changes[count++] = {c.voxel + first, c.density, c.before};
  }
  record_.removed_mm3 = static_cast<float>(removed_mm3);
  record_.voxels_changed = static_cast<std::uint32_t>(count - first_change);
}

const TickRecord& HandRenderer::finish() noexcept {
  record_.shown_offset_mm = to_floats(contact_.shown_offset_mm + (at_ - hand_at_));
  record_.normal_force_n = static_cast<float>(contact_.normal_force_n);
  record_.depth_mm = static_cast<float>(contact_.depth_mm);
  record_.immersed = contact_.immersed;
  record_.flags = flags_;
  record_.energy_mj = static_cast<float>(guard_.energy_mj());
  record_.speed_rpm = static_cast<float>(speed_rpm_);
  return record_;
}

}  // namespace osteo::inline simulation
