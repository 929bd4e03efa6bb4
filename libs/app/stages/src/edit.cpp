#include "edit.h"

#include <algorithm>
#include <array>
#include <limits>
#include <string>

namespace osteo::inline app {
namespace {

/// A structure that an edit has made anew: what was said of it, and the voxels that a program gave it.
struct Made {
  const AddStructureEdit* as = nullptr;
  const VoxelsEdit* voxels = nullptr;
};

std::array<Made, 256> made_by(const EditRecipe& recipe) {
  std::array<Made, 256> made;
  for (const EditOperation& o : recipe.operations) {
    if (const auto* const add = std::get_if<AddStructureEdit>(&o))
      made[static_cast<std::size_t>(add->structure)] = {add, nullptr};
    else if (const auto* const gone = std::get_if<DeleteStructureEdit>(&o))
      made[static_cast<std::size_t>(gone->structure)] = {};
    else if (const auto* const voxels = std::get_if<VoxelsEdit>(&o))
      made[static_cast<std::size_t>(voxels->structure)].voxels = voxels;
  }
  return made;
}

/// Whether a structure's voxels are still those that the program gave it.
bool as_given(const Labels& structures, std::uint8_t value, const VoxelsEdit& given) {
  return voxels_of(structures, value, value).runs == given.runs;
}

// What a person has drawn or changed says so from then on; what a program has found, and nobody has changed, keeps what
// the program says of it. `before`: the labels that the edits began with.
void note_hands(Labels& structures, const std::vector<std::uint8_t>& before, const EditRecipe& recipe) {
  std::array<bool, 256> was{}, changed{};
  const std::array<Made, 256> made = made_by(recipe);
  for (std::size_t v = 0; v < before.size(); ++v) {
    was[before[v]] = true;
    if (before[v] != structures.voxels[v]) changed[before[v]] = changed[structures.voxels[v]] = true;
  }
  for (Structure& s : structures.structures) {
    const auto& [as, voxels] = made[s.value];
    if (as != nullptr && voxels != nullptr && !as->origin.empty()) {
      const bool kept = as_given(structures, s.value, *voxels);
      s.origin = as->origin + (kept ? "" : std::string(kCorrectedByHand));
      s.doubt = kept ? as->doubt : "";
      s.within_mm = !kept ? 0 : as->within_mm < 0 ? std::numeric_limits<double>::infinity() : as->within_mm;
      continue;
    }
    if (!was[s.value])
      s.origin = voxels != nullptr ? "" : kDrawnByHand;  // by a tool of the editor, which is not recorded
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
          .version = 3,
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
