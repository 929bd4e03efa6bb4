#include "edited_scan.h"

#include <map>

#include "built_in_pipelines.h"
#include "mask_nodes.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/image/structures.h"
#include "osteo/imaging/io/volume_io.h"
#include "osteo/imaging/neural/segment_network.h"
#include "osteo/imaging/pipeline/formats.h"
#include "osteo/session/scene/case.h"
#include "osteo/session/scene/recipe.h"
#include "osteo/session/scene/slicer_exchange.h"

namespace osteo {
namespace {

// Stages run as they are needed, each once; what they give stays in memory.
class InMemory {
 public:
  InMemory(const Pipeline& pipeline, const Registry& registry, const Context& context)
      : pipeline_(pipeline), registry_(registry), context_(context) {}

  Data output(const PipelineNode::Input& from) {
    const PipelineNode& node = find(from.node);
    const std::unique_ptr<Stage> stage = registry_.make(node.stage);
    const std::vector<Data>& all = run(node, *stage);
    const std::vector<Port>& ports = stage->info().outputs;
    for (std::size_t p = 0; p < ports.size(); ++p) {
      if (from.port.empty() || ports[p].name == from.port) return all[p];
    }
    throw Error(ExitCode::usage, "stage '" + from.node + "' has no output '" + from.port + "'");
  }

 private:
  const PipelineNode& find(const std::string& id) const {
    for (const PipelineNode& n : pipeline_.nodes) {
      if (n.id == id) return n;
    }
    throw Error(ExitCode::usage, "the pipeline of this case has no stage '" + id + "'");
  }
  const std::vector<Data>& run(const PipelineNode& node, Stage& stage) {
    if (const auto it = done_.find(node.id); it != done_.end()) return it->second;
    for (const FieldRef& f : stage.fields()) {
      if (const auto it = node.params.find(std::string(f.doc.name)); it != node.params.end()) f.from_text(it->second);
    }
    std::vector<Data> inputs;
    for (const Port& port : stage.info().inputs) {
      const auto it = node.inputs.find(port.name);
      if (it == node.inputs.end()) {
        inputs.emplace_back();
      } else if (!it->second.node.empty()) {
        inputs.push_back(output(it->second));
      } else {
        inputs.push_back(load_data(it->second.file, port.kinds, context_));
      }
    }
    try {
      return done_[node.id] = stage.run(inputs, context_);
    } catch (const Error& e) {
      throw e.in("stage '" + node.id + "'");
    }
  }

  const Pipeline& pipeline_;
  const Registry& registry_;
  const Context& context_;
  std::map<std::string, std::vector<Data>> done_;
};

fs::path found(const std::optional<fs::path>& path, const std::string& what, const std::string& advice) {
  if (path) return *path;
  throw Error(ExitCode::no_input, what + " is not known here, or was moved or changed: a case does not hold its name",
              advice);
}

}  // namespace

EditedScan open_edited_scan(const fs::path& folder, const std::string& scan, const Registry& registry,
                            const Context& context) {
  static_cast<void>(load_case(folder));  // finishes an interrupted change; whole and unchanged
  const std::optional<Recipe> recipe = read_recipe(folder);
  if (!recipe)
    throw Error(ExitCode::usage, "'" + folder.string() + "' was made by an earlier version",
                "run 'osteo prepare SCAN -o CASE --fresh' with its flags");
  if (!recipe->lost.empty()) {
    throw Error(
        ExitCode::no_input,
        "the case was made with a value of '" + *recipe->lost.begin() + "' that names the scan and is not known here",
        "run 'osteo prepare SCAN -o CASE' with it again");
  }
  EditedScan result;
  if (scan.empty()) {
    result.scan = found(recall_file(recipe->source_hash), "the scan of '" + folder.string() + "'",
                        "give it: osteo edit CASE --scan SCAN");
  } else {
    require_readable(scan);
    if (hash_path(scan) != recipe->source_hash)
      throw Error(ExitCode::usage, "'" + scan + "' is another scan than that of the case, or was changed",
                  "a case is edited on the scan it was made from");
    result.scan = scan;
  }
  std::string text(kTemporalBonePipeline);
  if (!recipe->pipeline_hash.empty())
    text = read_text(found(pipeline_file(folder, recipe->pipeline_hash), "the pipeline file of the case",
                           "prepare the case again, with --pipeline"));
  std::map<std::string, std::string> settings = recipe->settings;
  settings.erase("names");
  settings["source"] = result.scan.string();
  settings["case"] = folder.string();
  const Pipeline pipeline = parse_pipeline(text, settings);
  const MaskNodes at = mask_nodes(pipeline);
  {
    InMemory stages(pipeline, registry, context);
    result.ct = std::get<Image>(stages.output(at.image));
    result.mask = std::get<Labels>(stages.output(at.mask));
  }
  if (!recipe->structures_hash.empty()) {
    StructuresParams names;
    fs::path file;
    const auto path = recall_file(recipe->structures_hash);
    if (path && is_network_folder(*path)) result.network = *path;
    if (path && result.network.empty()) {
      file = *path;
      if (const auto it = recipe->settings.find("names"); it != recipe->settings.end()) names = {it->second, true};
    } else {
      // As the case holds them, before any correction.
      file = folder / (output_exists(folder / kGivenStructures) ? kGivenStructures : "structures.seg.nrrd");
      if (!output_exists(file))
        throw Error(ExitCode::no_input, "the structures of the case are not known here",
                    "prepare the case again, with --structures");
    }
    const DataKind wanted[] = {DataKind::labels};
    result.structures = name_structures(std::get<Labels>(load_data(file, wanted, context)), names, &result.ct, context);
  }
  if (const fs::path file = folder / "uncertainty.seg.nrrd"; result.structures && output_exists(file)) {
    Labels uncertainty = load_labels(file);
    if (uncertainty.frame == result.structures->frame) result.uncertainty = std::move(uncertainty);
  }
  if (!recipe->edits_hash.empty()) {
    const fs::path file = folder / "edits.json";
    if (!output_exists(file) || hash_path(file) != recipe->edits_hash)
      throw Error(ExitCode::no_input, "'" + file.string() + "' is gone or was changed by hand",
                  "put it back, or: osteo prepare -o CASE --no-edits");
    result.edits = parse_edits(read_text(file), file.string());
  }
  return result;
}

}  // namespace osteo
