// How a recorded session is played back.
#pragma once
#include "osteo/core/base/param.h"

namespace osteo::inline network {

/// What the hand of who learns feels of the lesson.
enum class PlaybackMode : int {
  show,      ///< led along, with the expert's forces; bone itself is not felt
  feel,      ///< not led: bone as the expert's drill leaves it
  guide,     ///< led along, and bone is felt
  fading,    ///< led less the better it goes
  amplify,   ///< pushed away from the way, a little, outside the dead zone
  graphics,  ///< not led: the way is drawn
};
[[nodiscard]] constexpr std::array<std::string_view, 6> enum_names(PlaybackMode) {
  return {"show", "feel", "guide", "fading", "amplify", "graphics"};
}
/// Whose burr takes the bone away; `usual`: the expert's in show, feel and guide, the learner's in the others.
enum class WhoDrills : int { usual, expert, learner };
[[nodiscard]] constexpr std::array<std::string_view, 3> enum_names(WhoDrills) {
  return {"usual", "expert", "learner"};
}
/// How time goes; `usual`: in real time in show and feel, along the way in the others.
enum class Pace : int { usual, clock, way };
[[nodiscard]] constexpr std::array<std::string_view, 3> enum_names(Pace) {
  return {"usual", "clock", "way"};
}

struct PlaybackParams {
  using Params = PlaybackParams;
  PlaybackMode mode = PlaybackMode::show;
  WhoDrills drills = WhoDrills::usual;
  Pace pace = Pace::usual;
  double stiffness_n_per_mm = 1;
  double damping_n_s_per_m = 2;
  double forward = 1;
  double most_n = 3;
  double dead_zone_mm = 1;
  double tolerance_radius_mm = 2;
  double ramp_s = 1;
  double forget = 0.85;
  double trial_s = 5;

  static void describe(PlaybackParams& p, auto& visit) {
    visit({"mode",
           "show: led, with the expert's forces; feel: bone alone; guide: led, and bone; fading: led less the better "
           "it goes; amplify: "
           "pushed away from the way; graphics: the way is drawn, and nothing else"},
          p.mode);
    visit({"drills",
           "whose burr takes bone away; usual: the expert's in show, feel and guide, so that bone is as recorded"},
          p.drills);
    visit(
        {"pace",
         "clock: as recorded, but who is led and farther away than the tolerance radius is waited for; way: time waits "
         "and goes back with who "
         "learns; usual: clock in show and feel"},
        p.pace);
    visit({"stiffness_n_per_mm", "stiffness of the spring to the expert's hand, lowered where the device bears less",
           "N/mm", 0, 10},
          p.stiffness_n_per_mm);
    visit({"damping_n_s_per_m", "damping between the two hands", "N s/m", 0, 100}, p.damping_n_s_per_m);
    visit({"forward", "show: share of the expert's force that is felt (0: none), less the farther the hand is away", "",
           0, 2},
          p.forward);
    visit({"max_force_n", "all that leads the hand is no more", "N", 0, 20}, p.most_n);
    visit({"dead_zone_mm", "fading, amplify: apart so far counts as right; with --experts it is measured", "mm", 0, 20},
          p.dead_zone_mm);
    visit({"tolerance_radius_mm", "farther from who is led time waits; pace way: twice as far behind it goes back",
           "mm", 0.2, 50},
          p.tolerance_radius_mm);
    visit({"ramp_s", "over which the pull comes and goes", "s", 0.01, 10}, p.ramp_s);
    visit({"forget", "fading: of the pull, what is left after a trial without errors", "", 0, 0.99}, p.forget);
    visit({"trial_s", "fading: length of a trial, in the lesson's time", "s", 0.5, 600}, p.trial_s);
  }
};

/// Whether hands are led at all, by whom bone is taken, how time goes: as `usual` resolves.
[[nodiscard]] bool leads(const PlaybackParams& p);
[[nodiscard]] bool expert_drills(const PlaybackParams& p);
[[nodiscard]] bool by_clock(const PlaybackParams& p);

}  // namespace osteo::inline network
