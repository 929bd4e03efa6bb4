// What a case was asked for, as a pipeline and in words; and its report.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "case_edits.h"
#include "osteo/app/cli/command.h"
#include "osteo/assessment/case_report/case_report.h"
#include "osteo/imaging/pipeline/pipeline.h"
#include "osteo/session/scene/recipe.h"

namespace osteo {

/// As it is written on a command line: --lower 500, --set keep_largest=1, --remove-table.
[[nodiscard]] std::string flag_of(const std::string& name, const std::string& value,
                                  const std::vector<FieldRef>& fields);
/// The same of all settings: " --lower 500 --structures"; " nothing". Values that may name the patient are not in it.
[[nodiscard]] std::string flags_of(const Recipe& recipe);

/// `text` is the pipeline file's. `structures`: empty where there are none; `as_held`: they are the case's own, names
/// and all. `edits`: corrections by hand; `threshold_asked` as add_edits() has it.
[[nodiscard]] Pipeline case_pipeline(const std::string& text, const Recipe& recipe, const std::filesystem::path& source,
                                     const std::filesystem::path& structures, bool as_held,
                                     const std::filesystem::path& folder, const std::optional<CaseEdits>& edits,
                                     bool threshold_asked);

/// Keeps the CT and the mask that bone is made from while a pipeline runs; nothing where the pipeline has no such step.
class ScanKeeper {
 public:
  explicit ScanKeeper(const Pipeline& pipeline);
  /// For RunOptions::seen; `this` must outlive it.
  [[nodiscard]] std::function<void(const std::string&, const std::string&, const Data&)> sink();
  [[nodiscard]] std::optional<CaseScan> take();
  [[nodiscard]] bool possible() const { return !image_.first.empty(); }
  /// Ids of both nodes.
  [[nodiscard]] std::vector<std::string> ids() const { return {image_.first, mask_.first}; }

 private:
  std::pair<std::string, std::string> image_, mask_;  // node, port
  std::filesystem::path mask_file_;  // where no node makes it, as after a correction in another program
  std::optional<Image> ct_;
  std::optional<Labels> labels_;
};

/// Writes the report beside the case and says so. Where pictures are wanted that need the scan, and `scan` has none,
/// the steps of the pipeline up to the mask are done again. An error says that the case is whole.
CaseReport report_on(const std::filesystem::path& folder, const std::string& asked_for,
                     const std::optional<Pipeline>& pipeline, std::optional<CaseScan> scan, cli::Invocation& io);

}  // namespace osteo
