// experiment force-skill: the dissertation's chapter 4 as folder, runs and report.
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <mutex>
#include <ostream>
#include <set>

#include "commands/experiment.h"
#include "experiment_force.h"
#include "osteo/assessment/experiment/analysis.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/parallel.h"
#include "osteo/core/report/sheet.h"
#include "osteo/core/statistics/basics.h"
#include "window_program.h"

namespace osteo {
namespace {

using namespace experiment;

std::vector<std::string> codes_in(const std::string& text) {
  std::vector<std::string> codes;
  std::string code;
  for (const char c : text + ",") {
    if (c == ',') {
      if (!code.empty()) codes.push_back(code);
      code.clear();
    } else if (c != ' ') {
      code += c;
    }
  }
  return codes;
}

std::vector<std::string> numbered(const char* before, int count) {
  std::vector<std::string> codes;
  for (int i = 1; i <= count; ++i) codes.push_back(before + std::to_string(100 + i).substr(1));
  return codes;
}

// The folder's protocol; one of twelve people where there is none yet.
Protocol protocol_in(const fs::path& folder, const ExperimentCommand::Params& p, const cli::Invocation& io,
                     bool simulated) {
  if (output_exists(folder / "protocol.json")) {
    for (const char* const flag : {"people", "trials", "seed"}) {
      if (io.given.contains(flag))
        throw Error(ExitCode::usage, std::string("--") + flag + " does nothing here: the folder has a protocol",
                    "it is in " + (folder / "protocol.json").string());
    }
    return read_protocol(folder);
  }
  if (output_exists(folder) && !fs::is_empty(folder))
    throw Error(ExitCode::cannot_write, "'" + folder.string() + "' holds something that is no experiment",
                "give another folder");
  Protocol made;
  made.participants = io.given.contains("people") ? codes_in(p.people) : numbered(simulated ? "S" : "P", 12);
  made.trials = p.trials;
  made.seed = static_cast<int>(io.common.seed);
  made.simulated = simulated;
  if (p.trials <= made.break_after) made.break_after = 0;
  write_protocol(folder, made);
  return made;
}

int write_report(const fs::path& folder, const ExperimentCommand::Params& p, cli::Invocation& io) {
  const ExperimentAnalysis a = analyse(read_experiment(folder), p.level);
  const std::string base = (folder / "report").string();
  write_file(base + ".json", a.json.dump(2) + "\n");
  write_file(base + ".html", sheet_html(a.sheet));
  write_file(base + ".pdf", sheet_pdf(a.sheet));
  io.end_progress();
  if (io.common.json) {
    io.out << a.json.dump(2) << '\n';
  } else if (!io.common.quiet) {
    for (const Json& r : a.json.find("refused")->items())
      io.err << "not computed: " << *r.find("what")->text() << ". " << *r.find("why")->text() << '\n';
    io.err << base << ".html, .pdf and .json\n";
  }
  return 0;
}

int open_window(const fs::path& folder, const ExperimentCommand::Params& p, const cli::Invocation& io) {
  std::vector<std::string> args{window_program("osteo-experiment", "use --simulated --headless"), folder.string(),
                                "--participant=" + p.participant, "--device=" + p.device};
  if (p.retention) args.emplace_back("--retention");
  if (!p.state_file.empty()) args.push_back("--state-file=" + p.state_file);
  become(std::move(args), io);
}

int run_participant(const fs::path& folder, const ExperimentCommand::Params& p, cli::Invocation& io) {
  if (p.participant.empty())
    throw Error(ExitCode::usage, "whose trials?", "osteo experiment force-skill FOLDER --participant P01");
  const Protocol protocol = protocol_in(folder, p, io, p.simulated);
  const std::size_t who = participant_number(protocol, p.participant);
  if (p.headless && !p.simulated)
    throw Error(ExitCode::usage, "--headless has nobody to press", "add --simulated, or leave it out for the window");
  if (!p.simulated) {
    if (protocol.simulated)
      throw Error(ExitCode::usage, "this experiment's participants are programs", "give another folder for people");
    return open_window(folder, p, io);
  }
  if (!protocol.simulated)
    throw Error(ExitCode::usage,
                "this experiment's participants are people: --simulated would put a program among them",
                "give another folder, which is then made for programs");
  const std::size_t all = p.retention ? retention_of(protocol, who).size() : trials_of(protocol, who).size();
  std::size_t seen = 0;
  const std::size_t done = simulate_participant(
      folder, protocol, who, p.retention, p.null ? null_model() : ParticipantModel{}, io.context, [&] {
        ++seen;
        io.context.progress(static_cast<double>(seen) / static_cast<double>(all),
                            p.participant + ", trial " + std::to_string(seen) + " of " + std::to_string(all));
      });
  io.end_progress();
  if (io.common.json) {
    io.out
        << Json{{"participant", p.participant}, {"simulated", true}, {"trials_done_now", done}, {"trials", all}}.dump(2)
        << '\n';
  } else if (!io.common.quiet) {
    io.err << "SIMULATED: " << p.participant << ", " << done << " trials done now, " << all << " in all\n";
  }
  return 0;
}

int run_demo(const fs::path& folder, const ExperimentCommand::Params& p, cli::Invocation& io) {
  const Protocol protocol = protocol_in(folder, p, io, true);
  if (!protocol.simulated)
    throw Error(ExitCode::usage, "'" + folder.string() + "' is an experiment with people",
                "give the demo another folder");
  const std::size_t people = protocol.participants.size();
  const std::size_t trials =
      static_cast<std::size_t>(protocol.trials + protocol.trials / protocol.repetitions) * people;
  std::mutex mutex;
  std::size_t seen = 0;
  parallel_for(people, 1, io.common.threads, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      for (const bool retention : {false, true}) {
        (void)simulate_participant(
            folder, protocol, i, retention, p.null ? null_model() : ParticipantModel{}, io.context, [&] {
              const std::lock_guard lock(mutex);
              ++seen;
              io.context.progress(0.95 * static_cast<double>(seen) / static_cast<double>(trials),
                                  "trial " + std::to_string(seen) + " of " + std::to_string(trials));
            });
      }
    }
  });
  io.context.progress(0.96, "analysis");
  return write_report(folder, p, io);
}

int write_stimuli(const fs::path& folder, const ExperimentCommand::Params& p, cli::Invocation& io) {
  const Protocol protocol = protocol_in(folder, p, io, false);
  make_output_folder(folder / "stimuli");
  int count = 0;
  for (const Trial& t : trials_of(protocol, 0)) {
    if (t.repetition != 1) continue;
    const Stimulus s = stimulus_of(protocol, t);
    const std::string name = "stimulus-" + std::to_string(100 + t.block).substr(1);
    write_file(folder / "stimuli" / (name + ".csv"), stimulus_csv(s));
    write_file(folder / "stimuli" / (name + ".json"), stimulus_json(s));
    ++count;
  }
  if (io.common.json) {
    io.out << Json{{"stimuli", count}, {"folder", (folder / "stimuli").string()}}.dump(2) << '\n';
  } else if (!io.common.quiet) {
    io.err << count << " stimuli in " << (folder / "stimuli").string() << '\n';
  }
  return 0;
}

int run_null(const ExperimentCommand::Params& p, cli::Invocation& io) {
  NullSettings s;
  s.experiments = p.experiments;
  s.seed = static_cast<std::uint64_t>(io.common.seed);
  if (p.chain) {
    // Small ones: each trial is a run on a simulated device.
    s.people = 6;
    s.trials = 3;
  }
  const NullResult n = p.chain ? null_chain(s, null_model(), io.context) : null_experiments(s);
  Json rows = Json::list();
  if (!io.common.json)
    io.out << "SIMULATED: " << n.experiments << " experiments of " << s.people << " people, "
           << (p.chain ? "by programs on a simulated device, " : "scores drawn, ")
           << "without any effect, tests at 5 %\n";
  for (const auto& [name, found, valid] : {std::tuple{"repeated measures", n.repeated, true},
                                           std::tuple{"repeated measures, Greenhouse-Geisser", n.repeated_gg, true},
                                           std::tuple{"any pair, paired t with Holm", n.any_pair_holm, true},
                                           std::tuple{"pooled one-way ANOVA (as printed)", n.pooled, false}}) {
    const statistics::Interval i = statistics::wilson(found, n.experiments);
    rows.push_back({{"test", name},
                    {"valid", valid},
                    {"found", found},
                    {"share", static_cast<double>(found) / n.experiments},
                    {"interval", Json{i.lo, i.hi}}});
    char line[160];
    std::snprintf(line, sizeof line, "%-40s %5.1f %%  (%.1f to %.1f)\n", name, 100.0 * found / n.experiments,
                  100 * i.lo, 100 * i.hi);
    if (!io.common.json) io.out << line;
  }
  if (io.common.json)
    io.out << Json{{"simulated", true},
                   {"chain", p.chain},
                   {"experiments", n.experiments},
                   {"people", s.people},
                   {"tests", rows}}
                  .dump(2)
           << '\n';
  return 0;
}

// Beside --seed, --json and the like; anything else would do nothing.
const std::map<std::string, std::set<std::string>>& flags_of_experiments() {
  static const std::map<std::string, std::set<std::string>> flags{
      {"force-skill",
       {"participant", "people", "trials", "headless", "simulated", "retention", "null", "device", "state_file"}},
      {"analyse", {"level"}},
      {"demo", {"people", "trials", "null", "level", "out"}},
      {"stimuli", {"people", "trials"}},
      {"null", {"experiments", "chain"}},
  };
  return flags;
}

}  // namespace

bool is_force_experiment(const std::string& which) {
  return flags_of_experiments().contains(which);
}

int run_force_experiment(const ExperimentCommand::Params& p, cli::Invocation& io) {
  const std::string which = io.arguments[0];
  const auto& flags = flags_of_experiments().at(which);
  for (const FieldRef& f : [&] {
         static ExperimentCommand::Params defaults;
         return fields_of<ExperimentCommand>(defaults);
       }()) {
    if (io.given.contains(std::string(f.doc.name)) && !flags.contains(std::string(f.doc.name)))
      throw Error(ExitCode::usage, f.flag() + " does nothing with 'experiment " + which + "'");
  }
  if (which == "null") {
    if (io.arguments.size() > 1)
      throw Error(ExitCode::usage, "'experiment null' takes no folder: '" + io.arguments[1] + "'");
    return run_null(p, io);
  }
  if (io.arguments.size() > 1 && !p.out.empty())
    throw Error(ExitCode::usage, "the folder is given twice", "leave -o out");
  if (io.arguments.size() < 2 && p.out.empty() && which != "force-skill")
    throw Error(ExitCode::usage, "'experiment " + which + "' needs a folder", "osteo experiment " + which + " FOLDER");
  const fs::path folder = io.arguments.size() > 1 ? io.arguments[1]
                          : p.out.empty()         ? std::string("force-skill")
                                                  : p.out;
  if (which == "force-skill") return run_participant(folder, p, io);
  if (which == "demo") return run_demo(folder, p, io);
  if (which == "stimuli") return write_stimuli(folder, p, io);
  return write_report(folder, p, io);
}

}  // namespace osteo
