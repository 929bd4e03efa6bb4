// prepare: a CT becomes a case.
#include <algorithm>
#include <cmath>
#include <ostream>

#include "commands.h"
#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/cli/report.h"
#include "osteo/scene/case.h"
#include "temporal_bone_pipeline.h"

namespace osteo {

cli::CommandInfo PrepareCommand::info() {
  return {
      "prepare",
      "a CT becomes a case that can be rehearsed",
      "Runs the pipeline temporal-bone.json: import, crop, threshold, resample, surface, preview; writes a manifest. Run again, it keeps "
      "what is unchanged. "
      "Variables of the pipeline are also set with --set NAME=VALUE.",
      {{"source", "DICOM folder, DICOMDIR or zip, or a volume file (.nrrd .nii.gz .mha .vti)"}},
      "osteo prepare DICOM_FOLDER -o CASE"};
}

int PrepareCommand::run(const Params& p, cli::Invocation& io) {
  if (p.out.empty()) throw Error(ExitCode::usage, "where to? osteo prepare " + io.arguments[0] + " -o CASE");
  require_readable(io.arguments[0]);
  const fs::path folder = p.out;
  if (fs::exists(folder) && !fs::is_directory(folder))
    throw Error(ExitCode::cannot_write, "'" + folder.string() + "' is a file, not a folder");
  const bool is_new = !fs::exists(folder);
  if (!is_new && !fs::is_empty(folder) && !fs::exists(folder / "manifest.json") && !fs::exists(folder / "bone.vdb.prov.json") &&
      !fs::exists(folder / "import.json") && !io.common.force) {
    throw Error(ExitCode::cannot_write, "'" + folder.string() + "' holds other files than a case",
                "give another name, or --force to write into it");
  }
  const std::string text = p.pipeline.empty() ? std::string(kTemporalBonePipeline) : read_text(p.pipeline);
  std::map<std::string, std::string> settings{{"source", io.arguments[0]}, {"case", folder.string()}};
  // Each flag is a variable of the pipeline; one that another pipeline does not have may only be left alone.
  Params defaults, given = p;
  const auto known = pipeline_variables(text);
  const auto plain = fields_of<PrepareCommand>(defaults), set = fields_of<PrepareCommand>(given);
  for (std::size_t f = 0; f < set.size(); ++f) {
    const std::string name(set[f].doc.name), value = set[f].to_text();
    if (name == "out" || name == "pipeline" || name == "structures" || name == "names") continue;
    if (std::any_of(known.begin(), known.end(), [&](const PipelineVariable& v) { return v.name == name; })) {
      settings[name] = value;
    } else if (value != plain[f].to_text()) {
      throw Error(ExitCode::usage,
                  "the pipeline '" + p.pipeline + "' has no variable '" + name + "', so " + set[f].flag() + " does nothing");
    }
  }
  for (const auto& [key, value] : io.settings) settings[key] = value;
  Pipeline pipeline = parse_pipeline(text, settings);
  const std::string name = pipeline.name;
  if (!p.structures.empty()) {
    PipelineNode node;
    node.id = node.stage = "structures";
    node.inputs["labels"].file = p.structures;
    const bool has_ct = std::any_of(pipeline.nodes.begin(), pipeline.nodes.end(), [](const PipelineNode& n) { return n.id == "ct"; });
    if (has_ct) node.inputs["image"].node = "ct";
    node.params["names"] = p.names;
    if (!p.names.empty()) node.params["only_named"] = "true";
    node.outputs["structures"] = folder / "structures.seg.nrrd";
    pipeline.nodes.push_back(std::move(node));
    for (PipelineNode& n : pipeline.nodes) {
      if (n.id == "preview") n.inputs["mask"].node = "structures";
    }
  }
  validate(pipeline, io.registry);

  std::error_code ec;
  fs::create_directories(folder, ec);
  if (ec)
    throw Error(ExitCode::cannot_write, "cannot make the folder '" + folder.string() + "': " + ec.message(),
                "choose a folder that you may write to");
  try {
    const auto results =
        run_pipeline(std::move(pipeline), io.registry, {.overwrite = io.common.force, .reuse = !io.common.force}, io.context);
    write_manifest(folder, name, results);
    io.end_progress();
    cli::print_results(results, io);
  } catch (...) {
    // A folder that was made for nothing goes again; the verdict on a refused scan stays.
    const fs::path verdict = folder / "import.json";
    const bool refused = fs::exists(verdict) && !fs::exists(provenance_path(verdict));
    if (is_new && !refused && !fs::exists(folder / "bone.vdb")) fs::remove_all(folder, ec);
    io.end_progress();
    if (refused && !io.common.quiet) io.err << "what was found is in " << verdict.string() << '\n';
    throw;
  }
  if (!io.common.quiet) {
    io.err << "case: " << folder.string() << "  (peak memory " << std::lround(peak_memory_mb()) << " MB)\n  look at "
           << (folder / "preview.png").string() << "\n  then: osteo rehearse " << folder.string() << '\n';
  }
  return 0;
}

}  // namespace osteo
