#include "mouse_trail.h"

#include <utility>

namespace osteo::inline app {

void MouseTrail::part() {
  if (now_.dx != 0 || now_.dy != 0 || now_.wheel != 0 || now_.clicked) past_.push_back(now_);
  now_.dx = now_.dy = now_.wheel = 0;
  now_.clicked = false;
}

void MouseTrail::hold(int modifiers) {
  const bool shift = (modifiers & kShift) != 0, ctrl = (modifiers & kCtrl) != 0, alt = (modifiers & kAlt) != 0;
  if (shift == now_.shift && ctrl == now_.ctrl && alt == now_.alt) return;
  part();
  now_.shift = shift;
  now_.ctrl = ctrl;
  now_.alt = alt;
}

void MouseTrail::move(double x, double y, int modifiers) {
  hold(modifiers);
  if (known_) {
    now_.dx += x - now_.x;
    now_.dy += y - now_.y;
  }
  known_ = true;
  now_.x = x;
  now_.y = y;
}

void MouseTrail::button(int which, bool down, int modifiers) {
  hold(modifiers);
  bool* const button = which == 0 ? &now_.left : which == 1 ? &now_.right : which == 2 ? &now_.middle : nullptr;
  if (button == nullptr || *button == down) return;
  part();
  *button = down;
  now_.clicked = which == 0 && down;
}

void MouseTrail::wheel(double steps, int modifiers) {
  hold(modifiers);
  now_.wheel += steps;
}

std::vector<MouseSpell> MouseTrail::take() {
  std::vector<MouseSpell> spells = std::exchange(past_, {});
  spells.push_back(now_);
  now_.dx = now_.dy = now_.wheel = 0;
  now_.clicked = false;
  return spells;
}

}  // namespace osteo::inline app
