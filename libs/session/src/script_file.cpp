#include "osteo/session/script_file.h"

#include <nlohmann/json.hpp>

#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/bone/burr.h"

namespace osteo {
namespace {

using nlohmann::ordered_json;

Vec3 point_of(const ordered_json& j) {
  return {j.at(0).get<double>(), j.at(1).get<double>(), j.at(2).get<double>()};
}

}  // namespace

Script load_script(const fs::path& path) {
  const std::string text = read_text(path), name = "'" + path.string() + "'";
  Script script;
  std::string where = "header";
  try {
    const auto j = ordered_json::parse(text, nullptr, true, true);
    if (j.at("osteotome_strokes") != 1) throw Error(ExitCode::usage, name + ": \"osteotome_strokes\" must be 1");
    where = "burr";
    BurrKind kind = BurrKind::cutting;
    detail::FieldCollector fields;
    fields({"burr.kind", "kind of burr"}, kind);
    fields.fields.front().from_text(j.at("burr").at("kind").get<std::string>());
    script.tool = burr_index(kind, j.at("burr").at("diameter_mm"));
    where = "axis";
    script.axis = normalized(point_of(j.at("axis")));
    if (length(script.axis) == 0) throw Error(ExitCode::usage, name + ": the axis has no length");
    for (const auto& w : j.at("waypoints")) {
      where = "waypoint " + std::to_string(script.waypoints.size() + 1);
      const Script::Waypoint point{w.at("t_s"), point_of(w.at("at_mm")), w.value("drill", true)};
      if (!script.waypoints.empty() && !(point.t_s > script.waypoints.back().t_s))
        throw Error(ExitCode::usage, name + ": " + where + ": times must rise");
      script.waypoints.push_back(point);
    }
  } catch (const nlohmann::json::exception& e) {
    throw Error(ExitCode::usage, name + ": " + where + ": " + e.what(), "docs/session-format.md describes scripts of strokes");
  }
  if (script.waypoints.empty()) throw Error(ExitCode::usage, name + ": there are no waypoints");
  return script;
}

std::string script_json(const Script& script) {
  const Burr& burr = burr_library()[static_cast<std::size_t>(script.tool)];
  ordered_json j;
  j["osteotome_strokes"] = 1;
  j["burr"] = {{"kind", EnumNames<BurrKind>::values[static_cast<std::size_t>(burr.kind)]}, {"diameter_mm", burr.diameter_mm}};
  j["axis"] = {script.axis.x, script.axis.y, script.axis.z};
  j["waypoints"] = ordered_json::array();
  for (const auto& w : script.waypoints)
    j["waypoints"].push_back({{"t_s", w.t_s}, {"at_mm", {w.at_mm.x, w.at_mm.y, w.at_mm.z}}, {"drill", w.drill_on}});
  return j.dump(1) + "\n";
}

}  // namespace osteo
