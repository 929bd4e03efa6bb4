// Where a burr is held from more sides than on flat bone: how stiff the force is there, and whether a hand stays calm.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "osteo/simulation/haptics/renderer.h"
#include "osteo/simulation/haptics/simulated_device.h"
#include "solid.h"

namespace osteo {
namespace {

// A ball of 4 mm. `touch_mm`: where its middle is when it touches, going down along z.
struct Hollow {
  const char* name;
  bool (*inside)(Vec3);
  double x_mm, touch_mm;
};
template <int kHundredths>
bool pit(Vec3 p) {
  constexpr double r = 2 * kHundredths / 100.0;
  return p.z < 1 && length(p - Vec3{0.03, 0.02, 1}) > r;
}
const Hollow kHollows[] = {
    {"plane", [](Vec3 p) { return p.z < 0.07; }, 0, 2.07},
    {"edge of 90 degrees", [](Vec3 p) { return p.z < 0.07 && p.x < 0.03; }, 0.03, 2.07},
    {"groove of 120 degrees", [](Vec3 p) { return p.z < std::abs(p.x - 0.03) / std::sqrt(3.0); }, 0.03,
     2 / std::sin(60 * 3.14159265 / 180)},
    {"groove of 90 degrees", [](Vec3 p) { return p.z < std::abs(p.x - 0.03); }, 0.03, 2 * std::sqrt(2.0)},
    {"pit of the burr's radius", pit<100>, 0.03, 1},
    {"pit of 1.1 times the radius", pit<110>, 0.03, 0.8},
    {"pit of 1.25 times the radius", pit<125>, 0.03, 0.5},
};

HapticSetup setup_of(ContactMethod method) {
  HapticSetup setup;
  setup.params.contact.method = method;
  setup.params.contact.stiffness_n_per_mm = 2;
  setup.params.effects.shaft = false;
  setup.params.effects.vibration = false;
  return setup;
}

double steepest(const Hollow& hollow, ContactMethod method, double h) {
  auto bone = test::solid(h, 6, hollow.inside, {}, 3);
  HapticSetup setup = setup_of(method);
  setup.device.damping_n_s_per_m = 10;
  HapticRenderer renderer(setup, bone, {}, 1e-3);
  double most = 0;
  constexpr double kStep = 0.005;
  std::vector<double> f;
  for (int t = 0; t < 320; ++t) {
    DeviceSample s;
    s.position_mm = to_floats(Vec3{hollow.x_mm, 0.02, hollow.touch_mm + 0.6 - kStep * t});
    s.tool = 3;
    static_cast<void>(renderer.step(s));
    f.push_back(renderer.contact().force_n.z);
  }
  for (std::size_t i = 10; i < f.size(); ++i)
    if (f[i] < 6) most = std::max(most, (f[i] - f[i - 10]) / (10 * kStep));
  return most;
}

constexpr double kGrip = 0.3;  // of the hand, N/mm: without, the burr leaves an edge sideways
struct Rest {
  double fastest_mm_s = 0, gained_mj = 0;  // in the last 0.6 s; at any time
};
// Pressed from 1 mm above by `push_n`, for 4 s.
Rest rest(const Hollow& hollow, ContactMethod method, double h, const SimulatedDeviceParams& d, double push_n,
          int law = GuardParams{}.law) {
  auto bone = test::solid(h, 6, hollow.inside, {}, 3);
  SimulatedDevice device(d, {hollow.x_mm, 0.02, hollow.touch_mm + 1});
  device.set_hand({}, {hollow.x_mm, 0.02, hollow.touch_mm - push_n / kGrip}, kGrip);
  device.set_drill(false, 3);
  HapticSetup setup = setup_of(method);
  setup.device = device.traits();
  setup.params.guard.law = law;
  HapticRenderer renderer(setup, bone, {}, 1e-3);
  Rest r;
  Vec3 force;
  for (std::uint64_t t = 0; t < 4000; ++t) {
    force = from_floats(renderer.step(device.read(t, 1e-3, force)).record.force_n);
    r.gained_mj = std::max(r.gained_mj, device.work_mj());
    if (t > 3400) r.fastest_mm_s = std::max(r.fastest_mm_s, length(device.velocity_mm_s()));
  }
  return r;
}

const SimulatedDeviceParams kLight{.damping_n_s_per_m = 0.5}, kPlain{.damping_n_s_per_m = 1},
    kLate{.damping_n_s_per_m = 1, .delay_s = 2e-3}, kStepped{.damping_n_s_per_m = 1, .encoder_mm = 0.03};

// By the stiffness asked for, as before, a light device went to and fro in its own pit at 5 to 36 mm/s.
TEST(Hollows, AHandComesToRestInThem) {
  for (const ContactMethod method : {ContactMethod::overlap, ContactMethod::proxy}) {
    for (std::size_t n : {1, 3, 4, 5}) {
      const Hollow& hollow = kHollows[n];
      for (const auto& device : {kLight, kPlain, kLate}) {
        const Rest r = rest(hollow, method, 0.3, device, 0.3);
        EXPECT_LT(r.fastest_mm_s, 0.5) << hollow.name << ' ' << static_cast<int>(method) << ' ' << device.delay_s;
        EXPECT_LT(r.gained_mj, 0.05) << hollow.name << ' ' << static_cast<int>(method) << ' ' << device.delay_s;
      }
    }
  }
  EXPECT_GT(rest(kHollows[4], ContactMethod::overlap, 0.3, kLight, 0.3, 2).fastest_mm_s, 3);
  EXPECT_GT(rest(kHollows[3], ContactMethod::proxy, 0.3, kLate, 1, 2).fastest_mm_s, 3);
}

// What the guard damps by: the stiffness of a spring that it is not told of, along the push and across it.
TEST(LocalStiffness, IsMeasuredAlongAndAcross) {
  LocalStiffness s;
  const auto force = [](Vec3 x) { return Vec3{-3 * x.x, 0, x.z < 0 ? -7 * x.z : 0}; };
  Vec3 x{0, 0, 0.1};
  const auto go = [&](Vec3 to, int ticks) {
    const Vec3 from = x;
    for (int t = 1; t <= ticks; ++t) {
      x = from + (to - from) * (static_cast<double>(t) / ticks);
      s.update(x, force(x), {0, 0, 1}, 1e-3, 0);
    }
  };
  go({0, 0, -0.2}, 100);
  EXPECT_NEAR(s.along_n_per_mm(), 7, 0.1);
  EXPECT_EQ(s.across_n_per_mm(), 0);
  go({0.2, 0, -0.2}, 100);
  EXPECT_NEAR(s.along_n_per_mm(), 7, 0.1);
  EXPECT_NEAR(s.across_n_per_mm(), 3, 0.1);
  go({0.2, 0, -0.2}, 100);  // at rest nothing is learnt, and nothing forgotten
  EXPECT_NEAR(s.across_n_per_mm(), 3, 0.1);
  go({0, 0, 1}, 1);
  x.x = 0;
  for (int t = 0; t < 1000; ++t) s.update({0, 0, 1}, {}, {}, 1e-3, 0);
  EXPECT_LT(s.along_n_per_mm(), 0.01);
}

// The table of docs/validation/haptics.md: OSTEO_HOLLOWS=1.
TEST(Hollows, Benchmark) {
  if (std::getenv("OSTEO_HOLLOWS") == nullptr) GTEST_SKIP() << "OSTEO_HOLLOWS is not set";
  for (const ContactMethod m :
       {ContactMethod::overlap, ContactMethod::proxy, ContactMethod::volume, ContactMethod::rays}) {
    for (const Hollow& hollow : kHollows) {
      for (const double h : {0.3, 0.5}) {
        std::printf("| %s | %.1f | %s | %.1f |", hollow.name, h,
                    EnumNames<ContactMethod>::values[static_cast<std::size_t>(m)].data(), steepest(hollow, m, h));
        for (const auto& device : {kLight, kPlain, kLate, kStepped}) {
          std::array<Rest, 2> most{};
          for (const int law : {2, 3}) {
            Rest& worst = most[static_cast<std::size_t>(law) - 2];
            for (const double push : {0.3, 1.0}) {
              const Rest r = rest(hollow, m, h, device, push, law);
              worst = {std::max(worst.fastest_mm_s, r.fastest_mm_s), std::max(worst.gained_mj, r.gained_mj)};
            }
          }
          std::printf(" %.1f, %.1f | %.1f, %.1f |", most[0].fastest_mm_s, most[0].gained_mj, most[1].fastest_mm_s,
                      most[1].gained_mj);
        }
        std::printf("\n");
        std::fflush(stdout);
      }
    }
  }
}

// What of the tremor that an encoder's steps keep up a device's own friction ends: the second table, by the same
// variable.
TEST(Hollows, FrictionBenchmark) {
  if (std::getenv("OSTEO_HOLLOWS") == nullptr) GTEST_SKIP() << "OSTEO_HOLLOWS is not set";
  for (const ContactMethod m :
       {ContactMethod::overlap, ContactMethod::proxy, ContactMethod::volume, ContactMethod::rays}) {
    for (const double encoder_mm : {0.01, 0.03}) {
      std::printf("| %s | %.0f |", EnumNames<ContactMethod>::values[static_cast<std::size_t>(m)].data(),
                  1000 * encoder_mm);
      for (const double friction_n : {0.0, 0.05, 0.1, 0.2, 0.3}) {
        double fastest = 0;
        for (const Hollow& hollow : kHollows) {
          for (const double h : {0.3, 0.5}) {
            const SimulatedDeviceParams d{.damping_n_s_per_m = 1, .friction_n = friction_n, .encoder_mm = encoder_mm};
            for (const double push : {0.3, 1.0}) fastest = std::max(fastest, rest(hollow, m, h, d, push).fastest_mm_s);
          }
        }
        std::printf(" %.1f |", fastest);
        std::fflush(stdout);
      }
      std::printf("\n");
    }
  }
}

}  // namespace
}  // namespace osteo
