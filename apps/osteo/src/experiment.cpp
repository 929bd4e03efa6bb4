// experiment: what a way of working costs a person, measured on a model of one; and force-skill training, of people
// too.
#include <cmath>
#include <cstdio>
#include <ostream>

#include "commands/experiment.h"
#include "experiment_force.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/simulation/camera/camera_trial.h"

namespace osteo {

cli::CommandInfo ExperimentCommand::info() {
  return {"experiment",
          "force-skill training and its analysis; time to bring the camera to a view (simulated)",
          "force-skill: 72 trials of learning a force along a path by hand (H), by eye (V) or by both (V+H), each "
          "tested by recall at once "
          "(D. Morris 2006, chapter 4). FOLDER holds protocol.json (made where it is missing), and every tick and "
          "score of each participant; "
          "stopped, it goes on at the trial that was not finished. With --simulated a program takes part. 'analyse' "
          "compares trainings within "
          "people and writes report.html, .pdf and .json; 'stimuli' writes paths and forces as CSV and JSON; 'demo' is "
          "all of it by simulated "
          "participants; 'null' counts what tests find where nothing is. docs/guides/experiments.md defines every number.\n"
          "camera: a model of a person moves the window's own camera from view to view, one move after the other, each "
          "off by a share of its "
          "length, with times for looking, another grip and keys (docs/how-to/camera.md has the numbers). What follows for "
          "people is for people to "
          "show: 'osteo rehearse CASE --experiment camera' times yours on the same kind of views.",
          {{"which", "force-skill, analyse, stimuli, demo, null or camera"},
           {"folder", "of force-skill training (force-skill: 'force-skill')", true}},
          "osteo experiment demo -o FOLDER",
          false,
          {},
          {"out", "state_file"}};
}

int ExperimentCommand::run(const Params& p, cli::Invocation& io) {
  if (is_force_experiment(io.arguments[0])) return run_force_experiment(p, io);
  if (io.arguments[0] != "camera") {
    const std::vector<std::string> known{"force-skill", "analyse", "stimuli", "demo", "null", "camera"};
    const std::string near = nearest_name(io.arguments[0], known);
    throw Error(ExitCode::usage, "there is no experiment '" + io.arguments[0] + "'",
                near.empty() ? "force-skill, analyse, stimuli, demo, null or camera" : "did you mean '" + near + "'?");
  }
  if (io.arguments.size() > 1)
    throw Error(ExitCode::usage, "'experiment camera' takes no folder: '" + io.arguments[1] + "'");
  for (const char* const flag : {"participant", "people", "trials", "device", "headless", "simulated", "retention",
                                 "null", "experiments", "chain", "level", "state_file"}) {
    if (io.given.contains(flag))
      throw Error(ExitCode::usage, "--" + std::string(flag) + " does nothing with 'experiment camera'");
  }
  if (!p.out.empty() && fs::exists(p.out) && !io.common.force)
    throw Error(ExitCode::cannot_write, "'" + p.out + "' exists already", "--force replaces it");
  // As a temporal bone begins in the window.
  const ScopeView start = overview({}, 60, {0.94, -0.25, 0.22});
  const auto seed = static_cast<std::uint64_t>(io.common.seed);
  const auto targets = camera_targets(start, static_cast<std::size_t>(p.targets), seed);
  SimulatedPerson person;
  person.noise = p.noise;
  person.crosstalk = p.crosstalk;
  person.reaction_s = p.reaction_s;
  Json modes = Json::list();
  std::string csv;
  if (!io.common.json)
    io.out << "SIMULATED: a model of a person, " << p.targets
           << " views\nmode        median s   p90 s   moves   missed\n";
  const auto& names = EnumNames<CameraMode>::values;
  for (std::size_t m = 0; m < names.size(); ++m) {
    io.context.progress(static_cast<double>(m) / static_cast<double>(names.size()), names[m]);
    const auto results = simulate_trial(static_cast<CameraMode>(m), start, targets, person, seed);
    const TrialSummary s = summary_of(results);
    const auto rounded = [](double v) { return std::round(v * 100) / 100; };
    modes.push_back({{"mode", std::string(names[m])},
                     {"median_s", rounded(s.median_s)},
                     {"p90_s", rounded(s.p90_s)},
                     {"mean_moves", rounded(s.mean_moves)},
                     {"missed", static_cast<std::int64_t>(s.missed)}});
    char line[96];
    std::snprintf(line, sizeof line, "%-10s %9.1f %7.1f %7.1f %8zu\n", std::string(names[m]).c_str(), s.median_s,
                  s.p90_s, s.mean_moves, s.missed);
    if (!io.common.json) io.out << line;
    std::string rows = trial_csv(results);
    const std::size_t header = rows.find('\n') + 1;
    if (m == 0) csv = "simulated,mode," + rows.substr(0, header);
    for (std::size_t at = header; at < rows.size();) {
      const std::size_t end = rows.find('\n', at) + 1;
      csv += "1," + std::string(names[m]) + "," + rows.substr(at, end - at);
      at = end;
    }
  }
  io.end_progress();
  if (!p.out.empty()) write_file(p.out, csv);
  if (io.common.json)
    io.out << Json{{"simulated", true}, {"targets", p.targets},     {"seed", io.common.seed},
                   {"noise", p.noise},  {"crosstalk", p.crosstalk}, {"reaction_s", p.reaction_s},
                   {"modes", modes}}
                  .dump(2)
           << '\n';
  return 0;
}

}  // namespace osteo
