// Which key does what: one table for the window, its help and its tests. Private to libs/window; no GLFW, no ImGui, no screen.
#pragma once
#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace osteo {

enum class Command {
  bring,
  lift,
  deeper,
  back,
  drill,
  diameter,  // value: mm
  cutting,
  diamond,
  ball,
  cylinder,
  taper,
  suck,
  wash,
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
  panel_keys,
  wheel,
  ruler,
  before,
};

struct Key {
  int code;  ///< as GLFW numbers keys
  Command command;
  enum class When { pressed, repeated, held } when = When::pressed;
  int value = 0;
};
[[nodiscard]] std::span<const Key> key_table();
[[nodiscard]] const Key* find_key(int code);

/// The first key that does it, as people call it: "F", "Space", "F10"; empty: none.
[[nodiscard]] std::string key_name(Command command);

/// A line of the window's help, and the commands it tells of; none: of the mouse.
struct HelpLine {
  const char* keys;
  const char* text;
  std::vector<Command> commands;
};
[[nodiscard]] const std::vector<HelpLine>& help_lines();

/// Keys as the window's callback reports them. Events, not states: at few pictures a second a short press begins and ends between two
/// frames. ImGui is not asked: until 1.87 it knew keys by the numbers of its backend, since then by its own.
class Keyboard {
 public:
  enum class Event { released = 0, pressed = 1, repeated = 2 };  // as GLFW numbers them
  void on(int code, Event event, bool shift = false);
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
  std::vector<Press> presses_;
  std::vector<Command> down_, since_, held_;
};

}  // namespace osteo
