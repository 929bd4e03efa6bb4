#include "osteo/hospital/batch/table.h"

#include <algorithm>
#include <map>
#include <optional>

#include "osteo/core/base/csv.h"
#include "osteo/core/base/param.h"

namespace osteo::inline hospital {
namespace {

constexpr std::size_t kLongestCode = 64;
constexpr const char* kCodeAdvice =
    "a code is letters, digits, - and _, begins with a letter or a digit, and has 64 of them at most";

bool is_plain(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

bool is_code(const std::string& text) {
  return !text.empty() && text.size() <= kLongestCode && is_plain(text[0]) &&
         std::all_of(text.begin(), text.end(), [](char c) { return is_plain(c) || c == '-' || c == '_'; });
}

// The character that begins at text[at] as UTF-8 has it (RFC 3629): its bytes, 0 for none.
std::size_t utf8_length(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return at + i < text.size() ? static_cast<unsigned char>(text[at + i]) : 0U; };
  const auto follows = [&](std::size_t i) { return (byte(i) & 0xc0U) == 0x80U; };
  const unsigned first = byte(0), second = byte(1);
  if (first < 0x80) return 1;
  if (first >= 0xc2 && first < 0xe0) return follows(1) ? 2 : 0;
  if (first >= 0xe0 && first < 0xf0) {
    const bool shortest = first != 0xe0 || second >= 0xa0, no_surrogate = first != 0xed || second < 0xa0;
    return follows(1) && follows(2) && shortest && no_surrogate ? 3 : 0;
  }
  if (first >= 0xf0 && first < 0xf5) {
    const bool shortest = first != 0xf0 || second >= 0x90, in_range = first != 0xf4 || second < 0x90;
    return follows(1) && follows(2) && follows(3) && shortest && in_range ? 4 : 0;
  }
  return 0;
}

void add_utf8(std::string& to, unsigned c) {
  const auto tail = [&](int shift) { to += static_cast<char>(0x80U | (c >> shift & 0x3fU)); };
  if (c < 0x80) {
    to += static_cast<char>(c);
  } else if (c < 0x800) {
    to += static_cast<char>(0xc0U | c >> 6U), tail(0);
  } else if (c < 0x10000) {
    to += static_cast<char>(0xe0U | c >> 12U), tail(6), tail(0);
  } else {
    to += static_cast<char>(0xf0U | c >> 18U), tail(12), tail(6), tail(0);
  }
}

// "Unicode text" of a spreadsheet, behind its mark.
std::string from_utf16(std::string_view bytes, bool big_endian, const Csv& csv) {
  std::string text;
  std::size_t line = 1;
  const auto unit = [&](std::size_t at) {
    const unsigned a = static_cast<unsigned char>(bytes[at]), b = static_cast<unsigned char>(bytes[at + 1]);
    return big_endian ? a << 8U | b : b << 8U | a;
  };
  for (std::size_t at = 0; at < bytes.size(); at += 2) {
    unsigned c = at + 1 < bytes.size() ? unit(at) : 0xdfff;
    if (c >= 0xd800 && c < 0xe000) {
      const unsigned low = c < 0xdc00 && at + 3 < bytes.size() ? unit(at + 2) : 0;
      if (low < 0xdc00 || low >= 0xe000)
        throw csv.wrong(line, "half a character: the table is UTF-16 and was cut or changed",
                        "save it once more, as 'CSV UTF-8'");
      c = 0x10000 + ((c - 0xd800) << 10U) + (low - 0xdc00);
      at += 2;
    }
    line += c == '\n' ? 1 : 0;
    add_utf8(text, c);
  }
  return text;
}

void check_text(std::string_view text, const Csv& csv) {
  std::size_t line = 1;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = utf8_length(text, at);
    if (length == 0)
      throw csv.wrong(line, "a letter that is not in UTF-8, as of a table in Latin-1 or Windows-1252",
                      "save it as 'CSV UTF-8'");
    if (text[at] == '\0')
      throw csv.wrong(line, "there is a zero byte: no text, or UTF-16 without its mark", "save it as 'CSV UTF-8'");
    line += text[at] == '\n' ? 1 : 0;
    at += length;
  }
}

// Of a line that is not blank, the first.
char separator_of(std::string_view text) {
  while (!text.empty() && (text[0] == '\n' || text[0] == '\r')) text.remove_prefix(1);
  const std::string_view first = text.substr(0, text.find_first_of("\r\n"));
  for (const char c : {',', ';', '\t'}) {
    if (first.find(c) != std::string_view::npos) return c;
  }
  return ',';
}

// With commas, and nothing in lines that hold nothing. A field in quotes stays as it is.
std::string with_commas(std::string_view text, char separator) {
  const char ends[] = {separator, '\n', '\r', '\0'};
  const char blanks[] = {separator, ' ', '\t', '\0'};
  std::string out;
  bool begins = true;  // a line
  for (std::size_t at = 0; at < text.size();) {
    if (begins) {
      const std::size_t word = std::min(text.find_first_not_of(blanks, at), text.size());
      if (word == text.size() || text[word] == '\n' || text[word] == '\r') at = word;
    }
    const std::size_t quoted = at;
    if (at < text.size() && text[at] == '"') {
      for (++at; at < text.size(); ++at) {
        if (text[at] != '"') continue;
        if (at + 1 >= text.size() || text[at + 1] != '"') break;
        ++at;
      }
      at = std::min(at + 1, text.size());
      out += text.substr(quoted, at - quoted);
    }
    const std::size_t end = std::min(text.find_first_of(ends, at), text.size());
    std::string field(text.substr(at, end - at));
    if (separator != ',' && quoted == at && field.find(',') != std::string::npos) {
      field = csv_line({field});
      field.pop_back();
    }
    out += field;
    begins = end < text.size() && text[end] != separator;
    if (end < text.size()) out += begins ? text[end] : ',';
    at = end + 1;
  }
  return out;
}

}  // namespace

std::string plain_table(std::string_view bytes, const std::filesystem::path& file) {
  const Csv csv{file.string(), {}, {}};  // for its errors
  std::string text;
  if (bytes.starts_with("\xff\xfe") || bytes.starts_with("\xfe\xff"))
    text = from_utf16(bytes.substr(2), bytes.starts_with("\xfe\xff"), csv);
  else
    text = bytes.substr(bytes.starts_with("\xef\xbb\xbf") ? 3 : 0);
  check_text(text, csv);
  const std::size_t first = std::min(text.find_first_of("\r\n"), text.size());
  if (first == 5 && lower_case(text.substr(0, 4)) == "sep=") {
    const char separator = text[4];
    text.erase(0, 5);
    return with_commas(text, separator);
  }
  return with_commas(text, separator_of(text));
}

std::vector<BatchCase> read_batch_table(std::string_view text, const std::filesystem::path& file,
                                        std::span<const std::string> known, std::span<const std::string> paths) {
  const Csv csv = read_csv(plain_table(text, file), file.string());
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
    if (i == source || i == code || name.find('.') != std::string::npos ||
        std::find(known.begin(), known.end(), name) != known.end())
      continue;
    const std::string near = nearest_name(name, known);
    throw csv.wrong(1, "column '" + name + "' is no setting of a case",
                    near.empty() ? "'osteo help prepare' shows them" : "did you mean '" + near + "'?");
  }
  const std::filesystem::path folder = file.parent_path();
  std::vector<BatchCase> cases;
  std::map<std::string, std::size_t> lines;  // by code in lower case
  for (const CsvRow& row : csv.rows) {
    if (std::all_of(row.fields.begin(), row.fields.end(), [](const std::string& f) { return f.empty(); })) continue;
    BatchCase c{row.line, row.fields[code], {}, {}};
    if (!is_code(c.code)) throw csv.wrong(row.line, "'" + c.code + "' is no code of a case", kCodeAdvice);
    if (const auto [other, fresh] = lines.try_emplace(lower_case(c.code), row.line); !fresh)
      throw csv.wrong(row.line, "the case '" + c.code + "' is there already, in line " + std::to_string(other->second));
    if (row.fields[source].empty()) throw csv.wrong(row.line, "the case '" + c.code + "' has no source");
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

void check_batch_table(std::span<const BatchCase> cases, const std::filesystem::path& file,
                       const std::function<void(const std::map<std::string, std::string>& settings)>& check) {
  const Csv csv{file.string(), {}, {}};  // for its errors
  std::map<std::map<std::string, std::string>, bool> known;
  std::optional<Error> first;
  std::string others;
  std::size_t wrong = 0;
  for (const BatchCase& row : cases) {
    const auto [at, fresh] = known.try_emplace(row.settings, true);
    if (fresh) {
      try {
        check(row.settings);
      } catch (const Error& e) {
        at->second = false;
        if (!first) first = csv.wrong(row.line, e.what(), e.advice());
      }
    }
    if (at->second) continue;
    if (++wrong > 1 && wrong <= 10) others += (others.empty() ? "" : ", ") + std::to_string(row.line);
  }
  if (!first) return;
  if (wrong == 1) throw *first;
  const std::string more = " (and " + std::to_string(wrong - 1) + " more: line" + (wrong > 2 ? "s " : " ") + others +
                           (wrong > 10 ? ", ..." : "") + ")";
  throw Error(ExitCode::usage, first->what() + more, first->advice());
}

}  // namespace osteo::inline hospital
