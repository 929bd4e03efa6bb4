// An expert who presses hard, and arms that are led by him.
#pragma once
#include <algorithm>
#include <cmath>

#include "osteo/simulation/bone/instrument.h"
#include "osteo/simulation/haptics/simulated_device.h"

namespace osteo::test {

// A firm grip on the bar's upper face (z = 4) and along it, pressing harder than a spring hand can, the pedal up; at
// the end he rests.
class FirmHand final : public Device {
 public:
  FirmHand(double press_n, double seconds) : press_n_(press_n), seconds_(seconds) {
    device_.set_drill(false, burr_index(BurrKind::cutting, 4));
  }
  DeviceSample read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept override {
    const double t = static_cast<double>(tick) * dt_s, on = std::clamp((t - 0.4) / 0.8, 0.0, 1.0);
    const double x = -4 + 8 * (0.5 - 0.5 * std::cos(M_PI * std::clamp((t - 0.4) / (seconds_ - 1.2), 0.0, 1.0)));
    device_.set_hand({0, 0, -press_n_ * on}, {x, 0, t < 0.4 ? 7 - 2.5 * t : 6}, 0.8);
    return device_.read(tick, dt_s, force_n);
  }
  [[nodiscard]] DeviceTraits traits() const override { return device_.traits(); }
  [[nodiscard]] bool active(std::uint64_t tick) const noexcept override {
    return static_cast<double>(tick) < seconds_ * 1000;
  }

 private:
  double press_n_, seconds_;
  SimulatedDevice device_{{.mass_kg = 0.15, .damping_n_s_per_m = 20}, {-4, 0, 7}};
};

struct Arm {
  const char* name;
  SimulatedDeviceParams params;
};
inline const Arm kArms[] = {{"light, 0.05 kg", {.mass_kg = 0.05}},
                            {"0.1 kg", {}},
                            {"heavy, 0.5 kg, 2 ms late", {.mass_kg = 0.5, .damping_n_s_per_m = 5, .delay_s = 0.002}}};

}  // namespace osteo::test
