#include "window_state.h"

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

namespace osteo {
namespace {

nlohmann::ordered_json list(Vec3 v) {
  return {v.x, v.y, v.z};
}

}  // namespace

void write_window_state(const WindowState& s, const std::filesystem::path& file) {
  static constexpr const char* kHands[] = {"drill", "saw", "piece", "plate"};
  nlohmann::ordered_json places = nlohmann::ordered_json::array();
  for (const Vec3 p : s.places_mm) places.push_back(list(p));
  const Vec3 force = from_floats(s.tick.force_n);
  const nlohmann::ordered_json j{{"pictures", s.pictures},
                                 {"drawn", s.drawn},
                                 {"at_rest", s.at_rest},
                                 {"scale", s.scale},
                                 {"quality", EnumNames<Quality>::values[static_cast<std::size_t>(s.quality.wish())]},
                                 {"level", EnumNames<Quality>::values[static_cast<std::size_t>(s.quality.level())]},
                                 {"moving_ms", s.quality.moving_ms()},
                                 {"resting_ms", s.quality.resting_ms()},
                                 {"failure", s.failure},
                                 {"message", s.message},
                                 {"leading", s.leading},
                                 {"session", s.session.string()},
                                 {"tool", s.tool},
                                 {"drill_latched", s.drill_latched},
                                 {"help", s.help},
                                 {"sucking", s.sucking},
                                 {"washing", s.washing},
                                 {"sound", s.sound},
                                 {"hand", kHands[s.hand]},
                                 {"cut_in_middle", s.cut_in_middle},
                                 {"cuts_along_tool", s.cuts_along_tool},
                                 {"cuts_ms", s.cuts_ms},
                                 {"cut_at_mm", list(s.cut.at_mm)},
                                 {"cut_normal", list(s.cut.normal)},
                                 {"cut_along", list(s.cut.along)},
                                 {"plate_x", list(s.plate.rotation.column[0])},
                                 {"eye", list(s.eye)},
                                 {"centre_mm", list(s.centre_mm)},
                                 {"radius_mm", s.radius_mm},
                                 {"goal_mm", list(s.goal_mm)},
                                 {"focus_mm", list(s.view.focus_mm)},
                                 {"view_back", list(s.view.back)},
                                 {"view_up", list(s.view.up)},
                                 {"working_distance_mm", s.view.working_distance_mm},
                                 {"magnification", s.view.magnification},
                                 {"pixels_per_mm", s.pixels_per_mm},
                                 {"camera_moves", s.camera_moves},
                                 {"stereo", s.stereo},
                                 {"size", {s.width, s.height}},
                                 {"tick", s.tick.tick},
                                 {"at_mm", list(from_floats(s.tick.device.position_mm))},
                                 {"axis", list(from_floats(s.tick.device.axis))},
                                 {"drill_on", s.tick.device.pedal != 0},
                                 {"force_n", length(force)},
                                 {"removed_mm3", s.removed_mm3},
                                 {"bodies", s.bodies},
                                 {"fixtures", s.fixtures},
                                 {"undo_steps", s.undo_steps},
                                 {"places_mm", places},
                                 {"layout", s.room.layout},
                                 {"em_pixels", s.room.em_pixels},
                                 {"full_screen", s.room.full_screen},
                                 {"asking", s.room.asking},
                                 {"wheel", s.room.wheel},
                                 {"panel_keys", s.room.panel_keys},
                                 {"before", s.room.before},
                                 {"writing", s.room.writing},
                                 {"ended", s.room.ended},
                                 {"ruler", s.room.ruler},
                                 {"ruler_mm", s.room.ruler_mm},
                                 {"notes", s.room.notes},
                                 {"steps_done", s.room.steps_done},
                                 {"view", s.room.view}};
  const std::filesystem::path beside = file.string() + ".new";
  std::ofstream(beside) << j.dump() << '\n';
  std::error_code ignored;
  std::filesystem::rename(beside, file, ignored);
}

}  // namespace osteo
