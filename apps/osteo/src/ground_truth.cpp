// ground-truth: haptic renderers against solids of which everything is known; ours, old ones, other programs.
#include <algorithm>
#include <chrono>
#include <ostream>

#include "commands/ground_truth.h"
#include "osteo/assessment/ground_truth/experiments.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/imaging/io/surface_io.h"

namespace osteo {

cli::CommandInfo GroundTruthCommand::info() {
  return {"ground-truth",
          "haptic renderers against solids of which surface, normal and force are known",
          "Plays generated trajectories of a probe over analytic solids through our renderers, through those of 2006 "
          "(voxels, a proxy with "
          "a friction "
          "cone), and with --program through anyone's, and writes tables, plots and a leaderboard. Without "
          "--experiment: all that "
          "docs/validation/ground-truth.md "
          "describes, in minutes. Same seed, same numbers, to the bit; times are kept apart, in costs.md.",
          {},
          "osteo ground-truth -o truth --program 'python3 mine.py'"};
}

int GroundTruthCommand::run(const Params& p, cli::Invocation& io) {
  if (p.out.empty()) throw Error(ExitCode::usage, "ground-truth needs a folder for what it writes", "-o FOLDER");
  if (p.trajectory.empty() != p.surface.empty())
    throw Error(ExitCode::usage, "--trajectory and --surface belong together");
  if (p.trajectory.empty() && (io.given.count("columns") != 0 || io.given.count("stiffness_n_per_mm") != 0))
    throw Error(ExitCode::usage, "--columns and --stiffness-n-per-mm have no effect without --trajectory");
  if (!p.trajectory.empty() && (!p.experiment.empty() || !p.bone.empty() || io.given.count("share") != 0))
    throw Error(ExitCode::usage, "--experiment, --bone and --share have no effect on a recorded --trajectory");
  truth::GroundTruthOptions o;
  o.seed = static_cast<std::uint64_t>(io.common.seed);
  o.share = p.share;
  o.program = p.program;
  if (!p.bone.empty()) o.bone = soup_of(*load_surface(p.bone));
  if (!p.experiment.empty()) {
    o.only = {truth::parse_experiment(read_text(p.experiment), p.experiment)};
    const auto& solids = o.only.front().solids;
    if (!p.bone.empty() && std::find(solids.begin(), solids.end(), "bone") == solids.end())
      throw Error(ExitCode::usage, "--bone has no effect on an experiment that does not name the solid 'bone'");
  }
  if (!p.trajectory.empty()) {
    o.recorded.samples = truth::load_traj(p.trajectory, p.columns);
    o.recorded.surface = soup_of(*load_surface(p.surface));
    o.recorded.stiffness_n_per_mm = p.stiffness_n_per_mm;
  }
  // Before minutes of work.
  truth::require_result_folder(p.out, io.common.force);
  const auto begin = std::chrono::steady_clock::now();
  const truth::GroundTruthResult r = truth::run_ground_truth(o, io.context);
  truth::write_ground_truth(r, o, p.out, io.common.force);
  const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  io.end_progress();
  if (io.common.json) {
    Json bars = Json::list();
    for (const truth::Bar& b : r.bars)
      bars.push_back({{"what", b.what}, {"limit", b.limit}, {"measured", b.measured}, {"held", b.held}});
    io.out << Json{{"folder", p.out}, {"seed", io.common.seed}, {"seconds", took}, {"bars", bars}}.dump(2) << '\n';
    return 0;
  }
  for (const truth::Bar& b : r.bars)
    io.out << (b.held ? "held    " : "missed  ") << b.what << ": " << b.measured << " (" << b.limit << ")\n";
  if (!io.common.quiet)
    io.err << p.out << "/leaderboard.html, " << r.tables.size() << " tables in " << static_cast<int>(took) << " s\n";
  return 0;
}

}  // namespace osteo
