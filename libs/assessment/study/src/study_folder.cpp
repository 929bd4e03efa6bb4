#include "study_folder.h"

#include <cmath>
#include <set>

#include "osteo/core/base/csv.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"

namespace osteo::inline assessment::study {
namespace {

const std::vector<std::string> kPlanKeys{
    "osteotome_study", "title",  "procedure", "groups", "competent", "cases",   "attempts",
    "items",           "lowest", "highest",   "seed",   "simulated", "primary", "primary_after"};

Json plan_json(const Plan& p) {
  Json j{{"osteotome_study", 1},     {"title", p.title},       {"procedure", p.procedure}, {"groups", Json(p.groups)},
         {"competent", p.competent}, {"cases", Json(p.cases)}, {"attempts", p.attempts},   {"items", Json(p.items)},
         {"lowest", p.lowest},       {"highest", p.highest},   {"seed", p.seed},           {"simulated", p.simulated}};
  if (!p.primary.empty()) {
    j["primary"] = Json(p.primary);
    j["primary_after"] = p.primary_after;
  }
  return j;
}

Plan read_plan(const fs::path& file) {
  const JsonFile json(read_text(file), file.string());
  json.require_format("osteotome_study");
  const JsonValue& root = json.root();
  json.allow(root, "", kPlanKeys);
  Plan p;
  const auto names = [&](const char* key, std::vector<std::string>& to, bool needed) {
    const JsonValue* value = needed ? &json.need(root, "", key) : root.find(key);
    if (value == nullptr) return;
    to.clear();
    for (const JsonValue& v : json.list(*value, key)) to.push_back(json.text(v, key));
  };
  const auto whole = [&](const char* key, double otherwise) {
    const JsonValue* value = root.find(key);
    if (value == nullptr) return otherwise;
    const double v = json.number(*value, key, -1e15, 1e15);
    if (v != std::floor(v)) throw json.wrong(*value, std::string(key) + " is not a whole number");
    return v;
  };
  if (const JsonValue* v = root.find("title")) p.title = json.text(*v, "title");
  if (const JsonValue* v = root.find("procedure")) p.procedure = json.text(*v, "procedure");
  names("groups", p.groups, true);
  names("cases", p.cases, true);
  names("items", p.items, false);
  names("primary", p.primary, false);
  p.primary_after = static_cast<int>(std::clamp(whole("primary_after", 0), 0.0, 1e6));
  p.competent = root.find("competent") != nullptr ? json.text(*root.find("competent"), "competent")
                : p.groups.empty()                ? ""
                                                  : p.groups.back();
  p.attempts = static_cast<int>(std::clamp(whole("attempts", 1), -1.0, 1000.0));
  p.lowest = static_cast<int>(std::clamp(whole("lowest", 1), -1e6, 1e6));
  p.highest = static_cast<int>(std::clamp(whole("highest", 5), -1e6, 1e6));
  p.seed = static_cast<std::uint64_t>(std::max(0.0, whole("seed", 1)));
  if (const JsonValue* v = root.find("simulated")) json.read(*v, "", FieldRef{{"simulated", ""}, &p.simulated});
  if (const std::string what = wrong_with(p); !what.empty()) throw json.wrong(root, what);
  return p;
}

Csv read_table(const fs::path& file, const std::vector<std::string>& columns) {
  Csv csv{file.string(), columns, {}};
  if (!output_exists(file)) return csv;
  csv = read_csv(read_text(file), file.string());
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (i >= csv.columns.size() || csv.columns[i] != columns[i])
      throw csv.wrong(1, "the first columns are not " + listed(columns));
  }
  return csv;
}

}  // namespace

std::string listed(const std::vector<std::string>& names) {
  std::string all;
  for (const std::string& n : names) all += (all.empty() ? "" : ", ") + n;
  return all;
}

const Participant* find_participant(const Study& s, const std::string& code) {
  for (const Participant& p : s.participants) {
    if (p.code == code) return &p;
  }
  return nullptr;
}

// What holds of a plan wherever it comes from; empty when all is well.
std::string wrong_with(const Plan& p) {
  for (const auto& [names, called] :
       {std::pair{&p.groups, "groups"}, std::pair{&p.cases, "cases"}, std::pair{&p.items, "items"}}) {
    if (names->empty()) return std::string(called) + " must name one at least";
    const std::set<std::string> different(names->begin(), names->end());
    if (different.size() != names->size()) return std::string(called) + " name one twice";
    if (different.contains("")) return std::string(called) + " hold an empty name";
    for (const std::string& n : *names)
      if (is_formula(n)) return std::string(called) + " hold '" + n + "', which a spreadsheet takes for a formula";
  }
  if (std::set<std::string>(p.primary.begin(), p.primary.end()).size() != p.primary.size())
    return "primary names one twice";
  if (!among(p.groups, p.competent))
    return "competent is '" + p.competent + "', which is not one of the groups " + listed(p.groups);
  if (p.attempts < 1 || p.attempts > 100) return "attempts is from 1 to 100";
  if (p.lowest >= p.highest || p.highest - p.lowest > 100)
    return "lowest is below highest, and not more than 100 below";
  return {};
}

void write_plan(const fs::path& folder, const Plan& plan) {
  write_file(folder / "study.json", plan_json(plan).dump(2) + "\n");
}

void write_sessions(const fs::path& folder, const Study& s) {
  std::vector<std::string> head = kSessionColumns;
  head.insert(head.end(), kSourceColumns.begin(), kSourceColumns.end());
  head.insert(head.end(), s.metrics.begin(), s.metrics.end());
  std::string text = csv_line(head);
  for (const Session& one : s.sessions) {
    std::vector<std::string> row{one.blind, one.participant, one.case_name, std::to_string(one.attempt)};
    Source source = one.source;
    for (const std::string& column : kSourceColumns)
      row.push_back(column == "marks" ? marks_of(source) : *text_of(source, column));
    for (const std::string& m : s.metrics)
      row.push_back(one.metrics.contains(m) ? format_number(one.metrics.at(m)) : "");
    text += csv_line(row);
  }
  write_file(folder / "sessions.csv", text);
}

Study read_without_ratings(const fs::path& folder) {
  if (!output_exists(folder / "study.json"))
    throw Error(ExitCode::no_input, "'" + folder.string() + "' is no study: it has no study.json",
                "make one with: osteo study new " + folder.string());
  Study s;
  s.plan = read_plan(folder / "study.json");
  const Csv people = read_table(folder / "participants.csv", {"participant", "group"});
  for (const CsvRow& row : people.rows) {
    try {
      need_code(row.fields[0], "a participant");
    } catch (const Error& e) {
      throw people.wrong(row.line, e.what(), e.advice());
    }
    if (find_participant(s, row.fields[0]) != nullptr)
      throw people.wrong(row.line, "'" + row.fields[0] + "' is there twice");
    if (!among(s.plan.groups, row.fields[1]))
      throw people.wrong(row.line, "'" + row.fields[1] + "' is not one of the groups " + listed(s.plan.groups));
    s.participants.push_back({row.fields[0], row.fields[1]});
  }
  const Csv order = read_table(folder / "order.csv", {"participant", "position", "case"});
  for (const CsvRow& row : order.rows) {
    if (find_participant(s, row.fields[0]) == nullptr)
      throw order.wrong(row.line, "there is no participant '" + row.fields[0] + "'");
    if (!among(s.plan.cases, row.fields[2]))
      throw order.wrong(row.line, "'" + row.fields[2] + "' is not one of the cases " + listed(s.plan.cases));
    s.order.push_back({row.fields[0], order.whole(row, 1), row.fields[2]});
  }
  const Csv sessions = read_table(folder / "sessions.csv", kSessionColumns);
  for (std::size_t c = 4; c < sessions.columns.size(); ++c) {
    const std::string& column = sessions.columns[c];
    if (is_formula(column))
      throw sessions.wrong(1, "a metric is called '" + column + "', which a spreadsheet takes for a formula");
    if (!among(kSourceColumns, column)) s.metrics.push_back(column);
  }
  std::set<std::string> blinds, done;
  for (const CsvRow& row : sessions.rows) {
    Session one{row.fields[0], row.fields[1], row.fields[2], sessions.whole(row, 3), {}, {}};
    const auto wrong = [&](const std::string& what) { return sessions.wrong(row.line, what); };
    if (one.blind.empty() || !blinds.insert(one.blind).second)
      throw wrong("the blind code '" + one.blind + "' is empty or there twice");
    if (find_participant(s, one.participant) == nullptr)
      throw wrong("there is no participant '" + one.participant + "'");
    if (!among(s.plan.cases, one.case_name))
      throw wrong("'" + one.case_name + "' is not one of the cases " + listed(s.plan.cases));
    if (one.attempt < 1 || one.attempt > s.plan.attempts)
      throw wrong("attempt is from 1 to " + std::to_string(s.plan.attempts));
    if (!done.insert(one.participant + "\n" + one.case_name + "\n" + row.fields[3]).second)
      throw wrong("this attempt of '" + one.participant + "' is there twice");
    for (std::size_t c = 4; c < sessions.columns.size(); ++c) {
      const std::string& field = row.fields[c];
      if (std::string* const of = text_of(one.source, sessions.columns[c])) {
        *of = field;
        continue;
      }
      if (sessions.columns[c] == "marks") {
        if (!read_marks(field, one.source)) throw wrong("marks are '" + field + "'");
        continue;
      }
      // As other programs write a missing value.
      if (field.empty() || lower_case(field) == "nan" || field == "NA") continue;
      try {
        one.metrics[sessions.columns[c]] = parse_number(field, sessions.columns[c]);
      } catch (const Error&) {
        throw wrong(sessions.columns[c] + " is '" + field + "', not a number; leave it empty where there is none");
      }
    }
    s.sessions.push_back(std::move(one));
  }
  return s;
}

std::vector<fs::path> rating_files(const fs::path& folder) {
  std::vector<fs::path> files;
  if (fs::is_directory(folder / "ratings")) {
    for (const auto& entry : fs::directory_iterator(folder / "ratings")) {
      if (entry.path().extension() == ".json") files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

void write_participants(const fs::path& folder, const Study& s) {
  std::string text = csv_line({"participant", "group"});
  for (const Participant& p : s.participants) text += csv_line({p.code, p.group});
  write_file(folder / "participants.csv", text);
}

void write_order(const fs::path& folder, const Study& s) {
  std::string text = csv_line({"participant", "position", "case"});
  for (const OrderRow& row : s.order) text += csv_line({row.participant, std::to_string(row.position), row.case_name});
  write_file(folder / "order.csv", text);
}

void need_code(const std::string& code, const std::string& called) {
  const bool good =
      !code.empty() && code.size() <= 16 && code[0] != '-' && std::all_of(code.begin(), code.end(), [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
      });
  if (!good)
    throw Error(ExitCode::usage, called + " is '" + code + "', not a code of up to 16 characters, digits, '-' and '_'",
                "use codes, not names");
}

Study read_study(const fs::path& folder) {
  Study s = read_without_ratings(folder);
  for (const fs::path& file : rating_files(folder)) {
    std::vector<std::string> notes;
    s.raters.push_back(read_ratings(read_text(file), file.string(), s, notes));
    for (std::size_t i = 0; i + 1 < s.raters.size(); ++i) {
      if (s.raters[i].rater == s.raters.back().rater)
        throw Error(ExitCode::usage,
                    "'" + file.string() + "': rater '" + s.raters[i].rater + "' has another file already");
    }
  }
  return s;
}

}  // namespace osteo::inline assessment::study
