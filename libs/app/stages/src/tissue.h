// The stages of deformable tissue.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "osteo/core/stage/stage.h"
#include "osteo/simulation/tissue/fem.h"

namespace osteo::inline app {

/// ElasticLaw, and to choose none.
enum class LawChoice : int { automatic, linear, stvk, neo_hooke, neo_hooke_split, corotated };
[[nodiscard]] constexpr std::array<std::string_view, 6> enum_names(LawChoice) {
  return {"auto", "linear", "stvk", "neo_hooke", "neo_hooke_split", "corotated"};
}
enum class OrderChoice : int { automatic, t4, t10, t4_mean };
[[nodiscard]] constexpr std::array<std::string_view, 4> enum_names(OrderChoice) {
  return {"auto", "t4", "t10", "t4_mean"};
}

struct FemParams {
  LawChoice law = LawChoice::automatic;
  OrderChoice order = OrderChoice::automatic;
  std::string load;
  int load_steps = 1;
  double tolerance = 1e-10;
};
struct FemStage {
  using Params = FemParams;
  static void describe(Params& p, auto& visit) {
    visit({"law",
           "linear: small strains; stvk: Hooke's law in Green's strain; neo_hooke: large strains; neo_hooke_split: "
           "shape and volume apart, "
           "as CalculiX has it; corotated: Hooke's law seen from where each element has turned to, finite for what is "
           "inside out; "
           "auto: neo_hooke, or what the problem says"},
          p.law);
    visit(
        {"order",
         "t4: linear tetrahedra; t10: quadratic; t4_mean: linear ones whose change of volume is the mean of a patch, "
         "for Poisson's "
         "ratios near a half; "
         "auto: what the problem says, else quadratic, but for large meshes whose Poisson's ratio lets linear ones do"},
        p.order);
    visit({"load", "name of the load (empty: the first)"}, p.load);
    visit({"load_steps", "equal steps in which the load grows", "", 1, 1000}, p.load_steps);
    visit({"tolerance", "residual force over load", "", 1e-14, 1e-2}, p.tolerance);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

struct CalibrateParams {
  std::string fit;
  LawChoice law = LawChoice::automatic;
  OrderChoice order = OrderChoice::automatic;
  int grid_x = 1, grid_y = 1, grid_z = 1;
  bool shared_grid = true;
  bool blind = false;
  double pull = 0.02;
  double smooth = 0.05;
  int starts = 1;
  int samples = 0;
  int iterations = 60;
  bool check_truth = false;
  bool find_pose = false;
  int max_points = 5000;
};
struct CalibrateStage {
  using Params = CalibrateParams;
  static void describe(Params& p, auto& visit) {
    visit({"fit",
           "names of the loads to fit, like 'A,B' (empty: the first; measured: all that were); the others show how it "
           "carries over"},
          p.fit);
    visit({"law", "material law of the true solution, by finite elements"}, p.law);
    visit({"order", "order of the true solution's tetrahedra"}, p.order);
    visit({"grid_x", "points of the map of stiffness along x (1, 1, 1: one material)", "", 1, 20}, p.grid_x);
    visit({"grid_y", "along y", "", 1, 20}, p.grid_y);
    visit({"grid_z", "along z", "", 1, 20}, p.grid_z);
    visit({"shared_grid", "one map for all kinds of constraint, and one factor a kind; else a map for each kind"},
          p.shared_grid);
    visit({"blind", "the model does not know the problem's regions: a map has to find them"}, p.blind);
    visit({"pull", "towards the closed form: what the loads do not tell stays there", "", 0, 10}, p.pull);
    visit(
        {"smooth", "what differences in a shared map cost; borders between tissues cost less than ripples", "", 0, 10},
        p.smooth);
    visit({"starts", "starting points of the fit; the best result counts", "", 1, 3}, p.starts);
    visit({"samples", "coarse search before: so many mixtures are tried, the best is a start too", "", 0, 10000},
          p.samples);
    visit({"iterations", "maximum iterations of the trust region", "", 1, 1000}, p.iterations);
    visit({"check_truth",
           "solve finite elements half as large too (eight times as many): how far the truth is off itself"},
          p.check_truth);
    visit({"find_pose",
           "measured: each file may lie elsewhere by a small rigid motion, which is found too; else it is in the "
           "mesh's frame"},
          p.find_pose);
    visit({"max_points", "measured: of a larger cloud so many points are drawn at random", "", 20, 100000},
          p.max_points);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

enum class TimeMethod : int { explicit_steps, implicit_steps };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(TimeMethod) {
  return {"explicit", "implicit"};
}

struct SimulateParams {
  std::string load;
  TimeMethod method = TimeMethod::explicit_steps;
  double seconds = 3;
  double density_kg_m3 = 1000;
  double damping_per_s = 60;
  double min_step_ms = 0;
  double step_ms = 10;
  bool until_rest = true;
  double tool_radius_mm = 0;
  std::array<double, 3> tool_from_mm{}, tool_to_mm{};
  double tool_stiffness_n_per_mm = 0.3;
  double obstacle_stiffness_n_per_mm = 1;
};
struct SimulateStage {
  using Params = SimulateParams;
  static void describe(Params& p, auto& visit) {
    visit({"load", "name of the load (empty: the first; none: no load)"}, p.load);
    visit({"method", "explicit: many quick steps of a certified length; implicit: few long ones, for stiff bodies"},
          p.method);
    visit({"seconds", "maximum simulated time", "s", 1e-4, 1000}, p.seconds);
    visit({"density_kg_m3", "density of the tissue", "kg/m3", 1, 30000}, p.density_kg_m3);
    visit({"damping_per_s", "how fast motion dies down", "1/s", 0, 1e5}, p.damping_per_s);
    visit({"min_step_ms", "steps at least this long: points are made heavier for it (0: as long as is stable)", "ms", 0,
           100},
          p.min_step_ms);
    visit({"step_ms", "implicit: length of a step, any", "ms", 1e-4, 1e5}, p.step_ms);
    visit({"until_rest", "ends when the forces balance to a thousandth of the load and little moves"}, p.until_rest);
    visit({"tool_radius_mm", "a ball that is pushed into the body (0: none)", "mm", 0, 1e6}, p.tool_radius_mm);
    visit({"tool_from_mm", "where its centre begins, LPS", "mm", -1e6, 1e6}, p.tool_from_mm);
    visit({"tool_to_mm", "where it is after half of the time, and stays", "mm", -1e6, 1e6}, p.tool_to_mm);
    visit({"tool_stiffness_n_per_mm", "stiffness at each point that the tool meets", "N/mm", 1e-9, 1e9},
          p.tool_stiffness_n_per_mm);
    visit({"obstacle_stiffness_n_per_mm", "stiffness at each point of the surface that meets the obstacle", "N/mm",
           1e-9, 1e9},
          p.obstacle_stiffness_n_per_mm);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo::inline app
