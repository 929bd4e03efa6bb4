#include "osteo/app/window/person_settings.h"

#include <algorithm>
#include <cstdlib>

#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"
#include "osteo/core/base/translate.h"
#include "osteo/simulation/bone/posture.h"

namespace osteo::inline app {
namespace {

// What settings of 0.1 call things that a button does.
constexpr std::array<OldName, 4> kOldFunctions{
    {{"bring", "approach"}, {"lift", "retract"}, {"suck", "suction"}, {"water", "irrigation"}}};
constexpr std::string_view kFormat = "osteotome_settings", kCases = "recent_cases", kButtons = "buttons",
                           kNothing = "nothing";

Json value_of(const FieldRef& f) {
  if (auto* const flag = std::get_if<bool*>(&f.target)) return Json(**flag);
  if (auto* const number = std::get_if<double*>(&f.target)) return Json(**number);
  return Json(**std::get_if<std::string*>(&f.target));
}

}  // namespace

std::filesystem::path PersonSettings::usual_file() {
  const auto from = [](const char* name) {
    const char* const value = std::getenv(name);
    return std::filesystem::path(value != nullptr ? value : "");
  };
  // The base directory specification: a path that is not absolute is to be ignored.
  std::filesystem::path config = from("XDG_CONFIG_HOME");
  if (!config.is_absolute()) config = from("HOME").is_absolute() ? from("HOME") / ".config" : std::filesystem::path();
  return config.empty() ? config : config / "osteotome" / "settings.json";
}

PersonSettings::PersonSettings(std::filesystem::path file) : file_(std::move(file)) {
  std::error_code ignored;
  if (file_.empty() || !std::filesystem::exists(file_, ignored)) return;
  try {
    was_ = read_text(file_);
    const JsonFile json(was_, file_.string());
    json.require_format(kFormat);
    const std::vector<FieldRef> fields = fields_of<PersonValues>(values);
    for (const JsonMember& m : json.root().members) {
      if (m.key == kFormat) continue;
      try {
        if (m.key == kCases) {
          for (const JsonValue& c : json.list(m.value, m.key)) cases_.emplace_back(json.text(c, "a recent case"));
          continue;
        }
        if (m.key == kButtons) {
          read_buttons(json, m.value);
          continue;
        }
        const auto at =
            std::find_if(fields.begin(), fields.end(), [&](const FieldRef& f) { return f.doc.name == m.key; });
        if (at == fields.end()) throw json.wrong(m.value, "'" + m.key + "' is no setting", "it is left as it is");
        json.read(m.value, {}, *at);
        if (m.key == "layout" && values.layout == "beside") values.layout = "operate";  // its earlier name
        if (m.key == "layout" && values.layout != "operate" && values.layout != "plan") {
          values.layout = PersonValues{}.layout;
          throw json.wrong(m.value, "'layout' is operate or plan");
        }
        if (m.key == "theme" && values.theme != "dark" && values.theme != "light" && values.theme != "high_contrast") {
          values.theme = PersonValues{}.theme;
          throw json.wrong(m.value, "'theme' is dark, light or high_contrast");
        }
        constexpr auto kLanguages = enum_names(Language{});
        if (m.key == "language" && values.language != "auto" &&
            std::find(kLanguages.begin(), kLanguages.end(), values.language) == kLanguages.end()) {
          values.language = PersonValues{}.language;
          throw json.wrong(m.value, "'language' is auto, en, de, es, fr or zh_CN");
        }
        constexpr auto kPositions = enum_names(Posture{});
        if (std::find(kPositions.begin(), kPositions.end(), values.position) == kPositions.end()) {
          values.position = PersonValues{}.position;
          throw json.wrong(m.value, "'position' is supine, prone, sitting, left_side or right_side");
        }
        if (const double n = values.motion_one_to; n != 1 && n != 2 && n != 4 && n != 8) {
          values.motion_one_to = PersonValues{}.motion_one_to;
          throw json.wrong(m.value, "'motion_one_to' is 1, 2, 4 or 8");
        }
      } catch (const Error& e) {
        complaints_.emplace_back(e.what());
      }
    }
    // A comment, say, would be lost.
    if (!Json::parse(was_)) {
      leave_alone_ = true;
      complaints_.push_back("'" + file_.string() +
                            "' has comments, so what you change in the window is not kept in it");
    }
  } catch (const Error& e) {
    complaints_.push_back(std::string(e.what()) + "; the usual settings are taken, and the file is left as it is");
    leave_alone_ = true;
    values = {};
    buttons = HandButtons::usual();
    cases_.clear();
  }
  if (!values.remember_cases) cases_.clear();
  if (cases_.size() > kMaxCases) cases_.resize(kMaxCases);
  read_ = values;
  read_buttons_ = buttons;
  read_cases_ = cases_;
}

// Each of them for itself: one that is wrong does not take the others along.
void PersonSettings::read_buttons(const JsonFile& json, const JsonValue& value) {
  if (value.kind != JsonValue::Kind::object)
    throw json.wrong(value, "'buttons' is an object such as {\"pedal 1\": \"drill\"}", "it is left as it is");
  for (const JsonMember& m : value.members) {
    try {
      const std::optional<int> which = button_named(m.key);
      if (!which)
        throw json.wrong(m.value, "there is no button '" + m.key + "'",
                         "such as 'pedal 1', 'device 2', 'mouse 4', 'key F13'");
      std::string does = json.text(m.value, "what '" + m.key + "' does");
      const auto* const old = std::find_if(kOldFunctions.begin(), kOldFunctions.end(),
                                           [&](const OldName& name) { return name.old == does; });
      if (old != kOldFunctions.end()) does = old->current;
      const auto& all = EnumNames<HandFunction>::values;
      const auto* const at = std::find(all.begin(), all.end(), does);
      if (does == kNothing) {
        buttons.clear(*which);
      } else if (at == all.end()) {
        throw json.wrong(m.value, "'" + m.key + "' cannot do '" + does + "'", "it keeps what it usually does");
      } else {
        buttons.assign(*which, static_cast<HandFunction>(at - all.begin()));
      }
    } catch (const Error& e) {
      complaints_.emplace_back(e.what());
    }
  }
}

void PersonSettings::opened(const std::filesystem::path& the_case) {
  if (!values.remember_cases) return;
  std::error_code failed;
  std::filesystem::path path = std::filesystem::canonical(the_case, failed);
  if (failed) path = std::filesystem::absolute(the_case);
  std::erase(cases_, path);
  cases_.insert(cases_.begin(), path);
  if (cases_.size() > kMaxCases) cases_.resize(kMaxCases);
}

std::string PersonSettings::text() const {
  Json j = Json::parse(was_).value_or(Json::object());
  if (j.members().empty()) j = Json{{kFormat, 1}};
  PersonValues copy = values;
  for (const FieldRef& f : fields_of<PersonValues>(copy)) j[f.doc.name] = value_of(f);
  Json list = Json::list();
  if (values.remember_cases) {
    for (const auto& c : cases_) list.push_back(c.string());
  }
  j[kCases] = list;
  // Only what is not as usual; what is not known stays.
  const HandButtons usual = HandButtons::usual();
  if (buttons != usual || j.find(kButtons) != nullptr) {
    Json given =
        j.find(kButtons) != nullptr && !j.find(kButtons)->members().empty() ? *j.find(kButtons) : Json::object();
    std::vector<std::string> known;
    for (const Json::Member& m : given.members()) {
      const std::string does = m.value.text() != nullptr ? *m.value.text() : std::string();
      const auto& all = EnumNames<HandFunction>::values;
      const bool can = does == kNothing || std::find(all.begin(), all.end(), does) != all.end();
      if (button_named(m.key) && can) known.push_back(m.key);
    }
    for (const std::string& name : known) given.erase(name);
    for (const auto& [b, function] : buttons.all()) {
      if (usual.function(b) != function)
        given[button_name(b)] = EnumNames<HandFunction>::values[static_cast<std::size_t>(function)];
    }
    for (const auto& [b, function] : usual.all()) {
      if (!buttons.function(b)) given[button_name(b)] = kNothing;
    }
    j[kButtons] = given;
    if (given.members().empty()) j.erase(kButtons);
  }
  return j.dump(2) + "\n";
}

std::string PersonSettings::save() {
  if (!values.remember_cases) cases_.clear();
  if (values == read_ && buttons == read_buttons_ && cases_ == read_cases_) return {};
  if (file_.empty()) return "settings are not kept: neither XDG_CONFIG_HOME nor HOME is set";
  if (leave_alone_) return "settings are not kept: " + complaints_.back();
  try {
    make_output_folder(file_.parent_path());
    const std::string now = text();
    write_file(file_, now);
    was_ = now;
    read_ = values;
    read_buttons_ = buttons;
    read_cases_ = cases_;
    return {};
  } catch (const Error& e) {
    return std::string("settings are not kept: ") + e.what();
  }
}

}  // namespace osteo::inline app
