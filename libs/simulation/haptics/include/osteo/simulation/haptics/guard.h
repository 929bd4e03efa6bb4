// What stands between a computed force and a hand: limits, passivity, fading.
#pragma once
#include <cstdint>

#include "osteo/core/base/param.h"
#include "osteo/core/data/vec.h"

namespace osteo::inline simulation {

/// What is known of the device in the hand; from its driver, or measured.
struct DeviceTraits {
  double damping_n_s_per_m = 1;  ///< its own, at the tip
  double delay_s = 0;            ///< from a pose to the force that answers it, beyond the tick
  double encoder_mm = 0;         ///< quantum of its position
  double max_force_n = 8;
  double max_stiffness_n_per_mm = 1e9;
};

struct GuardParams {
  double max_force_n = 8;
  double max_rate_n_per_s = 4000;  ///< of the force; 0: none
  bool passivity = true;           ///< observer and controller
  double max_damping_n_s_per_m = 30;
  double contact_damping_n_s_per_m = 1;
  double jump_mm = 20;
  double resume_s = 0.1;
  double stale_ms = 10;
  double fade_ms = 40;
  /// Which arithmetic; no setting. 5, or for the replay of sessions whose kernel of contact is less than 6: 4, where
  /// bone at its chuck draws a saw out of its slot (HeldShaft); 3, where besides it slides across it
  /// (ContactModel::hold); 2, which besides damps by the stiffness asked for and not by the real one; 1, where besides
  /// nothing is owed from one contact to the next, and drag may give energy.
  int law = 5;

  static void describe(GuardParams& p, auto& visit) {
    visit({"limit_force_n", "the hand never feels more", "N", 0, 100}, p.max_force_n);
    visit({"limit_rate_n_per_s", "nor a faster change", "N/s", 0, 1e9}, p.max_rate_n_per_s);
    visit({"passivity", "take out energy that sampling puts in"}, p.passivity);
    visit({"limit_damping_n_s_per_m", "the passivity controller damps no more than this", "N s/m", 0, 1000},
          p.max_damping_n_s_per_m);
    visit({"contact_damping_n_s_per_m", "along the normal while in contact", "N s/m", 0, 100},
          p.contact_damping_n_s_per_m);
    visit({"jump_mm", "a pose farther away than this after one tick is a jump: force begins again from nothing", "mm",
           0, 1e9},
          p.jump_mm);
    visit({"resume_s", "time over which it comes back", "s", 0, 10}, p.resume_s);
    visit({"stale_ms", "time without a report after which the force fades", "ms", 1, 250}, p.stale_ms);
    visit({"fade_ms", "time over which it does", "ms", 1, 250}, p.fade_ms);
  }
};

/// The stiffness that a sampled wall may have in front of a device: (b + B) / (T / 2 + delay) with half of it in
/// reserve, since that bound is of stability, not of comfort, and three quarters where positions come in encoder steps,
/// which feed small cycles that only friction would end (J. Gil et al. 2004, N. Diolaiti et al. 2006; without delay and
/// B the passivity condition of J. Colgate, G. Schenkel 1997), and no more than the device's own limit.
[[nodiscard]] double safe_stiffness_n_per_mm(const DeviceTraits& device, double contact_damping_n_s_per_m,
                                             double tick_s);

/// Passivity observer and controller (B. Hannaford, J. Ryu, IEEE T-RA 18(1), 2002) over the elastic part of a force
/// that is held constant between ticks: the energy given is exactly the sum of F(n-1) . (x(n) - x(n-1)). When more was
/// given than taken, damping takes the rest out. Quantised positions: what less than an encoder step can feign is let
/// pass. Energy left over is forgotten when contact ends.
class PassivityControl {
 public:
  /// The damping to add now, N s/m; 0 when nothing is to be done. `x_mm` of this tick, `elastic_n` about to be applied.
  double update(Vec3 x_mm, Vec3 elastic_n, Vec3 velocity_mm_s, double dt_s, double encoder_mm, double most) noexcept;
  [[nodiscard]] double energy_mj() const { return energy_mj_; }  ///< positive: given, not yet taken out
  /// What the controller really applied, so that the sum stays true.
  void applied(Vec3 force_n) noexcept { last_force_n_ = force_n; }
  /// Of energy that was taken, no more than this may be given back before damping begins.
  void keep_at_most(double mj) noexcept { energy_mj_ = energy_mj_ < -mj ? -mj : energy_mj_; }
  void reset() noexcept { *this = {}; }

 private:
  Vec3 last_x_mm_, last_force_n_;
  double energy_mj_ = 0;
  bool started_ = false;
};

/// What a law of force gives on closed ways that no energy stands behind. Damping does not take it out: it comes by and
/// by, and the sum turns positive at the release, where no force is left to damp with. So what the hand has put in is
/// compared with what contact would still give back by its law: where that is more, the force on the way out, and only
/// there, is reduced in proportion, and both end together. What was given all the same is owed, and paid on the way out
/// of the next contacts. It goes by ways and not by speeds: nothing happens at rest, and it cannot stick. Bone taken
/// away is energy put in, so that a drilling stroke owes nothing; a hand that starts within bone owes nothing either.
class EnergyDebt {
 public:
  static constexpr double kMinShare = 0.5;   ///< no force is reduced further
  static constexpr double kMaxOwedMj = 0.5;  ///< no more is held against a hand
  /// The share of `elastic_n` to apply now. `stored_mj`: what contact would give on the way out; 0: not known, the
  /// share goes to 1.
  double update(Vec3 x_mm, Vec3 elastic_n, double stored_mj, Vec3 velocity_mm_s, double dt_s,
                double encoder_mm) noexcept;
  void applied(Vec3 force_n) noexcept { last_force_n_ = force_n; }
  /// Given since first touch and owed from before; negative: the hand has put in more.
  [[nodiscard]] double given_mj() const { return given_mj_; }
  /// The hand is somewhere else: the way there was none.
  void jumped() noexcept { started_ = false; }

 private:
  Vec3 last_x_mm_, last_force_n_;
  double given_mj_ = 0, share_ = 1, most_n_ = 0;
  // What is said to be stored is known roughly in hollows. The first way in tells it: what went in then comes out
  // again.
  double owed_mj_ = 0, fits_ = 1, out_mm_ = 0;
  bool started_ = false;
};

/// How stiff a force is where the hand is: along the contact's normal and across it, of what it changed by over the
/// last kWayMm. In a hollow of the burr's own shape a law of force is several times as stiff as on flat bone, and stiff
/// to the sides too, where flat bone is not.
class LocalStiffness {
 public:
  static constexpr double kWayMm = 0.005, kForgetS = 0.1, kMostNPerMm = 20;
  /// `elastic_n` by its law, before anything is taken from it.
  void update(Vec3 x_mm, Vec3 elastic_n, Vec3 normal, double dt_s, double encoder_mm) noexcept;
  [[nodiscard]] double along_n_per_mm() const { return along_; }
  [[nodiscard]] double across_n_per_mm() const { return across_; }
  void jumped() noexcept { started_ = false; }

 private:
  Vec3 last_x_mm_, last_force_n_;
  double along_ = 0, across_ = 0;
  bool started_ = false;
};

/// All limits in one place, in this order: fading and resuming, debt, damping and passivity, force
/// cap, rate cap. The last thing between whatever went wrong before and a hand. No allocation. The same input gives the
/// same bits.
class Guard {
 public:
  /// A limit that is negative or not a number counts as 0: no force, or none that changes.
  Guard(const GuardParams& params, const DeviceTraits& device);
  /// Other limits from now on; what it remembers of hand and energy stays.
  void set(const GuardParams& params) noexcept;

  struct Input {
    Vec3 position_mm;
    Vec3 elastic_n;     ///< of contact and constraints: what must not create energy
    Vec3 normal;        ///< unit, of the contact; zero without
    Vec3 effects_n;     ///< drag, vibration, what leads the hand: a motor drives them, they may
    double age_ms = 0;  ///< of the pose
    bool jumped = false;
    Vec3 drag_n{};         ///< of effects_n, the pull of the teeth: it pulls, but does not drive a hand that yields
    double stored_mj = 0;  ///< what contact would give back from here (EnergyDebt); 0: not known
  };
  struct Output {
    Vec3 force_n;
    std::uint32_t flags = 0;
  };
  /// Whatever comes in, the force that goes out is finite and within the limits of force and rate. What is not finite
  /// counts as none: force, normal; a position, as a jump; an age, as stale; a `dt_s` that is not positive and finite
  /// stands for a millisecond.
  Output limit(const Input& in, double dt_s) noexcept;
  [[nodiscard]] double energy_mj() const { return passivity_.energy_mj(); }
  [[nodiscard]] Vec3 velocity_mm_s() const { return velocity_; }

 private:
  GuardParams params_;
  DeviceTraits device_;
  double most_n_ = 0;
  PassivityControl passivity_, drag_;
  EnergyDebt debt_;
  LocalStiffness stiffness_;
  Vec3 velocity_, last_x_mm_, last_force_n_;
  bool moving_ = false;  // last_x_mm_ is of the tick before
  double resume_ = 1;    // 0 right after a jump, 1 when the force is back
};

}  // namespace osteo::inline simulation
