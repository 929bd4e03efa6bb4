#include "case_pipeline.h"

#include <algorithm>
#include <ostream>

#include "commands/prepare.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/shell.h"
#include "osteo/core/base/translate.h"
#include "osteo/imaging/io/volume_io.h"
#include "osteo/imaging/neural/segment_network.h"

namespace osteo {
namespace {

std::string quoted(const std::string& text) {
  return text.empty() || text.find_first_of(" '\"$;()") != std::string::npos ? "'" + text + "'" : text;
}

// A threshold that was asked for is where the boundary of bone lies; resample need not guess it from the mask.
void pass_threshold_on(Pipeline& pipeline) {
  for (PipelineNode& bone : pipeline.nodes) {
    const auto mask = bone.inputs.find("mask");
    if (bone.stage != "resample" || mask == bone.inputs.end() || bone.params.contains("lower")) continue;
    for (const PipelineNode& n : pipeline.nodes) {
      if (n.id != mask_before_edits(pipeline, mask->second.node) || n.stage != "threshold" ||
          !n.params.contains("lower"))
        continue;
      const auto preset = n.params.find("preset");
      if (preset == n.params.end() || preset->second == "fixed") bone.params["lower"] = n.params.at("lower");
    }
  }
}

// The nodes that these need, without anything written.
Pipeline up_to(const Pipeline& pipeline, const std::vector<std::string>& ids) {
  std::vector<std::string> open = ids, wanted;
  while (!open.empty()) {
    const std::string id = open.back();
    open.pop_back();
    if (id.empty() || std::find(wanted.begin(), wanted.end(), id) != wanted.end()) continue;
    wanted.push_back(id);
    for (const PipelineNode& n : pipeline.nodes) {
      if (n.id != id) continue;
      for (const auto& [port, input] : n.inputs) open.push_back(input.node);
    }
  }
  Pipeline part = pipeline;
  std::erase_if(part.nodes,
                [&](const PipelineNode& n) { return std::find(wanted.begin(), wanted.end(), n.id) == wanted.end(); });
  for (PipelineNode& n : part.nodes) n.outputs.clear();
  return part;
}

}  // namespace

// Messages end up in logs: no UID.
std::string flag_of(const std::string& name, const std::string& given, const std::vector<FieldRef>& fields) {
  const std::string value = without_uid(given);
  for (const FieldRef& f : fields) {
    if (f.doc.name != name) continue;
    if (f.kind() != "flag") return f.flag() + " " + quoted(value);
    return value == "true" ? f.flag() : "--no-" + f.flag().substr(2);
  }
  return "--set " + name + "=" + quoted(value);
}

std::string flags_of(const Recipe& recipe) {
  PrepareCommand::Params params;
  const auto fields = fields_of<PrepareCommand>(params);
  std::string all;
  for (const auto& [name, value] : recipe.settings) {
    // Such values may name the patient: that there was one is said, not which.
    all += " " + (recipe.withheld.contains(name) ? flag_of(name, "...", fields) : flag_of(name, value, fields));
  }
  for (const std::string& name : recipe.lost) all += " " + flag_of(name, "...", fields);
  if (!recipe.structures_hash.empty()) all += " --structures";
  if (!recipe.pipeline_hash.empty()) all += " --pipeline";
  return all.empty() ? " nothing" : all;
}

namespace {

// `structures`: a label map, or the folder of a trained network that finds them in the CT of the case.
void add_structures(Pipeline& pipeline, const fs::path& structures, const Recipe& recipe, bool as_held,
                    const fs::path& folder) {
  const bool has_ct =
      std::any_of(pipeline.nodes.begin(), pipeline.nodes.end(), [](const PipelineNode& n) { return n.id == "ct"; });
  PipelineNode node;
  node.id = node.stage = "structures";
  if (is_network_folder(structures)) {
    if (!has_ct)
      throw Error(ExitCode::usage, "the pipeline has no step 'ct', in which a network could look for structures",
                  "run 'osteo segment-network', and give its label map as --structures");
    PipelineNode network;
    network.id = "network";
    network.stage = "segment-network";
    network.inputs["image"].node = "ct";
    network.inputs["model"].file = structures;
    if (output_exists(structures / "calibration.json"))
      network.outputs["uncertainty"] = folder / "uncertainty.seg.nrrd";
    pipeline.nodes.push_back(std::move(network));
    node.inputs["labels"].node = "network";
  } else {
    node.inputs["labels"].file = structures;
  }
  if (has_ct) node.inputs["image"].node = "ct";
  const auto names = recipe.settings.find("names");
  if (names != recipe.settings.end() && !as_held) {
    node.params["names"] = names->second;
    node.params["only_named"] = "true";
  }
  node.outputs["structures"] = folder / "structures.seg.nrrd";
  pipeline.nodes.push_back(std::move(node));
  for (PipelineNode& n : pipeline.nodes) {
    if (n.id == "preview") n.inputs["mask"].node = "structures";
  }
}

}  // namespace

Pipeline case_pipeline(const std::string& text, const Recipe& recipe, const fs::path& source,
                       const fs::path& structures, bool as_held, const fs::path& folder,
                       const std::optional<CaseEdits>& edits, bool threshold_asked) {
  std::map<std::string, std::string> settings = recipe.settings;
  settings.erase("names");
  settings["source"] = source.string();
  settings["case"] = folder.string();
  Pipeline pipeline = parse_pipeline(text, settings);
  if (!structures.empty()) add_structures(pipeline, structures, recipe, as_held, folder);
  if (edits) add_edits(pipeline, *edits, folder, threshold_asked);
  pass_threshold_on(pipeline);
  return pipeline;
}

ScanKeeper::ScanKeeper(const Pipeline& pipeline) {
  for (const PipelineNode& n : pipeline.nodes) {
    const auto image = n.inputs.find("image"), mask = n.inputs.find("mask");
    if (n.stage != "resample" || image == n.inputs.end() || mask == n.inputs.end()) continue;
    if (image->second.node.empty()) continue;
    image_ = {image->second.node, image->second.port};
    mask_ = {mask->second.node, mask->second.port};
    mask_file_ = mask->second.file;
    return;
  }
}

std::function<void(const std::string&, const std::string&, const Data&)> ScanKeeper::sink() {
  return [this](const std::string& id, const std::string& port, const Data& value) {
    const auto is = [&](const std::pair<std::string, std::string>& wanted) {
      return id == wanted.first && (wanted.second.empty() || port == wanted.second);
    };
    if (const auto* image = std::get_if<Image>(&value); image != nullptr && is(image_)) ct_ = *image;
    if (const auto* labels = std::get_if<Labels>(&value); labels != nullptr && is(mask_)) labels_ = *labels;
  };
}

std::optional<CaseScan> ScanKeeper::take() {
  if (ct_ && !labels_ && !mask_file_.empty()) labels_ = load_labels(mask_file_);
  if (!ct_ || !labels_) return std::nullopt;
  CaseScan scan{std::move(*ct_), std::move(*labels_)};
  ct_.reset();
  labels_.reset();
  return scan;
}

CaseReport report_on(const fs::path& folder, const std::string& asked_for, const std::optional<Pipeline>& pipeline,
                     std::optional<CaseScan> scan, cli::Invocation& io) {
  try {
    if (!scan && pipeline && !has_full_report(folder)) {
      ScanKeeper keeper(*pipeline);
      if (keeper.possible()) {
        const std::vector<std::string> ids = keeper.ids();
        RunOptions options;
        options.overwrite = true;
        options.always = {ids.begin(), ids.end()};
        options.seen = keeper.sink();
        // What there is to say of these steps was said when the case was made.
        Context quiet = io.context.sub(0, 0.3);
        static_cast<void>(run_pipeline(up_to(*pipeline, ids), io.registry, options, quiet));
        static_cast<void>(io.context.take_report());
        scan = keeper.take();
      }
    }
    const InLanguage theirs(language_of_environment());
    CaseReport report = write_case_report(folder, asked_for, scan, io.context);
    static_cast<void>(io.context.take_report());
    io.end_progress();
    if (!io.common.quiet) {
      io.err << "report: " << (report.unchanged ? "unchanged" : "written") << "\n  " << report.html.string() << "\n  "
             << report.pdf.string() << '\n';
      for (const std::string& what : report.left_out) io.err << "  left out: " << what << '\n';
    }
    return report;
  } catch (const Error& e) {
    io.end_progress();
    if (e.code() == ExitCode::cancelled || !output_exists(folder / "manifest.json")) throw;
    throw Error(e.code(), std::string("the case is whole, but its report is not written: ") + e.what(),
                e.advice().empty() ? "'osteo report " + shell_path(folder) + "' writes it; --no-report does without"
                                   : e.advice());
  }
}

}  // namespace osteo
