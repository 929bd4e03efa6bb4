#include "osteo/assessment/trainee/skill.h"

#include <algorithm>
#include <utility>

#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"

namespace osteo::inline assessment {

TraineeSkill parse_skill(std::string_view text) {
  TraineeSkill skill;
  const std::vector<FieldRef> fields = fields_of<TraineeSkill>(skill);
  bool first = true;
  while (!text.empty()) {
    const std::size_t comma = std::min(text.find(','), text.size());
    std::string_view part = text.substr(0, comma);
    text.remove_prefix(std::min(comma + 1, text.size()));
    part = trimmed(part);
    if (part.empty()) continue;
    const bool begins = std::exchange(first, false);
    if (begins && part == "expert") continue;
    if (begins && part == "novice") {
      skill = {0.3, 0.6, 3, 0.2, 0.3, 15, 0.4, 0.2, 0.2};
      continue;
    }
    const std::size_t equals = part.find('=');
    const std::string_view key = trimmed(part.substr(0, std::min(equals, part.size())));
    const auto field = std::find_if(fields.begin(), fields.end(), [&](const FieldRef& f) { return f.doc.name == key; });
    if (field == fields.end() || equals == std::string_view::npos) {
      std::vector<std::string> names;
      for (const FieldRef& f : fields) names.emplace_back(f.doc.name);
      const std::string near = nearest_name(key, names);
      std::string all;
      for (const std::string& n : names) all += (all.empty() ? "" : ", ") + n;
      throw Error(ExitCode::usage,
                  field == fields.end() ? "a trainee has no skill '" + std::string(key) + "'"
                                        : "skill '" + std::string(key) + "' has no value",
                  near.empty() || field != fields.end() ? "expert or novice, then KEY=VALUE of: " + all
                                                        : "did you mean '" + near + "'?");
    }
    field->from_text(trimmed(part.substr(equals + 1)), "skill " + std::string(key));
  }
  return skill;
}

Json skill_json(const TraineeSkill& skill) {
  TraineeSkill s = skill;
  Json j = Json::object();
  for (const FieldRef& f : fields_of<TraineeSkill>(s)) j[f.doc.name] = *std::get<double*>(f.target);
  return j;
}

}  // namespace osteo::inline assessment
