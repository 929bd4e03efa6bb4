#include "osteo/simulation/haptics/detail/held_shaft.h"

#include <algorithm>
#include <cmath>

namespace osteo::inline simulation {
namespace {

constexpr int kMostEvaluations = 8;
// A way no longer than this is looked at as a whole.
constexpr double kOneLookMm = 8;
// With less bone before its surface than this share of a voxel's face, what is met is a crumb.
constexpr double kCrumb = 0.2;
// Of the bone at its surface so much must be pushed one way for it to have a direction.
constexpr double kOneWay = 0.1;
// So that small doubts about where a rim faces do not make it wander: a shaft has more.
constexpr double kFriction = 0.05;
// No farther off the surface than this share of its shell it rests on it.
constexpr double kOnIt = 0.5;

RoundCone grown(RoundCone shape, double by_mm) {
  shape.start_radius_mm += by_mm;
  shape.end_radius_mm += by_mm;
  return shape;
}

}  // namespace

HeldShaft::Answer HeldShaft::follow(const BrickGrid& bone, const Grains* known, const RoundCone& shaft, double shell_mm,
                                    Vec3 at_mm, Vec3 axis) noexcept {
  Answer a;
  if (!std::isfinite(dot(at_mm, at_mm))) {
    forget();
    return a;
  }
  const double h = bone.frame().spacing_mm.x;
  // Away from bone: all that the shaft can touch on its way is looked at once.
  const double way = proxy_.placed() ? length(at_mm - proxy_.position_mm()) : 0;
  if (!touched_ && way < kOneLookMm) {
    const Vec3 from = proxy_.placed() ? proxy_.position_mm() : at_mm;
    ++a.evaluations;
    if (!(overlap_.measure(bone, grown(shaft, shell_mm + way), from, axis, known).bone_mm3 > 0)) {
      proxy_.place(at_mm);
      return a;
    }
  }
  const RoundCone shell = grown(shaft, shell_mm);
  OverlapResult there;
  Vec3 where;
  bool one_way = true;
  const auto field = [&](Vec3 x) {
    there = overlap_.measure(bone, shell, x, axis, known);
    where = x;
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
    if (one_way) {
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
  if (!proxy_.placed()) {
    const Clearance c = field(at_mm);
    ++a.evaluations;
    if (c.value_mm < 0 && !one_way) return a;
  }
  GodObjectParams g;
  g.feature_mm = std::max(shell_mm, 0.25 * h);
  g.tolerance_mm = 2e-2 * h;
  g.friction = g.static_friction = kFriction;
  g.evaluations = kMostEvaluations - a.evaluations;
  const GodObject::Answer answer = proxy_.update(field, at_mm, g);
  a.evaluations += answer.evaluations;
  a.offset_mm = answer.proxy_mm - at_mm;
  a.contact = touched_ = answer.contact;
  if (!a.contact && !(length(a.offset_mm) > g.tolerance_mm)) return a;
  if (!a.contact || !(where == answer.proxy_mm)) {
    const Clearance c = field(answer.proxy_mm);
    ++a.evaluations;
    // All that was looked at may be used up just off the surface: it is held all the same.
    a.contact = touched_ = a.contact || (c.value_mm < kOnIt * shell_mm && dot(a.offset_mm, c.normal) > 0);
    if (!a.contact) return a;
  }
  if (const double pressed = length(there.area_mm2); pressed > 0)
    a.torque_mm = cross(axis, there.area_foot_mm3) * (-1 / pressed);
  return a;
}

}  // namespace osteo::inline simulation
