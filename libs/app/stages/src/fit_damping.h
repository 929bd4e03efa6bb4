// The stage that finds damping from a measured motion.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "osteo/core/stage/stage.h"
#include "tissue.h"

namespace osteo::inline app {

struct FitDampingParams {
  std::string load;
  std::array<double, 3> at_mm{}, along{0, 0, 1};
  TimeMethod method = TimeMethod::explicit_steps;
  double step_ms = 10;
  double density_kg_m3 = 1000;
  bool fit_stiffness = true;
  double release_s = 0;
  bool fit_release = true;
};
struct FitDampingStage {
  using Params = FitDampingParams;
  static void describe(Params& p, auto& visit) {
    visit({"load", "name of the load that plucked the body (empty: the first); it ends when the body is let go"},
          p.load);
    visit({"at_mm",
           "where it was measured, LPS: the nearest point of the mesh; says nothing for a table with a column point",
           "mm", -1e6, 1e6},
          p.at_mm);
    visit({"along", "direction of a column u_mm", "", -1e6, 1e6}, p.along);
    visit({"method", "steps that the damping is for, as of simulate"}, p.method);
    visit({"step_ms", "implicit: length of a step, as simulate will have it", "ms", 1e-4, 1e5}, p.step_ms);
    visit({"density_kg_m3", "density of the tissue", "kg/m3", 1, 30000}, p.density_kg_m3);
    visit(
        {"fit_stiffness", "one factor on all of the body's stiffness too; without, the problem's is taken to be right"},
        p.fit_stiffness);
    visit(
        {"release_s", "when it was let go, by the table's clock; what was measured before is not used", "s", -1e6, 1e6},
        p.release_s);
    visit({"fit_release", "fit the moment of release, too, within a quarter of a swing"}, p.fit_release);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo::inline app
