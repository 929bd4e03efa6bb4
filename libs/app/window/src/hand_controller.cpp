#include "hand_controller.h"

#include <algorithm>

#include "osteo/core/base/translate.h"

namespace osteo::inline app {

bool HandController::key(int code, int action) {
  if (!assign_.listens()) return false;
  if (action == 1) said_ = assign_.take(code, person_.buttons);
  // What was down before it listened must be able to come up.
  return action != 0;
}

void HandController::read(std::vector<ButtonLevel> levels, bool attended, const WindowActions& actions,
                          RehearsalControl& control) {
  if (attended_ && !attended) {
    keyboard_.let_go();
    if (control.latched()) control.say([&] { return tr("another window has the keys: the drill is off"); });
    control.latch(false);
  }
  attended_ = attended;
  const auto any = [&](int from, int to) {
    return std::any_of(levels.begin(), levels.end(),
                       [&](const ButtonLevel& l) { return l.button >= from && l.button < to; });
  };
  pad_there_ = any(button::kPad, button::kStick);
  stick_there_ = any(button::kStick, button::kAxis + 100);
  const std::optional<std::uint32_t> switches = actions.switches ? actions.switches(attended) : std::nullopt;
  pedal_there_ = switches.has_value();
  for (int n = 0; pedal_there_ && n < 3; ++n)
    levels.push_back({button::kPedal + n, (*switches >> n & 1U) != 0 ? 1.0 : 0.0});
  device_there_ = control.moves_by_itself();
  if (device_there_) {
    const std::uint32_t down = control.rehearsal().latest().device.buttons;
    for (int n = 0; n < 8; ++n) levels.push_back({button::kDevice + n, (down >> n & 1U) != 0 ? 1.0 : 0.0});
  }
  watch_.frame(levels, attended, person_.buttons, keyboard_);
  if (assign_.listens() && watch_.pressed()) {
    said_ = assign_.take(*watch_.pressed(), person_.buttons);
    // It does it from its next press on.
    keyboard_.on(*watch_.pressed(), Keyboard::Event::released);
  }
}

void HandController::give(RehearsalControl& control) const {
  const PersonValues& v = person_.values;
  control.motion().one_to = static_cast<int>(v.motion_one_to);
  control.motion().rest_share = v.wrist_rest;
  control.handle().set_left(v.left_handed);
  control.burr_share = v.burr_share;
}

void HandController::take(const RehearsalControl& control) {
  person_.values.motion_one_to = control.motion().one_to;
  person_.values.burr_share = control.burr_share;
}

HandInput HandController::input(const RehearsalControl& control) const {
  HandInput in;
  in.drill =
      std::max(keyboard_.held(Command::pedal) ? 1.0 : 0.0, watch_.drill(person_.buttons, control.moves_by_itself()));
  in.clutch = keyboard_.held(Command::clutch);
  in.wrist_rest = keyboard_.held(Command::wrist_rest);
  in.second_hand = keyboard_.held(Command::second_mouse);
  return in;
}

HandTuning HandController::tuned(HandTuning t) const {
  const HandButtons& b = person_.buttons;
  t.drill_buttons = b.mask(button::kDevice, HandFunction::drill);
  t.drill_switches = b.mask(button::kPedal, HandFunction::drill);
  t.clutch_switches = b.mask(button::kPedal, HandFunction::clutch);
  return t;
}

bool HandController::there(int button) const {
  if (button < button::kPedal || (button >= button::kMouse && button < button::kPad)) return true;
  if (button < button::kDevice) return pedal_there_;
  if (button < button::kMouse) return device_there_;
  return button < button::kStick ? pad_there_ : stick_there_;
}

}  // namespace osteo::inline app
