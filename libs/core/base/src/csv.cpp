#include "osteo/core/base/csv.h"

#include <algorithm>
#include <charconv>

namespace osteo {

Error Csv::wrong(std::size_t line, const std::string& what, const std::string& advice) const {
  return {ExitCode::usage, "'" + name + "' line " + std::to_string(line) + ": " + what, advice};
}

int Csv::whole(const CsvRow& row, std::size_t column) const {
  const std::string& text = row.fields[column];
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size())
    throw wrong(row.line, columns[column] + " is '" + text + "', not a whole number");
  return value;
}

Csv read_csv(std::string_view text, const std::string& name) {
  Csv csv{name, {}, {}};
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  std::size_t line = 1;
  bool named = false;
  for (std::size_t at = 0; at < text.size();) {
    CsvRow row{line, {}};
    bool more = true;
    while (more) {
      std::string field;
      if (at < text.size() && text[at] == '"') {
        for (++at;; ++at) {
          if (at >= text.size()) throw csv.wrong(row.line, "a quote is not closed");
          if (text[at] == '"' && at + 1 < text.size() && text[at + 1] == '"') {
            ++at;
          } else if (text[at] == '"') {
            break;
          }
          line += text[at] == '\n' ? 1 : 0;
          field += text[at];
        }
        ++at;
        if (at < text.size() && text[at] != ',' && text[at] != '\n' && text[at] != '\r')
          throw csv.wrong(line, "there is something after a closing quote");
      } else {
        while (at < text.size() && text[at] != ',' && text[at] != '\n' && text[at] != '\r') field += text[at++];
      }
      row.fields.push_back(std::move(field));
      more = at < text.size() && text[at] == ',';
      if (more) ++at;
    }
    if (at < text.size() && text[at] == '\r') ++at;
    if (at < text.size() && text[at] == '\n') ++at;
    ++line;
    if (row.fields.size() == 1 && row.fields[0].empty()) continue;
    if (!named) {
      named = true;
      csv.columns = row.fields;
      for (std::size_t i = 0; i < csv.columns.size(); ++i) {
        if (csv.columns[i].empty()) throw csv.wrong(row.line, "column " + std::to_string(i + 1) + " has no name");
        if (std::count(csv.columns.begin(), csv.columns.end(), csv.columns[i]) > 1)
          throw csv.wrong(row.line, "column '" + csv.columns[i] + "' is there twice");
      }
      continue;
    }
    if (row.fields.size() != csv.columns.size())
      throw csv.wrong(row.line,
                      std::to_string(row.fields.size()) + " fields where the first line names " +
                          std::to_string(csv.columns.size()),
                      "a field with a comma in it goes into quotes");
    csv.rows.push_back(std::move(row));
  }
  return csv;
}

bool is_formula(std::string_view field) {
  return !field.empty() && std::string_view("=+-@\t\r").find(field[0]) != std::string_view::npos;
}

std::string csv_line(const std::vector<std::string>& fields) {
  std::string line;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    line += i > 0 ? "," : "";
    if (fields[i].find_first_of(",\"\r\n") == std::string::npos) {
      line += fields[i];
      continue;
    }
    line += '"';
    for (const char c : fields[i]) line += c == '"' ? std::string("\"\"") : std::string(1, c);
    line += '"';
  }
  return line + "\n";
}

}  // namespace osteo
