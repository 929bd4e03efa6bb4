// The stability table: devices that differ, one wall. Shared by tests and benchmark.
#pragma once
#include <array>
#include <cmath>
#include <string>

#include "osteo/simulation/haptics/guard.h"
#include "osteo/simulation/haptics/simulated_device.h"

namespace osteo::test {

struct StabilityCase {
  const char* name;
  SimulatedDeviceParams device;
  double tick_s;
};

/// Rows as in the literature's own variables: damping b, Coulomb friction fc, tick T, delay, encoder, late ticks; mass
/// 0.1 kg.
inline const StabilityCase kStabilityCases[] = {
    {"b 0.5, T 1 ms", {.damping_n_s_per_m = 0.5}, 1e-3},
    {"b 1, T 1 ms", {.damping_n_s_per_m = 1}, 1e-3},
    {"b 2, T 1 ms", {.damping_n_s_per_m = 2}, 1e-3},
    {"b 1, T 0.5 ms", {.damping_n_s_per_m = 1}, 0.5e-3},
    {"b 1, T 0.25 ms", {.damping_n_s_per_m = 1}, 0.25e-3},
    {"b 1 + hand 2", {.damping_n_s_per_m = 1, .hand_damping_n_s_per_m = 2}, 1e-3},
    {"b 1 + hand 5", {.damping_n_s_per_m = 1, .hand_damping_n_s_per_m = 5}, 1e-3},
    {"b 1 + hand 20", {.damping_n_s_per_m = 1, .hand_damping_n_s_per_m = 20}, 1e-3},
    {"b 1, delay 1 ms", {.damping_n_s_per_m = 1, .delay_s = 1e-3}, 1e-3},
    {"b 1, delay 5 ms", {.damping_n_s_per_m = 1, .delay_s = 5e-3}, 1e-3},
    {"b 1, encoder 30 um", {.damping_n_s_per_m = 1, .encoder_mm = 0.03}, 1e-3},
    {"b 1, encoder 100 um", {.damping_n_s_per_m = 1, .encoder_mm = 0.1}, 1e-3},
    {"b 0.05, fc 0.2 N, encoder 30 um", {.damping_n_s_per_m = 0.05, .friction_n = 0.2, .encoder_mm = 0.03}, 1e-3},
    {"b 0.05, fc 0.05 N, encoder 30 um", {.damping_n_s_per_m = 0.05, .friction_n = 0.05, .encoder_mm = 0.03}, 1e-3},
    {"b 1, 1 % of ticks late 1-3 ms", {.damping_n_s_per_m = 1, .late_share = 0.01}, 1e-3},
    {"b 1, 5 % of ticks late 1-3 ms", {.damping_n_s_per_m = 1, .late_share = 0.05}, 1e-3},
};

struct StabilityResult {
  bool stable = false;
  double stiffness_n_per_mm = 0;  ///< in use
  double fastest_mm_s = 0;        ///< in the last half second
  double deepest_mm = 0;
  double gained_mj = 0;  ///< most that the wall had given beyond what it had taken, at any time
};

/// A hand pushes a device with 1 N against a wall from 3 mm away, for 3 s. Stable: slower than 2 mm/s at the end, by
/// the criterion of the published table. With `guarded`, the stiffness is limited and the guard stands between wall and
/// device; without, the wall is bare.
inline StabilityResult push_against_wall(const StabilityCase& c, double stiffness_n_per_mm, bool guarded,
                                         double push_n = 1) {
  SimulatedDevice device(c.device, {0, 0, 3});
  device.set_hand({0, 0, -push_n});
  GuardParams params;
  params.max_force_n = 100;
  Guard guard(params, device.traits());
  StabilityResult r;
  r.stiffness_n_per_mm =
      guarded ? std::min(stiffness_n_per_mm,
                         safe_stiffness_n_per_mm(device.traits(), params.contact_damping_n_s_per_m, c.tick_s))
              : stiffness_n_per_mm;
  Vec3 force{};
  const auto ticks = static_cast<std::uint64_t>(3 / c.tick_s);
  for (std::uint64_t t = 0; t < ticks; ++t) {
    const auto sample = device.read(t, c.tick_s, force);
    const double depth = -static_cast<double>(sample.position_mm[2]);
    const Vec3 push = depth > 0 ? Vec3{0, 0, r.stiffness_n_per_mm * depth} : Vec3{};
    if (guarded) {
      const Vec3 x{static_cast<double>(sample.position_mm[0]), static_cast<double>(sample.position_mm[1]),
                   static_cast<double>(sample.position_mm[2])};
      force = guard.limit({x, push, depth > 0 ? Vec3{0, 0, 1} : Vec3{}, {}, 0, false}, c.tick_s).force_n;
    } else {
      force = push;
    }
    r.gained_mj = std::max(r.gained_mj, device.work_mj());
    r.deepest_mm = std::max(r.deepest_mm, -device.position_mm().z);
    if (t > ticks * 5 / 6) r.fastest_mm_s = std::max(r.fastest_mm_s, length(device.velocity_mm_s()));
  }
  r.stable = std::isfinite(r.fastest_mm_s) && r.fastest_mm_s < 2;
  return r;
}

}  // namespace osteo::test
