#include "osteo/haptics/renderer.h"

#include <algorithm>
#include <cmath>

#include "contact_models.h"
#include "osteo/bone/thickness.h"

namespace osteo {
namespace {

// Above this share of the head in bone the pushes begin to cancel; at the second the map alone gives the direction.
constexpr double kEscapeFrom = 0.6, kEscapeAll = 0.9;
constexpr double kFarthestMm = 1e6;  // no pose of a hand: broken, as is what is not a number
constexpr int kMapBudget = 48;       // blocks of the distance map a tick, 5 us

HapticsParams made_safe(HapticsParams p, const DeviceTraits& device, double dt_s) {
  const double most = safe_stiffness_n_per_mm(device, p.guard.contact_damping_n_s_per_m, dt_s);
  p.contact.stiffness_n_per_mm = std::min(p.contact.stiffness_n_per_mm, most);
  p.contact.soft_stiffness_n_per_mm = std::min(p.contact.soft_stiffness_n_per_mm, most);
  return p;
}

}  // namespace

HapticRenderer::HapticRenderer(const HapticSetup& setup, const BrickGrid& bone, const Anatomy& anatomy, double dt_s)
    : params_(made_safe(setup.params, setup.device, dt_s)),
      anatomy_(anatomy),
      dt_s_(dt_s),
      removal_(most_hits(bone.frame().spacing_mm.x)),
      vibration_(setup.vibration_json.empty() ? default_vibration() : parse_vibration(setup.vibration_json, "the session's vibration")),
      guard_(params_.guard, setup.device) {
  method_of_tool_.assign(burr_library().size(), params_.contact.method);
  for (const auto& [tool, method] : setup.tool_methods) {
    if (tool >= 0 && tool < static_cast<int>(method_of_tool_.size())) method_of_tool_[static_cast<std::size_t>(tool)] = method;
  }
  for (const ContactMethod method : method_of_tool_) {
    auto& model = models_[static_cast<std::size_t>(method)];
    if (model) continue;
    ContactParams p = params_.contact;
    p.method = method;
    model = make_contact_model(p, bone.frame().spacing_mm.x);
  }
  if (params_.effects.fail_safe) {
    depth_map_ = std::make_unique<DepthMap>(bone);
    changed_.resize(most_hits(bone.frame().spacing_mm.x));
  }
  if (params_.effects.shaft) static_cast<void>(shaft_cut_depth(0));  // not in the servo
  if (setup.curve.size() >= 2) {
    curve_.emplace(setup.curve);
    constraint_.emplace(*curve_, setup.curve_params);
  }
}

HapticRenderer::~HapticRenderer() = default;

void HapticRenderer::escape(Vec3 at_mm, const Burr& burr) noexcept {
  const RoundCone head = burr.head();
  const double full = contact_.bone_mm3 / head.volume_mm3();
  const double share = std::clamp((full - kEscapeFrom) / (kEscapeAll - kEscapeFrom), 0.0, 1.0);
  if (share <= 0 || method_of_tool_[last_good_.tool] == ContactMethod::proxy) return;
  const DepthMap::Answer out = depth_map_->at(at_mm);
  if (out.outwards == Vec3{}) return;
  const double law = params_.contact.force_n(out.depth_mm + head.largest_radius_mm());
  contact_.force_n = contact_.force_n * (1 - share) + out.outwards * (law * share);
  contact_.normal = normalized(contact_.normal * (1 - share) + out.outwards * share);
  contact_.shown_offset_mm = contact_.shown_offset_mm * (1 - share) + out.outwards * (share * (out.depth_mm + head.largest_radius_mm()));
  contact_.normal_force_n = std::max(0.0, dot(contact_.force_n, contact_.normal));
  contact_.depth_mm = std::max(contact_.depth_mm, share * (out.depth_mm + head.largest_radius_mm()));
  flags_ |= kEscape;
}

HapticRenderer::Step HapticRenderer::step(BrickGrid& bone, const DeviceSample& sample) noexcept {
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
  } else if (has_last_ && length(position_of(sample) - position_of(last_good_)) > params_.guard.jump_mm) {
    jumped = true;
  }
  if (sample.age_ms > params_.guard.stale_ms) pose.drill_on = 0;
  const bool usable = has_last_ || (flags_ & kPoseInvalid) == 0;
  if ((flags_ & kPoseInvalid) == 0) {
    last_good_ = pose;
    has_last_ = true;
  }
  const Vec3 at = position_of(pose), axis = axis_of(pose);
  const Burr& burr = burr_library()[pose.tool];
  ContactModel* const model = models_[static_cast<std::size_t>(method_of_tool_[pose.tool])].get();
  if (model_ != nullptr && model != model_) model_->rest();
  model_ = model;
  contact_ = usable ? model_->contact(bone, pose) : ContactResult{};
  if (depth_map_ && contact_.bone_mm3 > 0) escape(at, burr);

  Vec3 elastic = contact_.force_n, torque = contact_.torque_n_mm;
  if (params_.effects.shaft && usable) {
    const RoundCone shape = burr.shaft();
    const OverlapResult o = shaft_.measure(bone, shape, at, axis);
    if (const double pressed = length(o.area_mm2); pressed > 0) {
      const Vec3 normal = o.area_mm2 * (-1 / pressed);
      const double depth = shaft_cut_depth(pose.tool)(o.sharp_mm3, -dot(normal, axis));
      const double push = push_left(o, depth, shape) * params_.contact.force_n(depth);
      elastic += normal * push;
      torque += cross(axis, o.area_foot_mm3) * (-push / pressed);
      if (push > 0) flags_ |= kShaftContact;
    }
  }
  Vec3 effects{};
  if (pose.drill_on != 0 && usable) {
    const double running = params_.effects.speed_rpm > 0 ? 1 : 0;
    const double turn = params_.effects.left_handed ? -1 : 1;
    effects += cross(contact_.normal, axis) * (turn * running * params_.effects.drag * contact_.normal_force_n);
    if (params_.effects.vibration && running > 0) {
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
  if (usable && contact_.normal_force_n > 0) {
    // Under the deepest point of the head.
    const RoundCone head = burr.head();
    const Vec3 away = contact_.normal;
    const double foot = dot(away, axis) < 0 ? head.length_mm : 0;
    const Vec3 deepest = at + contact_.shown_offset_mm + axis * foot - away * head.radius_at_mm(foot);
    r.thickness_mm = static_cast<float>(thickness_mm(bone, deepest + away * bone.frame().spacing_mm.x, -away));
  }
  if (anatomy_.structures && usable) {
    const auto near = anatomy_.structures->clearance(burr.head(), at + contact_.shown_offset_mm, axis);
    r.clearance_mm = static_cast<float>(near.distance_mm);
    r.structure = near.structure;
    if (near.structure != 0 && near.distance_mm <= 0)
      flags_ |= kStructureTouched | (pose.drill_on != 0 ? static_cast<std::uint32_t>(kStructureInjured) : 0U);
  }

  double removed = 0;
  // A hand whose force is not back yet, or that is not heard of, removes nothing.
  if (pose.drill_on != 0 && (out.flags & (kPoseJumped | kPoseStale)) == 0) {
    result.changes = removal_.remove(bone, model_->cut(bone), burr, contact_.normal_force_n, params_.effects.speed_rpm, dt_s_,
                                     anatomy_.hardness.get(), removed);
  }
  if (depth_map_) {
    const std::size_t n = std::min(result.changes.size(), changed_.size());
    for (std::size_t i = 0; i < n; ++i) changed_[i] = result.changes[i].voxel;
    depth_map_->update(bone, {changed_.data(), n}, kMapBudget);
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
