#include "button_watch.h"

#include <algorithm>

namespace osteo::inline app {
namespace {

// Between the two it stays as it was: a trigger that trembles at the edge is not pressed again and again.
constexpr double kDown = 0.15, kUp = 0.08;

}  // namespace

ButtonWatch::State& ButtonWatch::state_of(int button) {
  const auto at = std::find_if(all_.begin(), all_.end(), [&](const State& s) { return s.button == button; });
  if (at != all_.end()) return *at;
  // One that is down when it is first heard of has been down before: an axis that rests there, a pedal under a foot.
  all_.push_back({button, 0, false, true});
  return all_.back();
}

void ButtonWatch::frame(std::span<const ButtonLevel> levels, bool attended, const HandButtons& buttons,
                        Keyboard& keyboard) {
  pressed_.reset();
  const auto notify = [&](int button, Keyboard::Event event) {
    // One that was given another thing to do while it was down is let go all the same.
    if (event == Keyboard::Event::pressed && buttons.function(button) == HandFunction::drill) return;
    keyboard.on(button, event);
  };
  std::erase_if(all_, [&](const State& s) {
    const bool gone =
        std::none_of(levels.begin(), levels.end(), [&](const ButtonLevel& l) { return l.button == s.button; });
    if (gone && s.down) notify(s.button, Keyboard::Event::released);
    return gone;
  });
  for (const ButtonLevel& l : levels) {
    State& s = state_of(l.button);
    const bool was = s.down;
    const double level = std::clamp(l.level, 0.0, 1.0);
    if (level < kUp) s.waits = false;
    if (!attended && level >= kUp) s.waits = true;
    s.down = !s.waits && attended && (was ? level >= kUp : level > kDown);
    s.level = s.down ? level : 0;
    if (s.down != was) notify(s.button, s.down ? Keyboard::Event::pressed : Keyboard::Event::released);
    if (s.down && !was) pressed_ = s.button;
  }
}

double ButtonWatch::drill(const HandButtons& buttons, bool by_device) const {
  double most = 0;
  for (const State& s : all_) {
    const bool own = s.button >= button::kPedal && s.button < button::kMouse;
    if (s.down && !(own && by_device) && buttons.function(s.button) == HandFunction::drill)
      most = std::max(most, s.level);
  }
  return most;
}

}  // namespace osteo::inline app
