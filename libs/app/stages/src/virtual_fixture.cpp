#include "virtual_fixture.h"

#include "osteo/core/base/error.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/data/json_vec.h"
#include "osteo/core/data/points_io.h"

namespace osteo::inline app {

StageInfo VirtualFixtureStage::info() {
  return {.name = "virtual-fixture",
          .version = 1,
          .synopsis = "where a curve holds a moving hand, and with what force",
          .description =
              "Runs the curve constraint over a path, point after point, as the haptic thread would: the place on the "
              "curve that minimises "
              "distance "
              "plus a penalty on the way from the last place, found exactly, and the spring's force.",
          .inputs = {{"curve",
                      {DataKind::source},
                      "the curve's points in order: a text file, or .mrk.json or .fcsv of 3D Slicer"},
                     {"path", {DataKind::source}, "the hand's positions in order, likewise"}},
          .outputs = {{"places", {DataKind::document}, "one entry a position, in JSON"}},
          .references = {"D. Morris, Haptics and Physical Simulation for Virtual Bone Surgery, 2006, section 6.2"},
          .example = "osteo virtual-fixture incision.csv hand.csv places.json --arc-penalty 0.3"};
}

std::vector<Data> VirtualFixtureStage::run(const Params& p, std::span<const Data> inputs, const Context& context) {
  if (p.release_mm < p.engage_mm)
    throw Error(ExitCode::usage, "--release-mm is smaller than --engage-mm: the constraint would flutter");
  const std::vector<Vec3> points = load_points(std::get<Source>(inputs[0]).path),
                          path = load_points(std::get<Source>(inputs[1]).path);
  const Curve curve(points);
  CurveConstraint constraint(curve, p);
  Json places = Json::list();
  double farthest = 0, jump = 0, before = 0;
  bool held = false;
  for (const Vec3 x : path) {
    const auto a = constraint.update(x);
    places.push_back({{"engaged", a.engaged},
                      {"place_mm", json_of(a.place.point_mm)},
                      {"arc_mm", a.place.arc_mm},
                      {"distance_mm", a.place.distance_mm},
                      {"force_n", json_of(a.force_n)}});
    farthest = std::max(farthest, a.place.distance_mm);
    if (held && a.engaged) jump = std::max(jump, std::abs(a.place.arc_mm - before));
    held = a.engaged;
    before = a.place.arc_mm;
  }
  context.report("curve_points", static_cast<std::int64_t>(points.size()));
  context.report("curve_length_mm", curve.length_mm());
  context.report("positions", static_cast<std::int64_t>(path.size()));
  context.report("farthest_mm", farthest);
  context.report("largest_step_along_mm", jump);
  Json j;
  j["curve_length_mm"] = curve.length_mm();
  j["places"] = std::move(places);
  context.progress(1.0);
  return {Document{j.dump(1) + "\n"}};
}

}  // namespace osteo::inline app
