// What devices say and are told: reports, kinematics, recordings.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <random>

#include "osteo/core/base/error.h"
#include "osteo/simulation/devices/devices.h"
#include "osteo/simulation/haptics/servo.h"

namespace osteo {
namespace {

std::vector<std::byte> bytes(std::initializer_list<int> values) {
  std::vector<std::byte> b;
  for (const int v : values) b.push_back(static_cast<std::byte>(v));
  return b;
}

TEST(Reports, SpaceMouseOnCable) {
  SpaceMouseState s;
  EXPECT_TRUE(decode_space_mouse(bytes({1, 0x5e, 0x01, 0xa2, 0xfe, 0x00, 0x00}), s));  // 350, -350, 0
  EXPECT_DOUBLE_EQ(s.move[0], 1);
  EXPECT_DOUBLE_EQ(s.move[1], 1);
  EXPECT_DOUBLE_EQ(s.move[2], 0);
  EXPECT_TRUE(decode_space_mouse(bytes({2, 0xaf, 0, 0, 0, 0xaf, 0}), s));
  EXPECT_DOUBLE_EQ(s.turn[0], 0.5);
  EXPECT_DOUBLE_EQ(s.turn[2], -0.5);
  EXPECT_TRUE(decode_space_mouse(bytes({3, 2, 0}), s));
  EXPECT_EQ(s.buttons, 2u);
  EXPECT_DOUBLE_EQ(s.move[0], 1);  // kept
}

TEST(Reports, WirelessSpaceMouseCarriesAllSix) {
  SpaceMouseState s;
  EXPECT_TRUE(decode_space_mouse(bytes({1, 0xaf, 0, 0, 0, 0, 0, 0, 0, 0xaf, 0, 0, 0}), s));
  EXPECT_DOUBLE_EQ(s.move[0], 0.5);
  EXPECT_DOUBLE_EQ(s.turn[1], -0.5);
  EXPECT_TRUE(decode_space_mouse(bytes({0x17, 87}), s));
  EXPECT_EQ(s.battery_percent, 87);
}

TEST(Reports, ShortOnesAndGarbageAreRefused) {
  SpaceMouseState s;
  s.move[0] = 0.25;
  for (const auto& bad :
       {bytes({}), bytes({1}), bytes({1, 2, 3, 4, 5, 6}), bytes({2, 0}), bytes({3}), bytes({0x99, 1, 2, 3, 4, 5, 6})}) {
    EXPECT_FALSE(decode_space_mouse(bad, s));
  }
  EXPECT_EQ(s.move[0], 0.25);
  WoodenHapticsReport w;
  EXPECT_FALSE(decode_woodenhaptics(bytes({1, 2, 3}), w));
  std::uint32_t pressed = 7;
  EXPECT_FALSE(decode_pedal(DeviceModel::pedal_infinity, bytes({1}), pressed));
  EXPECT_EQ(pressed, 7u);
  // Whatever bytes: no more than full deflection, no crash.
  std::mt19937 random(3);
  for (int n = 0; n < 100000; ++n) {
    std::vector<std::byte> r(random() % 70);
    for (auto& b : r) b = static_cast<std::byte>(random());
    decode_space_mouse(r, s);
    decode_woodenhaptics(r, w);
    decode_pedal(n % 2 == 0 ? DeviceModel::pedal_infinity : DeviceModel::pedal_pcsensor, r, pressed);
    std::array<double, 3> ma;
    WoodenHapticsCommand c;
    decode_woodenhaptics_command(r, ma, c);
    for (std::size_t a = 0; a < 3; ++a) EXPECT_LE(std::abs(s.move[a]) + std::abs(s.turn[a]), 2);
  }
}

TEST(Reports, Pedals) {
  std::uint32_t pressed = 0;
  EXPECT_TRUE(decode_pedal(DeviceModel::pedal_infinity, bytes({5, 0}), pressed));
  EXPECT_EQ(pressed, 5u);
  EXPECT_TRUE(decode_pedal(DeviceModel::pedal_pcsensor, bytes({1, 0, 0, 4, 6, 0, 0, 0, 0}), pressed));
  EXPECT_EQ(pressed, 5u);
  EXPECT_TRUE(decode_pedal(DeviceModel::pedal_pcsensor, bytes({0, 0, 5, 0, 0, 0, 0, 0}), pressed));
  EXPECT_EQ(pressed, 2u);
}

TEST(Reports, WoodenHapticsThereAndBack) {
  const auto report = encode_woodenhaptics_report({1234, -4321, 17, 10077, -5, 6}, true);
  WoodenHapticsReport w;
  ASSERT_TRUE(decode_woodenhaptics(report, w));
  EXPECT_EQ(w.encoder, (std::array<int, 6>{1234, -4321, 17, 77, -5, 6}));
  EXPECT_TRUE(w.button);
  EXPECT_TRUE(w.calibrate);
  const auto command = encode_woodenhaptics({1500.4, -2999, NAN}, WoodenHapticsCommand::force, {1, 2, 3}, 65);
  EXPECT_EQ(command.size(), 65u);
  std::array<double, 3> ma{};
  WoodenHapticsCommand c{};
  ASSERT_TRUE(decode_woodenhaptics_command(command, ma, c));
  EXPECT_EQ(ma, (std::array<double, 3>{1500, -2999, 0}));
  EXPECT_EQ(c, WoodenHapticsCommand::force);
}

TEST(Kinematics, JacobianInverseAndForceAgree) {
  const WoodenHapticsKinematics k{{}};
  EXPECT_LT(length(k.position_mm({0, 0, M_PI / 2})), 1e-9);
  for (double x = -40; x <= 40; x += 20)
    for (double y = -40; y <= 40; y += 20)
      for (double z = -40; z <= 40; z += 20) {
        const auto counts = k.encoders({x, y, z});
        ASSERT_TRUE(counts.has_value());
        const Vec3 q = k.angles_rad(*counts);
        EXPECT_LT(length(k.position_mm(q) - Vec3{x, y, z}), 0.05);  // rounded to counts
        const Mat3 j = k.jacobian_mm(q);
        for (std::size_t a = 0; a < 3; ++a) {
          Vec3 up = q, down = q;
          up[a] += 1e-5;
          down[a] -= 1e-5;
          EXPECT_LT(length((k.position_mm(up) - k.position_mm(down)) / 2e-5 - j.column[a]), 1e-3);
        }
        const Vec3 f{1.1, -0.7, 0.4};
        EXPECT_LT(length(k.force_n(q, k.currents_ma(q, f)) - f), 1e-9);
        // Beyond the motors: less, but the same way.
        const Vec3 most = k.force_n(q, k.currents_ma(q, f * 1000));
        EXPECT_GT(dot(most, f), 0.999 * length(most) * length(f));
      }
  EXPECT_FALSE(k.encoders({5000, 0, 0}).has_value());
  EXPECT_LT(k.resolution_mm(), 0.05);
}

TEST(Workspace, ScalesTurnsAndClutches) {
  WorkspaceMap map({100, 0, 0}, {{Vec3{0, 1, 0}, Vec3{-1, 0, 0}, Vec3{0, 0, 1}}}, 0.5);
  EXPECT_EQ(map.update({7, 7, 7}, false), (Vec3{100, 0, 0}));  // takes hold where it is
  EXPECT_EQ(map.update({9, 7, 7}, false), (Vec3{100, 1, 0}));
  EXPECT_EQ(map.update({50, 7, 7}, true), (Vec3{100, 1, 0}));  // the device alone moves
  EXPECT_EQ(map.update({52, 7, 7}, false), (Vec3{100, 2, 0}));
  EXPECT_EQ(map.to_device({0, 1, 0}), (Vec3{1, 0, 0}));
}

TEST(Extrapolation, FollowsThePlaneThenFades) {
  ForcePlane p;
  p.force_n = {0, 0, 1};
  p.normal = {0, 0, 1};
  p.stiffness_n_per_mm = 2;
  p.time_ns = 1'000'000'000;
  const auto at = [&](double z, double ms) {
    return extrapolate(p, {0, 0, z}, p.time_ns + static_cast<std::int64_t>(ms * 1e6)).z;
  };
  EXPECT_DOUBLE_EQ(at(0, 1), 1);
  EXPECT_DOUBLE_EQ(at(-0.1, 1), 1.2);
  EXPECT_DOUBLE_EQ(at(0.2, 1), 0.6);
  EXPECT_DOUBLE_EQ(at(5, 1), 0);      // off the surface: nothing, and no pull
  EXPECT_DOUBLE_EQ(at(-50, 1), 2.5);  // bounded
  EXPECT_NEAR(at(0, 15), 0.5, 1e-9);
  EXPECT_DOUBLE_EQ(at(0, 26), 0);
  EXPECT_EQ(length(extrapolate({}, {0, 0, 0}, 5)), 0);
  EXPECT_EQ(length(extrapolate(p, {NAN, 0, 0}, p.time_ns)), 1);
}

// Whatever the servo left there and wherever the arm says it is: a finite force within bounds, and so are the motors'
// currents.
TEST(Extrapolation, AnyBitsGiveAFiniteForceAndCurrents) {
  std::mt19937_64 random(17);
  std::uniform_real_distribution<double> u(-3, 3);
  const WoodenHapticsGeometry geometry;
  const WoodenHapticsKinematics arm(geometry);
  for (int n = 0; n < 300000; ++n) {
    const auto one = [&] { return random() % 4 == 0 ? std::bit_cast<double>(random()) : u(random); };
    ForcePlane p;
    p.force_n = {one(), one(), one()};
    p.normal = {one(), one(), one()};
    p.position_mm = {one(), one(), one()};
    p.stiffness_n_per_mm = one();
    p.time_ns = 1 + static_cast<std::int64_t>(random() % 2'000'000'000);
    const Vec3 f =
        extrapolate(p, {one(), one(), one()}, static_cast<std::int64_t>(random() % 2'000'000'000), one(), one());
    ASSERT_TRUE(std::isfinite(length(f))) << n;
    ASSERT_FALSE(length(f) > (2 * length(p.force_n) + 0.5) * (1 + 1e-12)) << n;
    for (const double ma : arm.currents_ma({one(), one(), one()}, random() % 2 == 0 ? f : Vec3{one(), one(), one()})) {
      ASSERT_LE(std::abs(ma), 1000 * geometry.max_current_a * (1 + 1e-12)) << n;
    }
  }
}

TEST(Recording, IsReadAndRefusedWithTheLine) {
  const auto path = std::filesystem::temp_directory_path() / ("osteo-hid-" + std::to_string(::getpid()));
  std::ofstream(path) << "# comment\nD: 0\nR: 3 05 01 09\nN: 3Dconnexion SpaceNavigator\nI: 3 046d c626\nE: "
                         "000000.000010 7 01 5e 01 00 00 00 00\n"
                         "E: 000000.008010 3 03 01 00\n";
  const auto r = load_hid_recording(path);
  EXPECT_EQ(r.info.name, "3Dconnexion SpaceNavigator");
  EXPECT_EQ(model_of(r.info.vendor, r.info.product), DeviceModel::space_mouse);
  ASSERT_EQ(r.events.size(), 2u);
  SpaceMouseState s;
  for (const auto& e : r.events) EXPECT_TRUE(decode_space_mouse(e.report, s));
  EXPECT_DOUBLE_EQ(s.move[0], 1);
  EXPECT_EQ(s.buttons, 1u);
  std::ofstream(path) << "E: 0.1 4 01 02\n";
  EXPECT_THROW(static_cast<void>(load_hid_recording(path)), Error);
}

TEST(Models, KnowsItsDevices) {
  EXPECT_EQ(model_of(0x16c0, 0x0486), DeviceModel::woodenhaptics);
  EXPECT_EQ(model_of(0x256f, 0xc652), DeviceModel::space_mouse_wireless);
  EXPECT_EQ(model_of(0x05f3, 0x00ff), DeviceModel::pedal_infinity);
  EXPECT_EQ(model_of(1, 1), DeviceModel::unknown);
}

}  // namespace
}  // namespace osteo
