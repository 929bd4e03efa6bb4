// Corrections by hand in the pipeline that makes a case.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "osteo/imaging/edit/edit_file.h"
#include "osteo/imaging/pipeline/pipeline.h"
#include "osteo/session/scene/recipe.h"

namespace osteo {

struct CaseEdits {
  std::filesystem::path file;
  EditRecipe recipe;
};

/// Those of a file that is given (an empty name drops them), else those that the case holds; the case's recipe is told.
/// Error(no_input) when the case's own are gone or were changed; whatever the file says that cannot be.
[[nodiscard]] std::optional<CaseEdits> edits_of_case(const std::filesystem::path& folder,
                                                     const std::optional<std::string>& given, Recipe& recipe,
                                                     std::vector<std::string>& notes);

/// Before a case without corrections takes the place of one with them: what was done by hand stays beside it, as
/// edits-dropped.json.
void keep_dropped_edits(const std::filesystem::path& folder, const Context& context);

/// Puts them between the mask and all that is made of it; structures and the edits themselves are written into the
/// case. `threshold_asked`: Error(usage) when the edits have a threshold of their own, beside which it has no say.
void add_edits(Pipeline& pipeline, const CaseEdits& edits, const std::filesystem::path& folder, bool threshold_asked);

/// The node that made the mask which `node` corrects; `node` itself when it corrects none.
[[nodiscard]] std::string mask_before_edits(const Pipeline& pipeline, const std::string& node);

}  // namespace osteo
