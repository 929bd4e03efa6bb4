#include "osteo/session/haptic_settings.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/io/points_io.h"

namespace osteo {
namespace {

using nlohmann::ordered_json;

struct CurveFields {
  using Params = CurveConstraintParams;
  static void describe(CurveConstraintParams& p, auto& visit) {
    visit({"curve_stiffness_n_per_mm", "pull towards the curve for a mm of distance", "N/mm", 0, 100}, p.stiffness_n_per_mm);
    visit({"curve_max_force_n", "the pull grows no further", "N", 0, 100}, p.max_force_n);
    visit({"curve_arc_penalty", "mm of distance that a mm of way along the curve counts as", "", 0, 100}, p.arc_penalty);
    visit({"curve_engage_mm", "takes hold when nearer than this", "mm", 0, 1e9}, p.engage_mm);
    visit({"curve_release_mm", "lets go when farther than this", "mm", 0, 1e9}, p.release_mm);
  }
};

std::vector<FieldRef> all_fields(HapticSetup& setup) {
  auto fields = fields_of<HapticsParams>(setup.params);
  for (const FieldRef& f : fields_of<CurveFields>(setup.curve_params)) fields.push_back(f);
  return fields;
}

std::string text_of(const ordered_json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

// { "diamond": "proxy", "cutting taper": "volume" }: a burr is meant when its name holds all of the words.
void set_tool_methods(const ordered_json& tools, const std::string& name, HapticSetup& setup) {
  for (const auto& [words, method_name] : tools.items()) {
    ContactMethod method{};
    detail::FieldCollector collect;
    collect({"tools", "method of contact"}, method);
    try {
      collect.fields.front().from_text(method_name.get<std::string>());
    } catch (const Error& e) {
      throw e.in(name + ": tools: " + words);
    }
    bool any = false;
    for (std::size_t t = 0; t < burr_library().size(); ++t) {
      const Burr& b = burr_library()[t];
      // Balls do not say so in their name.
      const std::string burr = " " + b.name() + (b.shape == BurrShape::ball ? " ball " : " ");
      std::istringstream in(words);
      bool all = true;
      for (std::string word; in >> word;) all = all && burr.find(" " + word + " ") != std::string::npos;
      if (!all) continue;
      setup.tool_methods[static_cast<int>(t)] = method;
      any = true;
    }
    if (!any)
      throw Error(ExitCode::usage, name + ": tools: no burr is a \"" + words + "\"",
                  "words are cutting, diamond, ball, cylinder, taper, 1 mm to 7 mm");
  }
}

}  // namespace

void load_haptic_settings(const fs::path& path, HapticSetup& setup) {
  require_readable(path);
  const std::string name = "'" + path.string() + "'";
  try {
    const auto j = ordered_json::parse(read_text(path), nullptr, true, true);
    if (j.at("osteotome_haptics") != 1) throw Error(ExitCode::usage, name + ": \"osteotome_haptics\" must be 1");
    const auto fields = all_fields(setup);
    for (const auto& [key, value] : j.items()) {
      if (key == "osteotome_haptics") continue;
      const auto beside = [&] { return path.parent_path() / value.get<std::string>(); };
      if (key == "tools") {
        set_tool_methods(value, name, setup);
      } else if (key == "hardness") {
        if (value == "auto") {
          setup.hardness.reset();
        } else if (value.is_boolean()) {
          setup.hardness = value.get<bool>();
        } else {
          throw Error(ExitCode::usage, name + ": \"hardness\" must be true, false or \"auto\"");
        }
      } else if (key == "hardness_file") {
        setup.hardness_json = read_text(beside());
        static_cast<void>(parse_hardness(setup.hardness_json, "'" + beside().string() + "'"));
      } else if (key == "curve_file") {
        setup.curve = load_points(beside());
        if (setup.curve.size() < 2) throw Error(ExitCode::usage, name + ": the curve has fewer than 2 points");
      } else if (key == "vibration_file") {
        setup.vibration_json = read_text(beside());
        static_cast<void>(parse_vibration(setup.vibration_json, "'" + beside().string() + "'"));
      } else {
        const auto f = std::find_if(fields.begin(), fields.end(), [&](const FieldRef& r) { return r.doc.name == key; });
        if (f == fields.end()) {
          std::vector<std::string> known{"tools", "hardness", "hardness_file", "curve_file", "vibration_file"};
          for (const FieldRef& r : fields) known.emplace_back(r.doc.name);
          const std::string near = nearest_name(key, known);
          throw Error(ExitCode::usage, name + " has no setting \"" + key + "\"" + (near.empty() ? "" : ": did you mean \"" + near + "\"?"),
                      "osteo rehearse CASE --show-settings lists them");
        }
        try {
          f->from_text(text_of(value));
        } catch (const Error& e) {
          throw e.in(name);
        }
      }
    }
  } catch (const nlohmann::json::exception& e) {
    throw Error(ExitCode::usage, name + ": " + e.what(), "osteo rehearse CASE --show-settings prints a file to start from");
  }
}

std::string haptic_settings_json(const HapticSetup& setup) {
  HapticSetup copy = setup;
  std::string text = "{\n  \"osteotome_haptics\": 1,\n";
  const auto fields = all_fields(copy);
  for (const FieldRef& f : fields) {
    const bool quoted = f.kind() == "choice" || f.kind() == "text";
    text +=
        "  \"" + std::string(f.doc.name) + "\": " + (quoted ? "\"" + f.to_text() + "\"" : f.to_text()) + ",  // " + std::string(f.doc.help);
    if (!f.doc.unit.empty()) text += ", " + std::string(f.doc.unit);
    text += "\n";
  }
  text += std::string("  \"hardness\": ") + (!setup.hardness ? "\"auto\"" : *setup.hardness ? "true" : "false") +
          "  // dense bone resists the burr more, by the HU of the case; auto: where it keeps them; false: all bone alike\n}\n";
  return text;
}

}  // namespace osteo
