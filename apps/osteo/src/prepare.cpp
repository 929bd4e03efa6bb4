// prepare: a CT becomes a case.
#include <algorithm>
#include <cmath>
#include <ostream>

#include "built_in_pipelines.h"
#include "case_edits.h"
#include "case_pipeline.h"
#include "commands/prepare.h"
#include "osteo/app/cli/report.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/dicom/verdict.h"
#include "osteo/session/scene/case.h"
#include "osteo/session/scene/hand_over.h"

namespace osteo {
namespace {

// A file that the case was made from: as named now, or where it was seen last.
struct Input {
  fs::path path;
  std::string hash;
};

Input input_of(const std::string& named) {
  require_readable(named);
  return {named, hash_path(named)};
}

// The scan of the case as it is now and as it is going to be, where its verdicts know both.
bool another_scan(const CaseUpdate& update) {
  const fs::path before = update.folder() / "import.json", after = update.place(before);
  if (!output_exists(before) || !output_exists(after)) return false;
  try {
    const std::string was = read_verdict(read_text(before)).scan_hash, is = read_verdict(read_text(after)).scan_hash;
    return !was.empty() && !is.empty() && was != is;
  } catch (const Error&) {
    return false;  // a damaged verdict knows no scan
  }
}

// Whether a refusal has drawn it, and not a person.
bool is_picture_of_verdict(const fs::path& file) {
  std::error_code ec;
  return fs::is_regular_file(file, ec) &&
         read_text(file).find("The values of this scan, and where") != std::string::npos;
}

// Files of the old case that a person has changed are kept at the next state, but not as if they belonged to another
// scan.
void set_aside_stale_files(const fs::path& folder, const std::map<std::string, ManifestFile>& before,
                           const Context& context) {
  const auto now = parse_manifest(read_text(folder / "manifest.json"));
  for (const auto& [role, old] : before) {
    const bool kept = std::any_of(now.begin(), now.end(), [&](const auto& f) { return f.second.name == old.name; });
    const fs::path stale = folder / old.name, aside = folder / (old.name + ".of-another-scan");
    std::error_code ec;
    if (kept || !fs::is_regular_file(stale, ec)) continue;
    fs::rename(stale, aside, ec);
    if (ec)
      throw Error(ExitCode::cannot_write, "cannot rename '" + stale.string() + "': " + ec.message(),
                  "move it away: it is of another scan");
    fs::remove(provenance_path(stale), ec);
    context.warn("'" + old.name + "' was changed by hand and is of the scan before: it is now '" +
                 aside.filename().string() + "'");
  }
}

// What is asked for now, by variable; none where a setting is dropped.
std::map<std::string, std::optional<std::string>> given_now(const std::vector<FieldRef>& fields,
                                                            const cli::Invocation& io) {
  std::map<std::string, std::optional<std::string>> given;
  const auto own = [](const std::string& name) {
    return name == "out" || name == "pipeline" || name == "structures" || name == "edits" || name == "fresh" ||
           name == "no_report";
  };
  for (const FieldRef& f : fields) {
    const std::string name(f.doc.name), value = f.to_text();
    if (!io.given.contains(name) || own(name)) continue;
    given[name] = f.kind() == "text" && value.empty() ? std::nullopt : std::optional(value);
  }
  for (const auto& [name, value] : io.settings) {
    if (own(name) || name == "source" || name == "case")
      throw Error(ExitCode::usage, "--set " + name + ": that is not a setting of the pipeline here",
                  "'osteo help prepare' shows how it is given");
    given[name] = value.empty() ? std::nullopt : std::optional(value);
  }
  if (const auto it = given.find("preset");
      it != given.end() && it->second && *it->second != "fixed" && given.contains("lower") && given["lower"])
    throw Error(ExitCode::usage,
                "--lower does nothing with --preset " + *it->second + ", which finds the threshold itself",
                "give one of them");
  return given;
}

}  // namespace

cli::CommandInfo PrepareCommand::info() {
  return {"prepare",
          "a CT becomes a case that can be rehearsed",
          "Runs the pipeline temporal-bone.json: import, crop, threshold, resample, surface, preview; writes a "
          "manifest. Run again, it keeps "
          "what is unchanged, and the case remembers the flags that made it: only what is given again changes, and it "
          "says what from and to. "
          "--fresh forgets them all, --no-structures (or another of the text flags) or an empty --set NAME= drops one. "
          "Until the new state is "
          "whole the case stays as it was. Variables of the pipeline are also set with --set NAME=VALUE. Beside the "
          "case, not in it, a report "
          "to "
          "look at and print is written: CASE.report.html and CASE.report.pdf. Its cuts are pictures of the patient; "
          "--no-report leaves it "
          "out.",
          {{"source",
            "DICOM folder, DICOMDIR or zip, or a volume file (.nrrd .nii.gz .mha .vti); may be left out when the case "
            "was made on this "
            "machine",
            true}},
          "osteo prepare DICOM_FOLDER -o CASE",
          true};
}

int PrepareCommand::run(const Params& p, cli::Invocation& io) {
  if (p.out.empty())
    throw Error(ExitCode::usage,
                "where to? osteo prepare " + (io.arguments.empty() ? "SCAN" : io.arguments[0]) + " -o CASE");
  const fs::path folder = p.out;
  Params given_params = p;
  const auto fields = fields_of<PrepareCommand>(given_params);
  const auto given = given_now(fields, io);
  std::vector<std::string> notes;
  if (!io.arguments.empty()) require_readable(io.arguments[0]);
  CaseUpdate update(folder);

  const auto all_of = [&](const Recipe& r) {
    std::string all = r.structures_hash.empty() ? "" : " --structures";
    if (!r.edits_hash.empty()) all += " --edits";
    for (const auto& [name, value] : r.settings) all += " " + flag_of(name, value, fields);
    return all.empty() ? " nothing" : all;
  };

  // What the case remembers, and whether it is the same scan.
  std::optional<Recipe> before;
  try {
    before = read_recipe(folder);
  } catch (const Error&) {
    if (!p.fresh) throw;  // a damaged manifest: what it remembered is lost
  }
  const bool is_case = output_exists(folder / "manifest.json");
  if (is_case && !before && !p.fresh && foreign_files(folder, {}).empty()) {
    throw Error(ExitCode::usage, "'" + folder.string() + "' was made by an earlier version and remembers no flags",
                "give all its flags again, with --fresh");
  }
  std::map<std::string, ManifestFile> files_before;  // of a case of another scan
  std::optional<CaseReport> report;
  const auto files_of_case = [&]() -> std::map<std::string, ManifestFile> {
    try {
      return parse_manifest(read_text(folder / "manifest.json"));
    } catch (const Error&) {
      return {};
    }
  };
  Input source;
  if (!io.arguments.empty()) {
    source = input_of(io.arguments[0]);
    if (before && before->source_hash != source.hash) {
      if (!io.common.force) {
        throw Error(
            ExitCode::cannot_write,
            "'" + folder.string() + "' was made from another scan than '" + io.arguments[0] +
                "', or the scan was changed",
            "give another name, or --force to make the case anew from this scan, without the flags it remembers");
      }
      notes.push_back("another scan: forgotten is" + all_of(*before));
      files_before = files_of_case();
      before.reset();
    }
  } else {
    if (!before) throw Error(ExitCode::usage, "of which scan? osteo prepare SCAN -o " + p.out);
    const auto path = recall_file(before->source_hash);
    if (!path) {
      throw Error(ExitCode::no_input,
                  "the scan of '" + folder.string() +
                      "' is not known here, or was moved or changed: a case does not hold its name",
                  "give it: osteo prepare SCAN -o " + p.out);
    }
    source = {*path, before->source_hash};
  }
  if (before && p.fresh) {
    notes.push_back("--fresh: forgotten is" + all_of(*before));
    before.reset();
  }
  Recipe recipe = before.value_or(Recipe{});
  recipe.source_hash = source.hash;

  // The pipeline, and the label map of structures.
  std::string text(kTemporalBonePipeline);
  if (io.given.contains("pipeline") && p.pipeline.empty()) recipe.pipeline_hash.clear();
  if (!p.pipeline.empty()) {
    text = read_text(p.pipeline);
    recipe.pipeline_hash = hash_path(p.pipeline);
    remember(recipe.pipeline_hash, fs::absolute(p.pipeline).string());
  } else if (!recipe.pipeline_hash.empty()) {
    const auto path = pipeline_file(folder, recipe.pipeline_hash);
    if (!path) {
      throw Error(
          ExitCode::no_input,
          "the pipeline file that '" + folder.string() + "' was made with is not known here, or was moved or changed",
          "give it again with --pipeline, or --no-pipeline for the built-in one");
    }
    text = read_text(*path);
  }
  Input structures;
  bool as_the_case_holds_them = false;
  if (io.given.contains("structures")) {
    if (!p.structures.empty()) structures = input_of(p.structures);
  } else if (!recipe.structures_hash.empty()) {
    structures.hash = recipe.structures_hash;
    if (const auto path = recall_file(structures.hash)) {
      structures.path = *path;
    } else if (!given.contains("names") && fs::exists(folder / "structures.seg.nrrd")) {
      structures.path = folder / (fs::exists(folder / kGivenStructures) ? kGivenStructures : "structures.seg.nrrd");
      as_the_case_holds_them = true;
    } else {
      throw Error(
          ExitCode::no_input,
          "the label map of the structures of '" + folder.string() + "' is not known here, or was moved or changed",
          "give it again with --structures, or --no-structures to drop them");
    }
  }
  const bool other_structures = before && structures.hash != before->structures_hash;
  if (other_structures) {
    notes.push_back(structures.hash.empty()           ? "--structures: dropped"
                    : before->structures_hash.empty() ? "--structures: new"
                                                      : "--structures: another label map");
  }
  recipe.structures_hash = structures.hash;

  const auto edits =
      edits_of_case(folder, io.given.contains("edits") ? std::optional(p.edits) : std::nullopt, recipe, notes);

  // The settings. One that another pipeline does not have may only be left alone.
  const auto known = pipeline_variables(text);
  const auto is_known = [&](const std::string& name) {
    return name == "names" ||
           std::any_of(known.begin(), known.end(), [&](const PipelineVariable& v) { return v.name == name; });
  };
  for (const FieldRef& f : fields) {
    const std::string name(f.doc.name);
    if (given.contains(name) && given.at(name) && !is_known(name)) {
      throw Error(ExitCode::usage,
                  "the pipeline '" + p.pipeline + "' has no variable '" + name + "', so " + f.flag() + " does nothing");
    }
  }
  auto wanted = given;
  if (before && recipe.pipeline_hash != before->pipeline_hash) {
    notes.emplace_back("--pipeline: another pipeline");
    for (const auto& [name, value] : before->settings) {
      if (!is_known(name) && !wanted.contains(name)) wanted[name] = std::nullopt;
    }
  }
  const auto changes = change_settings(recipe, wanted, other_structures);
  if (!recipe.lost.empty()) {
    throw Error(ExitCode::no_input,
                "the case was made with " + flag_of(*recipe.lost.begin(), "...", fields) +
                    ", whose value names the scan and is not known here",
                "give it again, or drop it with an empty one");
  }
  if (recipe.settings.contains("names") && structures.path.empty())
    throw Error(ExitCode::usage, "--names is for --structures, which the case does not have",
                "give --structures, or --no-names");
  for (const auto& [name, value] : recipe.settings) {
    const bool names_file = std::any_of(known.begin(), known.end(),
                                        [&](const PipelineVariable& v) { return v.name == name && v.in_file_name; });
    if (names_file || value.find('/') != std::string::npos || without_uid(value) != value) recipe.withheld.insert(name);
  }

  Pipeline pipeline = case_pipeline(text, recipe, source.path, structures.path, as_the_case_holds_them, folder, edits,
                                    given.contains("lower") || given.contains("preset"));
  const std::string name = pipeline.name;
  validate(pipeline, io.registry);

  // What lies in the folder that is not ours is never replaced.
  std::vector<fs::path> outputs;
  for (const PipelineNode& n : pipeline.nodes) {
    for (const auto& [port, path] : n.outputs) outputs.push_back(path);
  }
  const auto foreign = foreign_files(folder, outputs);
  const bool in_the_way = std::any_of(foreign.begin(), foreign.end(), [&](const std::string& f) {
    return f == "manifest.json" ||
           std::any_of(outputs.begin(), outputs.end(), [&](const fs::path& o) { return o.filename() == f; });
  });
  if (!foreign.empty() && (!io.common.force || in_the_way)) {
    throw Error(
        ExitCode::cannot_write, "'" + folder.string() + "' holds other files than a case: " + list_names(foreign),
        in_the_way ? "give another name, or move them away" : "give another name, or --force to write beside them");
  }

  for (const std::string& note : notes) io.context.info(note);
  if (before) {
    for (const RecipeChange& c : changes) {
      const auto flag = [&](const std::optional<std::string>& v) {
        return v ? flag_of(c.name, *v, fields) : std::string("as the pipeline has it");
      };
      io.context.info("changed: " + flag(c.from) + " -> " + flag(c.to) + (c.why.empty() ? "" : ", since " + c.why));
    }
    std::string kept;
    for (const auto& [setting, value] : recipe.settings) {
      const bool changed =
          std::any_of(changes.begin(), changes.end(), [&](const RecipeChange& c) { return c.name == setting; });
      if (!changed && !given.contains(setting)) kept += " " + flag_of(setting, value, fields);
    }
    if (!structures.path.empty() && !other_structures)
      kept += as_the_case_holds_them ? " --structures (as the case holds them: their file is not known here)"
                                     : " --structures";
    if (edits && edits->file == folder / "edits.json") kept += " --edits";
    if (!kept.empty())
      io.context.info("kept:" + kept + "   (--fresh forgets all, --no-structures and the like drop one)");
  }

  const Pipeline as_run = pipeline;
  ScanKeeper keeper(as_run);
  const std::string asked_for = flags_of(recipe);
  try {
    RunOptions options{.overwrite = io.common.force, .reuse = !io.common.force, .place = [&](const fs::path& o) {
                         return update.place(o);
                       }};
    if (!p.no_report) options.seen = keeper.sink();
    auto results = run_pipeline(std::move(pipeline), io.registry, options, io.context);
    recall_facts(folder, results);
    if (another_scan(update)) {
      if (!io.common.force) {
        throw Error(ExitCode::cannot_write,
                    "'" + folder.string() + "' was made from another scan of '" + source.path.string() +
                        "' than this series is of",
                    "give another name, or --force to replace the case");
      }
      files_before = files_of_case();
    }
    if (!edits) keep_dropped_edits(folder, io.context);
    update.commit(make_manifest(update, name, results, recipe));
    // Of an earlier refusal.
    if (std::error_code ignored; is_picture_of_verdict(folder / "import.svg"))
      fs::remove(folder / "import.svg", ignored);
    remember(source.hash, fs::absolute(source.path).string());
    set_aside_stale_files(folder, files_before, io.context);
    if (!as_the_case_holds_them && !structures.path.empty())
      remember(structures.hash, fs::absolute(structures.path).string());
    for (const std::string& setting : recipe.withheld)
      remember(hash_text(recipe.settings.at(setting)), recipe.settings.at(setting));
    io.end_progress();
    cli::print_results(results, io);
    // The case is whole by now, whatever becomes of its report.
    if (!p.no_report) report = report_on(folder, asked_for, as_run, keeper.take(), io);
  } catch (const ErrorWithDocument&) {
    // The verdict on a refused scan stays, where there is no case yet.
    const fs::path verdict = folder / "import.json";
    io.end_progress();
    if (!is_case && output_exists(update.place(verdict))) {
      write_file(verdict, read_text(update.place(verdict)));
      const fs::path picture = folder / "import.svg";
      if (output_exists(update.place(picture)) && (!output_exists(picture) || is_picture_of_verdict(picture)))
        write_file(picture, read_text(update.place(picture)));
      if (!io.common.quiet) io.err << "what was found is in " << verdict.string() << '\n';
    } else if (!io.common.quiet) {
      io.err << "the case is as it was; --json prints what was found\n";
    }
    throw;
  } catch (...) {
    io.end_progress();
    throw;
  }
  if (!io.common.quiet) {
    io.err << "case: " << folder.string() << "  " << case_code(folder) << "  (peak memory "
           << std::lround(peak_memory_mb()) << " MB)\n";
    if (report) {
      io.err << "  look at " << report->html.string() << "\n  then: osteo approve " << folder.string()
             << " --by NAME\n";
    } else {
      io.err << "  look at " << (folder / "preview.png").string() << "\n  then: osteo rehearse " << folder.string()
             << '\n';
    }
  }
  return 0;
}

}  // namespace osteo
