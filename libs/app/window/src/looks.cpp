#include "looks.h"

#include <algorithm>
#include <utility>

#include "osteo/core/base/json.h"
#include "osteo/core/base/json_document.h"

namespace osteo::inline app {
namespace {

bool flag(const JsonFile& json, const JsonValue& object, std::string_view key) {
  const JsonValue& v = json.need(object, "", key);
  if (v.kind != JsonValue::Kind::flag) throw json.wrong(v, "'" + std::string(key) + "' is true or false");
  return v.flag;
}

void read_structure(const JsonFile& json, Looks& looks) {
  const double value = json.number(json.need(json.root(), "", "structure"), "structure", 1, 255);
  const std::string& look = json.text(json.need(json.root(), "", "look"), "look");
  const auto& names = EnumNames<StructureLook>::values;
  const auto at = std::find(names.begin(), names.end(), look);
  if (at == names.end()) throw json.wrong(json.root(), "there is no look '" + look + "'");
  looks.structures[static_cast<std::uint8_t>(value)] = static_cast<StructureLook>(at - names.begin());
}

CutsLook read_cuts(const JsonFile& json) {
  const JsonValue& root = json.root();
  CutsLook cuts;
  cuts.window_hu = json.number(json.need(root, "", "window_hu"), "window_hu", 1, 1e5);
  cuts.level_hu = json.number(json.need(root, "", "level_hu"), "level_hu", -1e5, 1e5);
  cuts.preset = static_cast<int>(json.number(json.need(root, "", "preset"), "preset", -1, 99));
  cuts.along_tool = flag(json, root, "along_tool");
  cuts.follow = flag(json, root, "follow");
  cuts.removed = flag(json, root, "removed");
  cuts.regions = flag(json, root, "regions");
  return cuts;
}

}  // namespace

std::string note_of(std::uint8_t value, const std::string& name, StructureLook look) {
  return Json{
      {"structure", value}, {"name", name}, {"look", EnumNames<StructureLook>::values[static_cast<std::size_t>(look)]}}
      .dump();
}

std::string note_of(const CutsLook& c) {
  return Json{{"window_hu", c.window_hu}, {"level_hu", c.level_hu}, {"preset", c.preset},  {"along_tool", c.along_tool},
              {"follow", c.follow},       {"removed", c.removed},   {"regions", c.regions}}
      .dump();
}

Looks looks_of(std::span<const Note> notes) {
  Looks looks;
  for (const Note& n : notes) {
    if (n.kind != "structure" && n.kind != "cuts") continue;
    try {
      const JsonFile json(n.json, "a note", ExitCode::corrupt);
      if (n.kind == "structure") {
        read_structure(json, looks);
      } else {
        looks.cuts = read_cuts(json);
      }
    } catch (const Error&) {
      ++looks.unreadable;
    }
  }
  return looks;
}

std::optional<std::string> CutsNotes::next(const CutsLook& now, double now_s) {
  constexpr double kSettledS = 0.5;
  if (now != seen_) {
    seen_ = now;
    since_s_ = now_s;
  }
  if (now == noted_ || now_s - since_s_ < kSettledS) return std::nullopt;
  noted_ = now;
  return note_of(now);
}

}  // namespace osteo::inline app
