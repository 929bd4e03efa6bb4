#include <cmath>
#include <optional>

#include "osteo/core/base/error.h"
#include "osteo/core/base/portable_math.h"
#include "osteo/geometry/grid/brick_places.h"
#include "osteo/session/scene/rehearsal.h"

namespace osteo::inline session {

Script make_default_script(const World& world, bool left, int tool, double seconds) {
  // Centre of the bone, from a brick's middle each: near enough for a starting point.
  const BrickGrid& bone = world.bodies().front().body->bone;
  Vec3 sum{};
  double weight = 0;
  for (std::uint32_t b = 0; b < bone.brick_count(); ++b) {
    sum += middle_of_brick_mm(bone, b);
    weight += 1;
  }
  if (weight == 0) throw Error(ExitCode::failed, "the case holds no bone");
  // The mastoid of most heads lies behind and below the middle of their bone.
  const Vec3 centre = sum / weight + Vec3{0, 20, -22};
  const Vec3 out{left ? 1.0 : -1.0, 0, 0};
  // The outside of the first bone met that is followed by 20 mm of nothing (air cells, the ear canal and a gap to a
  // head holder are narrower and wider); try rays around the centre until one meets bone.
  std::optional<Vec3> entry;
  const auto& f = bone.frame();
  const double longest = length({f.dims[0] * f.spacing_mm.x, f.dims[1] * f.spacing_mm.y, f.dims[2] * f.spacing_mm.z});
  for (int ring = 0; ring < 40 && !entry; ++ring) {
    for (int a = 0; a < (ring == 0 ? 1 : 8) && !entry; ++a) {
      const portable::SinCos turn = portable::sin_cos_turns(a / 8.0);
      const Vec3 from = centre + Vec3{0, 2.0 * ring * turn.cos, 2.0 * ring * turn.sin};
      double bone_end = -1;
      for (double s = 0; s < longest; s += 0.25) {
        if (world.nearest(from + out * s) >= 0.5F) {
          bone_end = s;
        } else if (bone_end >= 0 && s - bone_end > 20) {
          break;
        }
      }
      if (bone_end >= 0) entry = from + out * bone_end;
    }
  }
  if (!entry)
    throw Error(ExitCode::failed,
                "no bone was found on the patient's " + std::string(left ? "left" : "right") + " side",
                "write a script of strokes for this case");

  const double radius = instrument_library()[static_cast<std::size_t>(tool)].head.largest_radius_mm();
  Script script;
  script.tool = tool;
  script.axis = normalized(out + Vec3{0, 0.8, 0.6});
  const Vec3 u{0, 1, 0}, v{0, 0, 1};
  script.waypoints.push_back({0, *entry + out * (radius + 6), false});
  script.waypoints.push_back({0.04 * seconds, *entry + out * (radius + 1), true});
  const double first = 0.06 * seconds, last = 0.94 * seconds, step = 0.05;
  for (double t = first; t < last; t += step) {
    const double share = (t - first) / (last - first);
    // Turns that open and close between the middle and the rim, a little deeper each time.
    const double rim = std::min(7.0, 3 + seconds / 15), sway = std::abs(std::fmod(0.25 * (t - first), 2.0) - 1);
    const double circle = rim * (1 - sway);
    const portable::SinCos turn = portable::sin_cos_turns(1.2 * (t - first));
    const double depth = 3 + std::min(9.0, 0.12 * seconds + 1) * share;
    script.waypoints.push_back(
        {t, *entry + out * (radius - depth) + u * (circle * turn.cos) + v * (circle * turn.sin), true});
  }
  script.waypoints.push_back({last + step, *entry + out * (radius + 2), false});
  script.waypoints.push_back({seconds, *entry + out * (radius + 8), false});
  return script;
}

}  // namespace osteo::inline session
