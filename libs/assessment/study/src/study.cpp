#include "osteo/assessment/study/study.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "osteo/core/base/csv.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"
#include "osteo/core/statistics/basics.h"

namespace osteo::inline assessment::study {
namespace {

const std::vector<std::string> kPlanKeys{"osteotome_study", "title", "procedure", "groups",  "competent", "cases",
                                         "attempts",        "items", "lowest",    "highest", "seed",      "simulated"};
const std::vector<std::string> kSessionColumns{"blind", "participant", "case", "attempt"};

bool among(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}
std::string listed(const std::vector<std::string>& names) {
  std::string all;
  for (const std::string& n : names) all += (all.empty() ? "" : ", ") + n;
  return all;
}

Json plan_json(const Plan& p) {
  return Json{{"osteotome_study", 1},     {"title", p.title},         {"procedure", p.procedure},
              {"groups", Json(p.groups)}, {"competent", p.competent}, {"cases", Json(p.cases)},
              {"attempts", p.attempts},   {"items", Json(p.items)},   {"lowest", p.lowest},
              {"highest", p.highest},     {"seed", p.seed},           {"simulated", p.simulated}};
}

// What holds of a plan wherever it comes from; empty when all is well.
std::string wrong_with(const Plan& p) {
  for (const auto& [names, called] :
       {std::pair{&p.groups, "groups"}, std::pair{&p.cases, "cases"}, std::pair{&p.items, "items"}}) {
    if (names->empty()) return std::string(called) + " must name one at least";
    const std::set<std::string> different(names->begin(), names->end());
    if (different.size() != names->size()) return std::string(called) + " name one twice";
    if (different.contains("")) return std::string(called) + " hold an empty name";
  }
  if (!among(p.groups, p.competent))
    return "competent is '" + p.competent + "', which is none of the groups " + listed(p.groups);
  if (p.attempts < 1 || p.attempts > 100) return "attempts is from 1 to 100";
  if (p.lowest >= p.highest || p.highest - p.lowest > 100)
    return "lowest is below highest, and not more than 100 below";
  return {};
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

std::uint64_t seed_of(std::uint64_t seed, const std::string& what) {
  return std::stoull(hash_text(std::to_string(seed) + "\n" + what).substr(0, 16), nullptr, 16);
}

// Letters that are not read as one another, and make no words.
std::string blind_code(std::uint64_t seed) {
  statistics::Random random(seed);
  constexpr std::string_view kLetters = "BCDFGHJKMNPQRTVWXZ";
  std::string code;
  for (int i = 0; i < 5; ++i) code += kLetters[random.below(kLetters.size())];
  return code;
}

const Participant* find(const Study& s, const std::string& code) {
  for (const Participant& p : s.participants) {
    if (p.code == code) return &p;
  }
  return nullptr;
}

void write_sessions(const fs::path& folder, const Study& s) {
  std::vector<std::string> head = kSessionColumns;
  head.insert(head.end(), s.metrics.begin(), s.metrics.end());
  std::string text = csv_line(head);
  for (const Session& one : s.sessions) {
    std::vector<std::string> row{one.blind, one.participant, one.case_name, std::to_string(one.attempt)};
    for (const std::string& m : s.metrics)
      row.push_back(one.metrics.contains(m) ? format_number(one.metrics.at(m)) : "");
    text += csv_line(row);
  }
  write_file(folder / "sessions.csv", text);
}

// Names and values, whatever form they come in.
std::vector<std::pair<std::string, double>> read_metrics(const fs::path& file, std::vector<std::string>& notes) {
  const std::string text = read_text(file), name = file.string();
  std::vector<std::pair<std::string, double>> found;
  const auto skip = [&](std::size_t line, const std::string& metric) {
    notes.push_back("'" + name + "' line " + std::to_string(line) + ": '" + metric + "' is no number and was left out");
  };
  if (file.extension() == ".csv") {
    const Csv csv = read_csv(text, name);
    if (csv.rows.size() != 1)
      throw csv.wrong(1, "there are " + std::to_string(csv.rows.size()) + " rows of values, not one");
    for (std::size_t i = 0; i < csv.columns.size(); ++i) {
      const std::string& field = csv.rows[0].fields[i];
      try {
        found.emplace_back(csv.columns[i], parse_number(field, csv.columns[i]));
      } catch (const Error&) {
        skip(csv.rows[0].line, csv.columns[i]);
      }
    }
  } else {
    const JsonFile json(text, name);
    const JsonValue* root = &json.root();
    if (const JsonValue* inner = root->find("metrics")) root = inner;
    const auto take = [&](const std::string& metric, const JsonValue& v) {
      if (v.kind == JsonValue::Kind::number) {
        found.emplace_back(metric, v.number);
      } else {
        skip(v.line, metric);
      }
    };
    if (root->kind == JsonValue::Kind::list) {
      for (const JsonValue& v : root->items)
        take(json.text(json.need(v, "a metric", "name"), "name"), json.need(v, "a metric", "value"));
    } else if (root->kind == JsonValue::Kind::object) {
      for (const JsonMember& m : root->members) take(m.key, m.value);
    } else {
      throw json.wrong(*root, "there are no metrics: neither an object of numbers nor a list of names and values");
    }
  }
  std::set<std::string> seen;
  for (const auto& [metric, value] : found) {
    if (metric.empty() || among(kSessionColumns, metric))
      throw Error(ExitCode::usage, "'" + name + "': a metric cannot be called '" + metric + "'");
    if (!seen.insert(metric).second)
      throw Error(ExitCode::usage, "'" + name + "': the metric '" + metric + "' is there twice");
  }
  if (found.empty()) throw Error(ExitCode::no_input, "'" + name + "' holds no number");
  return found;
}

}  // namespace

void need_code(const std::string& code, const std::string& called) {
  const bool good = !code.empty() && code.size() <= 16 && std::all_of(code.begin(), code.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
  });
  if (!good)
    throw Error(ExitCode::usage, called + " is '" + code + "', not a code of up to 16 letters, digits, '-' and '_'",
                "use codes, not names");
}

void new_study(const fs::path& folder, const Plan& plan) {
  if (const std::string what = wrong_with(plan); !what.empty())
    throw Error(ExitCode::usage, "the study cannot be made: " + what);
  if (output_exists(folder) && !(fs::is_directory(folder) && fs::is_empty(folder)))
    throw Error(ExitCode::cannot_write, "'" + folder.string() + "' is there already",
                "choose another folder; a study is never replaced");
  make_output_folder(folder);
  write_file(folder / "study.json", plan_json(plan).dump(2) + "\n");
  write_file(folder / "participants.csv", "participant,group\n");
}

Study read_study(const fs::path& folder) {
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
    if (find(s, row.fields[0]) != nullptr) throw people.wrong(row.line, "'" + row.fields[0] + "' is there twice");
    if (!among(s.plan.groups, row.fields[1]))
      throw people.wrong(row.line, "'" + row.fields[1] + "' is none of the groups " + listed(s.plan.groups));
    s.participants.push_back({row.fields[0], row.fields[1]});
  }
  const Csv order = read_table(folder / "order.csv", {"participant", "position", "case"});
  for (const CsvRow& row : order.rows) {
    if (find(s, row.fields[0]) == nullptr)
      throw order.wrong(row.line, "there is no participant '" + row.fields[0] + "'");
    if (!among(s.plan.cases, row.fields[2]))
      throw order.wrong(row.line, "'" + row.fields[2] + "' is none of the cases " + listed(s.plan.cases));
    s.order.push_back({row.fields[0], order.whole(row, 1), row.fields[2]});
  }
  const Csv sessions = read_table(folder / "sessions.csv", kSessionColumns);
  s.metrics.assign(sessions.columns.begin() + 4, sessions.columns.end());
  std::set<std::string> blinds, done;
  for (const CsvRow& row : sessions.rows) {
    Session one{row.fields[0], row.fields[1], row.fields[2], sessions.whole(row, 3), {}};
    const auto wrong = [&](const std::string& what) { return sessions.wrong(row.line, what); };
    if (one.blind.empty() || !blinds.insert(one.blind).second)
      throw wrong("the blind code '" + one.blind + "' is empty or there twice");
    if (find(s, one.participant) == nullptr) throw wrong("there is no participant '" + one.participant + "'");
    if (!among(s.plan.cases, one.case_name))
      throw wrong("'" + one.case_name + "' is none of the cases " + listed(s.plan.cases));
    if (one.attempt < 1 || one.attempt > s.plan.attempts)
      throw wrong("attempt is from 1 to " + std::to_string(s.plan.attempts));
    if (!done.insert(one.participant + "\n" + one.case_name + "\n" + row.fields[3]).second)
      throw wrong("this attempt of '" + one.participant + "' is there twice");
    for (std::size_t c = 4; c < sessions.columns.size(); ++c) {
      const std::string& field = row.fields[c];
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
  std::vector<fs::path> files;
  if (fs::is_directory(folder / "ratings")) {
    for (const auto& entry : fs::directory_iterator(folder / "ratings")) {
      if (entry.path().extension() == ".json") files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
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

std::string add_participant(const fs::path& folder, std::string code, const std::string& group) {
  const Study s = read_study(folder);
  for (int i = 1; code.empty(); ++i) {
    const std::string next = (i < 10 ? "P0" : "P") + std::to_string(i);
    if (find(s, next) == nullptr) code = next;
  }
  need_code(code, "a participant");
  if (find(s, code) != nullptr) throw Error(ExitCode::usage, "participant '" + code + "' is there already");
  if (!among(s.plan.groups, group))
    throw Error(ExitCode::usage, "'" + group + "' is none of the groups " + listed(s.plan.groups),
                "give it with --group");
  std::string text = csv_line({"participant", "group"});
  for (const Participant& p : s.participants) text += csv_line({p.code, p.group});
  write_file(folder / "participants.csv", text + csv_line({code, group}));
  return code;
}

std::string add_session(const fs::path& folder, const std::string& participant, const std::string& case_name,
                        int attempt, const fs::path& file, std::vector<std::string>& notes) {
  Study s = read_study(folder);
  if (find(s, participant) == nullptr)
    throw Error(ExitCode::usage, "there is no participant '" + participant + "'", "add the participant first");
  if (!among(s.plan.cases, case_name))
    throw Error(ExitCode::usage, "'" + case_name + "' is none of the cases " + listed(s.plan.cases));
  if (attempt < 1 || attempt > s.plan.attempts)
    throw Error(ExitCode::usage, "--attempt is from 1 to " + std::to_string(s.plan.attempts));
  std::set<std::string> taken;
  for (const Session& one : s.sessions) {
    taken.insert(one.blind);
    if (one.participant == participant && one.case_name == case_name && one.attempt == attempt)
      throw Error(ExitCode::usage, "this attempt of '" + participant + "' is there already",
                  "take its line out of sessions.csv first");
  }
  Session added{"", participant, case_name, attempt, {}};
  for (const auto& [metric, value] : read_metrics(file, notes)) {
    if (!among(s.metrics, metric)) s.metrics.push_back(metric);
    added.metrics[metric] = value;
  }
  for (int i = 0; added.blind.empty() || taken.contains(added.blind); ++i)
    added.blind = blind_code(seed_of(
        s.plan.seed, participant + "\n" + case_name + "\n" + std::to_string(attempt) + "\n" + std::to_string(i)));
  s.sessions.push_back(added);
  write_sessions(folder, s);
  return added.blind;
}

std::vector<std::vector<int>> williams(int n) {
  std::vector<std::vector<int>> rows;
  for (int turned = 0; turned < (n % 2 == 0 ? 1 : 2); ++turned) {
    for (int r = 0; r < n; ++r) {
      std::vector<int> row;
      for (int c = 0; c < n; ++c) row.push_back((r + (c % 2 == 0 ? c / 2 : n - (c + 1) / 2)) % n);
      if (turned == 1) std::reverse(row.begin(), row.end());
      rows.push_back(std::move(row));
    }
  }
  return rows;
}

std::size_t make_order(const fs::path& folder) {
  Study s = read_study(folder);
  const auto square = williams(static_cast<int>(s.plan.cases.size()));
  std::set<std::string> have;
  for (const OrderRow& row : s.order) have.insert(row.participant);
  std::map<std::string, std::size_t> in_group;
  std::size_t added = 0;
  for (const Participant& p : s.participants) {
    // Dealt block by block: whoever comes later changes nothing for those before.
    const std::size_t place = in_group[p.group]++, block = place / square.size();
    std::vector<std::size_t> rows(square.size());
    for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = i;
    statistics::Random random(seed_of(s.plan.seed, "order\n" + p.group + "\n" + std::to_string(block)));
    random.shuffle(rows);
    if (have.contains(p.code)) continue;
    int position = 1;
    for (const int c : square[rows[place % square.size()]])
      s.order.push_back({p.code, position++, s.plan.cases[static_cast<std::size_t>(c)]});
    ++added;
  }
  std::string text = csv_line({"participant", "position", "case"});
  for (const OrderRow& row : s.order) text += csv_line({row.participant, std::to_string(row.position), row.case_name});
  if (added > 0) write_file(folder / "order.csv", text);
  return added;
}

RaterSheet read_ratings(const std::string& text, const std::string& name, const Study& study,
                        std::vector<std::string>& notes) {
  const JsonFile json(text, name);
  json.require_format("osteotome_ratings");
  json.allow(json.root(), "", std::vector<std::string>{"osteotome_ratings", "study", "rater", "ratings"});
  RaterSheet sheet;
  if (const JsonValue* id = json.root().find("study"); id != nullptr && json.text(*id, "study") != study_id(study.plan))
    throw json.wrong(*id, "these ratings are of another study");
  const JsonValue& rater = json.need(json.root(), "", "rater");
  sheet.rater = json.text(rater, "rater");
  try {
    need_code(sheet.rater, "the rater");
  } catch (const Error& e) {
    throw json.wrong(rater, e.what(), e.advice());
  }
  for (const JsonValue& row : json.list(json.need(json.root(), "", "ratings"), "ratings")) {
    json.allow(row, "a rating", std::vector<std::string>{"session", "item", "value"});
    const JsonValue &session = json.need(row, "a rating", "session"), &item = json.need(row, "a rating", "item"),
                    &value = json.need(row, "a rating", "value");
    const std::string& blind = json.text(session, "session");
    if (std::none_of(study.sessions.begin(), study.sessions.end(), [&](const Session& s) { return s.blind == blind; }))
      throw json.wrong(session, "there is no session '" + blind + "' in sessions.csv");
    if (!among(study.plan.items, json.text(item, "item")))
      throw json.wrong(item, "'" + item.text + "' is none of the items " + listed(study.plan.items));
    std::optional<double> given;
    if (value.kind != JsonValue::Kind::null) {
      given = json.number(value, "value", study.plan.lowest, study.plan.highest);
      if (*given != std::floor(*given)) throw json.wrong(value, "value is not a whole number");
    }
    if (!sheet.sessions[blind].emplace(item.text, given).second)
      throw json.wrong(row, "item '" + item.text + "' of session '" + blind + "' is rated twice");
  }
  std::size_t missing = 0, cannot = 0;
  for (const Session& s : study.sessions) {
    for (const std::string& item : study.plan.items) {
      const auto found = sheet.sessions.find(s.blind);
      if (found == sheet.sessions.end() || !found->second.contains(item)) {
        ++missing;
      } else if (!found->second.at(item)) {
        ++cannot;
      }
    }
  }
  if (missing > 0) notes.push_back(sheet.rater + ": " + std::to_string(missing) + " ratings are missing");
  if (cannot > 0) notes.push_back(sheet.rater + ": " + std::to_string(cannot) + " could not be judged");
  return sheet;
}

}  // namespace osteo::inline assessment::study
