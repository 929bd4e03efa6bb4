// What a rater's form saved.
#include <cmath>

#include "osteo/core/base/json.h"
#include "study_folder.h"

namespace osteo::inline assessment::study {

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
