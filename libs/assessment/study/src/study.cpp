#include "osteo/assessment/study/study.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "osteo/core/base/csv.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"
#include "osteo/core/statistics/basics.h"
#include "outcomes.h"

namespace osteo::inline assessment::study {
namespace {

const std::vector<std::string> kPlanKeys{
    "osteotome_study", "title",  "procedure", "groups", "competent", "cases",   "attempts",
    "items",           "lowest", "highest",   "seed",   "simulated", "primary", "primary_after"};
const std::vector<std::string> kSessionColumns{"blind", "participant", "case", "attempt"};
// What a row is of: all texts. Tables of before have none of them.
const std::vector<std::string> kSourceColumns{"stream", "bone", "procedure", "recorded_by", "scored_by", "marks"};
constexpr std::array<std::string_view, 4> kAcceptable{"cut-short", "other-bone", "procedure", "program"};

bool among(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}
std::string listed(const std::vector<std::string>& names) {
  std::string all;
  for (const std::string& n : names) all += (all.empty() ? "" : ", ") + n;
  return all;
}

std::string* text_of(Source& s, const std::string& column) {
  return column == "stream"        ? &s.stream
         : column == "bone"        ? &s.bone
         : column == "procedure"   ? &s.procedure
         : column == "recorded_by" ? &s.recorded_by
         : column == "scored_by"   ? &s.scored_by
                                   : nullptr;
}
struct Mark {
  const char* word;
  bool Source::*is;
};
constexpr std::array<Mark, 4> kMarks{{{"simulated", &Source::simulated},
                                      {"guided", &Source::guided},
                                      {"cut-short", &Source::cut_short},
                                      {"other-bone", &Source::other_bone}}};
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

// Where a row differs from the others: what it may be called to be accepted, and in words.
std::vector<std::pair<std::string, std::string>> differences(const Study& s, const Session& added) {
  std::vector<std::pair<std::string, std::string>> found;
  const auto differs = [&](const char* as, const std::string& words) {
    if (std::none_of(found.begin(), found.end(), [&](const auto& f) { return f.first == as; }))
      found.emplace_back(as, words);
  };
  const auto base = [](const std::string& procedure) { return procedure.substr(0, procedure.find(' ')); };
  const Source& mine = added.source;
  if (mine.cut_short) differs("cut-short", "it was cut short, or a part of it is lost");
  for (const Session& other : s.sessions) {
    const Source& o = other.source;
    if (!o.known() || !mine.known()) continue;
    const std::string of = other.participant + "'s attempt " + std::to_string(other.attempt) + " of " + other.case_name;
    const bool same_case = other.case_name == added.case_name;
    if (same_case && o.bone != mine.bone && !o.other_bone)
      differs("other-bone", "it was recorded on another bone than " + of);
    if (!same_case && o.bone == mine.bone && !o.other_bone)
      differs("other-bone", "it was recorded on the bone of another case: that of " + of);
    if (base(o.procedure) != base(mine.procedure) || (same_case && o.procedure != mine.procedure))
      differs("procedure", "it was scored by another procedure than " + of);
    if (o.recorded_by != mine.recorded_by)
      differs("program", "it was recorded by version " + mine.recorded_by + ", " + of + " by " + o.recorded_by);
    if (o.scored_by != mine.scored_by)
      differs("program", "it was scored by version " + mine.scored_by + ", " + of + " by " + o.scored_by);
  }
  return found;
}

// Of a session that a study cannot hold at all.
void need_own_work(const Study& s, const Session& added) {
  const Source& mine = added.source;
  const std::string it = mine.known() ? "this session" : "what these numbers are of";
  if (mine.guided)
    throw Error(ExitCode::usage, it + " is a guided session", "a study compares sessions that nobody guided");
  if (mine.simulated && !s.plan.simulated)
    throw Error(ExitCode::usage, it + " was drilled by a program, and this is a study of people",
                "simulated trainees have studies of their own: osteo study demo");
  if (mine.known() && !mine.simulated && s.plan.simulated)
    throw Error(ExitCode::usage, it + " was drilled by a person, and this study is of simulated trainees");
  for (const Session& other : s.sessions) {
    if (mine.known() && other.source.stream == mine.stream)
      throw Error(ExitCode::usage, "this session is in the study already: as " + other.participant + "'s attempt " +
                                       std::to_string(other.attempt) + " of " + other.case_name);
  }
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
    if (find(s, row.fields[0]) != nullptr) throw people.wrong(row.line, "'" + row.fields[0] + "' is there twice");
    if (!among(s.plan.groups, row.fields[1]))
      throw people.wrong(row.line, "'" + row.fields[1] + "' is not one of the groups " + listed(s.plan.groups));
    s.participants.push_back({row.fields[0], row.fields[1]});
  }
  const Csv order = read_table(folder / "order.csv", {"participant", "position", "case"});
  for (const CsvRow& row : order.rows) {
    if (find(s, row.fields[0]) == nullptr)
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
    if (find(s, one.participant) == nullptr) throw wrong("there is no participant '" + one.participant + "'");
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

}  // namespace

void need_code(const std::string& code, const std::string& called) {
  const bool good =
      !code.empty() && code.size() <= 16 && code[0] != '-' && std::all_of(code.begin(), code.end(), [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
      });
  if (!good)
    throw Error(ExitCode::usage, called + " is '" + code + "', not a code of up to 16 characters, digits, '-' and '_'",
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

std::string add_participant(const fs::path& folder, std::string code, const std::string& group) {
  Study s = read_study(folder);
  // A list on paper may not tell p01 from P01.
  const auto there = [&](const std::string& name) {
    const auto same = std::find_if(s.participants.begin(), s.participants.end(),
                                   [&](const Participant& p) { return lower_case(p.code) == lower_case(name); });
    return same == s.participants.end() ? std::string() : same->code;
  };
  for (int i = 1; code.empty(); ++i) {
    const std::string next = (i < 10 ? "P0" : "P") + std::to_string(i);
    if (there(next).empty()) code = next;
  }
  need_code(code, "a participant");
  if (const std::string same = there(code); !same.empty())
    throw Error(ExitCode::usage, "participant '" + same + "' is there already");
  if (!among(s.plan.groups, group))
    throw Error(ExitCode::usage, "'" + group + "' is not one of the groups " + listed(s.plan.groups),
                "give it with --group");
  s.participants.push_back({code, group});
  write_participants(folder, s);
  return code;
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

std::span<const std::string_view> acceptable_differences() {
  return kAcceptable;
}

std::string add_session(const fs::path& folder, const std::string& participant, const std::string& case_name,
                        int attempt, const Measurements& measured, const std::vector<std::string>& accepted,
                        std::vector<std::string>& notes) {
  Study s = read_study(folder);
  if (find(s, participant) == nullptr)
    throw Error(ExitCode::usage, "there is no participant '" + participant + "'", "add the participant first");
  if (!among(s.plan.cases, case_name))
    throw Error(ExitCode::usage, "'" + case_name + "' is not one of the cases " + listed(s.plan.cases));
  if (attempt < 1 || attempt > s.plan.attempts)
    throw Error(ExitCode::usage, "--attempt is from 1 to " + std::to_string(s.plan.attempts));
  for (const std::string& a : accepted) {
    if (std::find(kAcceptable.begin(), kAcceptable.end(), a) == kAcceptable.end())
      throw Error(ExitCode::usage, "'" + a + "' is nothing that can be accepted",
                  listed({kAcceptable.begin(), kAcceptable.end()}));
  }
  std::set<std::string> taken;
  for (const Session& one : s.sessions) {
    taken.insert(one.blind);
    if (one.participant == participant && one.case_name == case_name && one.attempt == attempt)
      throw Error(ExitCode::usage, "this attempt of '" + participant + "' is there already",
                  "'osteo study remove' takes it out");
  }
  Session added{"", participant, case_name, attempt, {}, measured.source};
  need_own_work(s, added);
  std::string asks, names;
  for (const auto& [as, words] : differences(s, added)) {
    if (as == "other-bone") added.source.other_bone = true;
    if (among(accepted, as)) continue;
    asks += (asks.empty() ? "" : "; ") + words;
    names += (names.empty() ? "" : ", ") + as;
  }
  if (!asks.empty())
    throw Error(ExitCode::usage, "this session differs from what the study holds: " + asks,
                "where that is meant to be, --accept '" + names + "' takes it, and the report says so");
  if (!added.source.known())
    notes.push_back(
        "numbers of an unknown session: neither bone, nor procedure, nor whether a person drilled can be "
        "checked; 'osteo study add' takes the session itself, or what 'osteo score' writes");
  for (const auto& [metric, value] : measured.metrics) {
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

Removed remove(const fs::path& folder, const std::string& participant, const std::string& case_name, int attempt) {
  Study s = read_without_ratings(folder);
  if (find(s, participant) == nullptr) throw Error(ExitCode::usage, "there is no participant '" + participant + "'");
  Removed r;
  std::vector<std::string> blinds;
  std::erase_if(s.sessions, [&](const Session& one) {
    if (one.participant != participant) return false;
    if (!case_name.empty() && (one.case_name != case_name || one.attempt != attempt)) return false;
    blinds.push_back(one.blind);
    return true;
  });
  r.sessions = blinds.size();
  if (!case_name.empty() && blinds.empty())
    throw Error(ExitCode::usage,
                "'" + participant + "' has no attempt " + std::to_string(attempt) + " of '" + case_name + "'");
  // Ratings first: a study that was stopped here lacks ratings, and holds none of sessions that are gone.
  const auto there = [&](const std::string& blind) {
    return std::any_of(s.sessions.begin(), s.sessions.end(), [&](const Session& one) { return one.blind == blind; });
  };
  for (const fs::path& file : rating_files(folder)) {
    auto ratings = Json::parse(read_text(file));
    const Json* const rows = ratings ? ratings->find("ratings") : nullptr;
    if (rows == nullptr) throw Error(ExitCode::usage, "'" + file.string() + "' holds no ratings");
    Json kept = Json::list();
    for (const Json& row : rows->items()) {
      const Json* const of = row.find("session");
      if (of != nullptr && of->text() != nullptr && !there(*of->text())) {
        ++r.ratings;
      } else {
        kept.push_back(row);
      }
    }
    if (kept.items().size() == rows->items().size()) continue;
    (*ratings)["ratings"] = std::move(kept);
    write_file(file, ratings->dump(1) + "\n");
  }
  for (const std::string& blind : blinds) r.movies += fs::remove(folder / "movies" / (blind + ".mp4")) ? 1 : 0;
  if (fs::is_directory(folder / "forms")) {
    std::vector<fs::path> forms;
    for (const auto& entry : fs::directory_iterator(folder / "forms"))
      if (entry.path().extension() == ".html") forms.push_back(entry.path());
    std::sort(forms.begin(), forms.end());
    for (const fs::path& form : forms) {
      if (blinds.empty()) break;
      r.forms.push_back(form.stem().string());
      if (s.sessions.empty()) {
        fs::remove(form);
      } else {
        write_file(form, form_html(s, form.stem().string()));
      }
    }
  }
  // A column that nobody has any more would stay as a name.
  std::erase_if(s.metrics, [&](const std::string& m) {
    return std::none_of(s.sessions.begin(), s.sessions.end(), [&](const Session& x) { return x.metrics.contains(m); });
  });
  if (!blinds.empty()) write_sessions(folder, s);
  if (!case_name.empty()) return r;
  std::erase_if(s.order, [&](const OrderRow& o) { return o.participant == participant; });
  if (output_exists(folder / "order.csv")) write_order(folder, s);
  std::erase_if(s.participants, [&](const Participant& p) { return p.code == participant; });
  write_participants(folder, s);
  return r;
}

void set_primary(const fs::path& folder, const std::vector<std::string>& outcomes) {
  Study s = read_study(folder);
  if (outcomes.empty()) throw Error(ExitCode::usage, "no outcome was named");
  std::vector<std::string> known;
  for (const Outcome& o : outcomes_of(s)) known.push_back(o.name);
  for (const std::string& item : s.plan.items) known.push_back("rating: " + item);
  if (s.plan.items.size() > 1) known.push_back("rating: mean of items");
  for (const std::string& o : outcomes) {
    if (s.sessions.empty() || among(known, o)) continue;
    const std::string near = nearest_name(o, known);
    throw Error(ExitCode::usage, "'" + o + "' is no outcome of this study",
                near.empty() ? "sessions.csv has a metric a column; ratings are 'rating: ITEM'"
                             : "did you mean '" + near + "'?");
  }
  s.plan.primary = outcomes;
  s.plan.primary_after = static_cast<int>(s.sessions.size());
  if (const std::string what = wrong_with(s.plan); !what.empty()) throw Error(ExitCode::usage, what);
  write_file(folder / "study.json", plan_json(s.plan).dump(2) + "\n");
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
  if (added > 0) write_order(folder, s);
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
      throw json.wrong(session, "there is no session '" + blind + "' in sessions.csv",
                       "'osteo study remove' takes people and sessions out with their ratings");
    if (!among(study.plan.items, json.text(item, "item")))
      throw json.wrong(item, "'" + item.text + "' is not one of the items " + listed(study.plan.items));
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
