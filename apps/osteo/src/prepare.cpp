// prepare: a CT becomes a case.
#include <algorithm>
#include <cmath>
#include <ostream>

#include "audit_case.h"
#include "built_in_pipelines.h"
#include "case_edits.h"
#include "case_pipeline.h"
#include "commands/prepare.h"
#include "osteo/app/cli/report.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/shell.h"
#include "osteo/imaging/dicom/verdict.h"
#include "osteo/session/scene/approval.h"
#include "osteo/session/scene/case.h"
#include "osteo/session/scene/slicer_exchange.h"

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
          "whole the case stays unchanged. Variables of the pipeline are also set with --set NAME=VALUE. Beside the "
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

namespace {

// One run, step by step: each decides what those after it go by.
class Preparation {
 public:
  Preparation(const PrepareCommand::Params& p, cli::Invocation& io)
      : p_(p),
        io_(io),
        folder_(p.out),
        params_(p),
        fields_(fields_of<PrepareCommand>(params_)),
        given_(given_now(fields_, io)) {
    if (!io.arguments.empty()) require_readable(io.arguments[0]);
    update_.emplace(folder_);
  }
  int run() {
    recall_case();
    find_source();
    find_pipeline();
    find_structures();
    edits_ =
        edits_of_case(folder_, io_.given.contains("edits") ? std::optional(p_.edits) : std::nullopt, recipe_, notes_);
    settle_settings();
    Pipeline pipeline = case_pipeline(text_, recipe_, source_.path, structures_.path, held_structures_, folder_, edits_,
                                      given_.contains("lower") || given_.contains("preset"));
    validate(pipeline, io_.registry);
    refuse_foreign_files(pipeline);
    report_changes();
    make(std::move(pipeline));
    report_end();
    return 0;
  }

 private:
  [[nodiscard]] std::string all_of(const Recipe& r) const {
    std::string all = r.structures_hash.empty() ? "" : " --structures";
    if (!r.edits_hash.empty()) all += " --edits";
    for (const auto& [name, value] : r.settings) all += " " + flag_of(name, value, fields_);
    return all.empty() ? " nothing" : all;
  }
  [[nodiscard]] std::map<std::string, ManifestFile> files_of_case() const {
    try {
      return parse_manifest(read_text(folder_ / "manifest.json"));
    } catch (const Error&) {
      return {};
    }
  }

  // What the case remembers.
  void recall_case() {
    try {
      before_ = read_recipe(folder_);
    } catch (const Error&) {
      if (!p_.fresh) throw;  // a damaged manifest: what it remembered is lost
    }
    is_case_ = output_exists(folder_ / "manifest.json");
    if (is_case_ && !before_ && !p_.fresh && foreign_files(folder_, {}).empty()) {
      throw Error(ExitCode::usage, "'" + folder_.string() + "' was made by an earlier version and remembers no flags",
                  "give all its flags again, with --fresh");
    }
  }

  // The scan that is given, or the one that the case was made from; and with another one it forgets.
  void find_source() {
    if (!io_.arguments.empty()) {
      source_ = input_of(io_.arguments[0]);
      if (before_ && before_->source_hash != source_.hash) {
        if (!io_.common.force) {
          throw Error(
              ExitCode::cannot_write,
              "'" + folder_.string() + "' was made from another scan than '" + io_.arguments[0] +
                  "', or the scan was changed",
              "give another name, or --force to make the case again from this scan, without the flags it remembers");
        }
        notes_.push_back("another scan: forgotten is" + all_of(*before_));
        files_before_ = files_of_case();
        before_.reset();
      }
    } else {
      if (!before_) throw Error(ExitCode::usage, "of which scan? osteo prepare SCAN -o " + p_.out);
      const auto path = recall_file(before_->source_hash);
      if (!path) {
        throw Error(ExitCode::no_input,
                    "the scan of '" + folder_.string() +
                        "' is not known here, or was moved or changed: a case does not hold its name",
                    "give it: osteo prepare SCAN -o " + p_.out);
      }
      source_ = {*path, before_->source_hash};
    }
    if (before_ && p_.fresh) {
      notes_.push_back("--fresh: forgotten is" + all_of(*before_));
      before_.reset();
    }
    recipe_ = before_.value_or(Recipe{});
    recipe_.source_hash = source_.hash;
  }

  void find_pipeline() {
    text_ = kTemporalBonePipeline;
    if (io_.given.contains("pipeline") && p_.pipeline.empty()) recipe_.pipeline_hash.clear();
    if (!p_.pipeline.empty()) {
      text_ = read_text(p_.pipeline);
      recipe_.pipeline_hash = hash_path(p_.pipeline);
      remember(recipe_.pipeline_hash, fs::absolute(p_.pipeline).string());
    } else if (!recipe_.pipeline_hash.empty()) {
      const auto path = pipeline_file(folder_, recipe_.pipeline_hash);
      if (!path) {
        throw Error(ExitCode::no_input,
                    "the pipeline file that '" + folder_.string() +
                        "' was made with is not known here, or was moved or changed",
                    "give it again with --pipeline, or --no-pipeline for the built-in one");
      }
      text_ = read_text(*path);
    }
  }

  // Their label map.
  void find_structures() {
    if (io_.given.contains("structures")) {
      if (!p_.structures.empty()) structures_ = input_of(p_.structures);
    } else if (!recipe_.structures_hash.empty()) {
      structures_.hash = recipe_.structures_hash;
      if (const auto path = recall_file(structures_.hash)) {
        structures_.path = *path;
      } else if (!given_.contains("names") && fs::exists(folder_ / "structures.seg.nrrd")) {
        structures_.path =
            folder_ / (fs::exists(folder_ / kGivenStructures) ? kGivenStructures : "structures.seg.nrrd");
        held_structures_ = true;
      } else {
        throw Error(
            ExitCode::no_input,
            "the label map of the structures of '" + folder_.string() + "' is not known here, or was moved or changed",
            "give it again with --structures, or --no-structures to drop them");
      }
    }
    other_structures_ = before_ && structures_.hash != before_->structures_hash;
    if (other_structures_) {
      notes_.push_back(structures_.hash.empty()           ? "--structures: dropped"
                       : before_->structures_hash.empty() ? "--structures: new"
                                                          : "--structures: another label map");
    }
    recipe_.structures_hash = structures_.hash;
  }

  // The settings. One that another pipeline does not have may only be left alone.
  void settle_settings() {
    const auto known = pipeline_variables(text_);
    const auto is_known = [&](const std::string& name) {
      return name == "names" ||
             std::any_of(known.begin(), known.end(), [&](const PipelineVariable& v) { return v.name == name; });
    };
    for (const FieldRef& f : fields_) {
      const std::string name(f.doc.name);
      if (given_.contains(name) && given_.at(name) && !is_known(name)) {
        throw Error(ExitCode::usage, "the pipeline '" + p_.pipeline + "' has no variable '" + name + "', so " +
                                         f.flag() + " does nothing");
      }
    }
    auto wanted = given_;
    if (before_ && recipe_.pipeline_hash != before_->pipeline_hash) {
      notes_.emplace_back("--pipeline: another pipeline");
      for (const auto& [name, value] : before_->settings) {
        if (!is_known(name) && !wanted.contains(name)) wanted[name] = std::nullopt;
      }
    }
    changes_ = change_settings(recipe_, wanted, other_structures_);
    if (!recipe_.lost.empty()) {
      throw Error(ExitCode::no_input,
                  "the case was made with " + flag_of(*recipe_.lost.begin(), "...", fields_) +
                      ", whose value names the scan and is not known here",
                  "give it again, or drop it with an empty one");
    }
    if (recipe_.settings.contains("names") && structures_.path.empty())
      throw Error(ExitCode::usage, "--names is for --structures, which the case does not have",
                  "give --structures, or --no-names");
    for (const auto& [name, value] : recipe_.settings) {
      const bool names_file = std::any_of(known.begin(), known.end(),
                                          [&](const PipelineVariable& v) { return v.name == name && v.in_file_name; });
      if (names_file || value.find('/') != std::string::npos || without_uid(value) != value)
        recipe_.withheld.insert(name);
    }
  }

  // What lies in the folder that is not ours is never replaced.
  void refuse_foreign_files(const Pipeline& pipeline) const {
    std::vector<fs::path> outputs;
    for (const PipelineNode& n : pipeline.nodes) {
      for (const auto& [port, path] : n.outputs) outputs.push_back(path);
    }
    const auto foreign = foreign_files(folder_, outputs);
    const bool in_the_way = std::any_of(foreign.begin(), foreign.end(), [&](const std::string& f) {
      return f == "manifest.json" ||
             std::any_of(outputs.begin(), outputs.end(), [&](const fs::path& o) { return o.filename() == f; });
    });
    if (!foreign.empty() && (!io_.common.force || in_the_way)) {
      throw Error(
          ExitCode::cannot_write, "'" + folder_.string() + "' holds other files than a case: " + list_names(foreign),
          in_the_way ? "give another name, or move them away" : "give another name, or --force to write beside them");
    }
  }

  void report_changes() const {
    for (const std::string& note : notes_) io_.context.info(note);
    if (!before_) return;
    for (const RecipeChange& c : changes_) {
      const auto flag = [&](const std::optional<std::string>& v) {
        return v ? flag_of(c.name, *v, fields_) : std::string("as the pipeline has it");
      };
      io_.context.info("changed: " + flag(c.from) + " -> " + flag(c.to) + (c.why.empty() ? "" : ", since " + c.why));
    }
    std::string kept;
    for (const auto& [setting, value] : recipe_.settings) {
      const bool changed =
          std::any_of(changes_.begin(), changes_.end(), [&](const RecipeChange& c) { return c.name == setting; });
      if (!changed && !given_.contains(setting)) kept += " " + flag_of(setting, value, fields_);
    }
    if (!structures_.path.empty() && !other_structures_)
      kept +=
          held_structures_ ? " --structures (as the case holds them: their file is not known here)" : " --structures";
    if (edits_ && edits_->file == folder_ / "edits.json") kept += " --edits";
    if (!kept.empty())
      io_.context.info("kept:" + kept + "   (--fresh forgets all, --no-structures and the like drop one)");
  }

  // Runs it. Until all of it is there, the case stays as it was.
  void make(Pipeline pipeline) {
    const std::string name = pipeline.name;
    const Pipeline as_run = pipeline;
    ScanKeeper keeper(as_run);
    const std::string asked_for = flags_of(recipe_);
    try {
      RunOptions options{.overwrite = io_.common.force, .reuse = !io_.common.force, .place = [&](const fs::path& o) {
                           return update_->place(o);
                         }};
      if (!p_.no_report) options.seen = keeper.sink();
      auto results = run_pipeline(std::move(pipeline), io_.registry, options, io_.context);
      recall_facts(folder_, results);
      refuse_another_scan();
      if (!edits_) keep_dropped_edits(folder_, io_.context);
      update_->commit(make_manifest(*update_, name, results, recipe_));
      remember_inputs();
      io_.end_progress();
      cli::print_results(results, io_);
      // The case is whole by now, whatever becomes of its report.
      if (!p_.no_report) report_ = report_on(folder_, asked_for, as_run, keeper.take(), io_);
    } catch (const ErrorWithDocument&) {
      io_.end_progress();
      keep_verdict();
      throw;
    } catch (...) {
      io_.end_progress();
      throw;
    }
  }

  // The same name may hold another scan by now, as its verdict tells.
  void refuse_another_scan() {
    if (!another_scan(*update_)) return;
    if (!io_.common.force) {
      throw Error(ExitCode::cannot_write,
                  "'" + folder_.string() + "' was made from another scan of '" + source_.path.string() +
                      "' than this series is of",
                  "give another name, or --force to replace the case");
    }
    files_before_ = files_of_case();
  }

  // What the case does not hold itself: where its inputs lie, and values that may name the patient.
  void remember_inputs() {
    // Of an earlier refusal.
    if (std::error_code ignored; is_picture_of_verdict(folder_ / "import.svg"))
      fs::remove(folder_ / "import.svg", ignored);
    remember(source_.hash, fs::absolute(source_.path).string());
    set_aside_stale_files(folder_, files_before_, io_.context);
    if (!held_structures_ && !structures_.path.empty())
      remember(structures_.hash, fs::absolute(structures_.path).string());
    for (const std::string& setting : recipe_.withheld)
      remember(hash_text(recipe_.settings.at(setting)), recipe_.settings.at(setting));
  }

  // The verdict on a rejected scan stays, where there is no case yet.
  void keep_verdict() {
    const fs::path verdict = folder_ / "import.json";
    if (!is_case_ && output_exists(update_->place(verdict))) {
      write_file(verdict, read_text(update_->place(verdict)));
      const fs::path picture = folder_ / "import.svg";
      if (output_exists(update_->place(picture)) && (!output_exists(picture) || is_picture_of_verdict(picture)))
        write_file(picture, read_text(update_->place(picture)));
      if (!io_.common.quiet) io_.err << "what was found is in " << verdict.string() << '\n';
    } else if (!io_.common.quiet) {
      io_.err << "the case is unchanged; --json prints what was found\n";
    }
  }

  void report_end() const {
    if (io_.common.quiet) return;
    io_.err << "case: " << folder_.string() << "  " << case_code(folder_) << "  (peak memory "
            << std::lround(peak_memory_mb()) << " MB)\n";
    // Who signed it before would else not hear that the signature is gone.
    if (const ApprovalNow now = approval_of(folder_); now.state == ApprovalState::outdated)
      io_.err << "  " << now.words() << '\n';
    if (report_) {
      io_.err << "  look at " << report_->html.string() << "\n  then: osteo approve " << shell_path(folder_)
              << " --by NAME\n";
    } else {
      io_.err << "  look at " << (folder_ / "preview.png").string() << "\n  then: osteo rehearse "
              << shell_path(folder_) << '\n';
    }
  }

  const PrepareCommand::Params& p_;
  cli::Invocation& io_;
  const fs::path folder_;
  PrepareCommand::Params params_;  // what the fields refer to
  const std::vector<FieldRef> fields_;
  const std::map<std::string, std::optional<std::string>> given_;
  std::vector<std::string> notes_;
  std::optional<CaseUpdate> update_;
  bool is_case_ = false;
  std::optional<Recipe> before_;                      // none where it is forgotten
  std::map<std::string, ManifestFile> files_before_;  // of a case of another scan
  Recipe recipe_;
  Input source_, structures_;
  bool held_structures_ = false;  // they are taken as the case holds them
  bool other_structures_ = false;
  std::string text_;  // of the pipeline
  std::optional<CaseEdits> edits_;
  std::vector<RecipeChange> changes_;
  std::optional<CaseReport> report_;
};

}  // namespace

int PrepareCommand::run(const Params& p, cli::Invocation& io) {
  if (p.out.empty())
    throw Error(ExitCode::usage, "where to? osteo prepare " +
                                     (io.arguments.empty() ? "SCAN" : shell_path(io.arguments[0])) + " -o CASE");
  const AuditTrail trail;
  const int done = Preparation(p, io).run();
  // What changes a case by hand ends here: 'edit' and its window, 'take-back', and who gives corrections.
  if (done == 0 && (io.given.contains("edits") || io.given.contains("structures") ||
                    fs::path(p.pipeline).filename() == kCorrectedPipeline))
    audit_case(trail, AuditEvent::Kind::edit, p.out, io.context);
  return done;
}

}  // namespace osteo
