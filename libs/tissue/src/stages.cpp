#include "osteo/tissue/stages.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "osteo/base/error.h"
#include "osteo/tissue/calibrate.h"
#include "osteo/tissue/dynamics.h"
#include "osteo/tissue/problem.h"

namespace osteo {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kManyTets = 60'000;  // quadratic elements of more take minutes and gigabytes
constexpr double kSafePoisson = 0.4;       // above, linear elements lock

struct Truth {
  ElasticLaw law;
  TetOrder order;
  std::string because;
};

// Which finite elements: as asked, as the problem's own file says, or by Poisson's ratio and size.
Truth truth_of(LawChoice law, OrderChoice order, const TissueProblem& problem, const TetMesh& mesh) {
  Truth t{law == LawChoice::automatic ? problem.law.value_or(ElasticLaw::neo_hooke) : static_cast<ElasticLaw>(static_cast<int>(law) - 1),
          order == OrderChoice::t4 ? TetOrder::t4 : TetOrder::t10, "asked for"};
  if (order != OrderChoice::automatic) return t;
  double poisson = 0;
  for (const Material& m : problem.materials) poisson = std::max(poisson, m.poisson);
  if (problem.order) {
    t.order = *problem.order;
    t.because = "as in the .inp file";
    if (t.order == TetOrder::t4 && poisson > kSafePoisson)
      t.because += "; linear tetrahedra lock at a Poisson's ratio of " + format_number(poisson);
  } else if (mesh.tets.size() > kManyTets && poisson <= kSafePoisson) {
    t.order = TetOrder::t4;
    t.because = std::to_string(mesh.tets.size()) + " tetrahedra, and none locks at a Poisson's ratio of " + format_number(poisson) +
                ": linear ones";
  } else {
    t.because = poisson > kSafePoisson ? "linear tetrahedra lock at a Poisson's ratio of " + format_number(poisson)
                                       : "linear tetrahedra bend too little";
  }
  return t;
}

std::string_view name_of(TetOrder order) {
  return order == TetOrder::t4 ? "t4" : "t10";
}

std::size_t load_named(const TissueProblem& problem, const std::string& name) {
  if (name.empty()) return 0;
  std::string names;
  for (std::size_t n = 0; n < problem.load_names.size(); ++n) {
    if (problem.load_names[n] == name) return n;
    names += (n > 0 ? ", " : "") + problem.load_names[n];
  }
  throw Error(ExitCode::usage, "there is no load '" + name + "'", "the loads are: " + names);
}

Tets moved_mesh(const TetMesh& mesh, std::span<const Vec3> x) {
  TetMesh moved;
  moved.points_mm.resize(mesh.points_mm.size());
  for (std::size_t p = 0; p < moved.points_mm.size(); ++p) moved.points_mm[p] = to_floats(x[p]);
  moved.tets.resize(mesh.tets.size());
  std::copy(mesh.tets.begin(), mesh.tets.end(), moved.tets.begin());
  return std::make_shared<const TetMesh>(std::move(moved));
}

ordered_json moves(std::span<const Vec3> rest, std::span<const Vec3> x) {
  double most = 0, sum = 0;
  for (std::size_t p = 0; p < rest.size(); ++p) {
    const double d = length(x[p] - rest[p]);
    most = std::max(most, d);
    sum += d * d;
  }
  return {{"rms_mm", std::sqrt(sum / static_cast<double>(rest.size()))}, {"largest_mm", most}};
}

Error not_at_rest(const Equilibrium& r, const std::string& advice) {
  return Error(ExitCode::failed, "the body does not come to rest: " + r.why, advice);
}

std::string written(const ordered_json& j) {
  return j.dump(1) + "\n";
}

}  // namespace

StageInfo FemStage::info() {
  return {.name = "fem",
          .version = 1,
          .synopsis = "how a soft body deforms under a load, by finite elements",
          .description =
              "Static equilibrium of tetrahedra under dead loads: Newton's method with exact Hessians and sparse Cholesky. Linear "
              "elasticity, Saint "
              "Venant-Kirchhoff or neo-Hookean; linear or quadratic tetrahedra; a material for each region. Agrees with CalculiX to 2e-7 "
              "where that "
              "has the same law. Reads and writes input files of CalculiX and Abaqus: give one .inp as mesh and as problem.",
          .inputs = {{"mesh", {DataKind::tets}, "the body at rest, as tetrahedralize makes it"},
                     {"problem", {DataKind::document}, "materials, what is fixed, loads, in JSON or .inp"}},
          .outputs = {{"deformed", {DataKind::tets}, "the same mesh under the load"},
                      {"report", {DataKind::document}, "displacements, energy, reaction, iterations, in JSON", true},
                      {"inp", {DataKind::document}, "the problem for CalculiX or Abaqus (not neo_hooke)", true}},
          .references = {"D. Morris, Haptics and Physical Simulation for Virtual Bone Surgery, 2006, section 5.3",
                         "J. Bonet, R. Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, 2008"},
          .example = "osteo fem tissue.vtu problem.json deformed.vtu --report-out report.json"};
}

std::vector<Data> FemStage::run(const Params& p, std::span<const Data> inputs, const Context& context) {
  const TetMesh& mesh = *std::get<Tets>(inputs[0]);
  const TissueProblem problem = parse_tissue_problem(std::get<Document>(inputs[1]).json, mesh);
  const std::size_t n = load_named(problem, p.load);
  const Truth elements = truth_of(p.law, p.order, problem, mesh);
  const FemBody body(points_of(mesh), tets_of(mesh), problem.materials, elements.law, elements.order);
  const TissueLoad load = body.on_all_points(problem.loads[n]);
  EquilibriumSolver solver(body, body.rest(), load);
  context.progress(0.1, "equilibrium");
  const Equilibrium r = solver.solve(body, body.rest(), load.forces_n, {p.tolerance, 100, p.load_steps}, context);
  if (!r.converged) throw not_at_rest(r, "let the load grow in more --load-steps, or make it smaller");
  const std::span<const Vec3> corners(r.points_mm.data(), mesh.points_mm.size());
  std::vector<Vec3> g(body.point_count());
  total_gradient(body, r.points_mm, g);
  Vec3 reaction{};
  for (const std::uint32_t q : load.fixed) reaction += g[q];
  for (const Slider& q : load.sliders) {
    for (std::size_t a = 0; a < 3; ++a) reaction[a] += (q.held >> a & 1) != 0 ? g[q.point][a] : 0;
  }
  const ordered_json moved = moves({body.rest().data(), corners.size()}, corners);
  const ordered_json j{{"load", problem.load_names[n]},
                       {"law", EnumNames<LawChoice>::values[static_cast<std::size_t>(elements.law) + 1]},
                       {"order", name_of(elements.order)},
                       {"order_because", elements.because},
                       {"points", body.point_count()},
                       {"displacement", moved},
                       {"energy_mj", r.energy_mj},
                       {"reaction_n", {reaction.x, reaction.y, reaction.z}},
                       {"iterations", r.iterations},
                       {"factorisations", r.factorisations},
                       {"factorisations_shifted", r.shifted},
                       {"residual", r.residual},
                       {"inverted_tetrahedra", body.inverted(r.points_mm)}};
  context.report("rms_mm", moved["rms_mm"].get<double>());
  context.report("largest_mm", moved["largest_mm"].get<double>());
  context.report("iterations", static_cast<std::int64_t>(r.iterations));
  context.progress(1);
  Document inp;
  if (elements.law != ElasticLaw::neo_hooke) inp.json = inp_text(body, load);
  return {moved_mesh(mesh, corners), Document{written(j)}, std::move(inp)};
}

StageInfo CalibrateStage::info() {
  return {
      .name = "calibrate",
      .version = 1,
      .synopsis = "constants of the fast tissue model, fitted to finite elements",
      .description =
          "The body of voxels (tetrahedralize --method grid) under the problem's loads is solved by finite elements; the constants of the "
          "distance and volume model are then fitted to it, from their closed form, with exact derivatives through the equilibrium "
          "(Ceres). The "
          "report holds errors before and after, on loads that were not fitted too, beside the truth's own error of discretisation (linear "
          "against quadratic tetrahedra); uncertain factors; the course of the fit.",
      .inputs = {{"mesh", {DataKind::tets}, "voxels of five tetrahedra each"},
                 {"problem", {DataKind::document}, "materials, what is fixed, loads, in JSON"}},
      .outputs = {{"constants", {DataKind::document}, "factors and report, in JSON"},
                  {"deformed", {DataKind::tets}, "the calibrated model under the first fitted load", true}},
      .references = {"D. Morris, Haptics and Physical Simulation for Virtual Bone Surgery, 2006, sections 5.3 and 5.4",
                     "M. Teschner et al., A Versatile and Robust Model for Geometrically Complex Deformable Solids, CGI 2004"},
      .example = "osteo calibrate tissue.vtu problem.json constants.json --fit pull"};
}

std::vector<Data> CalibrateStage::run(const Params& p, std::span<const Data> inputs, const Context& context) {
  const TetMesh& mesh = *std::get<Tets>(inputs[0]);
  const TissueProblem problem = parse_tissue_problem(std::get<Document>(inputs[1]).json, mesh);
  const auto points = points_of(mesh);
  const auto tets = tets_of(mesh);
  TissueModel model = model_of_problem(mesh, problem);
  std::vector<std::size_t> fitted;
  for (std::size_t at = 0; at < p.fit.size();) {
    const std::size_t comma = std::min(p.fit.find(',', at), p.fit.size());
    fitted.push_back(load_named(problem, p.fit.substr(at, comma - at)));
    at = comma + 1;
  }
  if (fitted.empty()) fitted.push_back(0);
  const Truth elements = truth_of(p.law, p.order, problem, mesh);
  const auto solve = [&](TetOrder order, const TissueLoad& load) {
    const FemBody body(points, tets, problem.materials, elements.law, order);
    const TissueLoad all = body.on_all_points(load);
    EquilibriumSolver solver(body, body.rest(), all);
    Equilibrium r = solver.solve(body, body.rest(), all.forces_n, {1e-10, 100, 1}, context);
    if (!r.converged) throw not_at_rest(r, "make the load smaller");
    r.points_mm.resize(points.size());
    return r.points_mm;
  };
  // The truth, and how far it may be off itself: the other order on the same mesh.
  std::vector<std::vector<Vec3>> truth;
  std::vector<double> doubt;
  for (std::size_t n = 0; n < problem.loads.size(); ++n) {
    context.progress(0.5 * static_cast<double>(n) / static_cast<double>(problem.loads.size()), "finite elements");
    truth.push_back(solve(elements.order, problem.loads[n]));
    doubt.push_back(
        calibration_error(points, solve(elements.order == TetOrder::t4 ? TetOrder::t10 : TetOrder::t4, problem.loads[n]), truth.back())
            .nrms);
  }
  std::vector<CalibrationCase> cases;
  for (const std::size_t n : fitted) cases.push_back({problem.loads[n], truth[n]});
  CalibrateOptions options;
  options.grid = {p.grid_x, p.grid_y, p.grid_z};
  options.shared_grid = p.shared_grid;
  options.pull = p.pull;
  options.starts = p.starts;
  options.iterations = p.iterations;
  const Calibration c = calibrate(model, cases, options, context);
  if (c.after.empty()) throw Error(ExitCode::failed, c.why, "make the loads smaller");
  ordered_json j{{"osteotome_tissue_constants", 1},
                 {"grid", options.grid},
                 {"order_of_factors", {"axis edges", "diagonal edges", "faces", "volumes"}},
                 {"log_factors", c.log_factors}};
  if (c.log_stiffness.size() > 1) j["log_stiffness"] = c.log_stiffness;
  j["uncertainty_of_parameters"] = c.uncertainty;
  j["converged"] = c.converged;
  if (!c.why.empty()) j["why"] = c.why;
  j["parameters"] = c.parameters;
  j["equilibrium_solves"] = c.solves;
  j["failed_solves"] = c.failed_solves;
  j["seconds"] = c.seconds;
  j["cost"] = c.cost;
  j["loads"] = ordered_json::array();
  TissueModel plain = model;
  plain.scale({1, 1, 0, 1});
  EquilibriumSolver solver(model, model.rest(), problem.fixed, problem.sliders);
  Tets deformed;
  double unseen = 0;
  for (std::size_t n = 0; n < problem.loads.size(); ++n) {
    const bool used = std::find(fitted.begin(), fitted.end(), n) != fitted.end();
    const Equilibrium before = solver.solve(plain, model.rest(), problem.loads[n].forces_n, {}, context);
    const Equilibrium after = solver.solve(model, model.rest(), problem.loads[n].forces_n, {}, context);
    if (n == fitted.front()) deformed = moved_mesh(mesh, after.points_mm);
    const CalibrationError b = calibration_error(points, before.points_mm, truth[n]),
                           a = calibration_error(points, after.points_mm, truth[n]);
    j["loads"].push_back({{"name", problem.load_names[n]},
                          {"fitted", used},
                          {"truth_rms_mm", a.truth_rms_mm},
                          {"truth_off_other_order", doubt[n]},
                          {"closed_form_nrms", b.nrms},
                          {"nrms", a.nrms},
                          {"nrms_free_of_rigid", a.nrms_free_of_rigid},
                          {"rms_mm", a.rms_mm},
                          {"at_rest", after.converged}});
    if (!used) unseen = std::max(unseen, a.nrms);
  }
  context.report("nrms", c.after.front().nrms);
  context.report("closed_form_nrms", c.before.front().nrms);
  context.report("worst_nrms_not_fitted", unseen);
  context.report("equilibrium_solves", static_cast<std::int64_t>(c.solves));
  context.progress(1);
  return {Document{written(j)}, deformed};
}

StageInfo SimulateStage::info() {
  return {.name = "simulate",
          .version = 1,
          .synopsis = "a soft body in time, by the fast distance and volume model",
          .description =
              "Explicit steps with a limit that is certified; lumped masses, viscous damping. Constants in closed form from the problem's "
              "materials, or "
              "those that calibrate found. Ends at rest, by the balance of forces.",
          .inputs = {{"mesh", {DataKind::tets}, "voxels of five tetrahedra each"},
                     {"problem", {DataKind::document}, "materials, what is fixed, loads, in JSON"},
                     {"constants", {DataKind::document}, "of calibrate", true}},
          .outputs = {{"deformed", {DataKind::tets}, "the mesh at the end"},
                      {"report", {DataKind::document}, "steps, energies, residual, clamps, in JSON", true}},
          .references = {"D. Morris, Haptics and Physical Simulation for Virtual Bone Surgery, 2006, section 5.4"},
          .example = "osteo simulate tissue.vtu problem.json deformed.vtu --constants constants.json"};
}

std::vector<Data> SimulateStage::run(const Params& p, std::span<const Data> inputs, const Context& context) {
  const TetMesh& mesh = *std::get<Tets>(inputs[0]);
  const TissueProblem problem = parse_tissue_problem(std::get<Document>(inputs[1]).json, mesh);
  const std::size_t n = load_named(problem, p.load);
  const auto* const constants = std::get_if<Document>(&inputs[2]);
  const TissueModel model = model_of_problem(mesh, problem, constants != nullptr ? std::optional(constants->json) : std::nullopt);
  DynamicsOptions options;
  options.density_kg_m3 = p.density_kg_m3;
  options.damping_per_s = p.damping_per_s;
  options.least_step_s = p.least_step_ms / 1000;
  TissueDynamics<double> dynamics(model, problem.fixed, options,
                                  problem.sliders);  // as quick, and single precision never balances to a thousandth
  dynamics.set_load(problem.loads[n].forces_n);
  const auto steps = static_cast<long>(std::ceil(p.seconds / dynamics.step_s()));
  long done = 0;
  bool at_rest = false;
  while (done < steps && !at_rest) {
    const int batch = static_cast<int>(std::min<long>(200, steps - done));
    dynamics.step(batch);
    done += batch;
    context.progress(static_cast<double>(done) / static_cast<double>(steps), "steps");
    at_rest = p.until_rest && dynamics.residual() < 1e-3 && dynamics.kinetic_mj() < 1e-6 * dynamics.elastic_mj();
  }
  const auto x = dynamics.positions_mm();
  const ordered_json j{{"load", problem.load_names[n]},
                       {"steps", done},
                       {"step_ms", 1000 * dynamics.step_s()},
                       {"simulated_s", static_cast<double>(done) * dynamics.step_s()},
                       {"at_rest", at_rest},
                       {"residual", dynamics.residual()},
                       {"elastic_mj", dynamics.elastic_mj()},
                       {"kinetic_mj", dynamics.kinetic_mj()},
                       {"displacement", moves(model.rest(), x)},
                       {"inverted_tetrahedra", model.inverted(x)},
                       {"places_not_finite", dynamics.counts().not_finite},
                       {"points_made_heavier", dynamics.counts().made_heavier}};
  if (dynamics.counts().made_heavier > 0)
    context.warn(std::to_string(dynamics.counts().made_heavier) + " points were made heavier for steps of " +
                 format_number(p.least_step_ms) + " ms: motion is slower than it would be");
  if (p.until_rest && !at_rest)
    context.warn("not at rest after " + format_number(p.seconds) + " s: residual " + format_number(dynamics.residual()));
  context.report("step_ms", 1000 * dynamics.step_s());
  context.report("steps", static_cast<std::int64_t>(done));
  context.progress(1);
  return {moved_mesh(mesh, x), Document{written(j)}};
}

}  // namespace osteo
