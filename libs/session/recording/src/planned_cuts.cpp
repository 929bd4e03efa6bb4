#include "osteo/session/recording/planned_cuts.h"

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/json_document.h"
#include "saw_fields.h"

namespace osteo::inline session {
namespace {

struct Head {
  int version = 1;
  std::string about;
  static void describe(Head& p, auto& visit) {
    visit({"osteotome_planned_cuts", "version of the format", "", 1, 1, true}, p.version);
    visit({"about", "what they are for"}, p.about);
  }
};

// Of a printed guide: where a blade lies in it.
struct Slot {
  double play_mm = 0, length_mm = 0;
  Triple at_mm{}, normal{}, up_mm{};
  static void describe(Slot& p, auto& visit) {
    visit({"play_mm", "its width beyond the blade's", "mm", 0, SceneAction::kMaxPlayMm, true}, p.play_mm);
    visit({"at_mm", "middle of its faces, LPS", "mm", -kFarMm, kFarMm, true}, p.at_mm);
    visit({"normal", "across its faces", "", -kFarMm, kFarMm, true}, p.normal);
    visit({"up_mm", "from the bone out, as long as its faces are high", "mm", -SceneAction::kMaxFaceMm,
           SceneAction::kMaxFaceMm, true},
          p.up_mm);
    visit({"length_mm", "of its faces, across their height", "mm", SceneAction::kLeastFaceMm, SceneAction::kMaxFaceMm,
           true},
          p.length_mm);
  }
};

struct Entry {
  std::string name, about;
  SawFields saw;
  double within_mm = PlannedCut{}.within_mm;
  static void describe(Entry& p, auto& visit) {
    visit({"name", "name that scripts and the window use", "", 0, 0, true}, p.name);
    visit({"about", "what it is for"}, p.about);
    SawFields::describe(p.saw, visit, true);
    visit({"within_mm", "as a cutting guide: a saw this near slips in", "mm", 0.1, SceneAction::kMaxSlotMm},
          p.within_mm);
  }
};

void add_slot(const JsonFile& file, const JsonValue& object, const std::string& where, PlannedCut& c) {
  Slot s;
  file.read(object, where, fields_in(s));
  static_cast<void>(direction_of(file, object, where, "normal", s.normal));
  c.slot = {vec(s.at_mm), vec(s.normal), c.within_mm, s.play_mm, vec(s.up_mm), s.length_mm};
  const double high = length(c.guide().up_mm);
  if (!(high >= SceneAction::kLeastFaceMm && high <= SceneAction::kMaxFaceMm))
    throw file.wrong(object, where + ": \"up_mm\" is " + format_number(high) + " mm long across \"normal\"",
                     "it lies in the slot's plane and is as long as its faces are high: " +
                         format_number(SceneAction::kLeastFaceMm) + " to " + format_number(SceneAction::kMaxFaceMm));
}

Json triple(Vec3 v) {
  return Json{v.x, v.y, v.z};
}

}  // namespace

CuttingGuide PlannedCut::guide() const {
  if (!slot.on()) return {cut.at_mm, normalized(cut.normal), within_mm};
  CuttingGuide g = slot;
  g.normal = normalized(g.normal);
  g.up_mm -= g.normal * dot(g.up_mm, g.normal);
  return g;
}

std::vector<PlannedCut> load_planned_cuts(const std::filesystem::path& path) {
  const JsonFile file(read_text(path), path.string());
  const JsonValue& root = file.root();
  Head head;
  const std::vector<std::string> besides{"cuts"};
  file.read(root, "", fields_in(head), besides);
  const auto& items = file.list(file.need(root, "", "cuts"), "\"cuts\"");
  if (items.empty())
    throw file.wrong(file.need(root, "", "cuts"), "\"cuts\": there is none", "without planned cuts leave the file out");
  std::vector<PlannedCut> cuts;
  for (std::size_t n = 0; n < items.size(); ++n) {
    const std::string where = "cut " + std::to_string(n + 1);
    Entry e;
    file.read(items[n], where, fields_in(e), std::vector<std::string>{"slot"});
    if (e.name.empty()) throw file.wrong(items[n], where + ": \"name\" is empty");
    for (const PlannedCut& c : cuts) {
      if (c.name == e.name)
        throw file.wrong(items[n], where + ": there is another \"" + e.name + "\" above",
                         "give each a name of its own");
    }
    cuts.push_back({e.name, e.saw.checked(file, items[n], where), e.within_mm});
    if (const JsonValue* const s = items[n].find("slot")) add_slot(file, *s, where + ": \"slot\"", cuts.back());
  }
  return cuts;
}

std::vector<PlannedCut> planned_cuts_of(const std::filesystem::path& case_folder) {
  const auto file = case_folder / kPlannedCutsFile;
  return std::filesystem::exists(file) ? load_planned_cuts(file) : std::vector<PlannedCut>{};
}

std::string planned_cuts_json(std::span<const PlannedCut> cuts) {
  Json j{{"osteotome_planned_cuts", 1}};
  j["cuts"] = Json::list();
  for (const PlannedCut& c : cuts) {
    j["cuts"].push_back({{"name", c.name},
                         {"at_mm", triple(c.cut.at_mm)},
                         {"normal", triple(c.cut.normal)},
                         {"along", triple(c.cut.along)},
                         {"kerf_mm", c.cut.kerf_mm},
                         {"length_mm", c.cut.length_mm},
                         {"depth_mm", c.cut.depth_mm},
                         {"within_mm", c.within_mm}});
    if (c.slot.on())
      j["cuts"].back()["slot"] = {{"play_mm", c.slot.play_mm},
                                  {"at_mm", triple(c.slot.at_mm)},
                                  {"normal", triple(c.slot.normal)},
                                  {"up_mm", triple(c.slot.up_mm)},
                                  {"length_mm", c.slot.length_mm}};
  }
  return j.dump(1) + "\n";
}

const PlannedCut& planned_cut(std::span<const PlannedCut> cuts, std::string_view name) {
  std::string names;
  for (const PlannedCut& c : cuts) {
    if (c.name == name) return c;
    names += (names.empty() ? "" : ", ") + c.name;
  }
  throw Error(ExitCode::usage, "no planned cut is called '" + std::string(name) + "'",
              cuts.empty() ? "the case has no " + std::string(kPlannedCutsFile) : "there are: " + names);
}

}  // namespace osteo::inline session
