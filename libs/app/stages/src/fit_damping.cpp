#include "fit_damping.h"

#include <cmath>
#include <numbers>

#include "osteo/core/base/csv.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"
#include "osteo/simulation/tissue/damping.h"
#include "tissue_parts.h"

namespace osteo::inline app {

using namespace tissue;

namespace {

Json interval(const Estimate& e) {
  return Json{{"value", e.value}, {"low_95", e.low}, {"high_95", e.high}};
}
Json swing(const Swing& s) {
  return Json{{"hz", s.hz},
              {"decay_per_s", s.decay_per_s},
              {"decrement", s.hz > 0 ? s.decay_per_s / s.hz : 0.0},
              {"swings", s.swings}};
}
double rounded(double v) {
  return v == 0 || !std::isfinite(v) ? v
                                     : std::round(v * std::pow(10, 3 - std::floor(std::log10(std::abs(v))))) *
                                           std::pow(10, std::floor(std::log10(std::abs(v))) - 3);
}
std::string percent(double share) {
  return format_number(std::round(1000 * share) / 10) + " %";
}

std::uint32_t nearest_point(const TissueModel& model, Vec3 at) {
  std::uint32_t best = 0;
  const auto& x = model.rest();
  for (std::uint32_t p = 1; p < x.size(); ++p) {
    if (length(x[p] - at) < length(x[best] - at)) best = p;
  }
  return best;
}

double longest_edge(const TissueModel& model) {
  double most = 0;
  for (const auto& t : model.tets()) most = std::max(most, length(model.rest()[t[1]] - model.rest()[t[0]]));
  return most;
}

std::string table_of(const DampingFit& fit) {
  std::string t = csv_line({"channel", "time_s", "measured_mm", "fitted_mm"});
  for (std::size_t c = 0; c < fit.used.channels.size(); ++c) {
    const auto& channel = fit.used.channels[c];
    for (std::size_t i = 0; i < channel.mm.size(); ++i)
      t += csv_line({channel.name, format_number(channel.time_s[i]), format_number(channel.mm[i]),
                     format_number(fit.fitted_mm[c][i])});
  }
  return t;
}

// What a user should not have to find out from the figures.
void warn_of(const DampingFit& fit, const FitDampingParams& p, const Context& context) {
  if (!fit.converged) context.warn("the fit did not come to its end: " + fit.why);
  const Estimate& c = fit.damping_per_s;
  if (c.low <= 0) {
    context.warn("what was measured cannot tell this damping from none: up to " + format_number(rounded(c.high)) +
                 " /s are possible");
  } else if (c.high - c.low > c.value) {
    context.warn("the damping is known to a factor of " + format_number(rounded(c.high / c.low)) +
                 " only: measure longer, or with less noise");
  }
  if (p.fit_stiffness && !(fit.stiffness_times.value > 0.25 && fit.stiffness_times.value < 4))
    context.warn("the body would have to be " + format_number(rounded(fit.stiffness_times.value)) +
                 " times as stiff as the problem says: another swing than its first one may have been measured, or it "
                 "was measured "
                 "too seldom, or density or young_kpa are far off");
  if (fit.measured.swings && fit.interval_s * fit.measured.hz > 0.2)
    context.warn(format_number(rounded(1 / (fit.interval_s * fit.measured.hz))) +
                 " values a swing are few: a faster swing would look the same");
  if (fit.amplitude_times < 0)
    context.warn("it was plucked the other way than the load pulls (amplitude " +
                 format_number(rounded(fit.amplitude_times)) + " of it)");
  if (fit.correlation > 0.3)
    context.warn(
        "what the fit leaves (" + percent(fit.residual_share) +
        " of the motion) is no noise: each value goes with the next (correlation " +
        format_number(rounded(fit.correlation)) +
        "); a base line that wanders, or several swings, are not in the model. The intervals were widened for it");
  for (std::size_t k = 0; k < fit.drift_mm_per_s.size(); ++k) {
    const double drift = fit.drift_mm_per_s[k];
    if (std::abs(drift) > 4 * fit.drift_error_mm_per_s[k] && std::abs(drift) * fit.span_s > 0.05 * fit.largest_mm[k])
      context.warn(fit.used.channels[k].name + " drifts by " + format_number(rounded(drift)) +
                   " mm/s, which was taken out");
  }
}

}  // namespace

StageInfo FitDampingStage::info() {
  return {
      .name = "fit-damping",
      .version = 2,
      .synopsis = "damping of the fast tissue model, from a motion that was measured",
      .description =
          "A body was plucked by the problem's load, let go, and its displacement measured over time (CSV: time_s; "
          "ux_mm, uy_mm, uz_mm or "
          "u_mm along --along; perhaps point, the number of a point of the mesh). Found are the damping that simulate "
          "has to be "
          "given, a factor on the stiffness (from the frequency), the moment of release, how far it was plucked, and "
          "the drift of each "
          "channel, each with its 95 % interval: least squares (Ceres) against simulate's own steps, so that "
          "what these take away of a motion by themselves is not taken for damping. The report says how much that is. "
          "Tables that are too "
          "short, too coarse, that do not swing, that are not sorted or hold no number are rejected with what to do.",
      .inputs = {{"mesh", {DataKind::tets}, "voxels of five tetrahedra each"},
                 {"problem", {DataKind::document}, "materials, what is fixed, the load that plucks, in JSON"},
                 {"motion", {DataKind::source}, "displacement over time (CSV)"},
                 {"constants", {DataKind::document}, "of calibrate", true}},
      .outputs = {{"damping", {DataKind::document}, "damping, stiffness, intervals, what the steps take away, in JSON"},
                  {"fitted", {DataKind::document}, "measured and fitted, value by value (CSV)", true}},
      .references = {"L. Meirovitch, Fundamentals of Vibrations, 2001, section 2.2 (logarithmic decrement)",
                     "D. Morris, Haptics and Physical Simulation for Virtual Bone Surgery, 2006, section 5.4"},
      .example = "osteo fit-damping tissue.vtu problem.json motion.csv damping.json --at-mm 20,2,2 --along 0,0,1"};
}

std::vector<Data> FitDampingStage::run(const Params& p, std::span<const Data> inputs, const Context& context) {
  const TetMesh& mesh = *std::get<Tets>(inputs[0]);
  const TissueProblem problem = parse_tissue_problem(std::get<Document>(inputs[1]).json, mesh);
  const auto* const constants = std::get_if<Document>(&inputs[3]);
  const TissueModel model =
      model_of_problem(mesh, problem, constants != nullptr ? std::optional(constants->json) : std::nullopt);
  const std::size_t n = load_named(problem, p.load);
  const Vec3 at{p.at_mm[0], p.at_mm[1], p.at_mm[2]};
  const std::uint32_t nearest = nearest_point(model, at);
  const auto& path = std::get<Source>(inputs[2]).path;
  const MeasuredMotion motion =
      read_motion(read_text(path), path.filename().string(), static_cast<std::uint32_t>(model.point_count()), nearest,
                  {p.along[0], p.along[1], p.along[2]});
  const bool by_place = motion.channels.front().name.find(" of point ") == std::string::npos;
  const double off = length(model.rest()[nearest] - at);
  if (by_place && off > longest_edge(model))
    throw Error(ExitCode::usage,
                "the nearest point of the mesh to --at-mm lies " + format_number(rounded(off)) +
                    " mm from it: it was not measured on this body",
                "places are LPS mm; mesh-info shows where the mesh is");
  DampingOptions options;
  options.density_kg_m3 = p.density_kg_m3;
  options.stepping = p.method == TimeMethod::implicit_steps ? Stepping::implicit_steps : Stepping::explicit_steps;
  options.step_s = p.step_ms / 1000;
  options.fit_stiffness = p.fit_stiffness;
  options.release_s = p.release_s;
  options.fit_release = p.fit_release;
  const DampingFit fit = fit_damping(model, problem.loads[n], problem.fixed, problem.sliders, motion, options, context);
  warn_of(fit, p, context);
  const double w = 2 * std::numbers::pi * (fit.measured.swings ? fit.measured.hz : fit.model_hz);
  const double undamped_w = fit.measured.swings ? std::hypot(w, fit.measured.decay_per_s) : w;
  const double numerical = fit.undamped_swings ? fit.undamped.decay_per_s : 0;
  Json j{{"osteotome_damping", 1},
         {"method", EnumNames<TimeMethod>::values[static_cast<std::size_t>(p.method)]},
         {"step_ms", 1000 * fit.step_s},
         {"damping_per_s", interval(fit.damping_per_s)},
         {"share_of_critical", fit.damping_per_s.value / (2 * undamped_w)},
         {"stiffness_fitted", p.fit_stiffness},
         {"stiffness_times", interval(fit.stiffness_times)},
         {"young_kpa", 1000 * problem.general.young_mpa * fit.stiffness_times.value},
         {"release_s", interval(fit.release_s)},
         {"amplitude_times", fit.amplitude_times},
         {"hz_of_the_problem", fit.model_hz},
         {"measured", swing(fit.measured)},
         {"fitted", swing(fit.model)},
         {"decay_of_the_steps_alone_per_s", numerical},
         {"share_of_decay_by_the_steps", fit.model.decay_per_s > 0 ? numerical / fit.model.decay_per_s : 0.0},
         {"residual_share", fit.residual_share},
         {"residual_correlation", fit.correlation},
         {"seconds", fit.span_s},
         {"interval_ms", 1000 * fit.interval_s},
         {"swings", fit.span_s * fit.measured.hz},
         {"converged", fit.converged},
         {"simulations", fit.simulations}};
  if (by_place) j["nearest_point_off_mm"] = off;
  j["channels"] = Json::list();
  for (std::size_t c = 0; c < fit.used.channels.size(); ++c)
    j["channels"].push_back({{"name", fit.used.channels[c].name},
                             {"point", fit.used.channels[c].point},
                             {"values", fit.used.channels[c].mm.size()},
                             {"drift_mm_per_s", fit.drift_mm_per_s[c]},
                             {"drift_error_mm_per_s", fit.drift_error_mm_per_s[c]}});
  context.report("damping_per_s", fit.damping_per_s.value);
  context.report("damping_low_95_per_s", fit.damping_per_s.low);
  context.report("damping_high_95_per_s", fit.damping_per_s.high);
  context.report("stiffness_times", fit.stiffness_times.value);
  context.report("share_of_decay_by_the_steps", fit.model.decay_per_s > 0 ? numerical / fit.model.decay_per_s : 0.0);
  context.report("residual_share", fit.residual_share);
  context.progress(1);
  return {Document{written(j)}, Document{table_of(fit)}};
}

}  // namespace osteo::inline app
