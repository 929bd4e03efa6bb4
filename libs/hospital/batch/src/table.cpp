#include "osteo/hospital/batch/table.h"

#include <algorithm>
#include <map>

#include "osteo/core/base/csv.h"
#include "osteo/core/base/param.h"

namespace osteo::inline hospital {
namespace {

constexpr std::size_t kLongestCode = 64;
constexpr const char* kCodeAdvice = "a code is letters, digits, - and _, begins with a letter or a digit, and has 64 of them at most";

bool is_plain(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

bool is_code(const std::string& text) {
  return !text.empty() && text.size() <= kLongestCode && is_plain(text[0]) &&
         std::all_of(text.begin(), text.end(), [](char c) { return is_plain(c) || c == '-' || c == '_'; });
}

}  // namespace

std::vector<BatchCase> read_batch_table(std::string_view text, const std::filesystem::path& file, std::span<const std::string> known,
                                        std::span<const std::string> paths) {
  const Csv csv = read_csv(text, file.string());
  const auto column = [&](const char* name) {
    const auto at = std::find(csv.columns.begin(), csv.columns.end(), name);
    if (at == csv.columns.end())
      throw csv.wrong(1, "there is no column '" + std::string(name) + "'",
                      "the first line names the columns: source,case and what else is set");
    return static_cast<std::size_t>(at - csv.columns.begin());
  };
  const std::size_t source = column("source"), code = column("case");
  for (std::size_t i = 0; i < csv.columns.size(); ++i) {
    const std::string& name = csv.columns[i];
    if (i == source || i == code || name.find('.') != std::string::npos || std::find(known.begin(), known.end(), name) != known.end())
      continue;
    const std::string near = nearest_name(name, known);
    throw csv.wrong(1, "column '" + name + "' is no setting of a case",
                    near.empty() ? "'osteo help prepare' shows them" : "did you mean '" + near + "'?");
  }
  const std::filesystem::path folder = file.parent_path();
  std::vector<BatchCase> cases;
  std::map<std::string, std::size_t> lines;  // by code in lower case
  for (const CsvRow& row : csv.rows) {
    BatchCase c{row.line, row.fields[code], {}, {}};
    if (!is_code(c.code)) throw csv.wrong(row.line, "'" + c.code + "' is no code of a case", kCodeAdvice);
    if (const auto [other, fresh] = lines.try_emplace(lower_case(c.code), row.line); !fresh)
      throw csv.wrong(row.line, "the case '" + c.code + "' is there already, in line " + std::to_string(other->second));
    if (row.fields[source].empty()) throw csv.wrong(row.line, "the case '" + c.code + "' has no source");
    if (row.fields[source].find('\0') != std::string::npos) throw csv.wrong(row.line, "there is a zero byte in the source");
    c.source = (folder / row.fields[source]).lexically_normal();
    for (std::size_t i = 0; i < csv.columns.size(); ++i) {
      if (i == source || i == code || row.fields[i].empty()) continue;
      const bool is_path = std::find(paths.begin(), paths.end(), csv.columns[i]) != paths.end();
      c.settings[csv.columns[i]] = is_path ? (folder / row.fields[i]).lexically_normal().string() : row.fields[i];
    }
    cases.push_back(std::move(c));
  }
  if (cases.empty()) throw csv.wrong(1, "there are no cases in it");
  return cases;
}

}  // namespace osteo::hospital
