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

Json triple(Vec3 v) {
  return Json{v.x, v.y, v.z};
}

}  // namespace

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
    file.read(items[n], where, fields_in(e));
    if (e.name.empty()) throw file.wrong(items[n], where + ": \"name\" is empty");
    for (const PlannedCut& c : cuts) {
      if (c.name == e.name)
        throw file.wrong(items[n], where + ": there is another \"" + e.name + "\" above",
                         "give each a name of its own");
    }
    cuts.push_back({e.name, e.saw.checked(file, items[n], where), e.within_mm});
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
