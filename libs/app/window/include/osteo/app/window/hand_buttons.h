// Buttons, switches and keys that a person has given something to do: what each does, and what it is called.
#pragma once
#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/param.h"

namespace osteo::inline app {

/// What a button can be given to do. camera: the mouse or the device moves the camera; second_hand: the mouse moves the
/// second hand.
enum class HandFunction : int {
  drill,
  clutch,
  wrist_rest,
  second_hand,
  camera,
  suck,
  water,
  undo,
  bring,
  lift,
  other_burr,
  larger_burr,
  smaller_burr,
  tool_wheel,
  faster,
  slower,
  finer,
  coarser,
  straight
};
[[nodiscard]] constexpr std::array<std::string_view, 19> enum_names(HandFunction) {
  return {"drill",  "clutch",   "wrist_rest", "second_hand", "camera",      "suction",      "irrigation",
          "undo",   "approach", "retract",    "other_burr",  "larger_burr", "smaller_burr", "tool_wheel",
          "faster", "slower",   "finer",      "coarser",     "straight"};
}

/// A button is a number: a key as GLFW numbers keys (32 to 348), or one of these and its own number from 0.
namespace button {
inline constexpr int kPedal = 1000;   ///< a switch of a foot pedal: "pedal 1" is the left one
inline constexpr int kDevice = 1100;  ///< a button of the device that moves the drill
inline constexpr int kMouse = 1200;   ///< "mouse 4" and "mouse 5": beside the thumb; the first three have their work
inline constexpr int kPad = 1300;     ///< of a gamepad, and its two triggers
inline constexpr int kStick = 1400;   ///< a button of another joystick, such as a pedal that acts as one
inline constexpr int kAxis = 1500;    ///< an axis of it: how far down, from its end at -1
inline constexpr int kPadRightTrigger = kPad + 16;
}  // namespace button

/// "key F13", "pedal 1", "device 2", "mouse 4", "pad A", "stick 3", "axis 2".
[[nodiscard]] std::string button_name(int button);
/// The other way; nothing where no button is called so.
[[nodiscard]] std::optional<int> button_named(std::string_view name);

/// One thing for each button; a thing may have several buttons, and is done while any of them is down.
class HandButtons {
 public:
  /// As they are until a person changes them: pedals drill, clutch, camera; the device's first button and the pad's
  /// right trigger drill; at the mouse's side clutch and wrist rest.
  [[nodiscard]] static HandButtons usual();
  [[nodiscard]] std::optional<HandFunction> function(int button) const;
  /// Returns what it did before.
  std::optional<HandFunction> assign(int button, HandFunction function);
  void clear(int button) { all_.erase(button); }
  [[nodiscard]] std::vector<int> buttons_of(HandFunction function) const;
  [[nodiscard]] const std::map<int, HandFunction>& all() const { return all_; }
  /// Of the buttons numbered from `first`, those that do it, as bits.
  [[nodiscard]] unsigned mask(int first, HandFunction function) const;
  friend bool operator==(const HandButtons&, const HandButtons&) = default;

 private:
  std::map<int, HandFunction> all_;
};

}  // namespace osteo::inline app
