// calibrate, where the truth was measured.
#include <algorithm>
#include <cmath>

#include "calibrate_parts.h"
#include "course_svg.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"
#include "osteo/geometry/tets/skin.h"
#include "osteo/simulation/tissue/measured.h"
#include "tissue_parts.h"

namespace osteo::inline app::tissue {
namespace {

constexpr double kSides95 = 1.96;
constexpr double kSettled = 0.5;

double rounded(double v) {
  return std::round(v * 1000) / 1000;
}
std::string percent(double share) {
  return format_number(std::round(1000 * share) / 10) + " %";
}

// The surface, following the mesh.
BodySurface following(const TriMesh& surface, const TetMesh& mesh, const Context& context) {
  const Skin skin(surface, mesh, {}, context);
  BodySurface s;
  for (std::size_t p = 0; p < skin.point_count(); ++p) {
    s.corners.push_back(skin.corners(p));
    const auto& w = skin.weights(p);
    s.weights.push_back({w[0], w[1], w[2], w[3]});
  }
  s.triangles = surface.triangles;
  return s;
}

Json times(const LogStiffness& s, double young_kpa, const char* called) {
  return Json{{called, young_kpa * std::exp(s.log)},
              {"low_95", young_kpa * std::exp(s.log - kSides95 * s.deviation)},
              {"high_95", young_kpa * std::exp(s.log + kSides95 * s.deviation)}};
}

void refuse_what_has_no_effect(const CalibrateParams& p) {
  if (p.law != LawChoice::automatic || p.order != OrderChoice::automatic || p.check_truth)
    throw Error(ExitCode::usage, "--law, --order and --check-truth have no effect with --measured",
                "no finite elements are solved: what was measured is the truth");
  if (p.starts != 1 || p.samples != 0)
    throw Error(ExitCode::usage, "--starts and --samples have no effect with --measured",
                "it begins at the one factor that explains most");
}

// What a user should not have to find out from the figures.
void warn_of(const MeasuredCalibration& c, std::size_t weak, std::size_t points, const Context& context) {
  if (!c.fit.converged) context.warn("the fit did not come to its end: " + c.fit.why);
  std::size_t distances = 0;
  for (const MeasuredView& v : c.views) distances += v.drawn * (v.markers ? 3 : 1);
  if (distances < 3 * static_cast<std::size_t>(c.fit.parameters))
    context.warn(std::to_string(distances) + " distances are few for " + std::to_string(c.fit.parameters) +
                 " parameters: the fit follows the noise, which it then gives too small, and its intervals too narrow; "
                 "take a coarser map");
  for (const MeasuredView& v : c.views) {
    const double rejected = static_cast<double>(v.rejected) / static_cast<double>(v.drawn);
    if (rejected > 0.2)
      context.warn(v.name + ": " + percent(rejected) +
                   " of its points lie off the body by over four times the noise; is something else in it?");
    if (!v.markers && v.seen_share < 0.3)
      context.warn(v.name + " shows " + percent(v.seen_share) +
                   " of the surface that moves; inside the rest the stiffness is hardly known");
    if (v.noise_mm > 0.3 * v.after.moved_rms_mm)
      context.warn(v.name + ": what is left (" + format_number(rounded(v.noise_mm)) +
                   " mm) is not small against the movement (" + format_number(rounded(v.after.moved_rms_mm)) +
                   " mm): push harder, or measure better");
    if (v.correlation > 0.5 && v.noise_mm > 0.03 * v.after.moved_rms_mm)
      context.warn(v.name + ": what the fit leaves (" + format_number(rounded(v.noise_mm)) +
                   " mm) is no noise, it goes together at neighbouring points (correlation " +
                   format_number(rounded(v.correlation)) +
                   "): the body's shape at rest may not be the mesh's (--surface), its place another (--find-pose), or "
                   "the map too coarse. The "
                   "intervals were widened for it");
  }
  if (2 * weak > points && points > 1)
    context.warn(std::to_string(weak) + " of the map's " + std::to_string(points) +
                 " points are not determined by what was measured: they keep to their neighbours and to the mean");
}

bool measured_under(const std::vector<MeasuredOfLoad>& files, std::size_t load) {
  return std::any_of(files.begin(), files.end(), [&](const auto& f) { return f.load == load; });
}

std::vector<MeasuredCase> cases_of(const std::vector<MeasuredOfLoad>& files, const TissueProblem& problem,
                                   const std::vector<std::size_t>& fitted) {
  std::vector<MeasuredCase> cases;
  for (const std::size_t n : fitted) {
    if (!measured_under(files, n))
      throw Error(ExitCode::usage, "nothing was measured under the load '" + problem.load_names[n] + "'",
                  "give a file that is called like it, or leave it out of --fit");
    cases.push_back({problem.loads[n], {}});
    for (const MeasuredOfLoad& f : files) {
      if (f.load == n) cases.back().views.push_back(f.points);
    }
  }
  for (const MeasuredOfLoad& f : files) {
    const TissueLoad& load = problem.loads[f.load];
    if (!load.moved.empty() || !load.contacts.empty())
      throw Error(
          ExitCode::usage,
          "the load '" + problem.load_names[f.load] + "' moves points or has contacts; calibrate fits to forces",
          "a body of any stiffness follows where it is moved to: only a known force shows how stiff it is");
  }
  return cases;
}

/// The closed form is of one material, so one stiffness can be told.
bool of_one_material(const CalibrateParams& p, const MaterialEdges& edges) {
  return p.blind || edges.young_kpa.empty();
}

/// Points of the map that a constraint is near, and those of them that the data have not settled.
struct Settling {
  std::size_t weak = 0, points = 0;
};
Settling settling_of(const MeasuredCalibration& c) {
  Settling s;
  for (std::size_t n = 0; n < c.settled.size(); ++n) {
    if (c.deviation[n] == 0) continue;
    ++s.points;
    s.weak += c.settled[n] < kSettled ? 1 : 0;
  }
  return s;
}

Json error_of_shape(const MeasuredError& e) {
  return Json{{"rms_mm", e.rms_mm}, {"median_mm", e.median_mm}, {"moved_rms_mm", e.moved_rms_mm}};
}

Json view_of(const MeasuredView& v, const std::string& load, bool find_pose) {
  Json view{{"file", v.name},
            {"load", load},
            {"fitted", true},
            {"kind", v.markers ? "markers" : "cloud"},
            {"points", v.points},
            {"points_used", v.drawn},
            {"points_rejected", v.rejected},
            {"closed_form", error_of_shape(v.before)},
            {"calibrated", error_of_shape(v.after)},
            {"noise_mm", v.noise_mm},
            {"correlation", v.correlation}};
  if (!v.markers) view["seen_share"] = v.seen_share;
  if (find_pose) {
    view["turned_deg"] = v.turned_deg;
    view["shifted_mm"] = v.shifted_mm;
  }
  return view;
}

/// `measured` is left empty.
Json constants_of(const MeasuredCalibration& c, const CalibrateParams& p, const TissueProblem& problem,
                  const MaterialEdges& edges) {
  Json j{{"osteotome_tissue_constants", 1},
         {"grid", std::array{p.grid_x, p.grid_y, p.grid_z}},
         {"order_of_factors", {"axis edges", "diagonal edges", "faces", "volumes"}},
         {"log_factors", c.fit.log_factors}};
  const double young_kpa = 1000 * problem.general.young_mpa;
  if (p.blind) j["base"] = {{"young_kpa", young_kpa}, {"poisson", problem.general.poisson}};
  const bool one = of_one_material(p, edges);
  if (one) {
    j["stiffness"] = times(c.all, young_kpa, "kpa");
  } else {
    j["stiffness_times"] = times(c.all, 1, "value");
  }
  if (!edges.young_kpa.empty()) {
    j["learnt"] = Json::list();
    for (std::size_t m = 0; m < edges.young_kpa.size(); ++m) {
      j["learnt"].push_back(times(c.groups[m], one ? young_kpa : edges.young_kpa[m], "learnt_kpa"));
      j["learnt"].back()["young_kpa"] = edges.young_kpa[m];
    }
  }
  if (c.fit.log_stiffness.size() > 1) j["log_stiffness"] = c.fit.log_stiffness;
  j["deviation_of_log_stiffness"] = c.deviation;
  j["settled"] = c.settled;
  j["points_not_settled"] = settling_of(c).weak;
  j["converged"] = c.fit.converged;
  if (!c.fit.why.empty()) j["why"] = c.fit.why;
  j["parameters"] = c.fit.parameters;
  j["rounds"] = c.rounds;
  j["equilibrium_solves"] = c.fit.solves;
  j["failed_solves"] = c.fit.failed_solves;
  j["seconds"] = c.fit.seconds;
  j["cost"] = c.fit.cost;
  j["measured"] = Json::list();
  return j;
}

/// Loads under which it was measured too, but which were not fitted: how the constants carry over.
struct CarriedOver {
  Tets deformed;  ///< under the first load that was fitted
  bool any = false;
  double worst_rms_mm = 0;
};
CarriedOver carry_over(const TetMesh& mesh, const TissueProblem& problem, const TissueModel& model,
                       const TissueModel& plain, const BodySurface& skin, const std::vector<MeasuredOfLoad>& files,
                       const std::vector<std::size_t>& fitted, bool find_pose, Json& j, const Context& context) {
  EquilibriumSolver solver(model, model.rest(), problem.fixed, problem.sliders);
  CarriedOver over;
  for (std::size_t n = 0; n < problem.loads.size(); ++n) {
    const bool used = std::find(fitted.begin(), fitted.end(), n) != fitted.end();
    if (used && n != fitted.front()) continue;
    if (!used && !measured_under(files, n)) continue;
    const Equilibrium after = solver.solve(model, model.rest(), problem.loads[n].forces_n, {}, context);
    if (!after.converged) throw not_at_rest(after, "make the load smaller");
    if (n == fitted.front()) over.deformed = moved_mesh(mesh, after.points_mm);
    if (used) continue;
    const Equilibrium before = solver.solve(plain, model.rest(), problem.loads[n].forces_n, {}, context);
    for (const MeasuredOfLoad& f : files) {
      if (f.load != n) continue;
      const MeasuredError e = measured_error(model, skin, f.points, after.points_mm, find_pose);
      Json view{{"file", f.points.name},
                {"load", problem.load_names[n]},
                {"fitted", false},
                {"points", f.points.points_mm.size()}};
      if (before.converged)
        view["closed_form"] = error_of_shape(measured_error(model, skin, f.points, before.points_mm, find_pose));
      view["calibrated"] = error_of_shape(e);
      j["measured"].push_back(view);
      over.any = true;
      over.worst_rms_mm = std::max(over.worst_rms_mm, e.rms_mm);
    }
  }
  return over;
}

/// `young_kpa`: of the one material, 0 where there are several.
void report_fit(const MeasuredCalibration& c, const CarriedOver& carried, double young_kpa, const Context& context) {
  std::size_t rejected = 0;
  double seen = 0;
  bool clouds = false;
  for (const MeasuredView& v : c.views) {
    rejected += v.rejected;
    clouds = clouds || !v.markers;
    seen = std::max(seen, v.seen_share);
  }
  const auto [weak, points] = settling_of(c);
  context.report("closed_form_rms_mm", c.views.front().before.rms_mm);
  context.report("rms_mm", c.views.front().after.rms_mm);
  context.report("noise_mm", c.views.front().noise_mm);
  context.report("points_rejected", static_cast<std::int64_t>(rejected));
  if (clouds) context.report("seen_share", seen);
  if (young_kpa > 0) {
    context.report("stiffness_kpa", young_kpa * std::exp(c.all.log));
    context.report("stiffness_low_95_kpa", young_kpa * std::exp(c.all.log - kSides95 * c.all.deviation));
    context.report("stiffness_high_95_kpa", young_kpa * std::exp(c.all.log + kSides95 * c.all.deviation));
  }
  if (carried.any) {
    context.report("worst_rms_mm_not_fitted", carried.worst_rms_mm);
  } else {
    context.warn(
        "all that was measured was fitted, so nothing says how the constants do on another load: keep one out of "
        "--fit");
  }
  context.report("points_of_map_not_settled", static_cast<std::int64_t>(weak));
  context.report("equilibrium_solves", static_cast<std::int64_t>(c.fit.solves));
  context.report("estimate_s", c.estimate_s);
  warn_of(c, weak, points, context);
}

}  // namespace

std::vector<Data> calibrate_to_measured(const CalibrateParams& p, const TetMesh& mesh, const TissueProblem& problem,
                                        TissueModel model, const std::filesystem::path& measured,
                                        const TriMesh* surface, std::vector<std::size_t> fitted,
                                        const Context& context) {
  refuse_what_has_no_effect(p);
  const std::vector<MeasuredOfLoad> files = read_measured(measured, problem.load_names);
  if (fitted.empty()) {
    for (std::size_t n = 0; n < problem.loads.size(); ++n) {
      if (measured_under(files, n)) fitted.push_back(n);
    }
  }
  const std::vector<MeasuredCase> cases = cases_of(files, problem, fitted);
  const BodySurface skin = surface != nullptr ? following(*surface, mesh, context) : boundary_surface(model);
  const MaterialEdges edges = material_edges(problem, model);
  MeasuredOptions options;
  options.calibrate.grid = {p.grid_x, p.grid_y, p.grid_z};
  options.calibrate.shared_grid = p.shared_grid;
  options.calibrate.pull = p.pull;
  options.calibrate.smooth = p.smooth;
  options.calibrate.iterations = p.iterations;
  options.find_pose = p.find_pose;
  options.max_points = static_cast<std::size_t>(p.max_points);
  options.group_of = edges.of;
  TissueModel plain = model;
  plain.scale({1, 1, 0, 1});
  const double young_kpa = 1000 * problem.general.young_mpa;
  const MeasuredCalibration c = calibrate_measured(model, skin, cases, options, context);

  Json j = constants_of(c, p, problem, edges);
  for (const MeasuredView& v : c.views)
    j["measured"].push_back(view_of(v, problem.load_names[fitted[v.load]], p.find_pose));
  const CarriedOver carried = carry_over(mesh, problem, model, plain, skin, files, fitted, p.find_pose, j, context);
  report_fit(c, carried, of_one_material(p, edges) ? young_kpa : 0, context);
  context.progress(1);
  const TissueModel uniform = TissueModel::of_voxels(points_of(mesh), tets_of(mesh), std::span(&problem.general, 1));
  const std::string title = std::to_string(c.fit.parameters) + " factors in " + std::to_string(c.fit.solves) +
                            " equilibrium solves, " + format_number(std::round(100 * c.fit.seconds) / 100) +
                            " s: " + format_number(rounded(c.views.front().before.rms_mm)) + " mm to " +
                            format_number(rounded(c.views.front().after.rms_mm)) + " mm";
  return {Document{written(j)}, carried.deformed,
          stiffness_map(mesh, model, stiffness_kpa(model, uniform, problem.general)),
          Document{course_svg(c.fit, title)}};
}

}  // namespace osteo::inline app::tissue
