// What speaks against a script before it runs.
#include <algorithm>
#include <cmath>

#include "osteo/core/base/param.h"
#include "osteo/session/scene/rehearsal.h"

namespace osteo::inline session {
namespace {

constexpr double kFarMm = 50;  // a burr that never comes this near to bone's box drills nothing

struct Box {
  Vec3 lo{1e300, 1e300, 1e300}, hi{-1e300, -1e300, -1e300};
  void add(Vec3 p) {
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], p[a]);
      hi[a] = std::max(hi[a], p[a]);
    }
  }
  [[nodiscard]] double distance(Vec3 p) const {
    Vec3 d;
    for (std::size_t a = 0; a < 3; ++a) d[a] = std::max({lo[a] - p[a], p[a] - hi[a], 0.0});
    return length(d);
  }
};

Box box_of(const World& world) {
  Box box;
  for (const PlacedBody& placed : world.bodies()) {
    const BrickGrid& bone = placed.body->bone;
    for (std::uint32_t b = 0; b < bone.brick_count(); ++b) {
      const Ijk o = bone.brick_coordinate(b);
      for (int c = 0; c < 8; ++c)
        box.add(placed.world_from_body(bone.frame().world_from_index(
            {8.0 * (o.i + (c & 1)) - 0.5, 8.0 * (o.j + (c >> 1 & 1)) - 0.5, 8.0 * (o.k + (c >> 2)) - 0.5})));
    }
  }
  return box;
}

// How near the way between the waypoints comes, all lengths taken so many times.
double nearest_mm(const Script& script, const Box& box, double times) {
  double best = 1e300;
  for (std::size_t w = 0; w < script.waypoints.size(); ++w) {
    const Vec3 a = script.waypoints[w].at_mm * times,
               b = script.waypoints[std::min(w + 1, script.waypoints.size() - 1)].at_mm * times;
    for (int s = 0; s < 16; ++s) best = std::min(best, box.distance(a + (b - a) * (s / 16.0)));
  }
  return best;
}

}  // namespace

std::vector<std::string> warnings_about(const Script& script, const World& world, bool dust, bool laid) {
  std::vector<std::string> warnings;
  const Box box = box_of(world);
  const double near = nearest_mm(script, box, 1), size = length(box.hi - box.lo);
  double extent = 0;
  for (const auto& w : script.waypoints)
    extent = std::max({extent, std::abs(w.at_mm.x), std::abs(w.at_mm.y), std::abs(w.at_mm.z)});
  if (extent < 0.01 * size && extent > 0 && nearest_mm(script, box, 1000) < kFarMm) {
    warnings.push_back("all strokes lie within " + format_number(std::round(extent * 1000) / 1000) +
                       " mm of the origin: are the script's points in metres? They are taken as millimetres");
  } else if (near > kFarMm) {
    warnings.push_back("the burr never comes nearer than " + format_number(std::round(near)) +
                       " mm to the bone: points are LPS mm of the case, whose bone lies between " +
                       format_number(std::round(box.lo.x)) + ", " + format_number(std::round(box.lo.y)) + ", " +
                       format_number(std::round(box.lo.z)) + " and " + format_number(std::round(box.hi.x)) + ", " +
                       format_number(std::round(box.hi.y)) + ", " + format_number(std::round(box.hi.z)));
  }
  const auto cleans = [](const Script::TimedAction& d) { return row_of(d.action).moves_dust; };
  const auto begins = [](const Script::TimedAction& d) {
    return d.action.is(ActionKind::simulate) && d.action.item == static_cast<std::uint32_t>(Simulated::dust) &&
           d.action.values[0] > 0;
  };
  dust = dust || std::any_of(script.actions.begin(), script.actions.end(), begins);
  if (!dust && std::any_of(script.actions.begin(), script.actions.end(), cleans))
    warnings.emplace_back(
        "the script sucks off dust, pours water or turns the patient, but there is no dust: add --dust");
  if (!dust && laid)
    warnings.emplace_back("how the patient lies moves dust and water alone, and there are none: add --dust");
  return warnings;
}

}  // namespace osteo::inline session
