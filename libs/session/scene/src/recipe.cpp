#include "osteo/session/scene/recipe.h"

#include <cstdlib>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"

namespace osteo::inline session {
namespace {

// Where notes are kept; empty without a home.
fs::path notes_folder() {
  if (const char* state = std::getenv("XDG_STATE_HOME"); state != nullptr && *state == '/')
    return fs::path(state) / "osteotome";
  if (const char* home = std::getenv("HOME"); home != nullptr && *home == '/')
    return fs::path(home) / ".local/state/osteotome";
  return {};
}

}  // namespace

void remember(const std::string& hash, const std::string& text) {
  const fs::path folder = notes_folder();
  if (folder.empty() || hash.empty() || recall(hash) == text) return;
  try {
    if (!output_exists(folder)) {
      make_output_folder(folder);
      fs::permissions(folder, fs::perms::owner_all);
    }
    write_file(folder / hash, text);
  } catch (const std::exception&) {
    // It is a convenience: without it the scan has to be named again, and prepare says so.
  }
}

std::optional<std::string> recall(const std::string& hash) {
  const fs::path folder = notes_folder();
  if (folder.empty() || hash.empty() || hash.find('/') != std::string::npos) return std::nullopt;
  try {
    return read_text(folder / hash);
  } catch (const Error&) {
    return std::nullopt;
  }
}

std::optional<fs::path> recall_file(const std::string& hash) {
  const auto text = recall(hash);
  try {
    if (text && hash_path(*text) == hash) return *text;
  } catch (const Error&) {
    // Gone, or not to be read any more.
  }
  return std::nullopt;
}

Json recipe_json(const Recipe& r) {
  Json j{{"source_hash", r.source_hash}};
  if (!r.structures_hash.empty()) j["structures_hash"] = r.structures_hash;
  if (!r.pipeline_hash.empty()) j["pipeline_hash"] = r.pipeline_hash;
  if (!r.edits_hash.empty()) j["edits_hash"] = r.edits_hash;
  j["settings"] = Json::object();
  for (const auto& [name, value] : r.settings) {
    if (r.withheld.contains(name)) {
      j["withheld"][name] = hash_text(value);
    } else {
      j["settings"][name] = value;
    }
  }
  return j;
}

std::optional<Recipe> read_recipe(const fs::path& case_folder) {
  const fs::path file = case_folder / "manifest.json";
  if (!output_exists(file)) return std::nullopt;
  try {
    const JsonFile m(read_text(file), file.string(), ExitCode::corrupt);
    const JsonValue* const j = m.root().find("recipe");
    if (j == nullptr) return std::nullopt;
    m.allow(*j, "recipe",
            std::vector<std::string>{"source_hash", "structures_hash", "pipeline_hash", "edits_hash", "settings",
                                     "withheld"});
    const auto text = [&](const char* key) {
      const JsonValue* const value = j->find(key);
      return value == nullptr ? std::string() : m.text(*value, std::string("recipe: \"") + key + "\"");
    };
    const auto each = [&](const JsonValue* object, const auto& take) {
      if (object == nullptr) return;
      for (const auto& [name, value] : object->members) take(name, m.text(value, "recipe: \"" + name + "\""));
    };
    Recipe r;
    r.source_hash = m.text(m.need(*j, "recipe", "source_hash"), "recipe: \"source_hash\"");
    r.structures_hash = text("structures_hash");
    r.pipeline_hash = text("pipeline_hash");
    r.edits_hash = text("edits_hash");
    each(&m.need(*j, "recipe", "settings"),
         [&](const std::string& name, const std::string& value) { r.settings[name] = value; });
    each(j->find("withheld"), [&](const std::string& name, const std::string& hash) {
      if (const auto value = recall(hash)) {
        r.settings[name] = *value;
        r.withheld.insert(name);
      } else {
        r.lost.insert(name);
      }
    });
    return r;
  } catch (const Error& e) {
    throw Error(e.code(), e.what(), "make the case again, with --fresh and all its flags");
  }
}

std::vector<RecipeChange> change_settings(Recipe& r, const std::map<std::string, std::optional<std::string>>& given,
                                          bool other_structures) {
  std::vector<RecipeChange> changes;
  const auto set = [&](const std::string& name, const std::optional<std::string>& to, const std::string& why) {
    const auto it = r.settings.find(name);
    std::optional<std::string> from;
    if (it != r.settings.end()) from = it->second;
    r.lost.erase(name);
    if (from == to) return;
    changes.push_back({name, from, to, why});
    r.withheld.erase(name);
    if (to) {
      r.settings[name] = *to;
    } else {
      r.settings.erase(it);
    }
  };
  const auto differs = [&](const char* name) {
    const auto now = given.find(name);
    if (now == given.end()) return false;
    const auto before = r.settings.find(name);
    return before == r.settings.end() ? now->second.has_value() : now->second != before->second;
  };
  // Decided before anything changes; what is given itself stays.
  std::vector<std::pair<std::string, std::string>> dropped;
  if (differs("region")) {
    for (const char* name : {"centre_mm", "size_mm"}) dropped.emplace_back(name, "it belonged to the region");
  }
  if (other_structures) dropped.emplace_back("names", "they belonged to the other label map");
  const auto preset = given.find("preset");
  if (preset != given.end() && preset->second && *preset->second != "fixed")
    dropped.emplace_back("lower", "the preset finds the threshold");
  if (given.contains("lower") && given.at("lower")) dropped.emplace_back("preset", "it would not use --lower");
  for (const auto& [one, other] : {std::pair{"keep_table", "remove_table"}, std::pair{"remove_table", "keep_table"}}) {
    if (const auto it = given.find(one); it != given.end() && it->second == "true")
      dropped.emplace_back(other, "the other was asked for");
  }
  for (const auto& [name, value] : given) set(name, value, "");
  for (const auto& [name, why] : dropped) {
    const auto it = r.settings.find(name);
    if (!given.contains(name) && it != r.settings.end() && !(name == "preset" && it->second == "fixed"))
      set(name, std::nullopt, why);
  }
  return changes;
}

}  // namespace osteo::inline session
