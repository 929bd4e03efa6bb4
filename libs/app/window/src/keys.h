// Which key does what: one table for the window, its help and its tests. Private to libs/app/window; no GLFW, no ImGui,
// no screen.
#pragma once
#include <array>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "osteo/app/window/hand_buttons.h"

namespace osteo::inline app {

enum class Command {
  bring,
  lift,
  deeper,
  back,
  drill,
  diameter,   // value: mm
  burr_kind,  // value: its place in kBurrKinds
  ball,
  cylinder,
  taper,
  suck,
  wash,        // while it is held, as by a pedal
  irrigation,  // on and off
  saw,
  pieces,
  plates,
  turn_left,
  turn_right,
  perform,
  undo,
  put_away,
  mark,
  screenshot,
  save,
  reset,
  home,
  sound,
  quality,
  cut_in_middle,
  cuts_along_tool,
  help,
  quit,
  magnify,  // value: up or down
  focus,    // value: deeper or back
  autofocus,
  look_there,
  look_at_drill,
  guide_camera,
  bookmark,  // value: which
  camera_back,
  orbit_left,
  orbit_right,
  orbit_up,
  orbit_down,
  second_hand,
  layout,
  full_screen,
  settings,    // all that can be chosen, in a dialog
  focus_next,  // the keys go to the next part of the window; with Shift to the one before
  palette,     // search among all commands
  wheel,
  ruler,
  before,
  pedal,         // drills while it is held; as far down as its button is
  clutch,        // the mouse moves without the drill
  wrist_rest,    // the hand moves finely
  second_mouse,  // the mouse moves the second hand
  tilt,          // value: 0 left, 1 right, 2 up, 3 down, as the handle's end goes in the picture
  roll,          // value: 1 clockwise, -1 back
  straight,      // the handle as the view holds it
  motion,        // value: 1 coarser, -1 finer
  burr_speed,    // value: 1 faster, -1 slower
  other_burr,    // of the next kind
  next_burr,     // value: 1 larger, -1 smaller
  hand_page,     // of the settings
  timeline,
  earlier,
  later,
  hints,
  monitor,       // the nerve monitor's window
  mute_monitor,  // and its sound
  regions,       // what the procedure wants removed or left
  lead,          // the own hand is led by another, or not
  posture,       // value: Posture; how the patient lies
  colours,       // value: ThemeName
  simulate,      // value: Simulated; begins, or ends
};

/// Keys that are down with another, as GLFW numbers them.
enum KeyModifier : int { kWithShift = 1, kWithCtrl = 2, kWithAlt = 4 };

struct Key {
  int code;  ///< as GLFW numbers keys
  Command command;
  enum class When { pressed, repeated, held } when = When::pressed;
  int value = 0;
  int with = 0;  ///< Ctrl or Alt, where it needs one
};
[[nodiscard]] std::span<const Key> key_table();
/// What a key does with these modifiers; where they mean nothing to it, what it does alone.
[[nodiscard]] const Key* find_key(int code, int modifiers = 0);

/// The first key that does it (`value`: with this value), as people call it: "F", "Space", "F10"; empty: none.
[[nodiscard]] std::string key_name(Command command, std::optional<int> value = {});
/// Any key: "F", "Space", "keypad 5"; without a name its number, which has three digits.
[[nodiscard]] std::string key_word(int code);

/// What a button that a person has given something to do does, as if it were a key.
struct ButtonCommand {
  Command command;
  int value;
};
[[nodiscard]] ButtonCommand command_of(HandFunction function);

/// Keys as the window's callback reports them. Events, not states: at few pictures a second a short press begins and
/// ends between two frames. ImGui is not asked: until 1.87 it knew keys by the numbers of its backend, since then by
/// its own.
class Keyboard {
 public:
  enum class Event { released = 0, pressed = 1, repeated = 2 };  // as GLFW numbers them
  /// `code`: a key, or another button that `bound` knows; `modifiers`: KeyModifier.
  void on(int code, Event event, int modifiers = 0);
  /// What a person has given keys and buttons to do goes before the table; null: nothing. Must outlive the keyboard.
  void bind(const HandButtons* bound) { bound_ = bound; }
  /// Nothing is down any more: another window has the keys now.
  void let_go() { down_.clear(); }
  struct Press {
    Command command;
    int value;
    bool shift = false;  ///< was down with it; at few pictures a second it is up again when the press is heard of
  };
  /// What was pressed since the last frame, in order; with `ignore` (someone writes text) nothing, and nothing is held.
  [[nodiscard]] std::vector<Press> frame(bool ignore);
  /// In this frame, also when it was let go again before it.
  [[nodiscard]] bool held(Command command) const;

 private:
  // By code: of two keys for one thing, one may be let go.
  struct Down {
    int code;
    Command command;
  };
  const HandButtons* bound_ = nullptr;
  std::vector<Press> presses_;
  std::vector<Down> down_;
  std::vector<Command> since_, held_;
};

}  // namespace osteo::inline app
