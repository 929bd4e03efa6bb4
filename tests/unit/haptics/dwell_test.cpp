// A burr that is pressed goes on cutting, by whatever method its contact is felt: what presses on it is what it can
// take.
#include <gtest/gtest.h>

#include "osteo/simulation/haptics/simulated_device.h"
#include "sweep.h"

namespace osteo {
namespace {

struct Pressed {
  double removed_mm3 = 0, late_mm3 = 0;  // in all; in the last quarter of the time
  double depth_mm = 0;                   // of a flat cut of as much
};

// A hand that yields pushes straight down on flat bone, with the same force all the time.
Pressed pressed(ContactMethod method, double h, double force_n, int tool, double seconds, double rate_hz = 1000) {
  auto bone = test::block(h, {{0, 0, 1}, 0.13});
  HapticSetup setup;
  setup.params.contact.method = method;
  setup.params.effects.drag = 0;
  setup.params.effects.vibration = setup.params.effects.shaft = false;
  setup.params.effects.spin_up_s = 0;
  const double r = burr_library()[static_cast<std::size_t>(tool)].diameter_mm / 2;
  SimulatedDeviceParams held;
  held.hand_damping_n_s_per_m = 5;
  SimulatedDevice device(held, {0.07, -0.11, r + 0.4});
  device.set_hand({0, 0, -force_n});
  device.set_axis(normalized({0.6, 0, 0.8}));
  device.set_drill(true, tool);
  setup.device = device.traits();
  HapticRenderer renderer(setup, bone, {}, 1 / rate_hz);
  Pressed p;
  Vec3 force;
  const auto ticks = static_cast<std::uint64_t>(seconds * rate_hz);
  for (std::uint64_t t = 0; t < ticks; ++t) {
    const TickRecord record = renderer.step(device.read(t, 1 / rate_hz, force)).record;
    force = from_floats(record.force_n);
    p.removed_mm3 += static_cast<double>(record.removed_mm3);
    if (t * 4 >= ticks * 3) p.late_mm3 += static_cast<double>(record.removed_mm3);
  }
  p.depth_mm = cap_depth_mm(p.removed_mm3, r);
  return p;
}

// However lightly it is pressed and whatever the method and the voxels, the rate is what decides: it neither stops nor
// goes by the voxels.
TEST(Pressed, AConstantForceNeverStopsCutting) {
  for (const auto& [tool, seconds] : {std::pair{3, 1.5}, {5, 1.0}}) {
    for (const double force_n : {0.05, 0.3, 1.0}) {
      double least = 1e9, most = 0;
      for (const ContactMethod method :
           {ContactMethod::overlap, ContactMethod::proxy, ContactMethod::volume, ContactMethod::rays}) {
        for (const double h : {0.3, 0.5, 0.9}) {
          if (tool == 5 && h == 0.3) continue;
          const Pressed p = pressed(method, h, force_n, tool, seconds, 500);
          SCOPED_TRACE(std::string(EnumNames<ContactMethod>::values[static_cast<std::size_t>(method)]) + ", " +
                       std::to_string(h) + " mm, " + std::to_string(force_n) + " N, tool " + std::to_string(tool));
          EXPECT_GT(p.late_mm3, 0.15 * p.removed_mm3);
          least = std::min(least, p.depth_mm);
          most = std::max(most, p.depth_mm);
        }
      }
      // In so short a time a light touch is no deeper than a fifth of the coarsest voxels.
      EXPECT_GT(least, (force_n < 0.1 ? 0.85 : 0.9) * most) << force_n << " N, tool " << tool;
    }
  }
}

}  // namespace
}  // namespace osteo
