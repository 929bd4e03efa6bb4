// Contact of a plate in the hand with bone.
#include <algorithm>
#include <cmath>

#include "osteo/geometry/grid/sampler.h"
#include "osteo/simulation/haptics/haptic_scene.h"

namespace osteo::inline simulation {
ContactResult plate_contact(const PlateInHand& plate, const RigidTransform& world_from_plate,
                            std::span<const HapticScene::Item> items, const ContactParams& params) noexcept {
  constexpr double kReachMm = 4;    // farther than that inside bone a sample knows no way out
  constexpr double kFullMm = 0.05;  // from this depth on a sample counts with its whole area
  ContactResult r;
  if (!std::isfinite(dot(world_from_plate.shift_mm, world_from_plate.shift_mm))) return r;
  Vec3 push{}, moment{};
  double touching = 0;
  for (const HapticScene::Item& item : items) {
    const RigidTransform own = item.body_from_world * world_from_plate;
    if (!item.bone->near(own.shift_mm, plate.radius_mm)) continue;
    const BrickGrid& bone = item.bone->bone();
    const Frame& frame = bone.frame();
    const double h = frame.spacing_mm.x, step = 1;
    const Mat3 to_index = transposed(frame.direction);
    for (const PlateSample& s : plate.samples) {
      Vec3 x = frame.index_from_world(own(s.at_mm));
      float before = linear_at(bone, x);
      if (before < 0.5F) continue;
      const Vec3 back = to_index * (own.rotation * s.outwards) * -step;
      double way = 0;
      bool out = false;
      for (way = step; way * h <= kReachMm; way += step) {
        x += back;
        const float now = linear_at(bone, x);
        if (now < 0.5F) {
          // Between here and half a step back, or in the half before.
          const float middle = linear_at(bone, x - back * 0.5);
          const bool last_half = middle >= 0.5F;
          const float above = last_half ? middle : before, below = last_half ? now : middle;
          way -= 0.5 * step * (static_cast<double>((0.5F - below) / (above - below)) + (last_half ? 0 : 1));
          out = true;
          break;
        }
        before = now;
      }
      ++r.immersed;
      if (!out) continue;
      const double depth = way * h, area = s.area_mm2 * std::min(1.0, depth / kFullMm);
      const Vec3 outwards = world_from_plate.rotation * s.outwards;
      push -= outwards * (depth * area);
      moment += cross(world_from_plate.rotation * s.at_mm, outwards) * (-depth * area);
      touching += area;
    }
  }
  // A corner alone is a twentieth of the underside, so that its push grows from nothing.
  const double share = 1 / std::max(touching, 0.05 * plate.side_mm2);
  const double depth = length(push) * share;
  if (!(depth > 0)) return r;
  r.normal = push / length(push);
  r.depth_mm = depth;
  r.normal_force_n = params.force_n(depth);
  r.force_n = r.normal * r.normal_force_n;
  r.torque_n_mm = moment * (share * r.normal_force_n / depth);
  r.shown_offset_mm = r.normal * depth;
  return r;
}

}  // namespace osteo::inline simulation
