#include "case_edits.h"

#include <algorithm>

#include "mask_nodes.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/session/scene/case.h"

namespace osteo {
namespace {

constexpr const char* kNode = "edits";

}  // namespace

std::optional<CaseEdits> edits_of_case(const fs::path& folder, const std::optional<std::string>& given, Recipe& recipe,
                                       std::vector<std::string>& notes) {
  const std::string before = recipe.edits_hash;
  if (given && given->empty()) {
    if (!before.empty()) notes.emplace_back("--edits: dropped");
    recipe.edits_hash.clear();
    return std::nullopt;
  }
  fs::path file = given ? fs::path(*given) : folder / "edits.json";
  if (given) {
    require_readable(file);
    recipe.edits_hash = hash_path(file);
    if (recipe.edits_hash != before) notes.emplace_back(before.empty() ? "--edits: new" : "--edits: other ones");
  } else {
    if (before.empty()) return std::nullopt;
    if (!output_exists(file) || hash_path(file) != before) {
      throw Error(ExitCode::no_input, "the corrections in '" + file.string() + "' are gone or were changed by hand",
                  "put them back, give them with --edits FILE, or --no-edits to drop them");
    }
  }
  EditRecipe edits = parse_edits(read_text(file), file.string());
  return CaseEdits{std::move(file), std::move(edits)};
}

void keep_dropped_edits(const fs::path& folder, const Context& context) {
  const fs::path file = folder / "edits.json";
  if (!output_exists(file)) return;
  write_file(folder / "edits-dropped.json", read_text(file));
  context.info("what was done by hand is kept in edits-dropped.json; --edits takes it up again");
}

void add_edits(Pipeline& pipeline, const CaseEdits& edits, const fs::path& folder, bool threshold_asked) {
  const MaskNodes at = mask_nodes(pipeline);
  const auto own = threshold_of(edits.recipe);
  if (own && threshold_asked) {
    throw Error(ExitCode::usage,
                "the threshold has no say: the case was edited by hand from " + format_number(*own) + " HU on",
                "change it in 'osteo edit', or --no-edits to drop what was done by hand");
  }
  // Whoever took the mask takes the corrected one.
  for (PipelineNode& n : pipeline.nodes) {
    for (auto& [port, input] : n.inputs) {
      if (input.node == at.mask.node && input.port == at.mask.port) input = {kNode, "", {}};
    }
    if (own && n.stage == "resample" && n.inputs.contains("mask") && n.inputs.at("mask").node == kNode)
      n.params.try_emplace("lower", format_number(*own));
  }
  PipelineNode node;
  node.id = kNode;
  node.stage = "apply-edits";
  node.inputs["image"] = at.image;
  node.inputs["mask"] = at.mask;
  node.inputs["edits"].file = edits.file;
  node.outputs["edits"] = folder / "edits.json";
  bool structures =
      std::any_of(edits.recipe.operations.begin(), edits.recipe.operations.end(), [](const EditOperation& o) {
        return std::holds_alternative<AddStructureEdit>(o) || std::holds_alternative<ChangeStructureEdit>(o);
      });
  for (PipelineNode& n : pipeline.nodes) {
    if (n.id != "structures") continue;
    structures = true;
    n.outputs["structures"] = folder / kGivenStructures;
    node.inputs["labels"].node = n.id;
  }
  if (structures) {
    node.outputs["structures"] = folder / "structures.seg.nrrd";
    for (PipelineNode& n : pipeline.nodes) {
      if (n.id == "preview") n.inputs["mask"] = {kNode, "structures", {}};
    }
  }
  pipeline.nodes.push_back(std::move(node));
}

std::string mask_before_edits(const Pipeline& pipeline, const std::string& node) {
  for (const PipelineNode& n : pipeline.nodes) {
    if (n.id == node && n.stage == "apply-edits" && n.inputs.contains("mask")) return n.inputs.at("mask").node;
  }
  return node;
}

}  // namespace osteo
