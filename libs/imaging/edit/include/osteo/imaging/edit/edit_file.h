// edits.json: what was done to a case by hand, to be done again bit for bit. Bound to the scan; holds no voxel of it
// and no name.
#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/json_document.h"
#include "osteo/imaging/edit/document.h"

namespace osteo::inline imaging {

struct EditRecipe {
  std::string ct_hash;      ///< of the CT that was edited, with its grid (`hash_of`)
  std::string start_hash;   ///< of mask and structures at the beginning
  std::string result_hash;  ///< of mask and structures at the end
  std::vector<EditOperation> operations;
  std::vector<int> hidden;  ///< values of structures that were not shown
};

[[nodiscard]] EditRecipe recipe_of(const EditDocument& document);
[[nodiscard]] Json edits_json(const EditRecipe& recipe);
/// One operation a line. Error(usage), with file and line, for a key, a value or an operation that is not known or out
/// of range.
[[nodiscard]] std::string edits_text(const EditRecipe& recipe);
[[nodiscard]] EditRecipe parse_edits(std::string_view text, const std::string& name);

/// Does all of it, in order, each a step that can be undone; then structures are hidden as they were. Error(usage) when
/// the CT is another one; Error(corrupt) when the start is the same and the result is not. From another start (the mask
/// was made with other flags) it goes on and says so by a warning.
void apply_edits(EditDocument& document, const EditRecipe& recipe, const Context& context = {});

/// The lower value of the last threshold, where there is one: where the boundary of bone lies.
[[nodiscard]] std::optional<double> threshold_of(const EditRecipe& recipe);

}  // namespace osteo::inline imaging
