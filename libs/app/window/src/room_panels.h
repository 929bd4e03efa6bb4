// What the window shows beside its pictures, drawn from plain values. Private to libs/app/window; ImGui, no GL. What a
// button does is what its key does: it gives the same command.
#pragma once
#include <string>
#include <vector>

#include "keys.h"
#include "room_layout.h"
#include "state_facts.h"
#include "steps.h"
#include "tool_wheel.h"

namespace osteo::inline app {

/// What the hand has, for buttons that show it.
struct HandFacts {
  int burr = 0;      ///< index in burr_library()
  int tool = 0;      ///< HandTools::Tool
  bool saw = false;  ///< in the hand, in place of the burr
  bool latched = false, sucking = false, washing = false, sound = true, before = false, ruler = false;
  bool second_hand = false;  ///< moved by keys
  std::size_t undo_steps = 0;
};

/// Presses of buttons, in order; and those held down.
struct Pressed {
  std::vector<Keyboard::Press> presses;
  std::vector<Command> held;
  void press(Command command, int value = 0) { presses.push_back({command, value}); }
};

/// Two rows whose fields never change places: tool and speed, force, bone under the burr, the nearest structure; below,
/// what was removed, the time and a line of words. `message`: the last thing said, empty after a while; see
/// warning_is_reported().
void draw_state(const ScreenBox& box, const StateFacts& facts, const std::string& message);
/// Buttons of instruments one below the other.
void draw_tray(const ScreenBox& box, const HandFacts& hand, Pressed& pressed);
/// Into the current window: the burr and the hand.
void draw_burr(const HandFacts& hand, Pressed& pressed);
/// Into the current window: what one does, and, apart from it, what cannot be taken back.
void draw_deeds(const HandFacts& hand, Pressed& pressed);
void draw_apart(Pressed& pressed);
/// Into the current window: the list of the first five minutes; the next of them in full, or all. Two beside each other
/// where there is room.
void draw_first_steps(const FirstSteps& steps, bool all_in_full);
void draw_wheel(const ToolWheel& wheel);
/// A question in the middle of the window. 1: yes, -1: no, 0: not yet.
[[nodiscard]] int draw_question(int width, int height, const std::string& title, const std::string& text,
                                const std::string& yes);

}  // namespace osteo::inline app
