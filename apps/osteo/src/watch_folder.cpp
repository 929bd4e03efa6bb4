// watch: scans that come into a folder become cases, by rules.
#include "osteo/hospital/pacs/watch.h"

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <ostream>

#include "batch_command.h"
#include "built_in_pipelines.h"
#include "osteo/app/stages/registry.h"
#include "osteo/core/base/json_document.h"
#include "osteo/hospital/pacs/orthanc.h"
#include "osteo/imaging/pipeline/pipeline.h"
#include "pacs_commands.h"

namespace osteo {
namespace {

// All that can be known to go wrong is told before anything is begun.
void check_rule(const SeriesRule& rule) {
  if (rule.ignore) return;
  const std::string text = rule.pipeline.empty() ? std::string(kTemporalBonePipeline) : read_text(rule.pipeline);
  PrepareCommand::Params prepare;
  std::vector<std::string> known;
  for (const FieldRef& f : case_fields(prepare)) known.emplace_back(f.doc.name);
  for (const PipelineVariable& v : pipeline_variables(text)) known.push_back(v.name);
  for (const auto& [name, value] : rule.set) {
    if (name.find('.') != std::string::npos || std::ranges::find(known, name) != known.end()) continue;
    const std::string near = nearest_name(name, known);
    throw Error(ExitCode::usage, "rule '" + rule.name + "' sets " + name + ": that is no setting of a case",
                near.empty() ? "'osteo help prepare' shows them" : "did you mean '" + near + "'?");
  }
  try {
    check_case_settings(text, rule.set, osteo_stages());
  } catch (const Error& e) {
    throw Error(ExitCode::usage, "rule '" + rule.name + "': " + e.what(), e.advice());
  }
}

}  // namespace

std::vector<SeriesRule> checked_rules(const fs::path& file) {
  std::vector<SeriesRule> rules = read_series_rules(read_text(file), file);
  for (const SeriesRule& rule : rules) check_rule(rule);
  return rules;
}

cli::CommandInfo WatchFolderCommand::info() {
  return {
      "watch-folder",
      "scans that come into a folder become cases, by rules",
      "Looks into FOLDER (that of 'osteo receive', or any other) and below it. When none of a series' files has come "
      "or changed for "
      "--quiet-s, the first rule that matches it decides: its pipeline is run by 'osteo prepare' in a process of its "
      "own, with bounds on "
      "memory and time. What was done is in OUT/records, by the objects it was done with, so that the same line "
      "started again, also after "
      "a "
      "power cut, goes on where it was, and the same objects never run twice. Slices that come late run their series "
      "again, into "
      "OUT/cases/CODE-2: no case is ever replaced. Objects made by this program, and what is no CT or MR image, never "
      "run. CODE is a hash; "
      "no name is in records or on standard output. With --orthanc, series that an Orthanc calls stable are copied "
      "into FOLDER first. A "
      "case that was rejected or failed is tried again when more of its series comes.",
      {{"folder", "where scans come in; nothing in it is changed (with --orthanc: where its series are copied to)"}},
      "osteo watch-folder INBOX --rules pipelines/rules.json -o CASES"};
}

int WatchFolderCommand::run(const Params& p, cli::Invocation& io) {
  if (p.rules.empty())
    throw Error(ExitCode::usage, "by which rules?", "--rules FILE; pipelines/rules.json is one to begin with");
  if (p.out.empty()) throw Error(ExitCode::usage, "where to? osteo watch-folder " + io.arguments[0] + " -o CASES");
  const std::vector<SeriesRule> rules = checked_rules(p.rules);
  WatchOptions o;
  o.folder = fs::absolute(io.arguments[0]);
  o.out = fs::absolute(p.out);
  o.quiet_s = p.quiet_s;
  o.poll_s = p.poll_s;
  o.jobs = p.jobs;
  o.memory_mb = p.memory_mb;
  o.seconds = p.minutes * 60;
  o.retries = p.retries;
  o.keep_free_mb = p.keep_free_mb;
  o.once = p.once;
  o.program = std::string(program_version());
  OrthancServer server;
  server.url = p.orthanc;
  server.ca = p.orthanc_ca;
  server.timeout_s = p.timeout_s;
  server.object_gb = p.object_gb;
  server.keep_free_mb = p.keep_free_mb;
  if (p.orthanc.empty()) {
    if (!p.orthanc_login.empty() || !p.orthanc_ca.empty())
      throw Error(ExitCode::usage, "a login or certificates for which server?", "--orthanc URL");
  } else {
    const char* const given = std::getenv("OSTEO_ORTHANC_LOGIN");
    server.login = !p.orthanc_login.empty() ? read_login(p.orthanc_login) : given != nullptr ? given : "";
    check_orthanc(server);
    check_watch_folders(o.folder, o.out);
    open_orthanc_folder(o.folder, server);
    o.feed = [&] {
      Context context = io.context;
      context.on_log([](LogLevel, std::string_view text) { std::cerr << text << std::endl; });
      try {
        follow_orthanc(o.folder, server, context);
      } catch (const Error& e) {
        std::cerr << e.what() << (e.advice().empty() ? "" : " (" + e.advice() + ")") << std::endl;
        return static_cast<int>(e.code());
      }
      return 0;
    };
  }
  io.end_progress();
  const WatchWork work = [&](const SeriesRule& rule, const fs::path& source, const fs::path& folder) {
    std::vector<std::string> a{"osteo",   "prepare", source.string(), "-o",     folder.string(),
                               "--quiet", "--json",  "--fresh",       "--seed", std::to_string(io.common.seed)};
    if (io.common.threads > 0) a.insert(a.end(), {"--threads", std::to_string(io.common.threads)});
    if (!rule.pipeline.empty()) a.insert(a.end(), {"--pipeline", rule.pipeline.string()});
    if (p.no_report) a.emplace_back("--no-report");
    return make_case(std::move(a), rule.set, folder);
  };
  const auto notify = [&](const WatchEvent& e, const WatchCounters& c) {
    if (io.common.json)
      io.out << Json{{"series", e.series},        {"what", e.what},      {"rule", e.rule}, {"why", e.why},
                     {"case", e.folder.string()}, {"objects", e.objects}}
                    .dump()
             << std::endl;
    else if (e.what == "done")
      io.out << e.folder.string() << std::endl;
    if (!io.common.quiet || e.what == "unreadable" || e.what == "refused" || e.what == "failed" ||
        e.what == "resources")
      io.err << (e.series.empty() ? "" : e.series + ": ") << e.what
             << (e.rule.empty() ? "" : " by rule '" + e.rule + "'") << (e.why.empty() ? "" : ": " + e.why) << std::endl;
    if (!p.metrics.empty()) write_file(p.metrics, metrics_text(c));
  };
  const WatchCounters c = watch_folder(rules, o, work, notify, io.context);
  if (!p.metrics.empty()) write_file(p.metrics, metrics_text(c));
  if (!io.common.quiet)
    io.err << c.done << " cases made, " << c.bad << " not, " << c.unmatched << " series without a rule\n";
  return static_cast<int>(p.once && c.bad > 0 ? ExitCode::partial : ExitCode::ok);
}

}  // namespace osteo
