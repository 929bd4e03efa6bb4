// A haptic device that exists as equations: mass, damping, friction, encoder, delay and late ticks, with a hand on it.
#pragma once
#include <array>
#include <cstdint>

#include "osteo/simulation/haptics/device.h"

namespace osteo::inline simulation {

struct SimulatedDeviceParams {
  double mass_kg = 0.1;
  double damping_n_s_per_m = 1;
  double friction_n = 0;  ///< Coulomb
  double encoder_mm = 0;  ///< quantum of the reported position
  double delay_s = 0;     ///< from a pose to the force that answers it
  double late_share = 0;  ///< of ticks that come 1 to 3 ms late; the force of the tick before stays meanwhile
  double hand_damping_n_s_per_m = 0;
  std::uint64_t seed = 1;  ///< of which ticks are late
};

/// A body in three dimensions, driven by the force of the servo and that of a hand, integrated in steps of 20 us
/// (semi-implicit Euler, friction that can stop but not reverse). The same seed and ticks give the same bits.
class SimulatedDevice final : public Device {
 public:
  explicit SimulatedDevice(const SimulatedDeviceParams& params, Vec3 start_mm) : params_(params), x_mm_(start_mm) {}

  /// What the hand does from now on: a constant push, and a spring to a place.
  void set_hand(Vec3 push_n, Vec3 place_mm = {}, double spring_n_per_mm = 0) {
    push_n_ = push_n;
    place_mm_ = place_mm;
    spring_ = spring_n_per_mm;
  }
  void set_axis(Vec3 axis) { axis_ = to_floats(axis); }
  void set_drill(bool on, int tool) {
    pedal_ = on ? 255 : 0;
    tool_ = static_cast<std::uint8_t>(tool);
  }

  DeviceSample read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept override;
  [[nodiscard]] DeviceTraits traits() const override {
    return {params_.damping_n_s_per_m, params_.delay_s, params_.encoder_mm, 100, 1e9};
  }

  [[nodiscard]] Vec3 position_mm() const { return x_mm_; }
  [[nodiscard]] Vec3 velocity_mm_s() const { return v_mm_s_; }
  /// Work that the servo's force has done on the body so far, mJ.
  [[nodiscard]] double work_mj() const { return work_mj_; }

 private:
  void advance(double seconds, Vec3 force_n) noexcept;

  SimulatedDeviceParams params_;
  Vec3 x_mm_, v_mm_s_, push_n_, place_mm_;
  double spring_ = 0, work_mj_ = 0;
  std::array<float, 3> axis_{0, 0, 1};
  std::uint8_t pedal_ = 0;
  std::uint8_t tool_ = 3;
  static constexpr int kLongestDelay = 128;   // ticks
  std::array<Vec3, kLongestDelay> forces_{};  // a ring, for the delay
  int newest_ = 0;
  std::uint64_t random_ = 0;
};

}  // namespace osteo::inline simulation
