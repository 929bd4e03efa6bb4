// What the window shows beside its pictures, drawn from plain values. Private to libs/app/window; ImGui, no GL. What a
// button does is what its key does: it gives the same command.
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "keys.h"
#include "second_hand.h"
#include "state_facts.h"
#include "steps.h"
#include "tool_wheel.h"
#include "view_layout.h"

namespace osteo::inline app {

/// What the hand has, for buttons that show it.
struct HandFacts {
  int burr = 0;      ///< index in burr_library()
  int tool = 0;      ///< HandTools::Tool
  bool saw = false;  ///< in the hand, in place of the burr
  bool latched = false, sucking = false, washing = false, sound = true, before = false, ruler = false;
  bool second_hand = false;  ///< moved by keys
  double burr_share = 1;     ///< of the burr's full speed
  std::size_t undo_steps = 0;
};

/// Presses of buttons, in order; and those held down.
struct Pressed {
  std::vector<Keyboard::Press> presses;
  std::vector<Command> held;
  void press(Command command, int value = 0) { presses.push_back({command, value}); }
};

/// Fields that never change places: force, burr speed, bone below, the nearest structure with a bar that fills as it
/// comes nearer; time, volume and the button that ends. `message`: what there is to tell now, in the strip where that
/// is wide enough, else at the foot of the view.
void draw_state(const ViewLayout& layout, const StateFacts& facts, const std::optional<Message>& message,
                Pressed& pressed);
/// The strip of tools: icons, each with its name and key on hovering. `menu`: the panel is open. `latched`: suction and
/// irrigation, which a click leaves on.
struct Latched {
  bool suction = false, irrigation = false;
};
void draw_tray(const ScreenBox& box, const HandFacts& hand, bool menu, Latched& latched, Pressed& pressed);
/// What belongs to the burr, at the upper left of the view: kind, diameter; unfolded its shape and speed. Where
/// `free_width` of the view, as far as the cuts, has no room for that, its name, which a click unfolds. Its box.
ScreenBox draw_burr_card(const ScreenBox& view, float free_width, const HandFacts& hand, bool& unfolded,
                         Pressed& pressed);
/// The same place for what belongs to another instrument, as high as it needs. `name`: of ImGui's window. Its box.
ScreenBox draw_tool_card(const ScreenBox& view, float free_width, const char* name, const std::string& title,
                         const std::function<void()>& content);
/// Below the cuts on the picture, or empty where none are.
[[nodiscard]] ScreenBox cuts_foot_box(const ViewLayout& layout);
/// Which cut is shown where there is one alone, else which planes they have; and whether what else there is to set is
/// open, which a click changes. `help`: what that is.
struct CutsFoot {
  int chosen = -1;  ///< pressed now
  bool settings = false;
};
CutsFoot draw_cuts_foot(const ScreenBox& box, bool alone, int chosen, bool settings_open, const std::string& help);
/// Where the picture has no room for cuts: a click brings one over it, and away again (`shown`).
void draw_cut_tile(const ScreenBox& box, bool shown, Pressed& pressed);
/// Into a card: what the second hand holds, and the size of its suction tube.
void draw_second_hand(Rehearsal& rehearsal, SecondHand& second, const std::function<void(const LocalText&)>& say);
/// Into the current window: what ends or begins a session.
void draw_apart(Pressed& pressed);
[[nodiscard]] float apart_width();
/// One step at a time at the foot of the view; in a low one its name, which a click unfolds. False: the person has
/// closed it.
/// `card`: the instrument's, which it stands beside in a very low view.
[[nodiscard]] bool draw_next_step(const ScreenBox& view, float free_width, const ScreenBox& card,
                                  const FirstSteps& steps, bool& unfolded);
void draw_wheel(const ToolWheel& wheel);
/// A question in the middle of the window. 1: yes, -1: no, 0: not yet.
[[nodiscard]] int draw_question(int width, int height, const std::string& title, const std::string& text,
                                const std::string& yes);

}  // namespace osteo::inline app
