#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "osteo/base/error.h"
#include "osteo/haptics/device.h"
#include "osteo/haptics/renderer.h"
#include "slab.h"

namespace osteo {
namespace {

DeviceSample at(Vec3 x, Vec3 axis, bool drill, int tool = 3) {
  DeviceSample s;
  s.position_mm = {static_cast<float>(x.x), static_cast<float>(x.y), static_cast<float>(x.z)};
  s.axis = {static_cast<float>(axis.x), static_cast<float>(axis.y), static_cast<float>(axis.z)};
  s.drill_on = drill ? 1 : 0;
  s.tool = static_cast<std::uint8_t>(tool);
  return s;
}

HapticSetup quiet() {
  HapticSetup s;
  s.device = SpringHand::traits();
  s.params.effects.vibration = false;
  return s;
}

Vec3 settled(HapticRenderer& r, const DeviceSample& s, int ticks = 60) {
  TickRecord record;
  for (int t = 0; t < ticks; ++t) record = r.step(s).record;
  return {record.force_n[0], record.force_n[1], record.force_n[2]};
}

// On its side the burr drags across its axis and along the surface, the other way round for the other hand; on its pole it does not.
TEST(Drag, RunsAlongTheSurfaceAndTurnsWithTheBurr) {
  double sideways[2];
  for (const bool left : {false, true}) {
    auto bone = test::slab(0.5);
    auto setup = quiet();
    setup.params.effects.left_handed = left;
    HapticRenderer r(setup, bone, {}, 1e-3);
    const Vec3 f = settled(r, at({0, 0, 1.4}, {1, 0, 0}, true), 10);
    EXPECT_NEAR(std::abs(f.y), setup.params.effects.drag * r.contact().normal_force_n, 0.05);
    EXPECT_NEAR(f.x, 0, 0.05);
    sideways[left ? 1 : 0] = f.y;
  }
  EXPECT_LT(sideways[0] * sideways[1], 0);
  auto bone = test::slab(0.5);
  HapticRenderer r(quiet(), bone, {}, 1e-3);
  const Vec3 f = settled(r, at({0, 0, 1.4}, {0, 0, 1}, true), 10);
  EXPECT_LT(std::hypot(f.x, f.y), 0.05);
}

TEST(Drag, AStandingBurrNeitherDragsNorCuts) {
  auto bone = test::slab(0.5);
  auto setup = quiet();
  setup.params.effects.speed_rpm = 0;
  HapticRenderer r(setup, bone, {}, 1e-3);
  const double before = bone.sum();
  const Vec3 f = settled(r, at({0, 0, 1.4}, {1, 0, 0}, true));
  EXPECT_NEAR(f.y, 0, 0.02);
  EXPECT_EQ(bone.sum(), before);
}

// Amplitudes at the peaks of the file and nowhere else, growing with the force pressed; nothing above the band.
TEST(Vibration, HasThePeaksOfItsSpectrum) {
  for (const BurrKind kind : {BurrKind::cutting, BurrKind::diamond}) {
    for (const double pressed : {0.0, 2.0}) {
      Vibration v(default_vibration());
      const int n = 4000;
      std::vector<double> x;
      for (int t = 0; t < n; ++t) x.push_back(v.step(kind, pressed, 1e-3)[0]);
      double outside = 0;
      for (int f = 5; f < 500; ++f) {
        std::complex<double> sum;
        for (int t = 0; t < n; ++t) sum += x[static_cast<std::size_t>(t)] * std::polar(1.0, -2 * std::numbers::pi * f * t / 1000.0);
        const double amplitude = 2 * std::abs(sum) / n;
        const auto& peaks = default_vibration().by_kind[static_cast<std::size_t>(kind)];
        const auto peak = std::find_if(peaks.begin(), peaks.end(), [&](const auto& p) { return p.frequency_hz == f; });
        if (peak != peaks.end()) {
          EXPECT_NEAR(amplitude, peak->idle_n + peak->per_n * pressed, 1e-3) << f;
        } else {
          outside = std::max(outside, amplitude);
        }
      }
      EXPECT_LT(outside, 1e-3);
    }
  }
}

TEST(Vibration, TheFileIsCheckedWithThePlace) {
  const auto refused = [](const std::string& text, const std::string& part) {
    try {
      static_cast<void>(parse_vibration(text, "'v.json'"));
      return false;
    } catch (const Error& e) {
      return e.code() == ExitCode::usage && std::string(e.what()).find(part) != std::string::npos;
    }
  };
  EXPECT_TRUE(refused("{", "header"));
  EXPECT_TRUE(refused(R"({"osteotome_vibration": 2})", "must be 1"));
  EXPECT_TRUE(refused(R"({"osteotome_vibration": 1, "band_hz": [400, 20]})", "band_hz"));
  EXPECT_TRUE(refused(R"({"osteotome_vibration": 1, "band_hz": [20, 400], "cutting": [{"frequency_hz": -1, "idle_n": 0, "per_n": 0}]})",
                      "cutting 1"));
  EXPECT_TRUE(refused(R"({"osteotome_vibration": 1, "band_hz": [20, 400], "cutting": []})", "diamond"));
}

TEST(Shaft, CollidesAndTurnsTheHand) {
  auto bone = test::slab(0.5);
  HapticRenderer r(quiet(), bone, {}, 1e-3);
  // Burr in the air beyond the slab's edge, shaft lying across its top: pushed up, and turned about the burr.
  const auto pose = at({-24, 0, 0.9}, {1, 0, 0}, false);
  const Vec3 f = settled(r, pose);
  const auto record = r.step(pose).record;
  EXPECT_NE(record.flags & kShaftContact, 0u);
  EXPECT_GT(f.z, 0.5);
  EXPECT_LT(record.torque_n_mm[1], -10);  // lever along +x, push along +z
  auto setup = quiet();
  setup.params.effects.shaft = false;
  HapticRenderer without(setup, bone, {}, 1e-3);
  EXPECT_EQ(length(settled(without, pose)), 0);
}

// A cylinder lying on bone with its upper half over the edge is turned.
TEST(Torque, ComesFromWhereTheBoneIs) {
  auto bone = test::slab(0.5);
  HapticRenderer r(quiet(), bone, {}, 1e-3);
  const int cylinder = burr_index(BurrKind::cutting, 4, BurrShape::cylinder);
  const auto on_tip = at({19, 0, 1.6}, {1, 0, 0}, false, cylinder), on_end = at({-25, 0, 1.6}, {1, 0, 0}, false, cylinder);
  static_cast<void>(settled(r, on_tip));
  const double tip = r.contact().torque_n_mm.y, tip_force = r.contact().force_n.z;
  HapticRenderer r2(quiet(), bone, {}, 1e-3);
  static_cast<void>(settled(r2, on_end));
  const double end = r2.contact().torque_n_mm.y, end_force = r2.contact().force_n.z;
  EXPECT_GT(tip_force, 0.5);
  EXPECT_GT(end_force, 0.5);
  EXPECT_NEAR(-tip / tip_force, 0.5, 0.5);  // bone up to 1 mm from the tip's centre
  EXPECT_NEAR(-end / end_force, 5.5, 0.6);  // from 5 mm on, to the end at 6
}

TEST(CurveFixture, HoldsTheHandOnItsCurve) {
  auto bone = test::slab(0.5);
  auto setup = quiet();
  setup.curve = {{-10, 0, 10}, {10, 0, 10}};
  setup.curve_params.stiffness_n_per_mm = 0.5;
  HapticRenderer r(setup, bone, {}, 1e-3);
  const auto pose = at({2, 3, 10}, {0, 0, 1}, false);
  const Vec3 f = settled(r, pose);
  EXPECT_NEAR(f.y, -1.5, 1e-3);
  EXPECT_NE(r.step(pose).record.flags & kCurveHeld, 0u);
}

TEST(Stiffness, IsWhatTheDeviceBears) {
  auto bone = test::slab(0.5);
  HapticSetup setup;
  setup.params.contact.stiffness_n_per_mm = 4;
  setup.device = {.damping_n_s_per_m = 1, .delay_s = 5e-3, .encoder_mm = 0, .max_force_n = 8, .max_stiffness_n_per_mm = 1e9};
  const HapticRenderer slow(setup, bone, {}, 1e-3);
  EXPECT_NEAR(slow.stiffness_n_per_mm(), 0.5 * 2 / 5.5, 1e-9);
  setup.device.delay_s = 0;
  const HapticRenderer quick(setup, bone, {}, 1e-4);
  EXPECT_EQ(quick.stiffness_n_per_mm(), 4);
}

// A nerve 3 mm under the surface: how near the burr is, how thick the bone above it, and what happens when it is met.
TEST(Structures, ClearanceThicknessAndInjury) {
  Labels labels;
  labels.frame.dims = {80, 80, 80};
  labels.frame.spacing_mm = {0.5, 0.5, 0.5};
  labels.frame.origin_mm = {-20, -20, -30};
  const auto v = make_voxels<std::uint8_t>(labels.frame.voxel_count());
  std::size_t n = 0;
  for (int k = 0; k < 80; ++k)
    for (int j = 0; j < 80; ++j)
      for (int i = 0; i < 80; ++i, ++n) {
        const Vec3 p = labels.frame.world_from_index({double(i), double(j), double(k)});
        v[n] = std::hypot(p.y, p.z + 4) < 1 ? 6 : 0;  // along x, its top at z = -3
      }
  labels.voxels = v;
  labels.structures = {{6, "facial nerve", {}}};
  auto bone = test::slab(0.5);
  HapticRenderer r(quiet(), bone, {nullptr, nullptr, std::make_shared<const StructureMap>(labels)}, 1e-3);
  TickRecord record;
  for (int t = 0; t < 200; ++t) record = r.step(at({0, 0, 5 - 0.018 * t}, {1, 0, 0}, false)).record;
  EXPECT_EQ(record.structure, 6u);
  EXPECT_NEAR(record.clearance_mm, 3, 0.5);  // the tool is shown at the surface, 3 mm above
  EXPECT_EQ(record.flags & (kStructureTouched | kStructureInjured), 0u);
  EXPECT_EQ(record.thickness_mm, 10);  // the slab is thicker than the reach
  // The bone above it gone, the burr comes down on the nerve.
  for (std::uint32_t key = 0; key < bone.brick_count() * BrickGrid::kVoxels; ++key) bone.set(key, 0);
  for (int t = 0; t < 300; ++t) record = r.step(at({0, 0, 1.4 - 0.012 * t}, {1, 0, 0}, false)).record;
  EXPECT_LT(record.clearance_mm, 0);
  EXPECT_NE(record.flags & kStructureTouched, 0u);
  EXPECT_EQ(record.flags & kStructureInjured, 0u);
  record = r.step(at({0, 0, -2.2}, {1, 0, 0}, true)).record;
  EXPECT_NE(record.flags & kStructureInjured, 0u);
}

}  // namespace
}  // namespace osteo
