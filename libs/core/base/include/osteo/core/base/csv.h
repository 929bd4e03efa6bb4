// Tables as spreadsheets write them (RFC 4180): commas, quotes where needed, a line of names first.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/error.h"

namespace osteo {

struct CsvRow {
  std::size_t line = 1;
  std::vector<std::string> fields;
};
struct Csv {
  std::string name;  ///< as errors call it
  std::vector<std::string> columns;
  std::vector<CsvRow> rows;

  [[nodiscard]] Error wrong(std::size_t line, const std::string& what, const std::string& advice = {}) const;
  /// A whole number; what the column is called.
  [[nodiscard]] int whole(const CsvRow& row, std::size_t column) const;
};
/// Error(usage) with file and line: a quote that is not closed, a row of another length, a column that is there twice.
[[nodiscard]] Csv read_csv(std::string_view text, const std::string& name);
/// What a spreadsheet takes for a formula, and works out, when it opens a table.
[[nodiscard]] bool is_formula(std::string_view field);
[[nodiscard]] std::string csv_line(const std::vector<std::string>& fields);

}  // namespace osteo
