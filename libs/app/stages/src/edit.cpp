#include "edit.h"

#include <algorithm>

namespace osteo::inline app {
namespace {

// What a person has drawn or changed says so from then on. `before`: the labels that the edits began with.
void note_hands(Labels& structures, const std::vector<std::uint8_t>& before, const EditRecipe& recipe) {
  std::array<bool, 256> was{}, changed{}, found{};
  for (const EditOperation& o : recipe.operations)
    if (const auto* const voxels = std::get_if<VoxelsEdit>(&o))
      found[static_cast<std::size_t>(voxels->structure)] = true;  // by a tool of the editor, which is not recorded
  for (std::size_t v = 0; v < before.size(); ++v) {
    was[before[v]] = true;
    if (before[v] != structures.voxels[v]) changed[before[v]] = changed[structures.voxels[v]] = true;
  }
  for (Structure& s : structures.structures) {
    if (!was[s.value])
      s.origin = found[s.value] ? "" : kDrawnByHand;
    else if (changed[s.value] && !s.origin.empty() && s.origin != kDrawnByHand && !s.origin.ends_with(kCorrectedByHand))
      s.origin += kCorrectedByHand;
    if (!was[s.value] || changed[s.value]) {  // what was said of its boundary was said of another
      s.within_mm = 0;
      s.doubt.clear();
    }
  }
}

}  // namespace

StageInfo ApplyEditsStage::info() {
  return {.name = "apply-edits",
          .version = 2,
          .synopsis = "corrections made by hand in 'osteo edit', done again on a mask",
          .description =
              "Does what edits.json holds, in order and to the bit: thresholds, fragments, boxes, cavities, smoothing, "
              "brush strokes, structures. "
              "The edits belong to one CT, and another is rejected; from another mask than they began with they go on, "
              "and it says so.",
          .inputs = {{"image", {DataKind::image}, "CT in HU"},
                     {"mask", {DataKind::labels}, "bone mask to begin with"},
                     {"edits", {DataKind::document}, "edits.json of 'osteo edit'"},
                     {"labels", {DataKind::labels}, "structures to begin with", true}},
          .outputs = {{"mask", {DataKind::labels}, "1 in bone, 0 elsewhere"},
                      {"structures", {DataKind::labels}, "critical structures, with names and colours", true},
                      {"edits", {DataKind::document}, "the edits as they were read", true}},
          .references = {},
          .example = "osteo apply-edits ct.nrrd mask.nrrd edits.json corrected.nrrd"};
}

std::vector<Data> ApplyEditsStage::run(const Params&, std::span<const Data> inputs, const Context& context) {
  const auto& ct = std::get<Image>(inputs[0]);
  const auto& text = std::get<Document>(inputs[2]).json;
  const EditRecipe recipe = parse_edits(text, "edits.json");
  EditDocument document(ct, std::get<Labels>(inputs[1]), std::get_if<Labels>(&inputs[3]));
  const double before = document.volume_mm3(0);
  const std::vector<std::uint8_t> given(document.labels().begin(), document.labels().end());
  apply_edits(document, recipe, context);
  context.report("steps", static_cast<std::int64_t>(recipe.operations.size()));
  context.report("mask_volume_before_mm3", before);
  context.report("mask_volume_mm3", document.volume_mm3(0));
  if (document.volume_mm3(0) == 0) throw Error(ExitCode::failed, "the edits leave no bone", "edit the case again");
  if (const auto lower = threshold_of(recipe)) context.report("lower_hu", *lower);
  Labels structures = document.structure_labels(StructureRole::at_risk);
  note_hands(structures, given, recipe);
  context.report("structures", static_cast<std::int64_t>(structures.structures.size()));
  return {document.bone_labels(context.threads), std::move(structures), Document{text}};
}

}  // namespace osteo::inline app
