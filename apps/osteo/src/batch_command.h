// Many scans become many cases.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "commands/prepare.h"
#include "osteo/app/cli/command.h"
#include "osteo/core/base/files.h"

namespace osteo {

/// What prepare takes, by name, but for what whoever makes many cases decides itself.
[[nodiscard]] std::vector<FieldRef> case_fields(PrepareCommand::Params& params);
/// What 'osteo prepare' would say of these settings before it reads anything: values, ranges, choices, what goes with
/// what, and those of the pipeline. Error(usage).
void check_case_settings(const std::string& pipeline, const std::map<std::string, std::string>& settings,
                         const Registry& registry);
/// In a child: what 'osteo prepare' does with these arguments and settings (of its own, or the pipeline's), and a small
/// preview.
int make_case(std::vector<std::string> arguments, const std::map<std::string, std::string>& settings,
              const fs::path& folder);

struct BatchCommand {
  struct Params {
    std::string out;
    std::string pipeline;
    int jobs = 0;
    double memory_mb = 4000;
    double minutes = 60;
    int retries = 1;
    bool retry_failed = false;
    double keep_free_mb = 500;
    std::string only;
    bool report_only = false;
    bool no_report = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder of the batch, made when it is not there (also -o)"}, p.out);
    visit({"pipeline", "another pipeline file than the built-in temporal-bone.json"}, p.pipeline);
    visit({"jobs", "cases at a time (0: as many as there are cores, and as fit into the memory that is free)", "", 0,
           1024},
          p.jobs);
    visit({"memory_mb", "memory that a case may have; one that needs more is ended (0: no bound)", "MB", 0, 10000000},
          p.memory_mb);
    visit({"minutes", "time that a case may take; one that needs longer is ended (0: no bound)", "min", 0, 100000},
          p.minutes);
    visit({"retries", "further tries of a case that ended for memory, time or a signal", "", 0, 100}, p.retries);
    visit({"retry_failed", "also try again what an earlier run rejected or saw fail, though nothing has changed"},
          p.retry_failed);
    visit({"keep_free_mb", "begin no case with less free on the disk of the batch", "MB", 0, 1e9}, p.keep_free_mb);
    visit({"only", "codes of the cases to do, with commas between them; the report is left alone (empty: all)"},
          p.only);
    visit({"report_only", "write the report of what is there and stop"}, p.report_only);
    visit({"no_report", "write no report of each case: its cuts are pictures of the patient"}, p.no_report);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
