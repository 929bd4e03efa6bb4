// How long it takes to bring the camera to a given view, by mode of control: the same targets and the same measure for
// a person in the window and for a simulated one. The thesis (8.2.2) saw surgeons lose most time there and hoped for
// such a study.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "osteo/simulation/camera/scope_control.h"

namespace osteo::inline simulation {

/// When a view counts as reached: for hold_s without a break.
struct TrialTolerance {
  double place = 0.1;  ///< between the foci, of the target's field
  double angle_rad = 0.0873;
  double zoom = 1.15;
  double hold_s = 0.5;
};
[[nodiscard]] bool close_to(const ScopeView& view, const ScopeView& target, const TrialTolerance& tolerance);

/// Views such as an operation asks for: upright, the focus up to 25 mm from where `start` has it, seen from up to 45
/// degrees off, at 4, 6 or 10 times. The same for the same seed, on any machine.
[[nodiscard]] std::vector<ScopeView> camera_targets(const ScopeView& start, std::size_t count, std::uint64_t seed);

struct TrialResult {
  double seconds = 0;
  bool reached = true;
  unsigned moves = 0;  ///< of hand, wheel, flights
  ScopeControl::Moves by_kind{};
};

/// Target after target, in real time.
class CameraTrial {
 public:
  CameraTrial(std::vector<ScopeView> targets, const TrialTolerance& tolerance = {})
      : targets_(std::move(targets)), tolerance_(tolerance) {}
  /// Null when all were reached.
  [[nodiscard]] const ScopeView* target() const {
    return results_.size() < targets_.size() ? &targets_[results_.size()] : nullptr;
  }
  [[nodiscard]] std::size_t count() const { return targets_.size(); }
  /// Each frame. True when the target was reached with it; the time to hold it does not count.
  bool advance(const ScopeControl& control, double seconds);
  /// Nobody reaches it; the next.
  void give_up(const ScopeControl& control);
  [[nodiscard]] const std::vector<TrialResult>& results() const { return results_; }
  [[nodiscard]] double seconds() const { return seconds_; }

 private:
  void note(const ScopeControl& control, bool reached);
  std::vector<ScopeView> targets_;
  TrialTolerance tolerance_;
  std::vector<TrialResult> results_;
  ScopeControl::Moves before_{};
  double seconds_ = 0, held_s_ = 0;
};

enum class CameraMode : int { mouse, point, device, six, rate, bookmarks };
[[nodiscard]] constexpr std::array<std::string_view, 6> enum_names(CameraMode) {
  return {"mouse", "point", "device", "six", "rate", "bookmarks"};
}

/// A model of a person, not a person. Moves come one after the other (sub-movements): each aims at the whole of the
/// error in what the hand has hold of, ends off by a share of its length, and is followed by a look; another grip takes
/// time. Velocity of a move: minimum jerk. The numbers are of the order that the literature has for hands (keystroke
/// level: key 0.2 s, pointing 1.1 s, deciding 1.35 s; choice reaction about 0.25 s), but chosen, not fitted to anybody.
struct SimulatedPerson {
  double reaction_s = 0.25;  ///< look, before each move
  double grip_s = 0.35;      ///< another button, key, mode
  double key_s = 0.2, point_s = 1.1, decide_s = 1.35;
  double least_move_s = 0.3;
  double hand_mm_s = 250;                  ///< peak
  double wrist_rad_s = 1.5;                ///< peak
  double noise = 0.1;                      ///< standard deviation of a move's end, of its length; each axis
  double crosstalk = 0.15;                 ///< what axes nobody meant get of the others, six degrees and rates
  double reach_mm = 120, wrist_rad = 0.9;  ///< of a device, before it must be clutched
  double clutch_s = 0.6;
  double wheel_step_s = 0.12;
  double most_s = 60;  ///< then it is given up
};

/// One mode, all targets one after the other, each from where the last ended; 60 pictures a second through the window's
/// own ScopeControl.
[[nodiscard]] std::vector<TrialResult> simulate_trial(CameraMode mode, const ScopeView& start,
                                                      const std::vector<ScopeView>& targets,
                                                      const SimulatedPerson& person, std::uint64_t seed,
                                                      const TrialTolerance& tolerance = {});

struct TrialSummary {
  std::size_t targets = 0, missed = 0;
  double median_s = 0, p90_s = 0, mean_moves = 0;
};
/// Of those that were reached; zeros where none was.
[[nodiscard]] TrialSummary summary_of(const std::vector<TrialResult>& results);

/// A header and a line for each: target, reached, seconds, moves by kind.
[[nodiscard]] std::string trial_csv(const std::vector<TrialResult>& results);

}  // namespace osteo::inline simulation
