#include "window_state.h"

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "drawn_state.h"
#include "osteo/core/base/translate.h"

namespace osteo::inline app {
namespace {

nlohmann::ordered_json list(Vec3 v) {
  return {v.x, v.y, v.z};
}

}  // namespace

void write_window_state(const WindowState& s, const std::filesystem::path& file) {
  static constexpr const char* kHands[] = {"drill", "saw", "piece", "plate"};
  nlohmann::ordered_json places = nlohmann::ordered_json::array();
  for (const Vec3 p : s.places_mm) places.push_back(list(p));
  nlohmann::ordered_json rows = nlohmann::ordered_json::object();
  for (const auto& row : s.main_view.rows) rows[row.name] = {row.x, row.y};
  const Vec3 force = from_floats(s.tick.force_n);
  nlohmann::ordered_json j{{"pictures", s.pictures},
                           {"drawn", s.drawn},
                           {"at_rest", s.at_rest},
                           {"kept", s.kept},
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
                           {"monitor",
                            {{"channels", s.monitor.channels},
                             {"events", s.monitor.events},
                             {"seconds", s.monitor.seconds},
                             {"shown", s.monitor.shown},
                             {"muted", s.monitor.muted}}},
                           {"tutor",
                            {{"title", s.tutor.title},
                             {"invitation", s.tutor.invitation},
                             {"steps", s.tutor.steps},
                             {"harm", s.tutor.harm},
                             {"links", s.tutor.links},
                             {"heard", s.tutor.heard},
                             {"guiding", s.tutor.guiding},
                             {"pull", s.tutor.pull},
                             {"apart_mm", s.tutor.apart_mm}}},
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
                           {"hottest_c", s.hottest_c},
                           {"bodies", s.bodies},
                           {"fixtures", s.fixtures},
                           {"undo_steps", s.undo_steps},
                           {"places_mm", places},
                           {"layout", s.main_view.layout},
                           {"em_pixels", s.main_view.em_pixels},
                           {"full_screen", s.main_view.full_screen},
                           {"asking", s.main_view.asking},
                           {"wheel", s.main_view.wheel},
                           {"settings", s.main_view.settings},
                           {"rows", rows},
                           {"before", s.main_view.before},
                           {"writing", s.main_view.writing},
                           {"ended", s.main_view.ended},
                           {"ruler", s.main_view.ruler},
                           {"ruler_mm", s.main_view.ruler_mm},
                           {"notes", s.main_view.notes},
                           {"findings", s.main_view.findings},
                           {"hints", s.main_view.hints},
                           {"hint", s.main_view.hint},
                           {"timeline", s.main_view.timeline},
                           {"playing", s.main_view.playing},
                           {"review_s", s.main_view.review_s},
                           {"review_mm3", s.main_view.review_mm3},
                           {"steps_done", s.main_view.steps_done},
                           {"next_step", s.main_view.next_step},
                           {"typing", s.main_view.typing},
                           {"search", s.main_view.search},
                           {"found", s.main_view.found},
                           {"focus", s.main_view.focus},
                           {"view", s.main_view.view},
                           {"down", list(s.down)},
                           {"structures", s.main_view.structures},
                           {"speed", s.main_view.speed},
                           {"language", enum_names(Language{})[static_cast<std::size_t>(language())]},
                           {"one_to", s.motion.one_to},
                           {"clutch", s.motion.clutch},
                           {"wrist_rest", s.motion.wrist_rest},
                           {"left_handed", s.motion.left_handed},
                           {"listening", s.motion.listening},
                           {"page_row", s.motion.row},
                           {"burr_share", s.motion.burr_share},
                           {"tilted_rad", s.motion.tilted_rad},
                           {"second_mm", list(s.motion.second_mm)},
                           {"axis_wanted", list(s.motion.axis)}};
  add_drawn(j);
  const std::filesystem::path beside = file.string() + ".new";
  std::ofstream(beside) << j.dump() << '\n';
  std::error_code ignored;
  std::filesystem::rename(beside, file, ignored);
}

}  // namespace osteo::inline app
