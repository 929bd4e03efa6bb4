// One hand led by another: what a teacher's hand, recorded or far away, does to the hand of who learns.
#pragma once
#include <cstddef>
#include <cstdint>

#include "osteo/simulation/bone/action.h"
#include "osteo/simulation/haptics/device.h"
#include "osteo/simulation/haptics/guard.h"
#include "osteo/simulation/haptics/stream.h"

namespace osteo::inline simulation {

/// Who leads whom, and how. Without a limit, a share of force, and with contact of its own: nobody is led.
struct HandGuide {
  std::uint32_t hand = 0;    ///< that is led
  std::uint32_t leader = 1;  ///< another
  double stiffness_n_per_mm =
      0;  ///< of the spring between them; negative: it pushes away, which amplifies an error. -10 to 10
  double damping_n_s_per_m =
      0;               ///< of their velocities' difference; where it pushes away, of the hand's own velocity. 0 to 100
  double forward = 0;  ///< share of the leader's force that the hand feels too, less the farther they are apart
  double most_n = 0;   ///< all that leads it together. 0 to 20
  double dead_zone_mm = 0;  ///< so far apart they may be
  bool own_contact = true;  ///< the hand meets bone itself; false: it feels nothing but what leads it
  double brake_n_s_per_m =
      0;  ///< of the hand's own velocity: what bears a spring to a leader that is heard of late. 0 to 100

  [[nodiscard]] bool on() const { return most_n > 0 || forward != 0 || !own_contact; }
  friend bool operator==(const HandGuide&, const HandGuide&) = default;
};

/// As it is recorded, and back.
[[nodiscard]] SceneAction action_of(const HandGuide& guide);
[[nodiscard]] HandGuide guide_of(const SceneAction& action);

/// F = Kp (x_leader - x) + Bp (v_leader - v) + g F_leader. (D. Morris 2006, section 3.4.1 has the first and the last
/// term, the spring with a sign that repels.) Kp is at most half of what a sampled wall may have before this device, so
/// that a wall and the spring together stay within what is stable. Velocities by differences, smoothed over kSmoothS.
/// The leader's sample says how much of it there is (LeadBits), so ramps, fading and a lost link follow from recorded
/// samples. The brake is within the limit too, and so is the leader's force: of that no more is forwarded than a spring
/// as stiff as the device bears has at kNearMm, and it is gone where hand and leader are kNearMm apart (beyond the dead
/// zone): a force that does not give way would carry the hand off, since position and force cannot both be given. While
/// the leader's time stands still, its force fades over kFadeS. Pushing away: at most kAwayN and kAwayStiffness, no
/// more than 5/s of the damping, not within kAwayClearanceMm of a critical structure, not above kAwayMmPerS. No
/// allocation. The same input gives the same bits.
class GuideLaw {
 public:
  static constexpr double kSmoothS = 0.003, kFadeS = 0.05, kNearMm = 0.8;
  static constexpr double kAwayN = 1, kAwayStiffness = 0.05, kAwayClearanceMm = 3, kAwayMmPerS = 50;

  struct Hand {
    float clearance_mm = 1e9F;  ///< to the nearest critical structure, in the tick before; far where there is none
  };
  /// `device`: of the hand that is led.
  void set(const HandGuide& guide, const DeviceTraits& device, double contact_damping_n_s_per_m,
           double tick_s) noexcept;
  [[nodiscard]] const HandGuide& guide() const { return guide_; }
  /// The force on the hand at `at_mm`. A leader that is not a number, or was not heard of for long (age_ms 255): none.
  Vec3 step(Vec3 at_mm, const Hand& hand, const DeviceSample& leader, Vec3 leader_force_n, double dt_s) noexcept;
  /// What the device bears of what was asked for.
  [[nodiscard]] double stiffness_n_per_mm() const { return stiffness_; }

 private:
  HandGuide guide_;
  double stiffness_ = 0, borne_ = 0, share_ = 0;  // borne: N/mm, of what leads a hand by this device
  Vec3 last_apart_, last_at_, rate_, speed_;      // apart: from the hand to its leader
  bool started_ = false;
};

// -- Where a scripted hand wants to be at a time: what ScriptedDevice follows, for those that follow it otherwise.

/// On the straight way between waypoints; behind the last, there with the pedal up. `leg`: 0 at the first call, kept
/// for the next, whose time is not earlier. O(1) from tick to tick.
[[nodiscard]] HandGoal goal_at(const Strokes& strokes, double t_s, std::size_t& leg) noexcept;

}  // namespace osteo::inline simulation
