// What a case is made from, in memory: the CT, its bone mask before any correction, its structures, and the corrections
// so far.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "osteo/core/base/context.h"
#include "osteo/core/stage/stage.h"
#include "osteo/imaging/edit/edit_file.h"

namespace osteo {

struct EditedScan {
  Image ct;
  Labels mask;
  std::optional<Labels> structures;
  std::optional<Labels> uncertainty;  ///< of their boundaries, where a network found them that knows it
  std::filesystem::path network;      ///< that found the structures, where it is known here; empty: none
  std::optional<EditRecipe> edits;
  std::filesystem::path scan;  ///< where it was found
};

/// Runs the stages of the case's own pipeline up to its mask, in memory: nothing is written. `scan`: empty, or where
/// the scan is. Errors: no_input when the scan, the pipeline file or the structures are not known on this machine;
/// usage for another scan than the case's, or a pipeline without a mask; and what those stages throw.
[[nodiscard]] EditedScan open_edited_scan(const std::filesystem::path& folder, const std::string& scan,
                                          const Registry& registry, const Context& context);

}  // namespace osteo
