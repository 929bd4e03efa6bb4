// Buttons of pedals, devices, pads and sticks, as if they were keys. Private to libs/app/window; reads none of them
// itself.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "keys.h"

namespace osteo::inline app {

/// How far down a button is: a mere switch 0 or 1, a pedal or a trigger what is between.
struct ButtonLevel {
  int button;
  double level;
};

class ButtonWatch {
 public:
  /// `levels`: of all that is there, in this frame; what is no longer among them is let go (its device is gone).
  /// `attended`: the window has the keys; while it has not all is let go, and what was down then must come up before it
  /// counts again. What drills is not told to the keyboard: see level().
  void frame(std::span<const ButtonLevel> levels, bool attended, const HandButtons& buttons, Keyboard& keyboard);
  /// The farthest down of those that count and drill, 0 to 1. `by_device`: what the device and its pedal press is its
  /// own business.
  [[nodiscard]] double drill(const HandButtons& buttons, bool by_device) const;
  /// A button that went down in the last frame.
  [[nodiscard]] std::optional<int> pressed() const { return pressed_; }

 private:
  struct State {
    int button;
    double level = 0;
    bool down = false, waits = false;  // waits: until it has come up
  };
  [[nodiscard]] State& state_of(int button);
  std::vector<State> all_;
  std::optional<int> pressed_;
};

}  // namespace osteo::inline app
