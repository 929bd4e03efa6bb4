#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>

#include "contact_models.h"

namespace osteo::inline simulation {
namespace {

// A saw with a shell as thick would rest on the shoulders of its own kerf; without any it would leave bone beside it:
// measured, a quarter.
RoundCone shell_of(const Instrument& held, double spacing_mm) {
  RoundCone head = held.head;
  const double grow = (held.kind == InstrumentKind::saw ? 0.25 : 0.5) * spacing_mm;
  head.start_radius_mm += grow;
  head.end_radius_mm += grow;
  return head;
}

// A table takes 2 ms: kept for each spacing and instrument that was used.
const CutDepth& shell_depth(double spacing_mm, std::size_t tool) {
  static std::mutex mutex;
  static std::map<std::pair<double, std::size_t>, CutDepth> known;
  const std::lock_guard lock(mutex);
  const auto key = std::pair(spacing_mm, tool);
  const auto it = known.find(key);
  return it != known.end() ? it->second
                           : known.try_emplace(key, shell_of(instrument_library()[tool], spacing_mm)).first->second;
}

// How far the teeth of a proxy reach, in voxels; and how much deeper than by what they have before them the hand may
// be: on flat bone that is as deep as it is.
constexpr double kTeeth = 0.75, kTeethTell = 1.25;
// A proxy that is no farther off the surface than this share of its shell rests on it.
constexpr double kOnIt = 0.5;
// Of a saw in a slot: with less of a push than this in the slot's plane there is no direction in it.
constexpr double kFlatShare = 0.02;

// With more voxels under the burr than may change in a tick, their rows take turns.
std::vector<std::uint32_t> strides_for(double spacing_mm) {
  std::vector<std::uint32_t> strides;
  for (const Instrument& i : instrument_library()) {
    const double voxels = i.head.volume_mm3() / (spacing_mm * spacing_mm * spacing_mm);
    strides.push_back(static_cast<std::uint32_t>(std::max(1.0, std::ceil(voxels / kMaxCutPerTick))));
  }
  return strides;
}

}  // namespace

HeadOverlap::HeadOverlap(double spacing_mm) : strides_(strides_for(spacing_mm)), overlap_(most_hits(spacing_mm)) {
  for (const Instrument& i : instrument_library()) heads_.push_back(i.head);
}

const OverlapResult& HeadOverlap::measure(const BrickGrid& bone, const Grains* known, std::size_t tool, Vec3 at_mm,
                                          Vec3 axis, bool cutting) noexcept {
  last_ = {};
  cutting_ = cutting && finite(at_mm);
  if (!finite(at_mm)) return last_;
  at_mm_ = at_mm;
  axis_ = axis;
  stride_ = strides_[tool];
  last_ = overlap_.measure(bone, heads_[tool], at_mm, axis, known, cutting, instrument_library()[tool].falloff_per_rad,
                           stride_, phase_++);
  return last_;
}

Cut HeadOverlap::cut() const noexcept {
  if (!cutting_) return {};
  return {overlap_.hits(), at_mm_, axis_, stride_ > 1};
}

ExactOverlap::ExactOverlap(const ContactParams& params, double spacing_mm) : ContactModel(params), head_(spacing_mm) {
  static_cast<void>(head_cut_depth(0));  // not in the servo
}

ContactResult ExactOverlap::contact(const BrickGrid& bone, const DeviceSample& pose) noexcept {
  const std::size_t tool = tool_of(pose);
  const Vec3 axis = axis_of(pose);
  const OverlapResult& o = head_.measure(bone, known_, tool, position_of(pose), axis, pose.pedal != 0);
  ContactResult r = contact_of_overlap(params_, tool, o, axis);
  r.immersed = static_cast<std::uint32_t>(std::min(4e9, std::ceil(o.bone_mm3 / bone.frame().voxel_volume_mm3())));
  return r;
}

ContactResult contact_of_overlap(const ContactParams& params, std::size_t tool, const OverlapResult& overlap,
                                 Vec3 axis) noexcept {
  ContactResult r;
  r.bone_mm3 = overlap.bone_mm3;
  const double pressed = length(overlap.area_mm2);
  if (!(overlap.bone_mm3 > 0) || !(pressed > 0)) return r;
  r.normal = overlap.area_mm2 * (-1 / pressed);
  const double cosine = -dot(r.normal, axis);
  r.depth_mm = head_cut_depth(tool)(overlap.sharp_mm3, cosine);
  const double left = push_left(overlap, r.depth_mm, instrument_library()[tool].head);
  r.normal_force_n = left * params.force_n(r.depth_mm);
  r.force_n = r.normal * r.normal_force_n;
  r.torque_n_mm = cross(axis, overlap.area_foot_mm3) * (-r.normal_force_n / pressed);
  // In a hollow there is more area than in the flat cut, so on the way out the depth changes by as much more than the
  // way. Volumes go with a power of the way: on flat bone the second, in a hollow of the burr's own shape the first;
  // rather too little is told than too much, which would dull the way out.
  const double against = head_cut_depth(tool).area_mm2(overlap.sharp_mm3, cosine) / pressed,
               power = std::clamp(2 * against, 1.0, 2.0);
  r.stored_mj = left * params.energy_mj(r.depth_mm) * against * 2 * power / (2 + power);
  // Where a rigid tool would be: the hand's depth back along the push.
  r.shown_offset_mm = r.normal * (r.depth_mm * left);
  return r;
}

Cut ExactOverlap::cut(const BrickGrid&) noexcept {
  return head_.cut();
}

BurrProxy::BurrProxy(const ContactParams& params, double spacing_mm, std::span<const std::size_t> tools)
    : ContactModel(params),
      spacing_mm_(spacing_mm),
      shell_depths_(instrument_library().size()),
      overlap_(0),
      head_(spacing_mm) {
  for (const Instrument& i : instrument_library()) shells_.push_back(shell_of(i, spacing_mm));
  for (std::size_t tool = 0; tool < shells_.size(); ++tool) {
    if (tools.empty() || std::find(tools.begin(), tools.end(), tool) != tools.end())
      shell_depths_[tool] = &shell_depth(spacing_mm, tool);
  }
}

ContactResult BurrProxy::contact(const BrickGrid& bone, const DeviceSample& pose) noexcept {
  ContactResult r;
  cutting_ = false;
  const Vec3 at = position_of(pose);
  axis_ = axis_of(pose);
  if (!finite(at)) return r;
  if (tool_ != tool_of(pose)) proxy_.forget();
  tool_ = tool_of(pose);
  // The proxy is a shell around the burr, half a voxel thick, that bone fills to exactly its depth: the cut of a shell
  // that deep is measured well, where a bare touch would be lost in the voxels.
  const double shell = 0.5 * spacing_mm_;
  if (shell_depths_[tool_] == nullptr) return r;
  const CutDepth& depths = *shell_depths_[tool_];
  Vec3 where;
  OverlapResult there;
  const auto field = [&](Vec3 x) {
    there = overlap_.measure(bone, shells_[tool_], x, axis_, known_);
    where = x;
    Clearance c;
    const double pressed = length(there.area_mm2);
    if (!(pressed > 0)) {
      // No voxel with bone is touched: half a voxel further on it still does not reach the burr. Or bone on all sides
      // alike: then back to where it came from.
      c.value_mm = there.bone_mm3 > 0 ? -shell : shell;
      c.gradient = c.normal = there.bone_mm3 > 0 ? normalized(proxy_.position_mm() - at) : Vec3{0, 0, 1};
      if (length(c.normal) == 0) c.gradient = c.normal = axis_;
      return c;
    }
    c.normal = there.area_mm2 * (-1 / pressed);
    const double cosine = -dot(c.normal, axis_), flat_depth = depths(there.sharp_mm3, cosine);
    // In a hollow of the burr's own shape there is more surface for the same volume than on flat bone, where the depth
    // is twice the mean thickness of what lies in the shell: there it goes by that thickness.
    const double hollow = 3 / std::max(there.surface_mm2, 1e-9), depth = std::min(flat_depth, hollow * there.sharp_mm3);
    c.value_mm = shell - depth;
    double share = 1;
    if (!(held_ == Vec3{})) {
      // The slot takes what presses across it. What is left presses in its plane, by its share of the bone.
      const Vec3 flat = c.normal - held_ * dot(c.normal, held_);
      share = length(flat);
      c.value_mm = shell - depth * share;
      c.normal = share > kFlatShare ? flat / share : axis_;
    }
    // And it grows faster: the step out is then the shorter.
    const double full = depth < flat_depth ? hollow * pressed : pressed / depths.area_mm2(there.sharp_mm3, cosine),
                 slope = full * share * share;
    c.gradient = c.normal * (depth > 0.2 * shell ? std::clamp(slope, 0.5, 50.0) : 1.0);
    return c;
  };
  GodObjectParams g;
  g.friction = pose.pedal != 0 ? 0 : params_.friction;
  g.static_friction = pose.pedal != 0 ? 0 : params_.static_friction;
  g.feature_mm = 0.5 * spacing_mm_;
  g.tolerance_mm = 1e-2 * spacing_mm_;
  g.evaluations = spacing_mm_ < 0.3 ? 8 : 16;  // 100 to 200 us at most
  // A blade's shell meets ten times a burr's voxels; what is left over is done in the next tick.
  if (instrument_library()[tool_].kind == InstrumentKind::saw) g.evaluations = 4;
  if (!(held_ == Vec3{}) && proxy_.placed()) proxy_.carry(held_ * dot(at - proxy_.position_mm(), held_));
  const GodObject::Answer answer = proxy_.update(field, at, g);
  const Vec3 offset = answer.proxy_mm - at;
  r.shown_offset_mm = offset;
  Vec3 normal = answer.normal;
  if (!answer.contact) {
    // All that was looked at may be used up just off the surface: it is held all the same.
    if (!(length(offset) > g.tolerance_mm)) return r;
    const Clearance c = field(answer.proxy_mm);
    if (!(c.value_mm < kOnIt * shell) || !(dot(offset, c.normal) > 0)) return r;
    normal = c.normal;
  }
  r.depth_mm = length(offset);
  cutting_ = pose.pedal != 0;
  if (cutting_) r.depth_mm = std::min(r.depth_mm, teeth(bone, answer.proxy_mm, -offset, normal));
  const double law = params_.force_n(r.depth_mm);
  r.force_n = normalized(offset) * law;
  r.stored_mj = params_.energy_mj(r.depth_mm);
  // A burr that turns has no friction: all walls that it rests on together push against the hand, and all of that
  // presses on it.
  r.normal = cutting_ ? normalized(offset) : normal;
  r.normal_force_n = std::max(0.0, dot(r.force_n, r.normal));
  if (!(where == answer.proxy_mm)) static_cast<void>(field(answer.proxy_mm));
  if (const double pressed = length(there.area_mm2); pressed > 0) {
    r.torque_n_mm = cross(axis_, there.area_foot_mm3) * (-r.normal_force_n / pressed);
  }
  r.bone_mm3 = there.bone_mm3;
  r.immersed = static_cast<std::uint32_t>(std::min(4e9, std::ceil(there.bone_mm3 / bone.frame().voxel_volume_mm3())));
  return r;
}

// The teeth reach a little beyond where the proxy rests, towards the hand but never past it; into what they take there
// it sinks. Where there is nothing to take so near, they reach farther. Tells how deep the hand is in bone by what the
// teeth have before them: a shell that rests on bone beside the burr is no reason to press where nothing is left to
// take.
double BurrProxy::teeth(const BrickGrid& bone, Vec3 proxy_mm, Vec3 to_hand_mm, Vec3 normal) noexcept {
  const double far = length(to_hand_mm), usual = kTeeth * spacing_mm_,
               reach = std::min(far, std::max(teeth_mm_, usual));
  const Vec3 at = far > 0 ? proxy_mm + to_hand_mm * (reach / far) : proxy_mm;
  const OverlapResult& there = head_.measure(bone, known_, tool_, at, axis_, true);
  const bool nothing = known_ != nullptr && !(there.sharp_mm3 > 0);
  teeth_mm_ = nothing ? reach + 0.25 * spacing_mm_ : 0;
  if (known_ == nullptr) return far;
  return kTeethTell * head_cut_depth(tool_)(there.sharp_mm3, -dot(normal, axis_)) + (far - reach);
}

Cut BurrProxy::cut(const BrickGrid&) noexcept {
  return cutting_ ? head_.cut() : Cut{};
}

}  // namespace osteo::inline simulation
