// The first minutes: what a new user does once, ticked off by what came of it. Private to libs/app/window; no
// ImGui.
#pragma once
#include <optional>
#include <string>
#include <vector>

namespace osteo::inline app {

/// What can be seen of a rehearsal, picture by picture.
struct StepFacts {
  double removed_mm3 = 0, sawn_mm3 = 0;
  std::size_t undo_steps = 0, fixtures = 0;
  bool undone = false;     ///< something was taken back in this picture
  bool retracted = false;  ///< the drill has come out of the bone, asked for
  bool pictured = false;   ///< a picture was kept
  bool ended = false;      ///< the session is over, and saved
  double tilted_rad = 0;   ///< the handle, from how the view holds it
  double measured_mm = 0;  ///< by the ruler; 0: nothing
  bool dust = false;       ///< the scene has any: else nothing can be sucked off
  double sucked_mm3 = 0;
  double magnification = 1;
};

struct Step {
  const char* text;  ///< of the catalogue: its name, a colon, what to do
  bool possible = true, done = false;
  [[nodiscard]] std::string words() const;  ///< in the language, with its keys
  [[nodiscard]] std::string name() const;   ///< what stands before the colon
  [[nodiscard]] std::string how() const;    ///< what follows it
};

class FirstSteps {
 public:
  FirstSteps();
  /// Another session has begun: what was done stays done.
  void renew() { first_.reset(); }
  void see(const StepFacts& facts);
  [[nodiscard]] const std::vector<Step>& steps() const { return steps_; }
  /// The first that is possible and not done; -1: all are.
  [[nodiscard]] int next() const;

 private:
  std::vector<Step> steps_;
  std::optional<StepFacts> first_;
};

}  // namespace osteo::inline app
