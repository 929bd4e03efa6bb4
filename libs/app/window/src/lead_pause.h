// The drill finds its way with nobody at it: who leads the hand lets go of it meanwhile. Private to libs/app/window; no
// GLFW, no ImGui, no VTK.
#pragma once
#include "osteo/app/window/rehearsal_window.h"

namespace osteo::inline app {

/// Lets the hand go where the person has it led, and has it led again. `actions` lives as long.
class LeadPause {
 public:
  explicit LeadPause(const WindowActions& actions) : actions_(actions) {}

  /// True: it was led, and is let go now, softly.
  bool begin() {
    if (on_ || !actions_.tutor || !actions_.lead) return false;
    const TutorNow now = actions_.tutor();
    if (!now.leads || !now.guiding) return false;
    actions_.lead(false);
    note("{\"on\":false}");
    return on_ = true;
  }
  [[nodiscard]] bool on() const { return on_; }
  /// What pulled it has not faded yet.
  [[nodiscard]] bool pulled() const { return on_ && actions_.tutor().pull > 0; }
  /// True: it had been let go by begin(), and is led again.
  bool end() {
    if (!on_) return false;
    on_ = false;
    actions_.lead(true);
    note("{\"on\":true}");
    return true;
  }

 private:
  void note(const char* json) const {
    if (Rehearsal* const r = actions_.rehearsal ? actions_.rehearsal() : nullptr) r->note("lead", json);
  }
  const WindowActions& actions_;
  bool on_ = false;
};

}  // namespace osteo::inline app
