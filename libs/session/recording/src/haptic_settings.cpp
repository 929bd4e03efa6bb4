#include "osteo/session/recording/haptic_settings.h"

#include <cctype>
#include <set>
#include <sstream>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "osteo/core/data/points_io.h"
#include "osteo/simulation/bone/hardness.h"
#include "osteo/simulation/haptics/texture.h"

namespace osteo::inline session {
namespace {

struct CurveFields {
  using Params = CurveConstraintParams;
  static void describe(CurveConstraintParams& p, auto& visit) {
    visit({"curve_stiffness_n_per_mm", "pull towards the curve for a mm of distance", "N/mm", 0, 100},
          p.stiffness_n_per_mm);
    visit({"curve_max_force_n", "the pull grows no further", "N", 0, 100}, p.max_force_n);
    visit({"curve_arc_penalty", "mm of distance that a mm of way along the curve counts as", "", 0, 100},
          p.arc_penalty);
    visit({"curve_engage_mm", "takes hold when nearer than this", "mm", 0, 1e9}, p.engage_mm);
    visit({"curve_release_mm", "lets go when farther than this", "mm", 0, 1e9}, p.release_mm);
  }
};

std::vector<FieldRef> all_fields(HapticSetup& setup) {
  auto fields = fields_of<HapticsParams>(setup.params);
  for (const FieldRef& f : fields_of<CurveFields>(setup.curve_params)) fields.push_back(f);
  return fields;
}

// "cutting, cylinder, diamond, ...": what instruments are called, but for numbers and units.
std::string words_of_instruments() {
  std::set<std::string> words;
  for (const Instrument& i : instrument_library()) {
    std::istringstream in(i.name);
    for (std::string word; in >> word;) {
      if (std::isdigit(static_cast<unsigned char>(word.front())) == 0 && word != "mm" && word != "Fr")
        words.insert(std::move(word));
    }
  }
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

// { "diamond": "proxy", "cutting taper": "volume", "suction": "overlap" }: an instrument is meant when its name holds
// all of the words.
void set_tool_methods(const JsonValue& tools, const JsonFile& file, HapticSetup& setup) {
  if (tools.kind != JsonValue::Kind::object) throw file.wrong(tools, "\"tools\" must be an object in braces");
  for (const auto& [words, method_name] : tools.members) {
    ContactMethod method{};
    detail::FieldCollector collect;
    collect({words, "method of contact"}, method);
    file.read(method_name, "tools", collect.fields.front());
    bool any = false;
    for (std::size_t t = 0; t < instrument_library().size(); ++t) {
      const Instrument& i = instrument_library()[t];
      // Balls do not say so in their name.
      const bool ball = i.as_burr() != nullptr && i.as_burr()->shape == BurrShape::ball;
      const std::string name = " " + i.name + (ball ? " ball " : " ");
      std::istringstream in(words);
      bool all = true;
      for (std::string word; in >> word;) {
        if (word == "sucker") word = "suction";  // as files of 0.1 have it
        all = all && name.find(" " + word + " ") != std::string::npos;
      }
      if (!all) continue;
      setup.tool_methods[static_cast<int>(t)] = method;
      any = true;
    }
    if (!any)
      throw file.wrong(
          method_name, "tools: no instrument is a \"" + words + "\"",
          "words are ball, a diameter like 4 mm, and those of the instruments' names: " + words_of_instruments());
  }
}

}  // namespace

void load_haptic_settings(const fs::path& path, HapticSetup& setup) {
  require_readable(path);
  const JsonFile file(read_text(path), path.string());
  int version = 0;
  std::string curve_file, vibration_file, hardness_file, texture_file;
  double texture_mass_kg = kTextureMassKg;
  auto fields = all_fields(setup);
  detail::FieldCollector others;
  others({"osteotome_haptics", "version of the format", "", 1, 1, true}, version);
  others({"hardness_file", "constants of the law of hardness, beside this file"}, hardness_file);
  others({"curve_file", "points of a curve, beside this file"}, curve_file);
  others({"vibration_file", "measured vibration, beside this file"}, vibration_file);
  others({"texture_file", "what tools feel that slide over bone, beside this file"}, texture_file);
  others({"texture_mass_kg", "of hand and tool, by which a recorded acceleration is a force", "kg", 0.001, 10},
         texture_mass_kg);
  fields.insert(fields.end(), others.fields.begin(), others.fields.end());
  const std::vector<std::string> besides{"tools", "hardness"};
  file.read(file.root(), "", fields, besides);
  if (const JsonValue* const tools = file.root().find("tools")) set_tool_methods(*tools, file, setup);
  if (const JsonValue* const hardness = file.root().find("hardness")) {
    if (hardness->kind == JsonValue::Kind::flag) {
      setup.hardness = hardness->flag;
    } else if (hardness->kind == JsonValue::Kind::text && hardness->text == "auto") {
      setup.hardness.reset();
    } else {
      throw file.wrong(*hardness, "\"hardness\" must be true, false or \"auto\"");
    }
  }
  if (!hardness_file.empty()) {
    const fs::path beside = path.parent_path() / hardness_file;
    setup.hardness_json = read_text(beside);
    static_cast<void>(parse_hardness(setup.hardness_json, beside.string()));
  }
  if (!curve_file.empty()) {
    setup.curve = load_points(path.parent_path() / curve_file);
    if (setup.curve.size() < 2) throw file.wrong(*file.root().find("curve_file"), "the curve has fewer than 2 points");
  }
  if (!vibration_file.empty()) {
    const fs::path beside = path.parent_path() / vibration_file;
    setup.vibration_json = read_text(beside);
    static_cast<void>(parse_vibration(setup.vibration_json, beside.string()));
  }
  if (!texture_file.empty()) {
    const fs::path beside = path.parent_path() / texture_file;
    // As the session will hold it: what is felt now and in a replay is read from the same text.
    setup.texture_json = texture_json(load_texture(beside, texture_mass_kg), "a texture file of the case");
    static_cast<void>(parse_texture(setup.texture_json, beside.string()));
  }
}

std::string haptic_settings_json(const HapticSetup& setup) {
  HapticSetup copy = setup;
  std::string text = "{\n  \"osteotome_haptics\": 1,\n";
  const auto fields = all_fields(copy);
  for (const FieldRef& f : fields) {
    const bool quoted = f.kind() == "choice" || f.kind() == "text";
    text += "  \"" + std::string(f.doc.name) + "\": " + (quoted ? "\"" + f.to_text() + "\"" : f.to_text()) + ",  // " +
            std::string(f.doc.help);
    if (!f.doc.unit.empty()) text += ", " + std::string(f.doc.unit);
    text += "\n";
  }
  text += std::string("  \"hardness\": ") +
          (!setup.hardness   ? "\"auto\""
           : *setup.hardness ? "true"
                             : "false") +
          "  // dense bone resists the burr more, by the HU of the case; auto: where it keeps them; false: all bone "
          "alike\n}\n";
  return text;
}

}  // namespace osteo::inline session
