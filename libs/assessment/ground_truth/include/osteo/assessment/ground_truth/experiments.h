// Experiments: renderers on trajectories, as tables with what they were in 2006, and a page.
#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/assessment/ground_truth/measure.h"
#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/report/sheet.h"

namespace osteo::inline assessment::truth {

/// Renderers times solids times friction, from a file of pipelines/ground-truth.
struct Experiment {
  using Params = Experiment;
  std::string id, title, note;
  std::vector<std::string> solids, renderers;
  std::vector<double> frictions{0};
  std::map<std::string, double> printed;  ///< renderer -> mean force error of the thesis, N
  double seconds = 20, rate_hz = 1000, stiffness_n_per_mm = 0, probe_radius_mm = 0;
  bool lifts = false, instruments = false, normal_force_only = false, plot_by_size = false;

  static void describe(Experiment& e, auto& visit) {
    visit({"id", "name, of letters, digits and '-'"}, e.id);
    visit({"title", "heading of its table"}, e.title);
    visit({"note", "what to think of when reading it"}, e.note);
    visit({"seconds", "seconds of each trajectory", "s", 0.5, 600}, e.seconds);
    visit({"rate_hz", "rate of each trajectory", "Hz", 50, 20000}, e.rate_hz);
    visit({"stiffness_n_per_mm", "0: each solid's own", "N/mm", 0, 100}, e.stiffness_n_per_mm);
    visit({"probe_radius_mm", "radius of the probe; burrs need 2", "mm", 0, 10}, e.probe_radius_mm);
    visit({"lifts", "half a second in the air every 5 s"}, e.lifts);
    visit({"instruments", "positions and forces with the noise of the instruments of 2006"}, e.instruments);
    visit({"normal_force_only", "p_in = p_out - F_n / k, without friction's share"}, e.normal_force_only);
    visit({"plot_by_size", "a curve for each kind of renderer over the number after its colon"}, e.plot_by_size);
  }
};
/// { "osteotome_ground_truth": 1, fields of Experiment, "solids", "renderers", "frictions", "printed" }. Error(usage)
/// with the line.
[[nodiscard]] Experiment parse_experiment(std::string_view json, const std::string& name);

/// One table; `cells` are texts, ready to print.
struct ResultTable {
  std::string id, title, note;
  std::vector<std::string> head;
  std::vector<std::vector<std::string>> cells;
  std::vector<sheet::Plot> plots;
};
struct Bar {
  std::string what, limit, measured;
  bool held = false;
};
/// A renderer over all solids of "solids", for the leaderboard.
struct Rank {
  std::string renderer;
  double mean_n = 0, friction_mean_n = 0, max_n = 0, missed_ms = 0, ns_p50 = 0, memory_mb = 0;
  std::size_t popped = 0;
};
struct GroundTruthResult {
  std::vector<ResultTable> tables;  ///< the same to the bit for the same seed
  std::vector<ResultTable> costs;   ///< of this machine
  std::vector<Bar> bars;
  std::vector<Rank> ranks;  ///< best first, by the mean error without friction
};

/// A recording of someone's probe on someone's object, both in the same coordinates.
struct Recorded {
  std::vector<TrajSample> samples;  ///< of the surface's contact, with the forces on the probe (empty: none)
  TriangleSoup surface;
  double stiffness_n_per_mm = 0.5;
};
struct GroundTruthOptions {
  std::uint64_t seed = 1;
  double share = 1;              ///< of each trajectory's length: less is quicker, and less is seen
  std::string program;           ///< measured beside the others, as process:PROGRAM (empty: none)
  TriangleSoup bone;             ///< a real bone's surface (empty: none)
  std::vector<Experiment> only;  ///< these instead of all that is built in
  Recorded recorded;             ///< this instead of all that is built in
};
/// All experiments of docs/validation/ground-truth.md. Independent rows run in threads; results do not depend on how many.
[[nodiscard]] GroundTruthResult run_ground_truth(const GroundTruthOptions& options, const Context& context = {});
/// Those that are files, in their order: pipelines/ground-truth.
[[nodiscard]] const std::vector<Experiment>& built_in_experiments();

[[nodiscard]] std::string markdown_of(const GroundTruthResult& result);
/// The reproducible part, as JSON.
[[nodiscard]] std::string results_json(const GroundTruthResult& result, const GroundTruthOptions& options);
[[nodiscard]] Sheet leaderboard_sheet(const GroundTruthResult& result, const GroundTruthOptions& options);
/// Error(cannot_write) where the folder holds something that is not to be replaced.
void require_result_folder(const std::filesystem::path& folder, bool replace);
/// FOLDER/results.json, tables.md, costs.md, leaderboard.html and .pdf, and trajectories/SOLID.{probe,out,in}.traj and
/// .csv of 20 s each. Written whole or not at all. Errors as of require_result_folder.
void write_ground_truth(const GroundTruthResult& result, const GroundTruthOptions& options,
                        const std::filesystem::path& folder, bool replace);

}  // namespace osteo::inline assessment::truth
