// What keys and clicks do in the window of a rehearsal, before the hand and the camera are asked.
#include <imgui.h>
#include <imgui_internal.h>

#include <algorithm>
#include <utility>

#include "main_view.h"
#include "osteo/core/base/translate.h"
#include "osteo/simulation/bone/posture.h"
#include "ui_kit.h"
#include "ui_style.h"

namespace osteo::inline app {

void MainView::key(int code, int modifiers, bool repeated) {
  palette_.key(code, modifiers);
  if (!writing_ || repeated) return;
  const Key* const known = find_key(code);
  if (known == nullptr) return;
  if (known->command == Command::perform) note_answer_ = 1;
  if (known->command == Command::put_away) note_answer_ = -1;
}

std::vector<Keyboard::Press> MainView::take_presses() {
  return std::exchange(pressed_.presses, {});
}

bool MainView::holds(Command command) const {
  if (command == Command::suck && latched_.suction) return true;
  if (command == Command::wash && latched_.irrigation) return true;
  return std::find(pressed_.held.begin(), pressed_.held.end(), command) != pressed_.held.end();
}

void MainView::answer(int answer, RehearsalControl& control) {
  if (answer == 0) return;
  asking_ = false;
  if (answer > 0) control.reset();
}

// What lies in front of the bone has the key. True: it was for that.
bool MainView::takes_in_front(Command c, RehearsalControl& control) {
  if (asking_) {
    answer(c == Command::perform ? 1 : c == Command::put_away ? -1 : 0, control);
    return true;
  }
  if (palette_.typing()) return true;  // pressed in the picture in which it was opened
  if (focus_ != Focus::bone) {
    const bool leaves = c == Command::put_away || (c == Command::settings && in_settings());
    if (leaves) {
      focus_ = Focus::bone;
      settings_.close();
    }
    // Arrows, Space and Enter are the focus'; other keys go on.
    if (leaves || c == Command::deeper || c == Command::back || c == Command::drill || c == Command::perform ||
        c == Command::earlier || c == Command::later)
      return true;
  }
  if (!wheel_.open()) return false;
  const bool takes_it = c == Command::wheel || c == Command::perform;
  if (c == Command::deeper || c == Command::back) {
    wheel_.turn(c == Command::deeper ? 1 : -1);
    return true;
  }
  wheel_.close();
  if (takes_it && wheel_.chosen() >= 0) {
    const WheelItem& item = wheel_items()[static_cast<std::size_t>(wheel_.chosen())];
    const Command chosen = item.command;
    // A burr is for the drill.
    const bool burr =
        chosen != Command::saw && chosen != Command::pieces && chosen != Command::plates && chosen != Command::put_away;
    if (burr && control.tools().tool() != HandTools::Tool::drill) pressed_.press(Command::put_away);
    pressed_.press(chosen, item.value);
  }
  return takes_it || c == Command::put_away;
}

void MainView::show_wheel() {
  const ImVec2 m = ImGui::GetIO().MousePos;
  const float edge = ToolWheel::kOuterEm * em();
  const ScreenBox& v = layout_.view;
  const bool inside = v.holds(m.x, m.y);
  const auto kept = [&](float at, float lo, float length) {
    return length < 2 * edge ? lo + length / 2 : std::clamp(at, lo + edge, lo + length - edge);
  };
  wheel_.show(inside ? kept(m.x, v.x, v.width) : v.x + v.width / 2,
              inside ? kept(m.y, v.y, v.height) : v.y + v.height / 2);
}

// The bone, and round the parts of the window again.
void MainView::move_focus(int by) {
  constexpr int kParts = 5;  // the panel is opened by its own key
  const int now = in_settings() ? 0 : static_cast<int>(focus_);
  focus_ = static_cast<Focus>((now + by + kParts) % kParts);
  settings_.close();
  focus_moved_ = true;
}

// Where dust and water fall to, also those that begin later.
void MainView::lay_patient(Posture posture, RehearsalControl& control) {
  person_.values.position = EnumNames<Posture>::values[static_cast<std::size_t>(posture)];
  control.rehearsal().act(SceneAction::posture(down_of(posture, 0)));
  std::string name(EnumNames<Posture>::values[static_cast<std::size_t>(posture)]);
  std::replace(name.begin(), name.end(), '_', ' ');
  control.say([&] { return filled(tr("patient position: {position}"), {{"position", tr(name)}}); });
}

bool MainView::takes(const Keyboard::Press& press, RehearsalControl& control, const std::optional<Vec3>& bone) {
  const Command c = press.command;
  if (takes_in_front(c, control)) return true;
  switch (c) {
    case Command::help:
      palette_.help();
      return true;
    case Command::palette:
      palette_.show(CommandPalette::Shown::commands);
      return true;
    case Command::focus_next:
      move_focus(press.shift ? -1 : 1);
      return true;
    case Command::irrigation:
      if (!second_hand_) {
        control.say([&] { return tr("there is no second hand in this session"); }, Message::Rank::hindrance);
      } else {
        latched_.irrigation = !latched_.irrigation;
      }
      return true;
    case Command::simulate: {  // the session follows what the person has chosen
      bool& on = press.value == static_cast<int>(Simulated::dust) ? person_.values.dust : person_.values.heat;
      on = !on;
      return true;
    }
    case Command::posture:
      lay_patient(static_cast<Posture>(press.value), control);
      return true;
    case Command::colours:
      person_.values.theme = EnumNames<ThemeName>::values[static_cast<std::size_t>(press.value)];
      take_theme(person_.values.theme);
      return true;
    case Command::lift:
      lifting_ = true;
      return false;
    case Command::layout:
      wanted_ = next_layout(wanted_);
      person_.values.layout = EnumNames<Layout>::values[static_cast<std::size_t>(wanted_)];
      if (lay_out(false, 0).why.empty()) {
        control.say([&] { return filled(tr("layout: {name}"), {{"name", tr(person_.values.layout)}}); });
      } else {
        control.say(layout_.why);
      }
      return true;
    case Command::full_screen:
      shell_.toggle_full_screen();
      person_.values.full_screen = shell_.full_screen();
      return true;
    case Command::hand_page:
    case Command::settings:
      focus_ = Focus::settings;
      settings_.show(c == Command::hand_page ? SettingsPage::controls : settings_.page(), c == Command::hand_page);
      return true;

    case Command::wheel:
      show_wheel();
      return true;
    case Command::ruler:
      ruler_.turn(!ruler_.on());
      control.say([&] { return ruler_.on() ? tr("ruler: click two points on the bone") : tr("ruler put away"); });
      return true;
    case Command::mark:
      // Where the mouse is; a button in the panel: where the burr is.
      writing_ = bone ? *bone : from_floats(control.rehearsal().latest().device.position_mm);
      note_text_.clear();
      note_answer_ = 0;
      write_focus_ = true;
      return true;
    case Command::reset:
      asking_ = true;
      return true;
    case Command::undo:
      undone_ = true;
      return false;
    case Command::put_away:
      if (palette_.shown() != CommandPalette::Shown::nothing) {
        palette_.show(CommandPalette::Shown::nothing);
        return true;
      }
      if (ruler_.on()) {
        ruler_.turn(false);
        return true;
      }
      return false;
    default:
      return false;
  }
}

bool MainView::click(std::optional<Vec3> bone, RehearsalControl& control) {
  if (!ruler_.on()) return false;
  if (!bone) {
    control.say([&] { return tr("no bone under the mouse"); }, Message::Rank::hindrance);
    return true;
  }
  if (const auto note = ruler_.click(*bone)) {
    control.rehearsal().note("ruler", *note);
    control.say([&] { return shown_number(*ruler_.length_mm(), 1) + " mm"; });
  }
  return true;
}

void MainView::draw_palette(RehearsalControl& control) {
  const ScreenBox window{0, 0, static_cast<float>(shell_.width()), static_cast<float>(shell_.height())};
  const CommandRow* const row = palette_.draw(window, layout_.view);
  if (row == nullptr) return;
  if (row->command == Command::suck) {
    if (second_hand_)
      latched_.suction = !latched_.suction;
    else
      control.say([&] { return tr("there is no second hand in this session"); }, Message::Rank::hindrance);
  } else if (!row->command || row->held) {
    control.say([&] {
      const std::string name = shown_name(*row), keys = shown_keys(*row);
      if (keys.empty()) return name;
      return filled(row->held ? tr("{command}: {keys}, held") : tr("{command}: {keys}"),
                    {{"command", name}, {"keys", keys}});
    });
  } else {
    pressed_.presses.push_back({*row->command, row->value, row->shift});
  }
}

// After what is drawn, so that the part is there.
void MainView::give_focus() {
  if (!std::exchange(focus_moved_, false)) return;
  if (focus_ == Focus::bone) return ImGui::SetWindowFocus(nullptr);
  const bool drill = ImGui::FindWindowByName("burr") != nullptr && ImGui::FindWindowByName("burr")->WasActive;
  const char* const names[] = {"", "tray", drill ? "burr" : "instrument", "cuts' foot", "state"};
  ImGuiWindow* const part = ImGui::FindWindowByName(names[static_cast<std::size_t>(focus_)]);
  if (part == nullptr || !part->Active) return;  // no room for it
  ImGui::FocusWindow(part);
  ImGui::NavInitWindow(part, true);
  GImGui->NavDisableHighlight = false;
  GImGui->NavDisableMouseHover = true;
}

}  // namespace osteo::inline app
