// experiment: what a way of working costs a person, measured on a model of one.
#include <cmath>
#include <cstdio>
#include <ostream>

#include "commands.h"
#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/base/json_document.h"
#include "osteo/camera/camera_trial.h"

namespace osteo {

cli::CommandInfo ExperimentCommand::info() {
  return {
      "experiment",
      "time to bring the camera to a view, by mode of control (simulated)",
      "A model of a person, not a person: moves one after the other, each off by a share of its length, with times for looking, another "
      "grip and keys (docs/camera.md has the numbers). It moves the window's own camera, from view to view, by mouse, by pointing at "
      "bone, by a device that moves or turns the camera, by six degrees at once, by rates, and by views that were kept before. What "
      "follows for people is for people to show: 'osteo rehearse CASE --experiment camera' times yours on the same kind of views.",
      {{"which", "camera"}},
      "osteo experiment camera"};
}

int ExperimentCommand::run(const Params& p, cli::Invocation& io) {
  if (io.arguments[0] != "camera")
    throw Error(ExitCode::usage, "there is no experiment '" + io.arguments[0] + "'", "'camera' is the only one");
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
    io.out << "SIMULATED: a model of a person, " << p.targets << " views\nmode        median s   p90 s   moves   missed\n";
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
    std::snprintf(line, sizeof line, "%-10s %9.1f %7.1f %7.1f %8zu\n", std::string(names[m]).c_str(), s.median_s, s.p90_s, s.mean_moves,
                  s.missed);
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
    io.out << Json{{"simulated", true},        {"targets", p.targets},       {"seed", io.common.seed}, {"noise", p.noise},
                   {"crosstalk", p.crosstalk}, {"reaction_s", p.reaction_s}, {"modes", modes}}
                  .dump(2)
           << '\n';
  return 0;
}

}  // namespace osteo
