#include "tissue.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"
#include "osteo/simulation/tissue/dynamics.h"
#include "osteo/simulation/tissue/fem.h"
#include "osteo/simulation/tissue/implicit.h"
#include "tissue_parts.h"

namespace osteo::inline app {

using namespace tissue;

StageInfo FemStage::info() {
  return {.name = "fem",
          .version = 5,
          .synopsis = "how a soft body deforms under a load, by finite elements",
          .description =
              "Static equilibrium of tetrahedra under dead loads: Newton's method with exact Hessians and sparse "
              "Cholesky. Linear "
              "elasticity, Saint "
              "Venant-Kirchhoff, neo-Hookean or corotated; linear or quadratic tetrahedra, or linear ones that do not "
              "lock near "
              "incompressibility; a material for each region. Agrees with CalculiX to 1e-6 "
              "where that "
              "has the same law. Reads and writes input files of CalculiX and Abaqus: give one .inp as mesh and as "
              "problem.",
          .inputs = {{"mesh", {DataKind::tets}, "the body at rest, as tetrahedralize makes it, or .inp"},
                     {"problem", {DataKind::document}, "materials, what is fixed, loads, in JSON or .inp"}},
          .outputs = {{"deformed", {DataKind::tets}, "the same mesh under the load"},
                      {"report", {DataKind::document}, "displacements, energy, reaction, iterations, in JSON", true},
                      {"inp",
                       {DataKind::document},
                       "the problem for CalculiX or Abaqus (not neo_hooke, corotated or t4_mean, which are not known "
                       "there); contacts as contact "
                       "pairs",
                       true},
                      {"nodes",
                       {DataKind::document},
                       "all nodes in double precision, middles of edges too, with displacement_mm (.vtu)",
                       true}},
          .references = {"D. Morris, Haptics and Physical Simulation for Virtual Bone Surgery, 2006, section 5.3",
                         "J. Bonet, R. Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, 2008"},
          .example = "osteo fem tissue.vtu problem.json deformed.vtu --report-out report.json"};
}

std::vector<Data> FemStage::run(const Params& p, std::span<const Data> inputs, const Context& context) {
  const TetMesh& mesh = *std::get<Tets>(inputs[0]);
  const TissueProblem problem = parse_tissue_problem(std::get<Document>(inputs[1]).json, mesh);
  const std::size_t n = load_named(problem, p.load);
  const Elements elements = elements_for(p.law, p.order, problem, mesh);
  const FemBody body(points_of(mesh), tets_of(mesh), problem.materials, elements.law, elements.order);
  const TissueLoad load = body.on_all_points(problem.loads[n]);
  context.progress(0.1, "equilibrium");
  const Statics r = statics(body, load, {p.tolerance, 100, p.load_steps}, context);
  if (!r.converged) throw not_at_rest(r, "let the load grow in more --load-steps, or make it smaller");
  const std::span<const Vec3> corners(r.points_mm.data(), mesh.points_mm.size());
  const Json moved = displacement({body.rest().data(), corners.size()}, corners);
  Json j{{"load", problem.load_names[n]},
         {"law", name_of(elements.law)},
         {"order", name_of(elements.order)},
         {"order_because", elements.because},
         {"points", body.point_count()},
         {"displacement", moved},
         {"energy_mj", r.energy_mj},
         {"reaction_n", {r.reaction_n.x, r.reaction_n.y, r.reaction_n.z}},
         {"contact_n", {r.contact_n.x, r.contact_n.y, r.contact_n.z}},
         {"points_in_contact", r.touching},
         {"iterations", r.iterations},
         {"factorisations", r.factorisations},
         {"factorisations_shifted", r.shifted},
         {"residual", r.residual},
         {"inverted_tetrahedra", body.inverted(r.points_mm)}};
  if (elements.order == TetOrder::t4_mean) {
    std::size_t of_few = 0;
    for (std::size_t q = 0; q < body.patch_count(); ++q) of_few += body.patch(q).size() < 4 ? 1 : 0;
    j["patches"] = body.patch_count();
    j["patches_of_fewer_than_four"] = of_few;
  }
  for (const auto& [key, value] : moved.members()) context.report(key, *value.number());
  context.report("iterations", static_cast<std::int64_t>(r.iterations));
  context.progress(1);
  Document inp;
  const bool known = elements.law != ElasticLaw::neo_hooke && elements.law != ElasticLaw::corotated &&
                     elements.order != TetOrder::t4_mean;
  if (known) {
    inp.json = inp_text(body, load);
  } else {
    // Whoever asked for the file finds in it why it holds no problem.
    inp.json = "** osteotome wrote no problem: CalculiX and Abaqus know no " + std::string(name_of(elements.law)) +
               " with " + std::string(name_of(elements.order)) +
               "; give --law linear, stvk or neo_hooke_split, --order t4 or t10\n";
  }
  return {moved_mesh(mesh, corners), Document{written(j)}, std::move(inp), Document{nodes_vtu(body, r.points_mm)}};
}

StageInfo SimulateStage::info() {
  return {
      .name = "simulate",
      .version = 4,
      .synopsis = "a soft body in time, by the fast distance and volume model",
      .description =
          "Explicit steps with a limit that is certified, or implicit ones of any length for stiff bodies; lumped "
          "masses, viscous damping. "
          "Constants in closed form from the problem's materials, or those that calibrate found. A ball can be pushed "
          "into the body "
          "(an indentation), and a surface such as bone be in its way. Ends at rest, by the balance of forces.",
      .inputs = {{"mesh", {DataKind::tets}, "voxels of five tetrahedra each"},
                 {"problem", {DataKind::document}, "materials, what is fixed, loads, in JSON"},
                 {"constants", {DataKind::document}, "of calibrate", true},
                 {"obstacle", {DataKind::surface}, "closed surface that the body does not enter, such as bone", true}},
      .outputs = {{"deformed", {DataKind::tets}, "the mesh at the end"},
                  {"report", {DataKind::document}, "steps, energies, residual, clamps, in JSON", true}},
      .references = {"D. Morris, Haptics and Physical Simulation for Virtual Bone Surgery, 2006, section 5.4"},
      .example = "osteo simulate tissue.vtu problem.json deformed.vtu --constants constants.json"};
}

namespace {

struct Course {
  long done = 0;
  bool at_rest = false;
  double tool_now_n = 0, tool_most_n = 0;
};

// Box of the points.
struct Box {
  Vec3 lo, hi;
  explicit Box(std::span<const Vec3> x) : lo(x.front()), hi(lo) {
    for (const Vec3& q : x) {
      for (std::size_t a = 0; a < 3; ++a) {
        lo[a] = std::min(lo[a], q[a]);
        hi[a] = std::max(hi[a], q[a]);
      }
    }
  }
};

// A body that has left this many times its size is torn apart, not deformed.
constexpr double kFarthest = 100;

void require_together(std::span<const Vec3> x, std::span<const Vec3> rest, double seconds) {
  const Box box(rest);
  const double size = length(box.hi - box.lo);
  for (std::size_t p = 0; p < x.size(); ++p) {
    const double far = length(x[p] - rest[p]);
    if (!(far <= kFarthest * size))
      throw Error(ExitCode::failed,
                  "stopped after " + format_number(seconds) + " s of simulated time: point " + std::to_string(p) +
                      (std::isfinite(far) ? " has moved " + format_number(far) + " mm, over " +
                                                format_number(kFarthest) + " times the body's size"
                                          : std::string(" is nowhere any more")),
                  "the load is too large for the material, or nothing holds that part; --method implicit bears more");
  }
}

// Both ways of going on in time, until rest or the end.
template <class Dynamics>
Course go_on(Dynamics& dynamics, const SimulateParams& p, int batch, const TissueModel& model,
             const std::vector<TissueLoad::Moved>& moved, const Context& context) {
  Course c;
  const auto steps = static_cast<long>(std::ceil(p.seconds / dynamics.step_s()));
  const Vec3 from{p.tool_from_mm[0], p.tool_from_mm[1], p.tool_from_mm[2]},
      to{p.tool_to_mm[0], p.tool_to_mm[1], p.tool_to_mm[2]};
  const bool tool = p.tool_radius_mm > 0 || !moved.empty();  // things that go on for half of the time
  while (c.done < steps && !c.at_rest) {
    const double share = static_cast<double>(c.done) / static_cast<double>(steps), way = std::min(1.0, 2 * share);
    // By points, as its stiffness is meant, so that both ways find the same.
    if (!moved.empty()) {
      const std::vector<Vec3> x = dynamics.positions_mm();
      for (const TissueLoad::Moved& m : moved) {
        Vec3 at = x[m.point];
        for (std::size_t a = 0; a < 3; ++a)
          at[a] = (m.held >> a & 1) != 0 ? model.rest()[m.point][a] + way * m.by_mm[a] : at[a];
        dynamics.set_position(m.point, at);
      }
    }
    if (p.tool_radius_mm > 0)
      dynamics.set_tool(
          {std::make_shared<BallShape>(from + (to - from) * way, p.tool_radius_mm, false), p.tool_stiffness_n_per_mm});
    const int now = static_cast<int>(std::min<long>(tool ? std::max(1, batch / 10) : batch, steps - c.done));
    const Vec3 force = dynamics.step(now);
    c.done += now;
    c.tool_now_n = length(force);
    c.tool_most_n = std::max(c.tool_most_n, c.tool_now_n);
    context.progress(static_cast<double>(c.done) / static_cast<double>(steps), "steps");
    require_together(dynamics.positions_mm(), model.rest(), static_cast<double>(c.done) * dynamics.step_s());
    c.at_rest = p.until_rest && (!tool || way >= 1) && dynamics.residual() < 1e-3 &&
                dynamics.kinetic_mj() < 1e-6 * dynamics.elastic_mj();
  }
  return c;
}

// What the body does not enter, as far as it can reach.
RigidContact obstacle_of(const TriMesh& surface, const TissueModel& model, double stiffness_n_per_mm,
                         const Context& context) {
  const Box box(model.rest());
  const Vec3 size = box.hi - box.lo;
  const double around = 0.25 * std::max({size.x, size.y, size.z});
  const Vec3 margin{around, around, around};
  const auto& t = model.tets().front();
  RigidContact obstacle{nullptr, stiffness_n_per_mm};
  obstacle.shape = std::make_shared<SurfaceShape>(surface, box.lo - margin, box.hi + margin,
                                                  length(model.rest()[t[1]] - model.rest()[t[0]]) / 4, context);
  return obstacle;
}

// A load as both ways of going on take it.
struct LoadInTime {
  std::string name = "none";
  std::vector<std::pair<std::uint32_t, Vec3>> forces_n;
  std::vector<TissueLoad::Moved> moved;
  std::vector<std::uint32_t> fixed;
  std::vector<Slider> sliders;
};

LoadInTime load_in_time(const TissueProblem& problem, const std::string& asked) {
  LoadInTime l;
  l.fixed = problem.fixed;
  l.sliders = problem.sliders;
  if (asked != "none" && !problem.loads.empty()) {
    const std::size_t n = load_named(problem, asked);
    l.forces_n = problem.loads[n].forces_n;
    l.moved = problem.loads[n].moved;
    for (const TissueLoad::Moved& m : l.moved) {
      if (m.held == 7) l.fixed.push_back(m.point);
      if (m.held != 7) l.sliders.push_back({m.point, m.held});
    }
    if (!problem.loads[n].contacts.empty())
      throw Error(ExitCode::usage, "simulate does not read a load's contacts",
                  "give it the rigid thing as --obstacle, or use fem");
    l.name = problem.load_names[n];
  } else if (asked != "none" && !asked.empty()) {
    load_named(problem, asked);
  }
  return l;
}

// Where the body is after its course, and what there is to say of that.
template <class Dynamics>
std::vector<Vec3> report_course(const Dynamics& dynamics, const Course& c, const SimulateParams& p,
                                const TissueModel& model, Json& j, const Context& context) {
  std::vector<Vec3> x = dynamics.positions_mm();
  j["steps"] = c.done;
  j["step_ms"] = 1000 * dynamics.step_s();
  j["simulated_s"] = static_cast<double>(c.done) * dynamics.step_s();
  j["at_rest"] = c.at_rest;
  j["residual"] = dynamics.residual();
  j["elastic_mj"] = dynamics.elastic_mj();
  j["kinetic_mj"] = dynamics.kinetic_mj();
  if (p.tool_radius_mm > 0) {
    j["tool_n"] = c.tool_now_n;
    j["tool_most_n"] = c.tool_most_n;
  }
  j["displacement"] = displacement(model.rest(), x);
  j["inverted_tetrahedra"] = model.inverted(x);
  if (p.until_rest && !c.at_rest)
    context.warn("not at rest after " + format_number(p.seconds) + " s: residual " +
                 format_number(dynamics.residual()));
  context.report("step_ms", 1000 * dynamics.step_s());
  return x;
}

void report_counts(const ImplicitDynamics& dynamics, Json& j, const Context& context) {
  const auto& counts = dynamics.counts();
  j["newton_iterations"] = counts.iterations;
  j["steps_unfinished"] = counts.unfinished;
  if (counts.unfinished > 0)
    context.warn(std::to_string(counts.unfinished) + " steps ended before their residual was small");
}

void report_counts(const TissueDynamics<double>& dynamics, const SimulateParams& p, Json& j, const Context& context) {
  const auto& counts = dynamics.counts();
  if (counts.not_finite > 0)
    throw Error(ExitCode::failed,
                std::to_string(counts.not_finite) +
                    " times a point was to go to a place that is no number: the load is too large",
                "make it smaller, or take --method implicit");
  j["places_not_finite"] = counts.not_finite;
  j["points_made_heavier"] = counts.made_heavier;
  j["points_made_heavier_by_stretch"] = counts.stretched;
  j["pushes_softened"] = counts.softened;
  if (counts.made_heavier > 0)
    context.warn(std::to_string(counts.made_heavier) + " points were made heavier for steps of " +
                 format_number(p.min_step_ms) + " ms: motion is slower than it would be");
  if (counts.softened > 0)
    context.warn(
        std::to_string(counts.softened) +
        " pushes were softer than asked for, so that steps stay stable; --method implicit needs no such limit");
}

}  // namespace

std::vector<Data> SimulateStage::run(const Params& p, std::span<const Data> inputs, const Context& context) {
  const TetMesh& mesh = *std::get<Tets>(inputs[0]);
  const TissueProblem problem = parse_tissue_problem(std::get<Document>(inputs[1]).json, mesh, false);
  const auto* const constants = std::get_if<Document>(&inputs[2]);
  const TissueModel model =
      model_of_problem(mesh, problem, constants != nullptr ? std::optional(constants->json) : std::nullopt);
  RigidContact obstacle{nullptr, p.obstacle_stiffness_n_per_mm};
  if (const auto* const surface = std::get_if<Surface>(&inputs[3]))
    obstacle = obstacle_of(**surface, model, p.obstacle_stiffness_n_per_mm, context.sub(0, 0.1));
  const LoadInTime load = load_in_time(problem, p.load);
  // Forces on what nothing holds: it would be gone.
  if (!load.forces_n.empty() && obstacle.shape == nullptr) require_held(model, model.rest(), load.fixed, load.sliders);
  Json j{{"load", load.name}};
  Course c;
  std::vector<Vec3> x;
  if (p.method == TimeMethod::implicit_steps) {
    ImplicitDynamics dynamics(model, load.fixed, {p.density_kg_m3, p.damping_per_s, p.step_ms / 1000}, load.sliders);
    dynamics.set_load(load.forces_n);
    dynamics.set_obstacle(obstacle);
    c = go_on(dynamics, p, 1, model, load.moved, context);
    x = report_course(dynamics, c, p, model, j, context);
    report_counts(dynamics, j, context);
  } else {
    DynamicsOptions options;
    options.density_kg_m3 = p.density_kg_m3;
    options.damping_per_s = p.damping_per_s;
    options.least_step_s = p.min_step_ms / 1000;
    // As quick as floats, which never balance to a thousandth.
    TissueDynamics<double> dynamics(model, load.fixed, options, load.sliders);
    dynamics.set_load(load.forces_n);
    dynamics.set_obstacle(obstacle);
    c = go_on(dynamics, p, 200, model, load.moved, context);
    x = report_course(dynamics, c, p, model, j, context);
    report_counts(dynamics, p, j, context);
  }
  context.report("steps", static_cast<std::int64_t>(c.done));
  if (p.tool_radius_mm > 0) context.report("tool_n", c.tool_now_n);
  context.progress(1);
  return {moved_mesh(mesh, x), Document{written(j)}};
}

}  // namespace osteo::inline app
