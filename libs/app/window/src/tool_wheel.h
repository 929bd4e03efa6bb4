// The wheel of tools: what lies in which direction from where it was opened. Private to libs/app/window; no ImGui.
#pragma once
#include <span>

#include "keys.h"

namespace osteo::inline app {

struct WheelItem {
  const char* word;
  Command command;
  int value = 0;
};
/// Clockwise from above.
[[nodiscard]] std::span<const WheelItem> wheel_items();

class ToolWheel {
 public:
  [[nodiscard]] bool open() const { return open_; }
  /// Where its middle is: at the mouse, as far as the box lets it.
  void show(float x, float y);
  [[nodiscard]] float x() const { return x_; }
  [[nodiscard]] float y() const { return y_; }
  void close() { open_ = false; }
  /// The mouse, in heights of text from the middle: within kInnerEm it chooses nothing new.
  void point(float right_em, float down_em);
  void turn(int items);  ///< by keys
  /// -1: none.
  [[nodiscard]] int chosen() const { return chosen_; }
  static constexpr float kInnerEm = 2, kOuterEm = 9.5F;

 private:
  bool open_ = false;
  float x_ = 0, y_ = 0;
  int chosen_ = -1;
};

}  // namespace osteo::inline app
