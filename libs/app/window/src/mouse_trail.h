// What the mouse did between two pictures, in order. Private to libs/app/window; no screen.
#pragma once
#include <vector>

namespace osteo::inline app {

/// The mouse for as long as its buttons and modifiers stayed as they were.
struct MouseSpell {
  double x = 0, y = 0;                               ///< where it was at the end, in pixels of the window
  double dx = 0, dy = 0;                             ///< how far it went
  double wheel = 0;                                  ///< steps, away from the person
  bool left = false, right = false, middle = false;  ///< down
  bool shift = false, ctrl = false, alt = false;     ///< down
  bool clicked = false;  ///< the left button went down at its beginning, at (x - dx, y - dy)
};

/// Pictures may be slow: within one a button may go down, drag and come up again, and a click is where it was, not
/// where the mouse has gone since.
class MouseTrail {
 public:
  enum Modifiers : int { kShift = 1, kCtrl = 2, kAlt = 4 };  ///< as GLFW numbers them

  void move(double x, double y, int modifiers);
  /// 0 left, 1 right, 2 middle; others are no part of it.
  void button(int which, bool down, int modifiers);
  void wheel(double steps, int modifiers);
  /// Since the last call, the first spell first: those in which something happened, and what is now. At least one.
  [[nodiscard]] std::vector<MouseSpell> take();

 private:
  // What went on before is a spell of its own.
  void hold(int modifiers);
  void part();
  std::vector<MouseSpell> past_;
  MouseSpell now_;
  bool known_ = false;  // where the mouse is
};

}  // namespace osteo::inline app
