#include <algorithm>

#include "rehearsal_parts.h"

namespace osteo::inline app {

// For tests: what can be seen, as numbers. Whole at any moment.
void RehearsalWindow::write_state() {
  if (state_file_.empty()) return;
  WindowState state;
  state.pictures = pictures_;
  state.drawn = painter_->drawn();
  state.at_rest = painter_->at_rest();
  state.kept = painter_->kept();
  state.scale = painter_->scale();
  state.quality = painter_->quality();
  state.failure = control_.failure() ? control_.failure()->what() : "";
  state.message = control_.leading() ? "on the way" : control_.message();
  state.leading = control_.leading();
  state.session = actions_.folder();
  state.tool = instrument_library()[static_cast<std::size_t>(control_.instrument())].name;
  state.drill_latched = control_.latched();
  state.help = main_view_.palette().shown() != CommandPalette::Shown::nothing;
  state.main_view = view_state();
  const HandMotion& motion = control_.motion();
  state.motion = {motion.one_to,
                  motion.clutch,
                  motion.rest,
                  control_.handle().left(),
                  controller_.assign().listens() ? words_of(*controller_.assign().listens()) : std::string(),
                  controller_.row(),
                  control_.burr_share,
                  control_.handle().tilted_rad(),
                  {},
                  control_.handle().axis(control_.view())};
  state.sucking = control_.sucking();
  state.washing = control_.washing();
  state.sound = sound_.on();
  if (MonitorController* const controller = monitor_controller()) {
    state.monitor.channels = controller->wiring().channels.size();
    state.monitor.shown = monitor_.shown();
    state.monitor.muted = controller->sound().muted();
    state.monitor.seconds = controller->screen().view().now_s;
    state.monitor.events = controller->screen().events();
  }
  const auto heard =
      std::count_if(tutor_.links.begin(), tutor_.links.end(), [](const TutorNow::Link& l) { return l.heard; });
  std::vector<std::string> done, harm;
  for (const TutorNow::Step& s : tutor_.steps) {
    if (s.items > 0 && s.passed == s.items) done.push_back(s.name);
  }
  for (const HarmLine& l : harm_) harm.push_back(l.text);
  state.tutor = {tutor_.title,
                 tutor_.invitation,
                 done,
                 harm,
                 tutor_.links.size(),
                 static_cast<std::size_t>(heard),
                 tutor_.leads && tutor_.guiding,
                 tutor_.pull,
                 tutor_.apart_mm};
  state.cut_in_middle = cuts_.control().enlarged();
  state.cuts_along_tool = cuts_.control().planes() == CutsControl::Planes::tool;
  state.cuts_ms = cuts_.last_ms();
  state.hand = static_cast<int>(control_.tools().tool());
  state.cut = control_.tools().cut();
  state.plate = control_.tools().plate_grip();
  state.eye = control_.towards_eye();
  state.centre_mm = control_.centre_mm();
  state.radius_mm = control_.radius_mm();
  state.goal_mm = control_.goal_mm();
  state.view = scope_.view();
  state.pixels_per_mm = scope_.view().pixels_per_mm(scope_.area);
  state.camera_moves = scope_.control.flies();
  state.stereo = static_cast<int>(stereo_.params.mode);
  state.width = width_;
  state.height = height_;
  if (Rehearsal* const rehearsal = actions_.rehearsal(); rehearsal != nullptr && !control_.failure()) {
    state.tick = rehearsal->latest();
    state.motion.second_mm = control_.second_mm();
    state.removed_mm3 = rehearsal->removed_mm3();
    if (warmth_) state.hottest_c = warmth_->bone_c;
    rehearsal->look([&](const World& world, SceneReaders& readers) {
      if (readers.dust) state.down = readers.dust->dust().gravity();
      state.bodies = world.bodies().size();
      state.fixtures = world.fixtures().size();
      state.undo_steps = world.undo_steps();
      for (const PlacedBody& b : world.bodies()) state.places_mm.push_back(b.world_from_body.shift_mm);
    });
  }
  write_window_state(state, state_file_);
}

ViewState RehearsalWindow::view_state() const {
  ViewState r;
  r.layout = EnumNames<Layout>::values[static_cast<std::size_t>(main_view_.layout().shown)];
  r.em_pixels = shell_.em_pixels();
  r.full_screen = shell_.full_screen();
  r.asking = main_view_.asking();
  r.wheel = main_view_.wheel_open();
  if (main_view_.in_settings()) {
    r.settings = enum_names(SettingsPage{})[static_cast<std::size_t>(main_view_.settings().page())];
    for (const SettingsDialog::Place& p : main_view_.settings().places()) r.rows.push_back({p.name, p.x, p.y});
  }
  r.before = main_view_.before() && before_view_;
  r.writing = main_view_.writing();
  r.ended = ended_.has_value();
  r.ruler = main_view_.ruler().on();
  review_.state(r);
  if (Rehearsal* const rehearsal = actions_.rehearsal();
      rehearsal != nullptr && structures_ && rehearsal->structures() != nullptr) {
    for (const StructuresView::One& s : structures_->all())
      r.structures[rehearsal->structures()->name_of(s.value)] =
          EnumNames<StructureLook>::values[static_cast<std::size_t>(s.look)];
  }
  r.hints = hints_.on();
  r.hint = hints_.words();
  r.ruler_mm = main_view_.ruler().length_mm().value_or(0);
  r.notes = main_view_.notes().all().size();
  for (const Step& s : main_view_.steps().steps()) {
    if (s.done) r.steps_done.push_back(s.name());
  }
  if (const int next = main_view_.steps().next(); next >= 0)
    r.next_step = main_view_.steps().steps()[static_cast<std::size_t>(next)].name();
  r.typing = main_view_.palette().typing();
  r.search = main_view_.palette().search().text();
  if (const CommandRow* const row = main_view_.palette().search().row(); r.typing && row != nullptr)
    r.found = row->name;
  static constexpr const char* kParts[] = {"bone", "strip", "card", "cuts", "state", "settings"};
  r.focus = kParts[static_cast<std::size_t>(main_view_.focus())];
  const ScreenBox& v = cuts_.scene();
  r.view = {v.x, v.y, v.width, v.height};
  return r;
}

}  // namespace osteo::inline app
