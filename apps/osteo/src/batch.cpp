// batch: a table of scans becomes cases, each in a process of its own.
#include "osteo/hospital/batch/batch.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <limits>
#include <sstream>
#include <thread>

#include "batch_command.h"
#include "built_in_pipelines.h"
#include "case_pipeline.h"
#include "commands/prepare.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/param.h"
#include "osteo/imaging/io/surface_io.h"
#include "osteo/imaging/pipeline/pipeline.h"
#include "program.h"

namespace osteo {
namespace {

constexpr int kThumbnailWidth = 264;  // pixels: twice what the page shows

double memory_available_mb() {
  std::ifstream in("/proc/meminfo");
  std::string name;
  double kb = 0;
  for (std::string rest; in >> name >> kb; std::getline(in, rest)) {
    if (name == "MemAvailable:") return kb * 1024 / 1e6;
  }
  return std::numeric_limits<double>::infinity();
}

int jobs_for(const BatchCommand::Params& p, int cores) {
  if (p.jobs > 0) return p.jobs;
  const double fit = p.memory_mb > 0 ? std::floor(memory_available_mb() / p.memory_mb) : cores;
  return std::max(1, static_cast<int>(std::min<double>(cores, fit)));
}

std::set<std::string> codes_in(const std::string& text) {
  std::set<std::string> codes;
  std::istringstream in(text);
  for (std::string code; std::getline(in, code, ',');) {
    if (!code.empty()) codes.insert(code);
  }
  return codes;
}

// The mean of the pixels that fall onto each.
Picture thumbnail_of(const Picture& picture) {
  const int scale = std::max(1, picture.width / kThumbnailWidth);
  Picture small{picture.width / scale, picture.height / scale, {}};
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        int sum = 0;
        for (int v = 0; v < scale; ++v) {
          for (int u = 0; u < scale; ++u)
            sum += picture.rgb[(static_cast<std::size_t>(y * scale + v) * static_cast<std::size_t>(picture.width) +
                                static_cast<std::size_t>(x * scale + u)) *
                                   3 +
                               static_cast<std::size_t>(c)];
        }
        small.rgb.push_back(static_cast<std::uint8_t>(sum / (scale * scale)));
      }
    }
  }
  return small;
}

Json counts_json(const BatchResult& r, const fs::path& out) {
  Json j{{"cases", r.cases},         {"done", r.done},       {"refused", r.refused},     {"failed", r.failed},
         {"resources", r.resources}, {"waiting", r.waiting}, {"untouched", r.untouched}, {"stopped", r.stopped}};
  j["report"] = (out / "report.html").string();
  return j;
}

std::string counts_text(const BatchResult& r) {
  std::string text = std::to_string(r.done) + " of " + std::to_string(r.cases) + " cases done";
  for (const auto& [count, words] :
       {std::pair{r.untouched, "known from before"}, std::pair{r.refused, "rejected for their input"},
        std::pair{r.failed, "failed"}, std::pair{r.resources, "out of memory or time"},
        std::pair{r.waiting, "waiting"}}) {
    if (count > 0) text += ", " + std::to_string(count) + " " + words;
  }
  return text;
}

int exit_code_of(const BatchResult& r) {
  if (!r.stopped.empty() || r.resources > 0) return static_cast<int>(ExitCode::resources);
  return static_cast<int>(r.done == r.cases ? ExitCode::ok : ExitCode::partial);
}

}  // namespace

std::vector<FieldRef> case_fields(PrepareCommand::Params& params) {
  auto fields = fields_of<PrepareCommand>(params);
  std::erase_if(fields, [](const FieldRef& f) {
    return f.doc.name == "out" || f.doc.name == "pipeline" || f.doc.name == "fresh" || f.doc.name == "no_report";
  });
  return fields;
}

void check_case_settings(const std::string& text, const std::map<std::string, std::string>& settings,
                         const Registry& registry) {
  PrepareCommand::Params prepare;
  const auto fields = case_fields(prepare);
  Recipe recipe;
  for (const auto& [name, value] : settings) {
    const FieldRef* const field = find_field(fields, name);
    if (field != nullptr) field->from_text(value, name);
    if (name == "structures" || name == "edits" || value.empty()) continue;
    recipe.settings[name] = field != nullptr ? field->to_text() : value;
  }
  const bool has_lower = recipe.settings.contains("lower"), has_preset = recipe.settings.contains("preset");
  if (prepare.preset != BonePreset::fixed && has_lower)
    throw Error(ExitCode::usage,
                "lower does nothing with preset '" + recipe.settings["preset"] + "', which finds the threshold itself",
                "give one of them");
  if (recipe.settings.contains("names") && prepare.structures.empty())
    throw Error(ExitCode::usage, "names is for structures, which the case does not have", "give structures");
  Pipeline pipeline =
      case_pipeline(text, recipe, "source", prepare.structures, false, "case", std::nullopt, has_lower || has_preset);
  validate(pipeline, registry);
}

int make_case(std::vector<std::string> arguments, const std::map<std::string, std::string>& settings,
              const fs::path& folder) {
  PrepareCommand::Params prepare;
  const auto fields = case_fields(prepare);
  for (const auto& [name, value] : settings) {
    const FieldRef* const field = find_field(fields, name);
    if (field != nullptr)
      arguments.push_back(field->flag() + "=" + value);
    else
      arguments.insert(arguments.end(), {"--set", name + "=" + value});
  }
  std::vector<char*> argv;
  for (std::string& a : arguments) argv.push_back(a.data());
  cli::Program program = make_osteo_program();
  const int code = cli::run_program(program, static_cast<int>(argv.size()), argv.data(), std::cout, std::cerr);
  const fs::path preview = folder / "preview.png", thumbnail = folder.string() + ".thumbnail.png";
  if (code == 0 && output_exists(preview)) save_picture(thumbnail_of(load_picture(preview)), thumbnail);
  return code;
}

cli::CommandInfo BatchCommand::info() {
  return {
      "batch",
      "many scans become many cases",
      "The table is CSV: its first line names the columns, 'source' (of the scan; from the table's folder on), "
      "'case' (a code, which "
      "becomes "
      "the name of the case) and any flag or variable of prepare, such as lower or structures; an empty field is "
      "not given. --set "
      "NAME=VALUE is for all cases. Each case is made by 'osteo prepare' in a process of its own, with bounds on "
      "memory and time; one that "
      "fails never stops the others. Run again, the same line goes on where it was: what is done is not touched, "
      "what was interrupted is "
      "begun again, what ended for memory, time or a signal is tried again, and so is a case whose row, pipeline or "
      "source has changed. "
      "OUT/report.html shows all cases, report.json and report.csv say the same; the cases are in OUT/cases. Exit "
      "code 0: all are done; 8: "
      "some are rejected or failed; 9: some ended for memory or time, or the disk is full. Names of scans are in "
      "none of it.",
      {{"table", "a .csv file"}},
      "osteo batch TABLE.csv -o OUT",
      true};
}

int BatchCommand::run(const Params& p, cli::Invocation& io) {
  const fs::path table_file = fs::absolute(io.arguments[0]);
  if (p.out.empty()) throw Error(ExitCode::usage, "where to? osteo batch " + io.arguments[0] + " -o OUT");
  const fs::path out = fs::absolute(p.out);
  const std::string pipeline = p.pipeline.empty() ? std::string(kTemporalBonePipeline) : read_text(p.pipeline);

  PrepareCommand::Params prepare;
  const auto fields = case_fields(prepare);
  const auto is_field = [&](const std::string& name) {
    return std::any_of(fields.begin(), fields.end(), [&](const FieldRef& f) { return f.doc.name == name; });
  };
  std::vector<std::string> known, paths{"structures", "edits"};
  for (const FieldRef& f : fields) known.emplace_back(f.doc.name);
  for (const PipelineVariable& v : pipeline_variables(pipeline)) {
    if (v.name == "source" || v.name == "case") continue;
    if (!is_field(v.name)) known.push_back(v.name);
    if (v.in_file_name) paths.push_back(v.name);
  }
  std::string common = pipeline + (p.no_report ? "\nno report" : "");
  for (const auto& [name, value] : io.settings) {
    if (name.find('.') == std::string::npos && std::find(known.begin(), known.end(), name) == known.end()) {
      const std::string near = nearest_name(name, known);
      throw Error(ExitCode::usage, "--set " + name + ": that is no setting of a case",
                  near.empty() ? "'osteo help prepare' shows them" : "did you mean '" + near + "'?");
    }
    common += "\n" + name + "=" + value;
  }
  const auto table = read_batch_table(read_text(table_file), table_file, known, paths);

  if (p.report_only) {
    if (!output_exists(out / "batch.json")) throw Error(ExitCode::no_input, "'" + p.out + "' is no batch");
    const BatchResult result = write_batch_report(table, out);
    if (io.common.json) io.out << counts_json(result, p.out).dump(2) << '\n';
    if (!io.common.quiet) io.err << counts_text(result) << "\n  " << (fs::path(p.out) / "report.html").string() << '\n';
    return exit_code_of(result);
  }

  const std::map<std::string, std::string> of_all(io.settings.begin(), io.settings.end());
  const auto with_common = [&](const std::map<std::string, std::string>& own) {
    std::map<std::string, std::string> settings = of_all;
    for (const auto& [name, value] : own) settings[name] = value;
    return settings;
  };
  check_batch_table(table, table_file,
                    [&](const auto& own) { check_case_settings(pipeline, with_common(own), io.registry); });

  const int cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  BatchOptions options;
  options.out = out;
  options.program = std::string(program_version());
  options.key = common;
  options.jobs = jobs_for(p, cores);
  options.memory_mb = p.memory_mb;
  options.seconds = p.minutes * 60;
  options.retries = p.retries;
  options.retry_failed = p.retry_failed;
  options.keep_free_mb = p.keep_free_mb;
  options.only = codes_in(p.only);
  if (!p.only.empty() && options.only.empty()) throw Error(ExitCode::usage, "--only " + p.only + " names no case");
  const int threads = io.common.threads > 0 ? io.common.threads : std::max(1, cores / options.jobs);
  const std::string pipeline_file = p.pipeline.empty() ? "" : fs::absolute(p.pipeline).string();

  const CaseWork work = [&](const BatchCase& row, const fs::path& folder) {
    std::vector<std::string> a{"osteo",
                               "prepare",
                               row.source.string(),
                               "-o",
                               folder.string(),
                               "--quiet",
                               "--json",
                               "--fresh",
                               "--seed",
                               std::to_string(io.common.seed),
                               "--threads",
                               std::to_string(threads)};
    if (!pipeline_file.empty()) a.insert(a.end(), {"--pipeline", pipeline_file});
    if (p.no_report) a.emplace_back("--no-report");
    if (io.common.force) a.emplace_back("--force");
    return make_case(std::move(a), with_common(row.settings), folder);
  };
  if (!io.common.quiet) {
    io.err << table.size() << " cases, " << options.jobs << " at a time with " << threads
           << (threads == 1 ? " thread" : " threads")
           << " each; bounds of a case: " << (p.memory_mb > 0 ? format_number(p.memory_mb) + " MB" : "no memory bound")
           << ", " << (p.minutes > 0 ? format_number(p.minutes) + " min" : "no time bound") << '\n';
  }
  const BatchResult result = run_batch(table, options, work, io.context);
  io.end_progress();
  if (io.common.json) io.out << counts_json(result, p.out).dump(2) << '\n';
  if (!io.common.quiet) {
    io.err << counts_text(result) << '\n';
    if (options.only.empty()) io.err << "  " << (fs::path(p.out) / "report.html").string() << '\n';
  }
  if (!result.stopped.empty())
    throw Error(ExitCode::resources, "stopped before the end: " + result.stopped,
                "the same line again goes on from here");
  return exit_code_of(result);
}

}  // namespace osteo
