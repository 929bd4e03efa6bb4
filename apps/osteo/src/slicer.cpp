// hand-over, take-back: a case to 3D Slicer and back.
#include <algorithm>
#include <cmath>
#include <ostream>

#include "audit_case.h"
#include "built_in_pipelines.h"
#include "case_edits.h"
#include "commands/export_slicer.h"
#include "commands/import_slicer.h"
#include "commands/prepare.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"
#include "osteo/core/base/shell.h"
#include "osteo/imaging/edit/document.h"
#include "osteo/imaging/io/segments.h"
#include "osteo/imaging/io/volume_io.h"
#include "osteo/session/scene/case.h"
#include "osteo/session/scene/slicer_exchange.h"

namespace osteo {
namespace {

// What the case is made with, by its recipe.
CasePipeline pipeline_of(const fs::path& folder, const std::string& named_source) {
  require_readable(folder);
  const auto recipe = read_recipe(folder);
  if (!recipe) {
    throw Error(ExitCode::no_input, "'" + folder.string() + "' is no case that remembers how it was made",
                "make one with: osteo prepare CT -o " + shell_path(folder));
  }
  if (!recipe->lost.empty())
    throw Error(ExitCode::no_input,
                "a setting of the case names its scan and is not known here: " + *recipe->lost.begin(),
                "run this on the machine where the case was made, or 'osteo prepare' with all flags first");
  CasePipeline made{std::string(kTemporalBonePipeline), recipe->settings};
  if (!recipe->pipeline_hash.empty()) {
    const auto path = pipeline_file(folder, recipe->pipeline_hash);
    if (!path)
      throw Error(ExitCode::no_input, "the pipeline file of the case is not known here, or was moved or changed",
                  "run 'osteo prepare -o " + shell_path(folder) + " --pipeline FILE' first");
    made.text = read_text(*path);
  }
  fs::path source = named_source;
  if (!named_source.empty()) {
    require_readable(source);
    if (hash_path(source) != recipe->source_hash)
      throw Error(ExitCode::corrupt,
                  "'" + named_source + "' is another scan than that of the case, or was changed since");
    remember(recipe->source_hash, fs::absolute(source).string());
  } else if (const auto known = recall_file(recipe->source_hash)) {
    source = *known;
  } else {
    throw Error(ExitCode::no_input, "the scan of '" + folder.string() + "' is not known here, or was moved or changed",
                "give it with --source: a case does not hold its scan");
  }
  made.settings.erase("names");
  made.settings["source"] = source.string();
  made.settings["case"] = folder.string();
  return made;
}

// As the case has them now: with what was corrected by hand in 'osteo edit'.
CaseImages images_now(const CasePipeline& pipeline, const fs::path& folder, std::optional<CaseEdits>& edits,
                      const cli::Invocation& io) {
  CaseImages images = images_of_case(pipeline, folder, io.registry, io.context);
  Recipe recipe = *read_recipe(folder);
  std::vector<std::string> notes;
  edits = edits_of_case(folder, std::nullopt, recipe, notes);
  if (edits) {
    // The structures it began with; corrected ones are in `images` already.
    std::optional<Labels> given;
    if (fs::exists(folder / kGivenStructures)) given = load_labels(folder / kGivenStructures);
    EditDocument document(images.ct, images.bone, given ? &*given : nullptr);
    apply_edits(document, edits->recipe, io.context);
    const std::vector<Structure> named = images.bone.structures;
    images.bone = document.bone_labels(io.context.threads);
    images.bone.structures = named;
  }
  return images;
}

std::string mm3(double v) {
  return format_number(v >= 100 ? std::round(v) : std::round(v * 10) / 10) + " mm3";
}

void print_changes(const SlicerImport& back, std::ostream& out) {
  char line[200];
  std::snprintf(line, sizeof line, "%-28s %12s %12s %12s %12s\n", "structure", "before", "after", "added", "removed");
  out << line;
  for (const SegmentChange& c : back.changes) {
    std::string name = c.name.empty()    ? c.was + " (gone)"
                       : c.was.empty()   ? c.name + " (new)"
                       : c.name == c.was ? c.name
                                         : c.name + " (was " + c.was + ")";
    std::snprintf(line, sizeof line, "%-28s %12s %12s %12s %12s\n", name.c_str(), mm3(c.before_mm3).c_str(),
                  mm3(c.after_mm3).c_str(), mm3(c.added_mm3).c_str(), mm3(c.removed_mm3).c_str());
    out << line;
  }
}

Json changes_json(const SlicerImport& back) {
  Json list = Json::list();
  for (const SegmentChange& c : back.changes)
    list.push_back({{"name", c.name},
                    {"was", c.was},
                    {"before_mm3", c.before_mm3},
                    {"after_mm3", c.after_mm3},
                    {"added_mm3", c.added_mm3},
                    {"removed_mm3", c.removed_mm3}});
  return {{"bone_changed", back.bone_changed}, {"structures_changed", back.structures_changed}, {"structures", list}};
}

}  // namespace

cli::CommandInfo ExportSlicerCommand::info() {
  return {"export-slicer",
          "a case's CT, bone and structures as files for 3D Slicer",
          "Writes ct.nrrd, bone.seg.nrrd and structures.seg.nrrd (with names and colours) into a new folder. Edit them "
          "in 3D Slicer, save them "
          "there under the same names, and 'osteo import-slicer' makes the case from them. Names of the patient are in "
          "none of them, but the CT "
          "of a head shows a face.",
          {{"case", "a prepared case"}, {"folder", "new folder for the files"}},
          "osteo export-slicer CASE FOLDER"};
}

int ExportSlicerCommand::run(const Params& p, cli::Invocation& io) {
  const fs::path folder = io.arguments[1];
  if (output_exists(folder) && !(fs::is_directory(folder) && fs::is_empty(folder)))
    throw Error(ExitCode::cannot_write, "'" + folder.string() + "' exists already",
                "give a new folder: what was edited there is not written over");
  std::optional<CaseEdits> edits;
  const CaseImages images = images_now(pipeline_of(io.arguments[0], p.source), io.arguments[0], edits, io);
  const AuditTrail trail;
  export_slicer(images, folder);
  io.end_progress();
  audit_case(trail, AuditEvent::Kind::hand_over, io.arguments[0], io.context);
  if (io.common.quiet) return 0;
  io.err << (folder / "ct.nrrd").string() << "  (anonymous, but shows the face)\n"
         << (folder / "bone.seg.nrrd").string() << '\n';
  if (images.structures)
    io.err << (folder / "structures.seg.nrrd").string() << "  (" << images.structures->structures.size()
           << " structures)\n";
  io.err << "  in 3D Slicer: drag the folder onto the window, edit in Segment Editor, save all into the same folder\n  "
            "then: osteo import-slicer "
         << shell_path(io.arguments[0]) << ' ' << shell_path(folder) << '\n';
  return 0;
}

cli::CommandInfo ImportSlicerCommand::info() {
  return {
      "import-slicer",
      "bone and structures that were edited in 3D Slicer, into their case",
      "Reads each .seg.nrrd of the folder, checks that it is of the scan of the case (by a mark that Slicer keeps in "
      "the segments, else "
      "by the CT beside them, and by where it lies), says what changed, and makes the case again from it. What belongs "
      "to another scan is "
      "rejected. --check only looks. Corrected bone stays with the case until 'osteo prepare -o CASE --no-pipeline'.",
      {{"case", "the case that was handed over"}, {"folder", "the folder of 'osteo export-slicer', or one .seg.nrrd"}},
      "osteo import-slicer CASE FOLDER"};
}

int ImportSlicerCommand::run(const Params& p, cli::Invocation& io) {
  const fs::path folder = io.arguments[0], from = io.arguments[1];
  const CasePipeline pipeline = pipeline_of(folder, p.source);
  std::optional<CaseEdits> edits;
  const CaseImages images = images_now(pipeline, folder, edits, io);
  SlicerImport back = import_slicer(images, from, {p.match_by_position}, io.context);
  io.end_progress();
  if (io.common.json) {
    io.out << changes_json(back).dump(2) << '\n';
  } else if (!io.common.quiet) {
    print_changes(back, io.out);
  }
  if (!back.bone && !io.common.quiet) io.err << "no bone came back: it stays as it is\n";
  if (!back.structures && images.structures && !io.common.quiet)
    io.err << "no structures came back: they stay as they are\n";
  if (!back.bone_changed && !back.structures_changed) {
    if (!io.common.quiet) io.err << "nothing changed; the case stays as it is\n";
    return 0;
  }
  if (p.check) return 0;

  // What prepare is to remember lies in the case: the folder may go.
  PrepareCommand::Params prepare;
  cli::Invocation again{io.registry, io.common, {}, {}, {}, io.context, io.out, io.err, io.end_progress};
  prepare.out = folder.string();
  again.given.insert("out");
  again.common.json = false;
  if (edits) {
    // What was corrected here is in what came back, or stays in what did not: done again on top of it, it would count
    // twice.
    if (!back.bone_changed) back.bone = images.bone;
    back.bone_changed = true;
    if (!back.structures_changed && images.structures) {
      back.structures = images.structures;
      back.structures_changed = true;
    }
    again.given.insert("edits");
    if (const auto lower = threshold_of(edits->recipe)) {
      prepare.lower = *lower;
      again.given.insert("lower");
    }
  }
  const TemporaryFolder scratch;
  if (back.structures_changed) {
    again.given.insert("structures");
    if (!back.structures->structures.empty()) {
      prepare.structures = (scratch.path() / "structures.seg.nrrd").string();
      save_labels(*back.structures, prepare.structures);
    }
  }
  if (back.bone_changed) {
    const fs::path file = folder / kCorrectedPipeline;
    const std::string text = with_corrected_bone(pipeline);
    save_labels(*back.bone, folder / kCorrectedBone);
    write_file(file, text);
    prepare.pipeline = file.string();
    again.given.insert("pipeline");
  }
  return PrepareCommand::run(prepare, again);
}

}  // namespace osteo
