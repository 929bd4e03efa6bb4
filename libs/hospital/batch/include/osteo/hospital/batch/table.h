// The table of a batch: a row is a case.
#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace osteo::inline hospital {

struct BatchCase {
  std::size_t line = 1;          ///< in the table
  std::string code;              ///< letters, digits, - and _, beginning with a letter or digit; at most 64
  std::filesystem::path source;  ///< of the scan; relative ones are resolved by the table's folder
  std::map<std::string, std::string> settings;  ///< what else its row says, by column; an empty field is not in it
};

/// The bytes of a table as any spreadsheet writes it, as CSV in UTF-8 with commas, line for line: UTF-16 with its mark
/// is converted; semicolons or tabs separate where the first line has no comma; lines of separators alone are emptied,
/// and so is a first line "sep=;". Error(usage) with file and line for what is no UTF-8, such as letters of Latin-1,
/// whose meaning nobody can know, and for zero bytes.
[[nodiscard]] std::string plain_table(std::string_view bytes, const std::filesystem::path& file);

/// A plain_table() with a first line of names: `source` and `case`, and one column for each setting that is given.
/// `known` are the settings there are; a name with a dot in it (STAGE.PARAMETER) passes. `paths` are those whose values
/// are files, resolved like `source`. Rows without a word in them are left out. Codes become names of folders, so two
/// that differ in case alone are equal: not every disk can tell them apart. Error(usage) with file and line: what
/// read_csv() rejects, a column or code that is missing, not known, there twice or no code, no rows. Nothing is looked
/// up on the disk.
[[nodiscard]] std::vector<BatchCase> read_batch_table(std::string_view text, const std::filesystem::path& file,
                                                      std::span<const std::string> known,
                                                      std::span<const std::string> paths);

/// Asks `check` about the settings of each row before anything is begun; equal settings once. What it throws (usage) is
/// told with file and line of the first row that it is wrong for, and how many others are wrong: Error(usage).
void check_batch_table(std::span<const BatchCase> cases, const std::filesystem::path& file,
                       const std::function<void(const std::map<std::string, std::string>& settings)>& check);

}  // namespace osteo::inline hospital
