// Hints while one drills: turned on and off, shown at one place, told to the session. Private to libs/app/window.
#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "osteo/app/window/person_settings.h"
#include "osteo/assessment/scoring/hint_reader.h"
#include "osteo/session/scene/rehearsal.h"
#include "view_layout.h"

namespace osteo::inline app {

/// Those that a person has not turned off by name; `off`: names with commas between them, as the settings keep them.
[[nodiscard]] std::vector<HintRule> hints_left(const std::vector<HintRule>& rules, const std::string& off);
/// `off` with a name in it or not, the others as they were.
[[nodiscard]] std::string with_hint(const std::string& off, const std::string& id, bool on);
/// The value of a "hint" note.
[[nodiscard]] std::string hint_note(const Hint& hint);

/// Off it is no reader of the rehearsal and costs nothing.
class HintController {
 public:
  /// How long a hint is shown.
  static constexpr double kShownS = 4;
  explicit HintController(PersonSettings& person) : person_(person) {}

  /// Another rehearsal runs; the one before has ended.
  void follow(Rehearsal& rehearsal);
  /// Before the rehearsal it follows goes on without it.
  void leave();
  void turn(bool on);
  [[nodiscard]] bool on() const { return person_.values.hints; }
  /// A picture: follows what the person has chosen, takes up what was said, which the session is told; `now_s` by any
  /// clock.
  void frame(Vec3 eye_mm, double now_s);
  /// What is shown now; empty: nothing.
  [[nodiscard]] const std::string& words() const { return words_; }
  /// At the upper edge of what is free of the picture.
  void draw(const ScreenBox& room) const;

 private:
  void join();
  PersonSettings& person_;
  Rehearsal* rehearsal_ = nullptr;
  std::unique_ptr<HintReader> reader_;
  std::string joined_off_;  // what the reader leaves out
  std::string words_;
  double until_s_ = 0;
};

}  // namespace osteo::inline app
