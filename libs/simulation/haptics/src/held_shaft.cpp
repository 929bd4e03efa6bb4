#include "osteo/simulation/haptics/detail/held_shaft.h"

#include <algorithm>
#include <cmath>

namespace osteo::inline simulation {
namespace {

constexpr int kMaxEvaluations = 5;
// So far around the shaft bone is looked for, in stretches of about so much of it, each again when it has moved so far
// or after so many calls.
constexpr double kLookMm = 1.5, kStretchMm = 4, kAgainMm = 0.5;
constexpr int kAgainCalls = 64;
// With less bone before its surface than this share of a voxel's face, what is met is a crumb.
constexpr double kCrumb = 0.2;
// Of the bone at its surface so much must be pushed one way for it to have a direction.
constexpr double kOneWay = 0.1;
// Of a push the share that lies in a slot's plane and has a direction; and how little the depth may seem to change
// there.
constexpr double kFlatShare = 0.01, kLeastSlope = 0.1;
// So that small doubts about where a rim faces do not make it wander: a shaft has more.
constexpr double kFriction = 0.05;

RoundCone grown(RoundCone shape, double by_mm) {
  shape.start_radius_mm += by_mm;
  shape.end_radius_mm += by_mm;
  return shape;
}

// Part of it: its balls from `from_mm` to `to_mm` of its axis.
RoundCone stretch_of(const RoundCone& shape, double from_mm, double to_mm) {
  return {shape.start_mm + from_mm, to_mm - from_mm, shape.radius_at_mm(from_mm), shape.radius_at_mm(to_mm)};
}

bool same(const RigidTransform& a, const RigidTransform& b) {
  return a.rotation == b.rotation && a.shift_mm == b.shift_mm;
}
bool same(const RoundCone& a, const RoundCone& b) {
  return a.start_mm == b.start_mm && a.length_mm == b.length_mm && a.start_radius_mm == b.start_radius_mm &&
         a.end_radius_mm == b.end_radius_mm;
}

}  // namespace

void HeldShaft::forget() noexcept {
  proxy_.forget();
  offset_mm_ = torque_mm_ = {};
}

// Other bodies, or elsewhere, or another shaft: nothing is known of what is near.
void HeldShaft::take(std::span<const Body> bodies, const RoundCone& shaft) noexcept {
  const std::size_t n = std::min(bodies.size(), kMaxBodies);
  bool known = n == count_ && same(shaft, shape_);
  for (std::size_t b = 0; b < n; ++b) {
    known = known && bodies_[b].name == bodies[b].name && same(bodies_[b].world_from_body, bodies[b].world_from_body);
    bodies_[b] = bodies[b];
  }
  count_ = n;
  shape_ = shaft;
  stretch_count_ = std::clamp(static_cast<int>(std::ceil(shaft.length_mm / kStretchMm)), 1, kMaxStretches);
  if (!known) stretches_.fill({});
}

// How far any of the shaft has moved.
double HeldShaft::moved_mm(const Stretch& since, Vec3 at_mm, Vec3 axis) const noexcept {
  return length(at_mm - since.at_mm) + (shape_.start_mm + shape_.length_mm) * length(axis - since.axis);
}

// At one stretch in a call, in turn, so that no call costs much.
void HeldShaft::look(const RoundCone& shaft, Vec3 at_mm, Vec3 axis) noexcept {
  const auto n = static_cast<std::size_t>(stretch_count_), all = n * count_;
  bool looked = false;
  std::size_t chosen = next_;
  for (std::size_t k = 0; k < all; ++k) {
    const std::size_t one = (next_ + k) % all;
    Stretch& s = stretches_[one / n][one % n];
    ++s.ago;
    if (looked || (s.looked_mm >= 0 && s.ago < kAgainCalls && moved_mm(s, at_mm, axis) < kAgainMm)) continue;
    const Body& body = bodies_[one / n];
    const double from = shaft.length_mm * static_cast<double>(one % n) / stretch_count_,
                 to = shaft.length_mm * static_cast<double>(one % n + 1) / stretch_count_;
    // Grains only take bone away.
    const OverlapResult o = overlap_.measure(*body.bone, grown(stretch_of(shaft, from, to), kLookMm),
                                             body.body_from_world(at_mm), body.body_from_world.rotation * axis);
    s = {at_mm, axis, kLookMm, 0, o.bone_mm3 > 0};
    looked = true;
    chosen = one;
  }
  if (all > 0) next_ = (chosen + 1) % all;
}

// From the first stretch to the last that may be near bone: elsewhere there is none.
OverlapResult HeldShaft::measure(const RoundCone& shaft, double grown_mm, Vec3 at_mm, Vec3 axis) noexcept {
  OverlapResult sum;
  for (std::size_t b = 0; b < count_; ++b) {
    int first = stretch_count_, last = -1;
    for (int i = 0; i < stretch_count_; ++i) {
      const Stretch& s = stretches_[b][static_cast<std::size_t>(i)];
      if (!s.near && moved_mm(s, at_mm, axis) + grown_mm <= s.looked_mm) continue;
      first = std::min(first, i);
      last = i;
    }
    if (last < 0) continue;
    const Body& body = bodies_[b];
    const RoundCone part =
        stretch_of(shaft, shaft.length_mm * first / stretch_count_, shaft.length_mm * (last + 1) / stretch_count_);
    const OverlapResult o = overlap_.measure(*body.bone, grown(part, grown_mm), body.body_from_world(at_mm),
                                             body.body_from_world.rotation * axis, body.known);
    sum.bone_mm3 += o.bone_mm3;
    sum.sharp_mm3 += o.sharp_mm3;
    sum.surface_mm2 += o.surface_mm2;
    sum.area_mm2 += body.world_from_body.rotation * o.area_mm2;
    sum.area_foot_mm3 += body.world_from_body.rotation * o.area_foot_mm3;
  }
  return sum;
}

HeldShaft::Answer HeldShaft::follow(std::span<const Body> bodies, const RoundCone& shaft, double shell_mm, Vec3 at_mm,
                                    Vec3 axis, Vec3 across) noexcept {
  Answer a;
  if (!std::isfinite(dot(at_mm, at_mm)) || !std::isfinite(dot(axis, axis))) {
    forget();
    return a;
  }
  take(bodies, shaft);
  double h = 1e9;
  for (std::size_t b = 0; b < count_; ++b) h = std::min(h, bodies_[b].bone->frame().spacing_mm.x);
  const bool first = !proxy_.placed();
  const double moved =
      first ? 0 : length(at_mm - last_at_mm_) + (shaft.start_mm + shaft.length_mm) * length(axis - last_axis_);
  last_at_mm_ = at_mm;
  last_axis_ = axis;
  const bool slot = !(across == Vec3{});
  if (slot && !first) proxy_.carry(across * dot(at_mm - proxy_.position_mm(), across));
  look(shaft, first ? at_mm : proxy_.position_mm(), axis);
  // Held by nothing: all that the shaft can touch on its way is looked at once.
  if (first || offset_mm_ == Vec3{}) {
    ++a.evaluations;
    if (!(measure(shaft, shell_mm + moved, first ? at_mm : proxy_.position_mm(), axis).bone_mm3 > 0)) {
      proxy_.place(at_mm);
      return a;
    }
  }
  OverlapResult there;
  bool one_way = true;
  const auto field = [&](Vec3 x) {
    there = measure(shaft, shell_mm, x, axis);
    one_way = true;
    Clearance c;
    c.value_mm = shell_mm;
    c.gradient = c.normal = {0, 0, 1};
    const double surface = there.surface_mm2, pressed = length(there.area_mm2);
    if (!(surface > 0) || !(there.sharp_mm3 > 0)) return c;
    // Twice the mean thickness of what lies in the shell is how deep a ball's cap is, and no less than how deep a
    // cylinder's side: it depends neither on how much of the bone there is beside the shaft nor on how thin it is.
    const double crumb = std::min(1.0, surface / (kCrumb * h * h)), depth = 2 * there.sharp_mm3 / surface * crumb;
    c.value_mm = shell_mm - depth;
    one_way = pressed > kOneWay * surface;
    if (one_way && slot) {
      // The slot takes what presses across it. What is left presses in its plane, by its share.
      const Vec3 normal = there.area_mm2 * (-1 / pressed), flat = normal - across * dot(normal, across);
      const double share = length(flat);
      c.value_mm = shell_mm - depth * share;
      c.normal = share > kFlatShare ? flat / share : axis;
      c.gradient = c.normal * std::clamp(1.5 * pressed / surface * share * share, kLeastSlope, 1.5);
    } else if (one_way) {
      c.normal = there.area_mm2 * (-1 / pressed);
      c.gradient = c.normal * std::clamp(1.5 * pressed / surface, 0.5, 1.5);
    } else if (c.value_mm < 0) {
      // Bone on both sides: back to where it came from.
      c.normal = normalized(proxy_.position_mm() - at_mm);
      if (length(c.normal) == 0) c.normal = axis;
      c.gradient = c.normal;
    } else if (length(there.area_mm2) > 0) {
      c.gradient = c.normal = there.area_mm2 * (-1 / pressed);
    }
    return c;
  };
  if (first) {
    const Clearance c = field(at_mm);
    ++a.evaluations;
    if (c.value_mm < 0 && !one_way) return a;
  }
  GodObjectParams g;
  g.feature_mm = std::max(shell_mm, 0.25 * h);
  g.tolerance_mm = 2e-2 * h;
  g.friction = g.static_friction = kFriction;
  g.evaluations = kMaxEvaluations - a.evaluations;
  g.travel_mm = std::max(moved + kReturnMm, g.feature_mm);
  const GodObject::Answer answer = proxy_.update(field, at_mm, g);
  a.evaluations += answer.evaluations;
  Vec3 offset = answer.proxy_mm - at_mm;
  if (!answer.contact && !(length(offset) > g.tolerance_mm)) {
    proxy_.place(at_mm);
    offset = {};
  }
  // Where a voxel's step puts it aside at once, it gets there in a few calls.
  const Vec3 change = offset - offset_mm_;
  const double most = 2 * moved + kReturnMm, n = length(change);
  offset_mm_ = n > most ? offset_mm_ + change * (most / n) : offset;
  if (offset_mm_ == Vec3{}) {
    torque_mm_ = {};
    return a;
  }
  // Off the bone for a moment it is pulled as it was.
  if (const double pressed = length(there.area_mm2); pressed > 0)
    torque_mm_ = cross(axis, there.area_foot_mm3) * (-1 / pressed);
  a.offset_mm = offset_mm_;
  a.torque_mm = torque_mm_;
  return a;
}

}  // namespace osteo::inline simulation
