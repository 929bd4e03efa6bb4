#include <algorithm>
#include <chrono>
#include <cmath>

#include "calibrate_parts.h"
#include "course_svg.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"
#include "osteo/simulation/tissue/calibrate.h"
#include "tissue_parts.h"

namespace osteo::inline app {

using namespace tissue;

namespace {

// Finite elements under one load after another, all held alike.
class Truth {
 public:
  Truth(const FemBody& body, const TissueLoad& held) : body_(body), solver_(body, body.rest(), held) {}
  std::vector<Vec3> solve(const TissueLoad& load, const Context& context) {
    const TissueLoad all = body_.on_all_points(load);
    Equilibrium r = solver_.solve(body_, body_.rest(), all.forces_n, {1e-10, 100, 1}, context);
    if (!r.converged) r = solver_.solve(body_, body_.rest(), all.forces_n, {1e-10, 100, 8}, context);
    if (!r.converged) throw not_at_rest(r, "make the load smaller");
    return r.points_mm;
  }

 private:
  const FemBody& body_;
  EquilibriumSolver solver_;
};

// Each tetrahedron as eight, over the points of the quadratic body.
std::vector<std::array<std::uint32_t, 4>> eight_of_each(const FemBody& quadratic) {
  // Nodes as of C3D10: corners, then the middles of 01, 12, 02, 03, 13, 23.
  constexpr std::size_t kParts[8][4] = {{0, 4, 6, 7}, {4, 1, 5, 8}, {6, 5, 2, 9}, {7, 8, 9, 3},
                                        {4, 6, 7, 8}, {4, 5, 6, 8}, {6, 5, 9, 8}, {6, 9, 7, 8}};
  const auto& x = quadratic.rest();
  std::vector<std::array<std::uint32_t, 4>> tets;
  for (std::size_t e = 0; e < quadratic.element_count(); ++e) {
    const auto node = quadratic.nodes(e);
    for (const auto& part : kParts) {
      std::array<std::uint32_t, 4> t{node[part[0]], node[part[1]], node[part[2]], node[part[3]]};
      if (dot(x[t[1]] - x[t[0]], cross(x[t[2]] - x[t[0]], x[t[3]] - x[t[0]])) < 0) std::swap(t[2], t[3]);
      tets.push_back(t);
    }
  }
  return tets;
}

// What is the same for every load.
struct MeshedBody {
  const TetMesh& mesh;
  const TissueProblem& problem;
  std::vector<Vec3> points;
  std::vector<std::array<std::uint32_t, 4>> tets;
  Elements elements;
  [[nodiscard]] FemBody fem(TetOrder order) const {
    return FemBody(points, tets, problem.materials, elements.law, order);
  }
};

// What finite elements say under each load, and how far they may be off themselves (NRMS).
struct Answers {
  std::vector<std::vector<Vec3>> points_mm;
  std::vector<double> off_other_order;  // against the other order on the same mesh
  std::vector<double> off_finer;        // against elements half as large; empty: not asked for
  double seconds = 0;                   // for the points alone
};

Answers solve_loads(const MeshedBody& of, const FemBody& body, const Context& context) {
  const TissueProblem& problem = of.problem;
  const FemBody other = of.fem(of.elements.order == TetOrder::t10 ? TetOrder::t4 : TetOrder::t10);
  Truth statics(body, body.on_all_points(problem.loads.front())),
      other_statics(other, other.on_all_points(problem.loads.front()));
  Answers a;
  for (std::size_t n = 0; n < problem.loads.size(); ++n) {
    context.progress(0.5 * static_cast<double>(n) / static_cast<double>(problem.loads.size()), "finite elements");
    const auto before = std::chrono::steady_clock::now();
    a.points_mm.push_back(statics.solve(problem.loads[n], context));
    a.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
    a.off_other_order.push_back(
        calibration_error(of.points, other_statics.solve(problem.loads[n], context), a.points_mm.back()).nrms);
  }
  return a;
}

// Eight times as many elements: that much more to add up, and sparse Cholesky of a solid takes the square of its
// unknowns.
void report_finer_estimate(const MeshedBody& of, const FemBody& body, double seconds, const Context& context) {
  const std::size_t loads = of.problem.loads.size();
  const double share = std::min(1.0, static_cast<double>(body.point_count()) / 2e4),
               estimate_s = seconds * (8 + 56 * share);
  context.report("finer_truth_estimate_s", estimate_s);
  context.warn("--check-truth solves " + std::to_string(8 * of.tets.size()) + " elements under " +
               std::to_string(loads) + (loads == 1 ? " load" : " loads") + ": about " +
               format_number(std::max(1.0, std::round(estimate_s))) + " s (the truth itself took " +
               format_number(std::round(10 * seconds) / 10) + ")");
}

std::vector<double> off_finer_elements(const MeshedBody& of, const Answers& truth, const Context& context) {
  const TissueProblem& problem = of.problem;
  // Held and loaded as quadratic elements are: in the middle of an edge, too.
  const FemBody quadratic = of.fem(TetOrder::t10);
  std::vector<Material> materials = problem.materials;
  if (materials.size() > 1) {
    materials.clear();
    for (const Material& m : problem.materials) materials.insert(materials.end(), 8, m);
  }
  const FemBody fine(quadratic.rest(), eight_of_each(quadratic), std::move(materials), of.elements.law,
                     of.elements.order);
  Truth finer(fine, fine.on_all_points(quadratic.on_all_points(problem.loads.front())));
  std::vector<double> off;
  const std::size_t corners = of.points.size();
  for (std::size_t n = 0; n < problem.loads.size(); ++n) {
    context.progress(0.5, "finite elements half as large");
    const auto x = finer.solve(quadratic.on_all_points(problem.loads[n]), context);
    off.push_back(calibration_error(of.points, {truth.points_mm[n].data(), corners}, {x.data(), corners}).nrms);
  }
  return off;
}

CalibrateOptions options_of(const CalibrateParams& p) {
  CalibrateOptions options;
  options.grid = {p.grid_x, p.grid_y, p.grid_z};
  options.shared_grid = p.shared_grid;
  options.pull = p.pull;
  options.smooth = p.smooth;
  options.starts = p.starts;
  options.samples = p.samples;
  options.iterations = p.iterations;
  return options;
}

// The file of constants, but for its loads.
Json constants_json(const CalibrateParams& p, const TissueProblem& problem, const TissueModel& model,
                    const CalibrateOptions& options, const Calibration& c, std::span<const double> kpa) {
  Json j{{"osteotome_tissue_constants", 1},
         {"grid", options.grid},
         {"order_of_factors", {"axis edges", "diagonal edges", "faces", "volumes"}},
         {"log_factors", c.log_factors}};
  if (p.blind) j["base"] = {{"young_kpa", 1000 * problem.general.young_mpa}, {"poisson", problem.general.poisson}};
  if (problem.materials.size() > 1) j["learnt"] = learnt(material_edges(problem, model), kpa);
  if (c.log_stiffness.size() > 1) j["log_stiffness"] = c.log_stiffness;
  j["uncertainty_of_parameters"] = c.uncertainty;
  j["converged"] = c.converged;
  if (!c.why.empty()) j["why"] = c.why;
  j["parameters"] = c.parameters;
  j["equilibrium_solves"] = c.solves;
  j["failed_solves"] = c.failed_solves;
  j["seconds"] = c.seconds;
  j["cost"] = c.cost;
  return j;
}

// How the calibrated model does under every load, also those that were not fitted.
struct Tried {
  Json loads = Json::list();
  Tets deformed;      // under the first fitted load
  double unseen = 0;  // worst NRMS of a load that was not fitted
};

Tried try_loads(const MeshedBody& of, const TissueModel& model, const Answers& truth,
                const std::vector<std::size_t>& fitted, const Context& context) {
  const TissueProblem& problem = of.problem;
  Tried t;
  TissueModel plain = model;
  plain.scale({1, 1, 0, 1});
  EquilibriumSolver solver(model, model.rest(), problem.fixed, problem.sliders);
  for (std::size_t n = 0; n < problem.loads.size(); ++n) {
    const bool used = std::find(fitted.begin(), fitted.end(), n) != fitted.end();
    const Equilibrium before = solver.solve(plain, model.rest(), problem.loads[n].forces_n, {}, context);
    const Equilibrium after = solver.solve(model, model.rest(), problem.loads[n].forces_n, {}, context);
    if (n == fitted.front()) t.deformed = moved_mesh(of.mesh, after.points_mm);
    const CalibrationError b = calibration_error(of.points, before.points_mm, truth.points_mm[n]),
                           a = calibration_error(of.points, after.points_mm, truth.points_mm[n]);
    t.loads.push_back(
        {{"name", problem.load_names[n]},
         {"fitted", used},
         {"truth_rms_mm", a.truth_rms_mm},
         {"truth_off_other_order", truth.off_other_order[n]},
         {"closed_form_nrms", b.nrms},
         {"nrms", a.nrms},
         {"nrms_free_of_rigid", a.nrms_free_of_rigid},
         {"rms_mm", a.rms_mm},
         {"felt_stiffer_by", force_error(of.points, after.points_mm, truth.points_mm[n], problem.loads[n])},
         {"at_rest", after.converged}});
    if (!truth.off_finer.empty()) t.loads.back()["truth_off_finer"] = truth.off_finer[n];
    if (!used) t.unseen = std::max(t.unseen, a.nrms);
  }
  return t;
}

void report_fit(const TissueProblem& problem, const Answers& truth, const Calibration& c, const Tried& tried,
                const std::vector<std::size_t>& fitted, const Context& context) {
  context.report("nrms", c.after.front().nrms);
  context.report("closed_form_nrms", c.before.front().nrms);
  if (fitted.size() < problem.loads.size()) {
    context.report("worst_nrms_not_fitted", tried.unseen);
  } else {
    context.warn(
        "all loads were fitted, so nothing says how the constants do on another: give the problem loads that are not "
        "fitted");
  }
  context.report("truth_off_other_order", truth.off_other_order[fitted.front()]);
  if (!truth.off_finer.empty()) context.report("truth_off_finer", truth.off_finer[fitted.front()]);
  context.report("equilibrium_solves", static_cast<std::int64_t>(c.solves));
}

std::string title_of_course(const Calibration& c) {
  return std::to_string(c.parameters) + " factors in " + std::to_string(c.solves) + " equilibrium solves, " +
         format_number(std::round(100 * c.seconds) / 100) + " s: NRMS " +
         format_number(std::round(1e4 * c.before.front().nrms) / 1e4) + " to " +
         format_number(std::round(1e4 * c.after.front().nrms) / 1e4);
}

// The outputs of calibrate. `fitted` empty: the first load.
std::vector<Data> calibrate_to_elements(const CalibrateParams& p, const TetMesh& mesh, const TissueProblem& problem,
                                        TissueModel model, std::vector<std::size_t> fitted, const Context& context) {
  if (fitted.empty()) fitted.push_back(0);
  for (std::size_t n = 0; n < problem.loads.size(); ++n) {
    if (!problem.loads[n].moved.empty() || !problem.loads[n].contacts.empty())
      throw Error(ExitCode::usage,
                  "the load '" + problem.load_names[n] + "' moves points or has contacts; calibrate fits to forces",
                  "leave it out of the problem that calibrate gets");
  }
  const MeshedBody of{mesh, problem, points_of(mesh), tets_of(mesh), elements_for(p.law, p.order, problem, mesh)};
  const FemBody body = of.fem(of.elements.order);
  Answers truth = solve_loads(of, body, context);
  if (p.check_truth) {
    report_finer_estimate(of, body, truth.seconds, context);
    truth.off_finer = off_finer_elements(of, truth, context);
  }
  std::vector<CalibrationCase> cases;
  for (const std::size_t n : fitted) {
    const auto& x = truth.points_mm[n];
    cases.push_back({problem.loads[n], {x.begin(), x.begin() + static_cast<std::ptrdiff_t>(of.points.size())}});
  }
  const CalibrateOptions options = options_of(p);
  const Calibration c = calibrate(model, cases, options, context);
  if (c.after.empty()) throw Error(ExitCode::failed, c.why, "make the loads smaller");
  const TissueModel uniform = TissueModel::of_voxels(of.points, of.tets, std::span(&problem.general, 1));
  const std::vector<double> kpa = stiffness_kpa(model, uniform, problem.general);
  Json j = constants_json(p, problem, model, options, c, kpa);
  Tried tried = try_loads(of, model, truth, fitted, context);
  j["loads"] = std::move(tried.loads);
  report_fit(problem, truth, c, tried, fitted, context);
  context.progress(1);
  return {Document{written(j)}, tried.deformed, stiffness_map(mesh, model, kpa),
          Document{course_svg(c, title_of_course(c))}};
}

}  // namespace

StageInfo CalibrateStage::info() {
  return {
      .name = "calibrate",
      .version = 3,
      .synopsis = "constants of the fast tissue model, fitted to finite elements or to what was measured",
      .description =
          "The body of voxels (tetrahedralize --method grid) under the problem's loads is solved by finite elements; "
          "the constants of the "
          "distance and volume model are then fitted to it, from their closed form, with exact derivatives through the "
          "equilibrium "
          "(Ceres). The "
          "report holds errors before and after, on loads that were not fitted too, beside the truth's own error of "
          "discretisation (linear "
          "against quadratic tetrahedra, and with --check-truth finer ones: a residual below that says nothing); "
          "uncertain factors; the "
          "course of the fit. A map of stiffness (--grid-x, -y, -z) finds what the "
          "regions of "
          "a body are made of, also without being given them (--blind). With --measured the truth is what was "
          "measured: clouds of points "
          "on the deformed surface (.ply .stl .obj .vtp .csv .xyz), with noise, stray points and only a part of it "
          "seen, or markers whose "
          "places at rest are known (.csv with x0_mm, y0_mm, z0_mm). The report then has distances before and after, "
          "the noise that was "
          "found, points that were rejected, how much of the surface was seen, and 95 % intervals.",
      .inputs =
          {{"mesh", {DataKind::tets}, "voxels of five tetrahedra each"},
           {"problem", {DataKind::document}, "materials, what is fixed, loads, in JSON or .inp"},
           {"measured",
            {DataKind::source},
            "instead of finite elements: points of the deformed body, a file or a folder of them, called like their "
            "loads",
            true},
           {"surface", {DataKind::surface}, "measured: the body's surface at rest, which the mesh stands for", true}},
      .outputs =
          {{"constants", {DataKind::document}, "factors and report, in JSON"},
           {"deformed", {DataKind::tets}, "the calibrated model under the first fitted load", true},
           {"map", {DataKind::tets}, "the mesh with the learnt stiffness at its points (snapshot draws it)", true},
           {"course", {DataKind::document}, "the course of the fit as a plot (.svg)", true}},
      .references =
          {"D. Morris, Haptics and Physical Simulation for Virtual Bone Surgery, 2006, sections 5.3 and 5.4",
           "M. Teschner et al., A Versatile and Robust Model for Geometrically Complex Deformable Solids, CGI 2004"},
      .example = "osteo calibrate tissue.vtu problem.json constants.json --fit pull"};
}

std::vector<Data> CalibrateStage::run(const Params& p, std::span<const Data> inputs, const Context& context) {
  const TetMesh& mesh = *std::get<Tets>(inputs[0]);
  const TissueProblem problem = parse_tissue_problem(std::get<Document>(inputs[1]).json, mesh);
  TissueProblem known = problem;
  if (p.blind) known.materials.assign(1, problem.general);
  TissueModel model = model_of_problem(mesh, known);
  std::vector<std::size_t> fitted = loads_named(problem, p.fit);
  if (const auto* const measured = std::get_if<Source>(&inputs[2]); measured != nullptr) {
    const auto* const surface = std::get_if<Surface>(&inputs[3]);
    return calibrate_to_measured(p, mesh, problem, std::move(model), measured->path,
                                 surface != nullptr ? surface->get() : nullptr, std::move(fitted), context);
  }
  if (std::get_if<Surface>(&inputs[3]) != nullptr || p.find_pose || p.max_points != CalibrateParams{}.max_points)
    throw Error(ExitCode::usage, "--surface, --find-pose and --max-points have no effect without --measured",
                "finite elements are compared point by point");
  return calibrate_to_elements(p, mesh, problem, std::move(model), std::move(fitted), context);
}

}  // namespace osteo::inline app
