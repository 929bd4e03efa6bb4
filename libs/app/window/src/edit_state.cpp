#include "edit_state.h"

#include <fstream>

#include "drawn_state.h"
#include "osteo/core/base/json_document.h"

namespace osteo::inline app {

void write_edit_state(const EditWindowState& s, const EditControl& control, const std::filesystem::path& file) {
  const auto list = [](Vec3 v) { return Json{v.x, v.y, v.z}; };
  Json views = Json::list();
  for (std::size_t v = 0; v < 4; ++v) {
    const EditViewBox& b = s.boxes[v];
    Json view{{"x", b.x}, {"y", b.y}, {"width", b.width}, {"height", b.height}};
    if (v < 3) {
      view["centre_mm"] = list(control.view(static_cast<int>(v)).centre_mm);
      view["mm_per_pixel"] = control.view(static_cast<int>(v)).mm_per_pixel;
      view["slice"] = control.slice(static_cast<int>(v)).first;
    }
    views.push_back(std::move(view));
  }
  Json structures = Json::list();
  for (const EditStructure& e : control.document().structures())
    structures.push_back({{"value", e.is.value}, {"name", e.is.name}, {"shown", e.shown}});
  Json places = Json::list();
  for (const EditPlace& p : control.places) places.push_back({{"name", p.name}, {"at_mm", list(p.at_mm)}});
  const EditDocument& d = control.document();
  Json j{{"pictures", s.pictures},
         {"size", {s.width, s.height}},
         {"views", std::move(views)},
         {"enlarged", control.enlarged()},
         {"tool", edit_tool_name(control.tool())},
         {"hint", control.hint()},
         {"message", control.message()},
         {"readout", control.readout()},
         {"cross_mm", list(control.cross_mm())},
         {"window_hu", control.hu.width},
         {"level_hu", control.hu.level},
         {"lower_hu", control.lower_hu},
         {"brush_mm", 2 * control.brush_radius_mm},
         {"steps", d.steps()},
         {"can_redo", d.can_redo()},
         {"version", d.version()},
         {"busy", control.busy()},
         {"previewing", control.previewing()},
         {"unsaved", control.unsaved()},
         {"saving", s.saving},
         {"asking", s.asking},
         {"help", control.show_help},
         {"structures", std::move(structures)},
         {"triangles", s.triangles},
         {"threshold_slider", s.threshold_slider},
         {"first_place", s.first_place},
         {"find_button", s.find_button},
         {"places", std::move(places)},
         {"progress", control.progress()},
         {"undo", d.undo_text()},
         {"worst_ms", s.worst_ms}};
  add_drawn(j);
  const std::filesystem::path beside = file.string() + ".new";
  std::ofstream(beside) << j.dump() << '\n';
  std::error_code ignored;
  std::filesystem::rename(beside, file, ignored);
}

}  // namespace osteo::inline app
