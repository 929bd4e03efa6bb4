#include "osteo/hospital/pacs/rules.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/json.h"

namespace osteo::inline hospital {
namespace {

std::vector<std::string> words(const JsonFile& file, const JsonValue& rule, const char* key) {
  std::vector<std::string> all;
  const JsonValue* const list = rule.find(key);
  if (list == nullptr) return all;
  for (const JsonValue& v : file.list(*list, key)) {
    all.push_back(lower_case(file.text(v, key)));
    if (all.back().empty())
      throw file.wrong(v, std::string(key) + ": an empty word is in every description", "take it out");
  }
  return all;
}

SeriesRule read_rule(const JsonFile& file, const JsonValue& v, const fs::path& folder) {
  static const std::vector<std::string> kKeys{"name",          "modality", "any_of",   "none_of", "slice_mm",
                                              "least_objects", "ignore",   "pipeline", "set"};
  file.allow(v, "a rule", kKeys);
  SeriesRule r;
  r.name = file.text(file.need(v, "a rule", "name"), "name");
  if (r.name.empty()) throw file.wrong(v, "a rule needs a name");
  if (const JsonValue* m = v.find("modality")) r.modality = file.text(*m, "modality");
  r.any_of = words(file, v, "any_of");
  r.none_of = words(file, v, "none_of");
  if (const JsonValue* mm = v.find("slice_mm")) {
    const auto& bounds = file.list(*mm, "slice_mm", 2);
    r.least_mm = file.number(bounds[0], "slice_mm", 0, 1000);
    r.most_mm = file.number(bounds[1], "slice_mm", 0, 1000);
    if (r.least_mm > r.most_mm) throw file.wrong(*mm, "slice_mm: the least is above the most", "[least, most] in mm");
  }
  if (const JsonValue* n = v.find("least_objects")) {
    const double least = file.number(*n, "least_objects", 1, 1e6);
    if (least != std::floor(least)) throw file.wrong(*n, "least_objects: a whole number is needed");
    r.least_objects = static_cast<std::size_t>(least);
  }
  if (const JsonValue* i = v.find("ignore")) {
    if (i->kind != JsonValue::Kind::flag || !i->flag)
      throw file.wrong(*i, "ignore: only true is meant", "leave it out otherwise");
    r.ignore = true;
  }
  if (const JsonValue* p = v.find("pipeline")) {
    if (r.ignore) throw file.wrong(*p, "a rule that ignores has no pipeline");
    const std::string& name = file.text(*p, "pipeline");
    if (name.empty()) throw file.wrong(*p, "pipeline: no file is named", "leave it out for the built-in one");
    r.pipeline = (folder / name).lexically_normal();
  }
  if (const JsonValue* set = v.find("set")) {
    if (r.ignore) throw file.wrong(*set, "a rule that ignores sets nothing");
    if (set->kind != JsonValue::Kind::object)
      throw file.wrong(*set, "set: names and values are needed", R"({"lower": "400"})");
    for (const JsonMember& m : set->members) {
      if (!r.set.emplace(m.key, file.text(m.value, m.key)).second) throw file.wrong(m.value, m.key + " is set twice");
    }
  }
  return r;
}

// What does not hold; empty when all does.
std::string misses(const SeriesRule& r, const SeriesFacts& f) {
  if (!r.modality.empty() && r.modality != f.modality) return "another modality than " + r.modality;
  const std::string text = lower_case(f.description);
  const auto has = [&](const std::string& word) { return text.find(word) != std::string::npos; };
  if (!r.any_of.empty() && std::ranges::none_of(r.any_of, has)) return "its description has none of the words";
  if (std::ranges::any_of(r.none_of, has)) return "its description has a word it may not have";
  const bool bounded = r.least_mm > 0 || std::isfinite(r.most_mm);
  if (bounded && !(f.slice_mm > 0)) return "its slice thickness is not said";
  if (bounded && (f.slice_mm < r.least_mm || f.slice_mm > r.most_mm))
    return "slices of " + format_number(f.slice_mm) + " mm, not " + format_number(r.least_mm) + " to " +
           format_number(r.most_mm);
  if (f.objects < r.least_objects) return "fewer than " + std::to_string(r.least_objects) + " objects";
  return {};
}

}  // namespace

std::vector<SeriesRule> read_series_rules(std::string_view text, const fs::path& file) {
  const JsonFile json(text, file.string());
  json.require_format("osteotome_rules");
  json.allow(json.root(), "", std::vector<std::string>{"osteotome_rules", "description", "rules"});
  std::vector<SeriesRule> rules;
  const JsonValue& list = json.need(json.root(), "", "rules");
  for (const JsonValue& v : json.list(list, "rules")) {
    SeriesRule rule = read_rule(json, v, fs::absolute(file).parent_path());
    if (std::ranges::any_of(rules, [&](const SeriesRule& r) { return r.name == rule.name; }))
      throw json.wrong(v, "a second rule named '" + rule.name + "'");
    rules.push_back(std::move(rule));
  }
  if (rules.empty()) throw json.wrong(list, "there is no rule, so nothing would ever be done");
  return rules;
}

RuleChoice choose_rule(const std::vector<SeriesRule>& rules, const SeriesFacts& facts) {
  if (facts.own) return {nullptr, "made by this program"};
  if (!facts.scan) return {nullptr, "no CT or MR images"};
  RuleChoice choice;
  for (const SeriesRule& r : rules) {
    const std::string why = misses(r, facts);
    if (why.empty()) {
      choice.rule = &r;
      return choice;
    }
    choice.why += (choice.why.empty() ? "'" : "; '") + r.name + "': " + why;
  }
  return choice;
}

}  // namespace osteo::inline hospital
