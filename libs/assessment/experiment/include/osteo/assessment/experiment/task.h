// One run along a path: the forces on the hand, and what is recorded of it (D. Morris 2006, section 4.2.4).
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "osteo/assessment/experiment/protocol.h"
#include "osteo/simulation/haptics/device.h"
#include "osteo/simulation/haptics/guard.h"
#include "osteo/simulation/haptics/stream.h"

namespace osteo::inline assessment::experiment {

/// As printed (its damping in N/mm lacks the second). What the device cannot bear is made smaller: springs by
/// safe_stiffness_n_per_mm, dampers to half of what a mass moves by in a tick, since the velocity comes a tick late.
struct TaskGains {
  double path_n_per_mm = 0.9, path_n_s_per_mm = 0.1;
  double plane_n_per_mm = 2.0, plane_n_s_per_mm = 0.3;
  double moving_mass_kg = 0.25;  ///< of arm and hand, at the tip: a guess, the dissertation does not say
};
[[nodiscard]] TaskGains safe_gains(const TaskGains& wanted, const DeviceTraits& device, double rate_hz);

/// What a run is for: a training, or the test behind it.
enum class RunKind : int { training, test };

/// What can be seen of a run, as of a tick.
struct TaskView {
  double t_s = 0;  ///< since the path began; negative while the hand is brought to its beginning
  Vec3 hand_mm;
  double path_x_mm = 0, path_z_mm = 0;  ///< where the path is now
  double target_n = 0, applied_n = 0;   ///< downwards; applied: what the plane takes, 0 where there is none
  bool saturated = false;               ///< of the device, now
  bool done = false;
};

/// Called once a tick, by one thread. step() allocates nothing. x: right, y: up, z: towards the person.
class ForceTask {
 public:
  /// `stimulus` must outlive it. `lead_s`: time in which the hand is brought from where it is to the path's beginning.
  ForceTask(const Stimulus& stimulus, const Trial& trial, RunKind kind, const TaskGains& gains,
            const DeviceTraits& device, double limit_n, double lead_s = 1);
  /// The force of this tick on the hand and what is recorded. depth_mm: below the plane; normal_force_n: the force that
  /// the hand is taken to apply downwards; flags: kForceCapped where the device was at its limit.
  TickRecord step(std::uint64_t tick, const DeviceSample& sample) noexcept;
  [[nodiscard]] bool done() const { return view_.done; }
  [[nodiscard]] const TaskView& view() const { return view_; }
  /// Ticks of the whole run, and of its lead.
  [[nodiscard]] std::uint64_t ticks() const { return lead_ + stimulus_->force_n.size(); }
  [[nodiscard]] std::uint64_t lead_ticks() const { return lead_; }

 private:
  const Stimulus* stimulus_;
  Trial trial_;
  RunKind kind_;
  TaskGains gains_;
  double dt_s_;
  std::uint64_t lead_;
  double limit_n_;
  Guard guard_;
  TaskView view_;
  std::optional<Vec3> from_mm_;
  Vec3 last_mm_, velocity_;
};

/// No passivity control: the path pulls by itself, so it is meant to put energy in.
[[nodiscard]] GuardParams task_guard(double limit_n);

}  // namespace osteo::inline assessment::experiment
