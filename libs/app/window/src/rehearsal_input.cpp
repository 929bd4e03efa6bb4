#include <vector>

#include "gamepad.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/translate.h"
#include "osteo/simulation/bone/world_mesh.h"
#include "rehearsal_parts.h"

namespace osteo::inline app {

std::vector<ScopeMouse> RehearsalWindow::mouse() {
  const auto on_picture = [&](double x, double y) { return unsqueezed(stereo_.params.mode, scope_.area, x, y); };
  std::vector<ScopeMouse> all;
  for (const MouseSpell& s : trail_.take()) {
    const auto [x, y] = on_picture(s.x, s.y);
    ScopeMouse m;
    m.x = x;
    m.y = y;
    m.dx = s.dx;
    m.dy = s.dy;
    m.wheel = s.wheel;
    m.right = s.right;  // its first pixels too: they are not the drill's
    m.middle = s.middle;
    m.ctrl = s.ctrl;
    m.shift = s.shift;
    m.alt = s.alt;
    m.left = s.left;
    m.clicked = s.clicked;
    m.works = s.left || keyboard_.held(Command::second_mouse);
    all.push_back(m);
  }
  return all;
}

// Where there is no hand to move.
void RehearsalWindow::camera_by_mouse() {
  const ImGuiIO& io = ImGui::GetIO();
  const auto seconds = static_cast<double>(io.DeltaTime);
  const std::vector<ScopeMouse> did = mouse();
  if (cuts_.scene().holds(io.MousePos.x, io.MousePos.y) && !io.WantCaptureMouse) {
    for (const ScopeMouse& m : did) scope_.mouse(m, false, seconds / static_cast<double>(did.size()));
  }
  scope_.advance(keyboard_, io.KeyShift, {}, seconds);
}

void RehearsalWindow::mouse_and_keys() {
  const ImGuiIO& io = ImGui::GetIO();
  const bool in_view = cuts_.scene().holds(io.MousePos.x, io.MousePos.y) && !main_view_.in_front();
  const auto seconds = static_cast<double>(io.DeltaTime);
  const CameraDevices devices = actions_.camera ? actions_.camera(scope_.lent()) : CameraDevices{};
  read_hand();
  scope_.lend(keyboard_.held(Command::guide_camera));
  const std::vector<ScopeMouse> did = mouse();
  bool measured = false;
  if (in_view && !io.WantCaptureMouse) {
    const bool lent = scope_.lent() && !devices.hand_mm;
    for (const ScopeMouse& m : did) {
      const bool measures = m.clicked && main_view_.click(bone_seen(ray(m.x - m.dx, m.y - m.dy)), control_);
      measured = measured || measures;
      if (measures || tilt_by_mouse(m)) continue;
      if (!scope_.mouse(m, lent, seconds / static_cast<double>(did.size()))) use_mouse(m);
      control_.look_from(view_axes());  // the mouse may have turned it
    }
  }
  control_.look_from(view_axes());
  const std::optional<Vec3> direction = in_view ? std::optional(ray(did.back().x, did.back().y)) : std::nullopt;
  std::vector<Keyboard::Press> presses = keyboard_.frame(io.WantTextInput || main_view_.typing());
  for (const Keyboard::Press& button : main_view_.take_presses()) presses.push_back(button);
  for (const Keyboard::Press& press : presses) {
    do_press(press, direction);
    if (control_.failure() || ended_ || quit_) return;
  }
  scope_.advance(keyboard_, io.KeyShift, devices, seconds);
  control_.look_from(view_axes());
  if (const auto said = trial_.advance(scope_.control, seconds, actions_.folder() / "camera-trial.csv"))
    control_.say(*said);
  const bool may_drill =
      in_view && !io.WantCaptureMouse && !measured && !main_view_.ruler().on() && !main_view_.before();
  controller_.take(control_);
  HandInput hand = controller_.input(control_);
  hand.seconds = seconds;
  hand.pressed = ImGui::IsMouseDown(ImGuiMouseButton_Left) && !scope_.lent();
  hand.on_bone = may_drill;
  hand.pad = read_gamepad();
  if (scope_.lent() || main_view_.before()) hand.drill = 0;
  control_.hold(hand);
}

void RehearsalWindow::read_hand() {
  std::vector<ButtonLevel> levels;
  read_stick_buttons(levels);
  for (int n = 3; n < 5; ++n) levels.push_back({button::kMouse + n, ImGui::GetIO().MouseDown[n] ? 1.0 : 0.0});
  shell_.mirror_mouse = controller_.mirror_mouse();
  controller_.read(std::move(levels), shell_.attended(), actions_, control_);
  controller_.give(control_);
}

bool RehearsalWindow::tilt_by_mouse(const ScopeMouse& m) {
  constexpr double kRadPerPx = 0.0061;
  if (!m.alt || !m.right || !control_.tools().in_hand()) return false;
  if (m.shift) {
    control_.roll_hand(kRadPerPx * m.dx);
  } else {
    control_.tilt_hand(kRadPerPx * m.dx, -kRadPerPx * m.dy);
  }
  return true;
}

void RehearsalWindow::do_press(const Keyboard::Press& press, const std::optional<Vec3>& direction) {
  // What begins or ends a session shows pictures of its own.
  const bool long_work = press.command == Command::save || press.command == Command::quit ||
                         press.command == Command::perform || press.command == Command::before;
  if (long_work) ImGui::EndFrame();
  const std::optional<Vec3> bone = press.command == Command::mark ? bone_seen(direction) : std::nullopt;
  if (press.command == Command::before) {
    show_before(!main_view_.before());
  } else if (!main_view_.takes(press, control_, bone) && !camera_takes(press, direction) &&
             !control_.command(press, direction)) {
    command(press.command);
  }
  if (long_work) shell_.new_frame();
}

bool RehearsalWindow::camera_takes(const Keyboard::Press& press, const std::optional<Vec3>& direction) {
  LocalText said;
  if (!scope_.key(press, scope_scene(), direction, said)) return false;
  if (!said.empty()) control_.say(said);
  return true;
}

std::optional<Vec3> RehearsalWindow::bone_seen(const std::optional<Vec3>& direction) {
  if (!direction) return std::nullopt;
  const std::optional<BoneHit> hit = control_.bone_seen(*direction);
  return hit ? std::optional(hit->at_mm) : std::nullopt;
}

// The mouse is the hand, or what the hand's tool is moved by.
void RehearsalWindow::use_mouse(const ScopeMouse& m) {
  Rehearsal& rehearsal = control_.rehearsal();
  HandTools& tools = control_.tools();
  if (!tools.in_hand()) {
    use_tool(tools, rehearsal, m);
    if (m.wheel != 0 && (m.shift || m.works)) tools.push(1.0 * m.wheel, rehearsal, view_axes());
    return;
  }
  if (tools.tool() == HandTools::Tool::plate && !m.shift && m.clicked)
    return control_.bring(ray(m.x - m.dx, m.y - m.dy));
  if (keyboard_.held(Command::second_mouse)) {
    const Vec3 by = step_of(m, control_.second_mm()).by_mm + view_axes().forward * (0.5 * m.wheel);
    if (m.dx != 0 || m.dy != 0 || m.wheel != 0) control_.drag_second(by);
    return;
  }
  if (m.shift && m.left) {
    control_.push_hand(0.05 * -m.dy);
  } else if (m.dx != 0 || m.dy != 0) {
    control_.drag_hand(step_of(m, control_.goal_mm()));
  }
  if (m.wheel != 0 && (m.shift || m.works)) control_.push_hand(0.5 * m.wheel);
}

// Saw and pieces: what the mouse drags is not the hand.
void RehearsalWindow::use_tool(HandTools& tools, Rehearsal& rehearsal, const ScopeMouse& m) {
  if (m.clicked) tools.pick(rehearsal, view_axes().eye_mm, ray(m.x - m.dx, m.y - m.dy));
  if (!m.left || (m.dx == 0 && m.dy == 0)) return;
  const Vec3 at = tools.position_mm();
  const Vec3 by = step_of(m, at).by_mm;
  const ViewAxes view = view_axes();
  tools.drag(dot(by, view.right), dot(by, view.up), m.shift, rehearsal, view);
}

// What is the window's own.
void RehearsalWindow::command(Command command) {
  if (command == Command::screenshot) screenshot_wanted_ = true;
  if (command == Command::hints) {
    hints_.turn(!hints_.on());
    control_.say([&] { return hints_.on() ? tr("hints are given") : tr("no hints"); });
  }
  if (command == Command::timeline)
    control_.say([&] { return tr("the course of the session is shown when it is over (Q)"); });
  if (command == Command::sound) sound_.turn(!sound_.on());
  if (command == Command::lead) switch_lead();
  if (command == Command::monitor || command == Command::mute_monitor) monitor_command(command);
  if (command == Command::quality) {
    QualityChoice& q = painter_->quality();
    q.want(static_cast<Quality>((static_cast<int>(q.wish()) + 1) % 4));
  }
  if (command == Command::cut_in_middle) cuts_.control().enlarge_or_back();
  if (command == Command::cuts_along_tool) {
    const bool along = cuts_.control().planes() == CutsControl::Planes::tool;
    cuts_.control().take_planes(along ? CutsControl::Planes::body : CutsControl::Planes::tool);
  }
  if (command == Command::regions) {
    if (regions_) {
      regions_->show(!regions_->shown());
    } else {
      control_.say([&] { return tr("no regions are planned: --procedure FILE names them"); });
    }
  }
  if (command == Command::quit) end_session();
}

// What the pull does is in the samples of who leads, and so recorded; that it was the person's wish is a note.
void RehearsalWindow::switch_lead() {
  if (!tutor_.leads || !actions_.lead)
    return control_.say([&] { return tr("nobody leads your hand in this session"); });
  if (control_.leading())
    return control_.say([&] { return tr("the drill is on its way: your hand is let go until it is there"); });
  const bool on = !tutor_.guiding;
  actions_.lead(on);
  control_.rehearsal().note("lead", on ? R"({"on":true})" : R"({"on":false})");
  control_.say([&] { return on ? tr("your hand is led") : tr("your hand is let go"); });
}

// What the person has chosen meanwhile, by keys or in the settings; what a session had when is a note of it.
void RehearsalWindow::look_at_settings() {
  const SettingsDialog& settings = main_view_.settings();
  if (!main_view_.in_settings() || settings.page() != SettingsPage::controls) controller_.leave();
  PersonValues& values = person_.values;
  if (values.monitor != (monitor_controller() != nullptr) && actions_.turn_monitor) {
    if (!actions_.turn_monitor(values.monitor))
      control_.say([&] { return tr("the nerve monitor stays as it is in this session"); }, Message::Rank::hindrance);
    values.monitor = monitor_controller() != nullptr;
    monitor_.show(true);
  }
  static constexpr const char* kNames[] = {"sound", "hints", "monitor"};
  const std::array<bool, 3> now = switches_now();
  for (std::size_t n = 0; n < now.size(); ++n) {
    if (now[n] == switches_[n]) continue;
    control_.rehearsal().note("switch", Json{{"name", kNames[n]}, {"on", now[n]}}.dump());
  }
  switches_ = now;
  look_at_simulation();
  if (!main_view_.take_another_session()) return;
  end_ = {true, actions_.folder(), true, scope_.view(), values.dust, values.heat};
  quit_ = true;
}

void RehearsalWindow::look_at_simulation() {
  const auto simulated = [&] {
    Rehearsal& rehearsal = control_.rehearsal();
    return SimulationSwitches::Both{rehearsal.simulates(Simulated::dust), rehearsal.simulates(Simulated::heat)};
  };
  if (!actions_.simulate) {
    if (simulation_.follow(simulated()))
      control_.say([&] { return tr("dust, water and heat are switched where the session runs"); },
                   Message::Rank::hindrance);
    return;
  }
  for (const auto& change : simulation_.take_changes()) {
    const bool on = change.second;
    actions_.simulate(change.first, on);
    if (change.first == Simulated::dust)
      control_.say([&] { return on ? tr("bone dust and water from here on") : tr("no bone dust and no water"); });
    else
      control_.say([&] { return on ? tr("heat of drilling from here on") : tr("no heat of drilling"); });
  }
}

void RehearsalWindow::use_water() {
  const bool suck = keyboard_.held(Command::suck) || main_view_.holds(Command::suck);
  const bool wash = keyboard_.held(Command::wash) || main_view_.holds(Command::wash);
  if ((suck || wash) && main_view_.second_hand() && actions_.simulate) simulation_.use_water();
  control_.wash(suck, wash);
}

void RehearsalWindow::monitor_command(Command command) {
  MonitorController* const controller = monitor_controller();
  if (controller == nullptr) {
    if (command == Command::monitor && actions_.turn_monitor)
      person_.values.monitor = true;  // it begins with this picture
    else
      control_.say([&] { return tr("there is no nerve monitor here"); });
    return;
  }
  if (command == Command::monitor) monitor_.show(!monitor_.shown());
  if (command == Command::mute_monitor) {
    controller->sound().mute(!controller->sound().muted());
    control_.say([&] {
      return controller->sound().muted() ? tr("the nerve monitor is muted") : tr("the nerve monitor is heard");
    });
  }
}

}  // namespace osteo::inline app
