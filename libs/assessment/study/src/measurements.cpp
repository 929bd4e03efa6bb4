// What was measured of one session, as 'osteo score' or others wrote it.
#include <set>

#include "osteo/core/base/csv.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/param.h"
#include "study_folder.h"

namespace osteo::inline assessment::study {
namespace {

struct Mark {
  const char* word;
  bool Source::*is;
};
constexpr std::array<Mark, 4> kMarks{{{"simulated", &Source::simulated},
                                      {"guided", &Source::guided},
                                      {"cut-short", &Source::cut_short},
                                      {"other-bone", &Source::other_bone}}};

Measurements read_csv_row(const std::string& text, const std::string& name, const auto& skip) {
  Measurements found;
  const Csv csv = read_csv(text, name);
  if (csv.rows.size() != 1)
    throw csv.wrong(1, "there are " + std::to_string(csv.rows.size()) + " rows of values, not one");
  for (std::size_t i = 0; i < csv.columns.size(); ++i) {
    const std::string &field = csv.rows[0].fields[i], &column = csv.columns[i];
    // The session's name is the folder's: where it is from is its hash.
    if (field.empty() || column == "session") continue;
    if (column == "marks") {
      if (!read_marks(field, found.source)) throw csv.wrong(csv.rows[0].line, "marks are '" + field + "'");
    } else if (std::string* const of = text_of(found.source, column)) {
      *of = field;
    } else {
      try {
        found.metrics.emplace_back(column, parse_number(field, column));
      } catch (const Error&) {
        skip(csv.rows[0].line, column);
      }
    }
  }
  return found;
}

Measurements read_json(const std::string& text, const std::string& name, const auto& skip) {
  Measurements found;
  const JsonFile json(text, name);
  const JsonValue& root = json.root();
  const auto take = [&](const std::string& metric, const JsonValue& v) {
    if (v.kind == JsonValue::Kind::number) {
      found.metrics.emplace_back(metric, v.number);
    } else if (v.kind != JsonValue::Kind::null) {
      skip(v.line, metric);
    }
  };
  const JsonValue* metrics = root.find("metrics");
  if (metrics == nullptr) metrics = &root;
  if (metrics->kind == JsonValue::Kind::list) {
    for (const JsonValue& v : metrics->items) {
      std::string metric = json.text(json.need(v, "a metric", "name"), "name");
      if (const JsonValue* const of = v.find("of"); of != nullptr && of->kind != JsonValue::Kind::null)
        metric += "[" + json.text(*of, "of") + "]";
      take(metric, json.need(v, "a metric", "value"));
    }
  } else if (metrics->kind == JsonValue::Kind::object) {
    for (const JsonMember& m : metrics->members) take(m.key, m.value);
  } else {
    throw json.wrong(*metrics, "there are no metrics: neither an object of numbers nor a list of names and values");
  }
  if (root.kind != JsonValue::Kind::object || metrics == &root) return found;
  // What else 'osteo score' says: items, and what it is of.
  if (const JsonValue* const items = root.find("items")) {
    for (const JsonValue& v : json.list(*items, "items")) {
      const std::string item = "[" + json.text(json.need(v, "an item", "name"), "name") + "]";
      take("item" + item, json.need(v, "an item", "value"));
      if (const JsonValue& pass = json.need(v, "an item", "pass"); pass.kind == JsonValue::Kind::flag)
        found.metrics.emplace_back("pass" + item, pass.flag ? 1 : 0);
    }
  }
  if (const JsonValue* const source = root.find("source")) {
    for (const JsonMember& m : source->members) {
      if (m.key == "marks") {
        if (!read_marks(json.text(m.value, m.key), found.source))
          throw json.wrong(m.value, "these marks are not known");
      } else if (std::string* const of = text_of(found.source, m.key)) {
        *of = json.text(m.value, m.key);
      }
    }
  }
  found.source.guided = found.source.guided || root.find("guided") != nullptr;
  return found;
}

}  // namespace

std::string* text_of(Source& s, const std::string& column) {
  return column == "stream"        ? &s.stream
         : column == "bone"        ? &s.bone
         : column == "procedure"   ? &s.procedure
         : column == "recorded_by" ? &s.recorded_by
         : column == "scored_by"   ? &s.scored_by
                                   : nullptr;
}

std::string marks_of(const Source& s) {
  std::string words;
  for (const Mark& m : kMarks)
    if (s.*m.is) words += (words.empty() ? "" : " ") + std::string(m.word);
  return words;
}
// False where a word is none of them.
bool read_marks(std::string words, Source& s) {
  for (words += ' '; !words.empty(); words.erase(0, words.find(' ') + 1)) {
    const std::string word = words.substr(0, words.find(' '));
    if (word.empty()) continue;
    const auto* const m = std::find_if(kMarks.begin(), kMarks.end(), [&](const Mark& k) { return word == k.word; });
    if (m == kMarks.end()) return false;
    s.*m->is = true;
  }
  return true;
}

Measurements read_measurements(const std::string& text, const std::string& name, std::vector<std::string>& notes) {
  const auto skip = [&](std::size_t line, const std::string& metric) {
    notes.push_back("'" + name + "' line " + std::to_string(line) + ": '" + metric + "' is no number and was left out");
  };
  Measurements found = name.ends_with(".csv") ? read_csv_row(text, name, skip) : read_json(text, name, skip);
  std::set<std::string> seen;
  for (const auto& [metric, value] : found.metrics) {
    if (metric.empty() || among(kSessionColumns, metric) || among(kSourceColumns, metric))
      throw Error(ExitCode::usage, "'" + name + "': a metric cannot be called '" + metric + "'");
    if (is_formula(metric))
      throw Error(ExitCode::usage,
                  "'" + name + "': a metric is called '" + metric + "', which a spreadsheet takes for a formula");
    if (!seen.insert(metric).second)
      throw Error(ExitCode::usage, "'" + name + "': the metric '" + metric + "' is there twice");
  }
  for (const std::string& column : kSourceColumns) {
    if (const std::string* const of = text_of(found.source, column); of != nullptr && is_formula(*of))
      throw Error(ExitCode::usage, "'" + name + "': " + column + " is '" + *of + "'");
  }
  if (found.metrics.empty()) throw Error(ExitCode::no_input, "'" + name + "' holds no number");
  return found;
}

}  // namespace osteo::inline assessment::study
