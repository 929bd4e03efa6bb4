// The table of a batch: a row is a case.
#pragma once
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace osteo::inline hospital {

struct BatchCase {
  std::size_t line = 1;                         ///< in the table
  std::string code;                             ///< letters, digits, - and _, beginning with a letter or digit; at most 64
  std::filesystem::path source;                 ///< of the scan; relative ones are resolved by the table's folder
  std::map<std::string, std::string> settings;  ///< what else its row says, by column; an empty field is not in it
};

/// CSV with a first line of names: `source` and `case`, and one column for each setting that is given. `known` are the settings there are;
/// a name with a dot in it (STAGE.PARAMETER) passes. `paths` are those whose values are files, resolved like `source`.
/// Codes become names of folders, so two that differ in case alone are equal: not every disk can tell them apart.
/// Error(usage) with file and line: what read_csv() refuses, a column or code that is missing, not known, there twice or no code, no rows.
/// Nothing is looked up on the disk.
[[nodiscard]] std::vector<BatchCase> read_batch_table(std::string_view text, const std::filesystem::path& file,
                                                      std::span<const std::string> known, std::span<const std::string> paths);

}  // namespace osteo::hospital
