// What a case says of itself, in the words and digits of people. Private to libs/assessment/case_report.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "measures.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/report/sheet.h"

namespace osteo::inline assessment::case_report {

/// The manifest and the verdict of the import, and ways into them.
class CaseFacts {
 public:
  explicit CaseFacts(const std::filesystem::path& case_folder);

  [[nodiscard]] const Json& manifest() const { return manifest_; }
  [[nodiscard]] const Json* verdict(std::string_view a, std::string_view b = {}) const;
  /// What the first step of that stage reported or was given.
  [[nodiscard]] std::optional<double> reported(std::string_view stage, std::string_view key) const;
  [[nodiscard]] std::string reported_text(std::string_view stage, std::string_view key) const;
  [[nodiscard]] std::string param(std::string_view stage, std::string_view key) const;

 private:
  [[nodiscard]] const Json* step(std::string_view stage) const;
  Json manifest_, verdict_;
};

/// "574 cm³", "12.3 cm³", "1.41 cm³"; below 1 cm³ "83 mm³".
[[nodiscard]] std::string volume_text(double mm3);
/// With so many digits that mean something: "0.45", "1", "12.5".
[[nodiscard]] std::string number_text(double value, int decimals);

[[nodiscard]] sheet::Band verdict_band(const CaseFacts& facts);
/// Notes of the import that a person has to know, beyond the band.
[[nodiscard]] std::vector<sheet::Paragraph> verdict_notes(const CaseFacts& facts);
using Rows = std::vector<std::pair<std::string, std::string>>;
[[nodiscard]] Rows scan_rows(const CaseFacts& facts);
[[nodiscard]] Rows bone_rows(const CaseFacts& facts);
/// What was taken off the bone and what was left that might not belong to it.
[[nodiscard]] Rows removed_rows(const CaseFacts& facts);
/// One row a structure. Distances carry the uncertainty of both boundaries (root of the sum of squares) where it is
/// known of both; what its maker says is not to be trusted stands out.
[[nodiscard]] sheet::Table structure_table(const std::vector<StructureMeasure>& measures);
/// Of the sizes that the table calls usual.
[[nodiscard]] std::string sources_of(const std::vector<StructureMeasure>& measures);
/// Of the text of a file of 'osteo outcome': fragments, condyles, cuts and contours, each with its interval or why it
/// is not known.
[[nodiscard]] SheetBlocks outcome_blocks(const std::string& json);
/// How many voxels small structures have, and what that means.
[[nodiscard]] sheet::Table resolution_table(const CaseFacts& facts);

}  // namespace osteo::inline assessment::case_report
