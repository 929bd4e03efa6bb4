#include "osteo/assessment/ground_truth/experiments.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <mutex>

#include "ground_truth_json.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/parallel.h"
#include "tables.h"

namespace osteo::inline assessment::truth {
namespace {

constexpr double kBoneSpacing = 1.25;  // mm

struct Row {
  std::string solid, renderer;
  double friction = 0;
  Played played;
};

std::shared_ptr<const Solid> solid_of(const std::string& name, const std::shared_ptr<const Solid>& bone) {
  return name == "bone" ? bone : make_solid(name);
}

std::vector<Row> rows_of(const Experiment& e, const RunAll& run, const std::shared_ptr<const Solid>& bone) {
  std::vector<Row> rows;
  for (const std::string& s : e.solids)
    for (const double f : e.frictions)
      for (const std::string& r : e.renderers) rows.push_back({s, r, f, {}});
  // A solid's trajectories are made once.
  std::map<std::pair<std::string, double>, Trajectory> trajectories;
  std::map<std::string, std::shared_ptr<const Solid>> solids;
  for (const std::string& s : e.solids) {
    const auto solid = solids[s] = solid_of(s, bone);
    if (!solid) throw Error(ExitCode::usage, "experiment '" + e.id + "' needs a bone", "--bone SURFACE names one");
    for (const double f : e.frictions) {
      TruthParams p;
      p.path.seed = run.options.seed;
      p.seconds = std::max(1.0, e.seconds * run.options.share);
      p.rate_hz = e.rate_hz;
      p.stiffness_n_per_mm = e.stiffness_n_per_mm;
      p.friction = f;
      p.probe_radius_mm = e.probe_radius_mm;
      p.lifts = e.lifts;
      p.device_by_normal_force = e.normal_force_only;
      Trajectory t = true_trajectory(*solid, p);
      if (e.instruments) {
        Instruments in;
        in.seed = run.options.seed;
        t = measured_trajectory(*solid, t, in);
      }
      trajectories.emplace(std::pair(s, f), std::move(t));
    }
  }
  std::size_t done = 0;
  std::mutex mutex;
  parallel_for(rows.size(), 1, run.context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Row& row = rows[i];
      const Trajectory& t = trajectories.at({row.solid, row.friction});
      // With instruments, friction is in the forces alone, as in the thesis' table.
      const RenderSettings s{.stiffness_n_per_mm = t.stiffness_n_per_mm,
                             .friction = e.instruments ? 0 : row.friction,
                             .rate_hz = t.rate_hz,
                             .probe_radius_mm = e.probe_radius_mm};
      Context alone = run.context;
      alone.threads = 1;
      const auto renderer = make_point_renderer(row.renderer, *solids.at(row.solid), s, alone);
      row.played = play(t, *renderer, s, false, run.context);
      const std::lock_guard lock(mutex);
      run.context.progress(static_cast<double>(++done) / static_cast<double>(rows.size()), e.id);
    }
  });
  return rows;
}

// "cone-shaded:9024" -> 9024; 0 where there is none.
double size_of(const std::string& renderer) {
  const std::size_t colon = renderer.find(':');
  double v = 0;
  if (colon != std::string::npos) std::from_chars(renderer.data() + colon + 1, renderer.data() + renderer.size(), v);
  return v;
}

// `legend`: which line is which, for the text above.
sheet::Plot plot_by_size(const Experiment& e, const std::vector<Row>& rows, std::string& legend) {
  sheet::Plot plot;
  plot.id = e.id;
  plot.title = "Mean force error over triangles";
  double least = 1e9, most = 0, lowest = 1e9, highest = 0;
  const auto at = [&](double size, double error) {
    const sheet::Plot::At p{std::log10(size), std::log10(std::max(1e-6, error))};
    least = std::min(least, p[0]);
    most = std::max(most, p[0]);
    lowest = std::min(lowest, p[1]);
    highest = std::max(highest, p[1]);
    return p;
  };
  static constexpr std::array kTones{Tone::bad, Tone::caution, Tone::quiet, Tone::good};
  std::vector<std::string> kinds;
  for (const Row& r : rows) {
    const std::string kind = r.renderer.substr(0, r.renderer.find(':'));
    if (std::find(kinds.begin(), kinds.end(), kind) == kinds.end()) kinds.push_back(kind);
  }
  static constexpr std::array<std::string_view, 4> kNames{"red", "amber", "grey", "green"};
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    sheet::Plot::Line line;
    line.tone = kTones[k % kTones.size()];
    for (const Row& r : rows)
      if (r.renderer.substr(0, r.renderer.find(':')) == kinds[k] && size_of(r.renderer) > 0)
        line.at.push_back(at(size_of(r.renderer), r.played.accuracy.mean_n));
    plot.points.push_back({line.at, line.tone, false});
    plot.lines.push_back(line);
    legend += std::string(legend.empty() ? "" : ", ") + kinds[k] + " (" + std::string(kNames[k % kNames.size()]) + ")";
  }
  sheet::Plot::Line printed;
  printed.dashed = true;
  for (const auto& [renderer, v] : e.printed) printed.at.push_back(at(size_of(renderer), v));
  std::sort(printed.at.begin(), printed.at.end());
  plot.lines.push_back(printed);
  const auto decades = [](double lo, double hi, const std::string& name, const std::string& unit) {
    sheet::Plot::Axis a{std::floor(lo), std::ceil(hi), 1, name, {}};
    for (double d = a.from; d <= a.to; ++d)
      a.named.emplace_back(d, d >= 6   ? digits(std::pow(10, d - 6), 1) + " M" + unit
                              : d >= 3 ? digits(std::pow(10, d - 3), 1) + " k" + unit
                                       : digits(std::pow(10, d), 1) + unit);
    return a;
  };
  plot.x = decades(least, most, "triangles", "");
  plot.y = decades(lowest, highest, "N", "");
  plot.height_mm = 70;
  return plot;
}

void add_table(const Experiment& e, const std::vector<Row>& rows, const RunAll& run) {
  ResultTable table{e.id, e.title, e.note, {"solid", "renderer", "friction"}, {}, {}};
  if (!e.printed.empty()) table.head.push_back("printed N");
  for (const char* h : {"mean N", "RMS N", "p95 N", "max N", "direction deg", "position mm", "over 0.5 mm %",
                        "missed ms", "false ms", "pushed in", "operations"})
    table.head.push_back(h);
  ResultTable cost{
      e.id + "-cost", e.title + ": cost", "", {"solid", "renderer", "ns p50", "ns p99", "set-up s", "MB"}, {}, {}};
  for (const Row& r : rows) {
    const Accuracy& a = r.played.accuracy;
    std::vector<std::string> cells{r.solid, r.renderer, digits(r.friction, 2)};
    if (!e.printed.empty()) {
      const auto found = e.printed.find(r.renderer);
      cells.push_back(found == e.printed.end() ? "" : fixed(found->second, 3));
    }
    for (const std::string& c :
         {fixed(a.mean_n, 5), fixed(a.rms_n, 5), fixed(a.p95_n, 5), fixed(a.max_n, 4), fixed(a.direction_deg, 3),
          fixed(a.position_mean_mm, 4),
          fixed(a.moments > 0 ? 100.0 * static_cast<double>(a.position_over) / static_cast<double>(a.moments) : 0, 1),
          fixed(a.missed_ms, 0), fixed(a.false_ms, 0), std::to_string(a.popped), fixed(a.operations, 1)})
      cells.push_back(c);
    table.cells.push_back(std::move(cells));
    const Cost& c = r.played.cost;
    cost.cells.push_back(
        {r.solid, r.renderer, fixed(c.ns_p50, 0), fixed(c.ns_p99, 0), fixed(c.setup_s, 3), fixed(c.memory_mb, 2)});
  }
  if (e.plot_by_size) {
    std::string legend;
    table.plots.push_back(plot_by_size(e, rows, legend));
    table.note += std::string(table.note.empty() ? "" : " ") + "Lines: " + legend +
                  (e.printed.empty() ? "." : "; dashed: printed in 2006.");
  }
  run.result.tables.push_back(std::move(table));
  run.result.costs.push_back(std::move(cost));
}

// Someone's recording through every renderer that takes a mesh or a field.
void run_recorded(const RunAll& run) {
  const Recorded& recorded = run.options.recorded;
  const auto solid = make_mesh_solid(recorded.surface, run.context);
  const Trajectory t = trajectory_of(*solid, recorded.samples, recorded.stiffness_n_per_mm);
  Experiment e;
  e.id = "recorded";
  e.title = "A recorded trajectory";
  e.note =
      "Forces as they were recorded; the contact is the nearest point of the surface, the in-trajectory p_out - F_n / "
      "k.";
  e.printed = {{"voxel:32/1000", 0.136}, {"voxel:64/1000", 0.130}, {"cone:1000", 0.129}};
  e.renderers = {"voxel:32/1000", "voxel:64/1000", "cone:1000", "cone-shaded:1000", "triangles:1000",
                 "shaded:1000",   "field:64",      "spline:64", "spline:128"};
  if (!run.options.program.empty()) e.renderers.push_back("process:" + run.options.program);
  std::vector<Row> rows;
  for (const std::string& what : e.renderers) {
    run.context.progress(static_cast<double>(rows.size()) / static_cast<double>(e.renderers.size()), what);
    const RenderSettings s{.stiffness_n_per_mm = t.stiffness_n_per_mm, .rate_hz = t.rate_hz};
    rows.push_back(
        {"recorded", what, 0, play(t, *make_point_renderer(what, *solid, s, run.context), s, false, run.context)});
  }
  add_table(e, rows, run);
}

void run_experiment(const Experiment& e, const RunAll& run, const std::shared_ptr<const Solid>& bone) {
  const std::vector<Row> rows = rows_of(e, run, bone);
  add_table(e, rows, run);
  if (e.id == "solids") {
    for (const std::string& renderer : e.renderers) {
      Rank rank{renderer};
      int plain = 0, rough = 0;
      for (const Row& r : rows) {
        if (r.renderer != renderer) continue;
        const Accuracy& a = r.played.accuracy;
        (r.friction > 0 ? rank.friction_mean_n : rank.mean_n) += a.mean_n;
        ++(r.friction > 0 ? rough : plain);
        rank.max_n = std::max(rank.max_n, a.max_n);
        rank.missed_ms += a.missed_ms;
        rank.popped += a.popped;
        rank.ns_p50 = std::max(rank.ns_p50, r.played.cost.ns_p50);
        rank.memory_mb = std::max(rank.memory_mb, r.played.cost.memory_mb);
      }
      rank.mean_n /= std::max(1, plain);
      rank.friction_mean_n /= std::max(1, rough);
      run.result.ranks.push_back(rank);
    }
    std::stable_sort(run.result.ranks.begin(), run.result.ranks.end(),
                     [](const Rank& a, const Rank& b) { return a.mean_n < b.mean_n; });
    for (const double friction : {0.0, 0.3}) {
      // The smooth ones are what 1 MB, 64^3 voxels, can hold.
      double worst = 0, duck = 0, all = 0;
      for (const Row& r : rows) {
        if (r.renderer != "spline:64" || r.friction != friction) continue;
        const double m = r.played.accuracy.mean_n;
        if (r.solid == "duck") duck = m;
        all = std::max(all, m);
        if (r.solid == "plane" || r.solid == "sphere" || r.solid == "torus" || r.solid == "duck" || r.solid == "saddle")
          worst = std::max(worst, m);
      }
      const double limit = friction > 0 ? 0.001 : 0.0005;
      run.result.bars.push_back(
          {std::string("mean force error on the duck, 1 MB (spline:64), friction ") + digits(friction, 2),
           fixed(limit, 4) + " N", fixed(duck, 5) + " N", duck <= limit});
      run.result.bars.push_back(
          {std::string("the same, worst of plane, sphere, torus, duck, saddle, friction ") + digits(friction, 2),
           fixed(limit, 4) + " N", fixed(worst, 5) + " N", worst <= limit});
      run.result.bars.push_back(
          {std::string("the same, worst of all nine (sharp edges, a thin wall), friction ") + digits(friction, 2),
           fixed(limit, 4) + " N", fixed(all, 5) + " N", all <= limit});
    }
  }
}

}  // namespace

std::string fixed(double v, int after) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", after, v);
  return text;
}
std::string digits(double v, int count) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*g", count, v);
  if (std::string_view(text).find('e') != std::string_view::npos && std::abs(v) >= 1 && std::abs(v) < 1e9)
    std::snprintf(text, sizeof text, "%.0f", v);
  return text;
}
sheet::Plot::Axis axis(double lo, double hi, const std::string& name) {
  if (!(hi > lo)) hi = lo + 1;
  const double raw = (hi - lo) / 4, magnitude = std::pow(10, std::floor(std::log10(raw)));
  double tick = magnitude;
  for (const double m : {2.0, 5.0})
    if (m * magnitude <= raw) tick = m * magnitude;
  return {std::floor(lo / tick) * tick, std::ceil(hi / tick) * tick, tick, name, {}};
}

Experiment parse_experiment(std::string_view text, const std::string& name) {
  const JsonFile file(text, name);
  Experiment e;
  file.require_format("osteotome_ground_truth");
  const std::vector<std::string> besides{"osteotome_ground_truth", "solids", "renderers", "frictions", "printed"};
  const auto fields = fields_of<Experiment>(e);
  file.read(file.root(), "", fields, besides);
  const auto texts = [&](const char* key) {
    std::vector<std::string> out;
    for (const JsonValue& v : file.list(file.need(file.root(), "", key), std::string("\"") + key + "\""))
      out.push_back(file.text(v, std::string("an item of \"") + key + "\""));
    if (out.empty()) throw file.wrong(file.root(), std::string("\"") + key + "\" names nothing");
    return out;
  };
  e.solids = texts("solids");
  for (const JsonValue& v : file.need(file.root(), "", "solids").items) {
    if (v.text == "bone") continue;
    try {
      static_cast<void>(make_solid(v.text));
    } catch (const Error& error) {
      throw file.wrong(v, error.what(), error.advice());
    }
  }
  e.renderers = texts("renderers");
  if (const JsonValue* f = file.root().find("frictions")) {
    e.frictions.clear();
    for (const JsonValue& v : file.list(*f, "\"frictions\""))
      e.frictions.push_back(file.number(v, "an item of \"frictions\"", 0, 3));
    if (e.frictions.empty()) throw file.wrong(*f, "\"frictions\" names nothing");
  }
  if (const JsonValue* p = file.root().find("printed")) {
    file.allow(*p, "\"printed\"", e.renderers);
    for (const JsonMember& m : p->members) e.printed[m.key] = file.number(m.value, "\"" + m.key + "\"", 0, 1000);
  }
  if (e.id.empty() || e.id.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") != std::string::npos)
    throw file.wrong(file.root(), "\"id\" is of small letters, digits and '-'");
  if (e.title.empty()) e.title = e.id;
  return e;
}

const std::vector<Experiment>& built_in_experiments() {
  static const std::vector<Experiment> all = [] {
    std::vector<Experiment> v;
    for (const auto& [name, text] : kGroundTruthJson)
      v.push_back(parse_experiment(text, "the built-in " + std::string(name)));
    return v;
  }();
  return all;
}

GroundTruthResult run_ground_truth(const GroundTruthOptions& options, const Context& context) {
  if (!(options.share > 0 && options.share <= 10))
    throw Error(ExitCode::usage, "the share of the length lies between 0 and 10");
  GroundTruthResult result;
  std::shared_ptr<const Solid> bone;
  // Its progress is not part of the whole's.
  if (!options.bone.triangles.empty()) bone = make_bone(options.bone, kBoneSpacing, context.sub(0, 0));
  std::vector<Experiment> experiments = options.only.empty() ? built_in_experiments() : options.only;
  if (options.only.empty() && bone) {
    Experiment e;
    e.id = "bone";
    e.title = "A bone, by the exact distance to its mesh";
    e.note =
        "Brought to 70 mm. The truth is the surface where that distance, in voxels of 1.25 mm joined by the cubic "
        "spline, is 0; 8 N/mm. "
        "Triangles are the "
        "mesh itself, so they differ from it by what the spline rounds off as well. Sharper than its voxels it is "
        "still here and there: ";
    // Where the way in has another way out, the truth is not the only one.
    const PathParams path{options.seed, false};
    int other = 0;
    for (int i = 0; i < 400; ++i) {
      const Vec3 at = bone->place(0.05 * i, path);
      other += length(bone->foot(at - bone->normal(at) * (2 / bone->stiffness_n_per_mm())) - at) > 0.1 ? 1 : 0;
    }
    e.note += "at " + std::to_string(other) +
              " of 400 places of the way the surface nearest to the device, pressed with 2 N, is another.";
    e.solids = {"bone"};
    e.frictions = {0, 0.3};
    e.renderers = {"exact",       "field:128",      "spline:128", "field:64",     "spline:64",
                   "shaded:1000", "triangles:1000", "cone:1000",  "voxel:64/1000"};
    experiments.push_back(e);
  }
  if (!options.recorded.samples.empty()) {
    run_recorded({options, context, result});
    return result;
  }
  if (!options.program.empty()) {
    for (Experiment& e : experiments)
      if (e.id == "table-4" || !options.only.empty()) e.renderers.push_back("process:" + options.program);
  }
  const std::size_t special = options.only.empty() ? 10 : 0, steps = experiments.size() + special;
  std::size_t step = 0;
  const auto next = [&] {
    ++step;
    return context.sub(static_cast<double>(step - 1) / static_cast<double>(steps),
                       static_cast<double>(step) / static_cast<double>(steps));
  };
  for (const Experiment& e : experiments) {
    const Context part = next();
    run_experiment(e, {options, part, result}, bone);
  }
  if (options.only.empty()) {
    for (auto* const run : {run_friction, run_ridges, run_units, run_rates, run_smoothness, run_receding, run_layers,
                            run_delay, run_vibration, run_texture}) {
      const Context part = next();
      part.progress(0, "special experiments");
      run({options, part, result});
    }
  }
  return result;
}

}  // namespace osteo::inline assessment::truth
