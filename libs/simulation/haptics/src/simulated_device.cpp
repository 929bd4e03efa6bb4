#include "osteo/simulation/haptics/simulated_device.h"

#include <algorithm>
#include <cmath>

#include "contact_models.h"

namespace osteo::inline simulation {
namespace {

// SplitMix64: the same on every machine.
std::uint64_t next(std::uint64_t& state) noexcept {
  std::uint64_t z = (state += 0x9e3779b97f4a7c15ULL);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

}  // namespace

void SimulatedDevice::advance(double seconds, Vec3 force_n) noexcept {
  constexpr double kStep = 2e-5;
  const int steps = std::max(1, static_cast<int>(std::lround(seconds / kStep)));
  const double dt = seconds / steps, damping = (params_.damping_n_s_per_m + params_.hand_damping_n_s_per_m) / 1000;
  for (int s = 0; s < steps; ++s) {
    const Vec3 driven = force_n + push_n_ + (place_mm_ - x_mm_) * spring_;
    Vec3 v = v_mm_s_ + (driven - v_mm_s_ * damping) * (1000 * dt / params_.mass_kg);
    if (params_.friction_n > 0) {
      const double speed = length(v), loss = params_.friction_n * 1000 * dt / params_.mass_kg;
      v = speed > loss ? v * (1 - loss / speed) : Vec3{};
    }
    v_mm_s_ = v;
    const Vec3 moved = v * dt;
    x_mm_ += moved;
    work_mj_ += dot(force_n, moved);
  }
}

DeviceSample SimulatedDevice::read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept {
  if (tick == 0) random_ = params_.seed;
  newest_ = (newest_ + 1) % kLongestDelay;
  forces_[static_cast<std::size_t>(newest_)] = force_n;
  const int behind = std::min(static_cast<int>(std::lround(params_.delay_s / dt_s)), kLongestDelay - 1);
  const Vec3 acting = forces_[static_cast<std::size_t>((newest_ - behind + kLongestDelay) % kLongestDelay)];
  double seconds = dt_s;
  if (params_.late_share > 0) {
    const double chance = static_cast<double>(next(random_) >> 11) * 0x1p-53,
                 amount = static_cast<double>(next(random_) >> 11) * 0x1p-53;
    if (chance < params_.late_share) seconds += 0.001 + 0.002 * amount;
  }
  advance(seconds, acting);
  DeviceSample sample;
  for (std::size_t a = 0; a < 3; ++a) {
    const double q = params_.encoder_mm;
    sample.position_mm[a] = static_cast<float>(q > 0 ? q * std::round(x_mm_[a] / q) : x_mm_[a]);
  }
  sample.axis = axis_;
  sample.pedal = pedal_;
  sample.tool = tool_;
  return sample;
}

}  // namespace osteo::inline simulation
