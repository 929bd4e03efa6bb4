// A device's loop is measured, not believed.
#include "osteo/simulation/haptics/device_measure.h"

#include <gtest/gtest.h>

#include <random>

#include "osteo/simulation/haptics/simulated_device.h"

namespace osteo {
namespace {

/// A simulated device whose driver says something else, with a hand on it.
class Untold final : public Device {
 public:
  Untold(const SimulatedDeviceParams& real, const DeviceTraits& reported)
      : device_(real, {1, 2, 3}), reported_(reported) {}
  DeviceSample read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept override {
    if (held) device_.set_hand({}, {1, 2, 3}, 0.5);
    DeviceSample s = device_.read(tick, dt_s, force_n * pushes);
    most_n = std::max(most_n, length(force_n));
    std::normal_distribution<float> noise(0, 1);
    for (float& x : s.position_mm) x += noise_mm * noise(random_);
    s.age_ms = age_ms;
    return s;
  }
  [[nodiscard]] DeviceTraits traits() const override { return reported_; }

  double pushes = 1, most_n = 0;
  float noise_mm = 0;
  bool held = false;
  std::uint8_t age_ms = 0;

 private:
  SimulatedDevice device_;
  DeviceTraits reported_;
  std::mt19937 random_{5};
};

const DeviceTraits kReported{.damping_n_s_per_m = 1, .delay_s = 0, .encoder_mm = 0, .max_force_n = 8};

TEST(MeasuredDevice, FindsDelayDampingAndStepThatItsDriverDoesNotTell) {
  for (const double rate_hz : {1000.0, 2000.0}) {
    for (const double delay_s : {0.0, 1e-3, 2e-3, 5e-3}) {
      for (const double encoder_mm : {0.0, 0.01, 0.03}) {
        for (const double damping : {0.5, 1.0, 3.0}) {
          // All of them at 1 kHz with the delay asked for; else some.
          if ((rate_hz > 1000 || delay_s != 2e-3) && damping != (encoder_mm > 0 ? 0.5 : 1.0)) continue;
          Untold device({.mass_kg = 0.1, .damping_n_s_per_m = damping, .encoder_mm = encoder_mm, .delay_s = delay_s},
                        kReported);
          int ticks = 0;
          const MeasuredDevice m = measure_device(device, 1 / rate_hz, [&] { ++ticks; });
          ASSERT_TRUE(m.delay_measured) << m.reported << ' ' << delay_s << ' ' << encoder_mm << ' ' << damping;
          EXPECT_NEAR(m.traits.delay_s, delay_s, 0.25e-3) << m.reported << ' ' << encoder_mm << ' ' << damping;
          // No more than told, and less where it surely is less.
          EXPECT_LE(m.traits.damping_n_s_per_m, encoder_mm == 0 && damping < 1 ? 0.75 : 1) << m.reported;
          EXPECT_GE(m.traits.damping_n_s_per_m, 0.7 * std::min(1.0, damping)) << m.reported;
          if (encoder_mm > 0) {
            EXPECT_NEAR(m.traits.encoder_mm, encoder_mm, 0.001);
          }
          EXPECT_LE(ticks, 1.4 * rate_hz);
          EXPECT_LE(device.most_n, 4);
        }
      }
    }
  }
}

TEST(MeasuredDevice, TheStiffnessInUseFollowsWhatWasMeasured) {
  Untold device({.mass_kg = 0.1, .damping_n_s_per_m = 1, .delay_s = 2e-3}, kReported);
  const MeasuredDevice m = measure_device(device, 1e-3, [] {});
  EXPECT_NEAR(safe_stiffness_n_per_mm(kReported, 1, 1e-3), 2, 1e-9);
  EXPECT_NEAR(safe_stiffness_n_per_mm(m.traits, 1, 1e-3), 0.4, 0.06);
  EXPECT_NE(m.reported.find("its driver says 0 ms"), std::string::npos) << m.reported;
}

TEST(MeasuredDevice, WhatCannotBeMeasuredIsSaidAndTakenWithAMargin) {
  const SimulatedDeviceParams real{.mass_kg = 0.1, .damping_n_s_per_m = 1, .delay_s = 2e-3};
  const auto expect_not = [](Untold& device, const char* why) {
    const MeasuredDevice m = measure_device(device, 1e-3, [] {});
    EXPECT_FALSE(m.delay_measured) << why << ": " << m.reported;
    EXPECT_NEAR(m.traits.delay_s, kReported.delay_s + kUnmeasuredDelayS, 1e-9) << why;
    EXPECT_EQ(m.traits.damping_n_s_per_m, kReported.damping_n_s_per_m) << why;
    EXPECT_NE(m.reported.find("not measured"), std::string::npos) << m.reported;
  };
  Untold dead(real, kReported);
  dead.pushes = 0;
  expect_not(dead, "no motors");
  Untold noisy(real, kReported);
  noisy.noise_mm = 0.3F;
  expect_not(noisy, "noise");
  Untold silent(real, kReported);
  silent.age_ms = 200;
  expect_not(silent, "silent");
  Untold firm({.mass_kg = 0.1, .damping_n_s_per_m = 1, .friction_n = 8}, kReported);
  expect_not(firm, "held fast");
  DeviceTraits weak = kReported;
  weak.max_force_n = 0;
  Untold none(real, weak);
  EXPECT_FALSE(measure_device(none, 1e-3, [] {}).delay_measured);
}

// A hand that rests on it, by a spring and heavier, does not hide its delay.
TEST(MeasuredDevice, AGentleHandDoesNotHideTheDelay) {
  Untold device(
      {.mass_kg = 0.25, .damping_n_s_per_m = 1, .encoder_mm = 0.01, .delay_s = 2e-3, .hand_damping_n_s_per_m = 5},
      kReported);
  device.held = true;
  const MeasuredDevice m = measure_device(device, 1e-3, [] {});
  EXPECT_TRUE(m.delay_measured) << m.reported;
  EXPECT_NEAR(m.traits.delay_s, 2e-3, 0.5e-3) << m.reported;
  EXPECT_LE(m.traits.damping_n_s_per_m, 1);
}

}  // namespace
}  // namespace osteo
