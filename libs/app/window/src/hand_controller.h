// The person's hand: what was chosen for it, and what pedals, buttons and keys do to it. Private to
// libs/app/window.
#pragma once
#include <string>
#include <vector>

#include "button_assign.h"
#include "button_watch.h"
#include "osteo/simulation/haptics/device.h"
#include "rehearsal_control.h"

namespace osteo::inline app {

class HandController {
 public:
  HandController(PersonSettings& person, Keyboard& keyboard) : person_(person), keyboard_(keyboard) {
    keyboard_.bind(&person_.buttons);
  }

  /// Each key as it goes down or up; true: it is being given something to do.
  bool key(int code, int action);
  /// What is down beside keys, in this frame: `levels` of pads and the mouse; pedal and device are asked for here.
  /// Before the keyboard is asked for this frame. `attended`: the window has the keys.
  void read(std::vector<ButtonLevel> levels, bool attended, const WindowActions& actions, RehearsalControl& control);
  /// The choices into the control, before its frame; and back, when keys have changed them.
  void give(RehearsalControl& control) const;
  void take(const RehearsalControl& control);
  /// What buttons do to the hand in this frame: all of it but the mouse's own.
  [[nodiscard]] HandInput input(const RehearsalControl& control) const;
  /// The same with what a device's own buttons and switches do.
  [[nodiscard]] HandTuning tuned(HandTuning tuning) const;

  [[nodiscard]] const ButtonAssign& assign() const { return assign_; }
  /// The row of the page that the keys' cursor is on; empty: on none.
  [[nodiscard]] const std::string& row() const { return row_; }
  [[nodiscard]] bool mirror_mouse() const { return person_.values.mirror_mouse; }
  /// Into the current ImGui window: the handle, and what pedals, buttons and keys do. Not drawn any more, it listens to
  /// none.
  void draw(RehearsalControl& control);
  void leave() {
    assign_.cancel();
    row_.clear();
  }

 private:
  void draw_buttons();
  [[nodiscard]] bool there(int button) const;
  PersonSettings& person_;
  Keyboard& keyboard_;
  ButtonWatch watch_;
  ButtonAssign assign_;
  std::string said_, row_;
  bool attended_ = true, pedal_there_ = false, device_there_ = false, pad_there_ = false, stick_there_ = false;
};

}  // namespace osteo::inline app
