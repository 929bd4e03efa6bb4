// What a case was asked for, so that it can be made again with one thing changed and the rest kept.
#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/json_document.h"

namespace osteo::inline session {

/// Kept in the manifest. It holds no paths and no UIDs, since those may name the patient: files are known by the hashes
/// of their content.
struct Recipe {
  std::string source_hash{};      ///< of the scan
  std::string structures_hash{};  ///< of the label map; empty: none was given
  std::string pipeline_hash{};    ///< of the pipeline file; empty: the built-in one
  std::string edits_hash{};       ///< of edits.json, which lies in the case; empty: nothing was corrected by hand
  /// Variable of the pipeline, or ID.PARAMETER -> text: only what was asked for. The rest is as the pipeline has it.
  std::map<std::string, std::string> settings;
  std::set<std::string> withheld{};  ///< those of `settings` whose values may name the patient
  std::set<std::string> lost{};      ///< withheld ones whose values this machine does not know
  friend bool operator==(const Recipe&, const Recipe&) = default;
};

[[nodiscard]] Json recipe_json(const Recipe& recipe);
/// Of the case's manifest; nothing when there is no manifest, or an old one without a recipe. Error(corrupt) when it is
/// damaged.
[[nodiscard]] std::optional<Recipe> read_recipe(const std::filesystem::path& case_folder);

struct RecipeChange {
  std::string name;
  std::optional<std::string> from, to;  ///< none: as the pipeline has it
  std::string why;                      ///< empty: it was asked for
};
/// `given` over what the recipe holds; a value of none drops a setting. What belongs to something that changes goes
/// with it: the place of a box to the region, the names to the label map (`other_structures`), the threshold to the
/// preset that would ignore it, and vice versa.
[[nodiscard]] std::vector<RecipeChange> change_settings(Recipe& recipe,
                                                        const std::map<std::string, std::optional<std::string>>& given,
                                                        bool other_structures);

/// Notes of this user on this machine, outside every case: where a file of this content was last seen, or a text of
/// this hash. In $XDG_STATE_HOME/osteotome (else ~/.local/state/osteotome), readable by the user alone. A note that
/// cannot be kept is not kept.
void remember(const std::string& hash, const std::string& text);
[[nodiscard]] std::optional<std::string> recall(const std::string& hash);
/// The file or folder of this content, when it is still where it was and what it was.
[[nodiscard]] std::optional<std::filesystem::path> recall_file(const std::string& hash);

}  // namespace osteo::inline session
