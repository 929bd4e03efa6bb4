#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "osteo/core/base/error.h"
#include "osteo/simulation/haptics/device.h"
#include "osteo/simulation/haptics/renderer.h"
#include "slab.h"

namespace osteo {
namespace {

DeviceSample at(Vec3 x, Vec3 axis, bool drill, int tool = 3) {
  DeviceSample s;
  s.position_mm = {static_cast<float>(x.x), static_cast<float>(x.y), static_cast<float>(x.z)};
  s.axis = {static_cast<float>(axis.x), static_cast<float>(axis.y), static_cast<float>(axis.z)};
  s.pedal = drill ? 255 : 0;
  s.tool = static_cast<std::uint8_t>(tool);
  return s;
}

HapticSetup quiet() {
  HapticSetup s;
  s.device = SpringHand::traits();
  s.params.effects.vibration = false;
  s.params.effects.spin_up_s = s.params.effects.spin_down_s = 0;
  return s;
}

Vec3 settled(HapticRenderer& r, const DeviceSample& s, int ticks = 60) {
  TickRecord record;
  for (int t = 0; t < ticks; ++t) record = r.step(s).record;
  return {record.force_n[0], record.force_n[1], record.force_n[2]};
}

// On its side the burr drags across its axis and along the surface, the other way round for the other hand; on its pole
// it does not.
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

// A tool that slides over bone feels the scene's texture and one that rests does not; where none is listed nothing
// changes, to the bit; a burr that turns has its own.
TEST(Textured, IsFeltByWhatSlidesOverBone) {
  const auto forces = [](const std::string& texture, double mm_a_tick, bool drill) {
    auto bone = test::slab(0.5);
    auto setup = quiet();
    setup.texture_json = texture;
    HapticRenderer r(setup, bone, {}, 1e-3);
    settled(r, at({-3, 0, 1.4}, {0, 0, 1}, false), 200);
    std::vector<std::array<float, 3>> all;
    for (int t = 0; t < 200; ++t)
      all.push_back(r.step(at({-3 + mm_a_tick * t, 0, 1.4}, {0, 0, 1}, drill)).record.force_n);
    return all;
  };
  const std::string texture =
      R"({"osteotome_texture": 1, "rate_hz": 1000, "force_n": [0.5], "speed_mm_s": [20], "models": [{"force_n": 0.5, "speed_mm_s": 20, "ar": [0], "noise_n2": 0.04}]})";
  const auto plain = forces("", 0.02, false), shaken = forces(texture, 0.02, false);
  double power = 0;
  for (std::size_t i = 100; i < 200; ++i) {
    power += std::pow(shaken[i][1] - plain[i][1], 2) / 100;
    EXPECT_NEAR(shaken[i][0], plain[i][0], 1e-4);  // the way it slides
    EXPECT_NEAR(shaken[i][2], plain[i][2], 1e-4);  // out of the bone
  }
  EXPECT_NEAR(std::sqrt(power), 0.2, 0.05);
  EXPECT_EQ(forces(texture, 0.02, false), shaken);
  EXPECT_EQ(forces(texture, 0, false), forces("", 0, false));
  EXPECT_EQ(forces(texture, 0.02, true), forces("", 0.02, true));
  auto bone = test::slab(0.5);
  auto setup = quiet();
  setup.texture_json = "{}";
  EXPECT_THROW(HapticRenderer(setup, bone, {}, 1e-3), Error);
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
        for (int t = 0; t < n; ++t)
          sum += x[static_cast<std::size_t>(t)] * std::polar(1.0, -2 * std::numbers::pi * f * t / 1000.0);
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
      static_cast<void>(parse_vibration(text, "v.json"));
      return false;
    } catch (const Error& e) {
      return e.code() == ExitCode::usage && std::string(e.what()).find(part) != std::string::npos;
    }
  };
  EXPECT_TRUE(refused("{", "'v.json' line 1"));
  EXPECT_TRUE(refused(R"({"osteotome_vibration": 2})", "must be 1"));
  EXPECT_TRUE(refused(R"({"osteotome_vibration": 1, "band_hz": [400, 20]})", "band_hz"));
  EXPECT_TRUE(refused(
      R"({"osteotome_vibration": 1, "band_hz": [20, 400], "cutting": [{"frequency_hz": -1, "idle_n": 0, "per_n": 0}]})",
      "cutting 1"));
  EXPECT_TRUE(refused(R"({"osteotome_vibration": 1, "band_hz": [20, 400], "cutting": []})", "diamond"));
  // Nothing is left out in silence.
  const std::string good(default_vibration_json());
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return text;
  };
  EXPECT_NO_THROW(static_cast<void>(parse_vibration(good, "v.json")));
  EXPECT_TRUE(refused(with("\"band_hz\": [20, 400],", "\"band_hz\": [20, 400],\n\"band\": [1, 2],"),
                      "line 5: the key \"band\" is not known"));
  EXPECT_TRUE(refused(with("\"idle_n\": 0.015", "\"idle\": 0.015"),
                      "line 7: cutting 2: the key \"idle\" is not known: did you mean \"idle_n\"?"));
  EXPECT_TRUE(refused(with("\"idle_n\": 0.015", "\"idle_n\": 15"),
                      "line 7: cutting 2: \"idle_n\" is 15 and must be from 0 to 10"));
  EXPECT_TRUE(refused(with("[20, 400]", "[20, 1e400]"), "line 4"));
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
  const auto on_tip = at({19, 0, 1.6}, {1, 0, 0}, false, cylinder),
             on_end = at({-25, 0, 1.6}, {1, 0, 0}, false, cylinder);
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
  setup.device = {
      .damping_n_s_per_m = 1, .delay_s = 5e-3, .encoder_mm = 0, .max_force_n = 8, .max_stiffness_n_per_mm = 1e9};
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
  EXPECT_NEAR(record.clearance_mm, 3.25,
              0.06);  // the tool is shown at the surface; three voxels of 0.5 mm make the nerve
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

BrickGrid no_bone() {
  auto bone = test::slab(1);
  for (std::uint32_t key = 0; key < bone.brick_count() * BrickGrid::kVoxels; ++key) bone.set(key, 0);
  return bone;
}

// Two flat structures, 3 below z = 0 and 7 beyond x = 4, in voxels whose borders lie there.
std::shared_ptr<const StructureMap> floor_and_wall() {
  Labels labels;
  labels.frame.dims = {60, 40, 40};
  labels.frame.spacing_mm = {0.25, 0.25, 0.25};
  labels.frame.origin_mm = {-5 + 0.125, -5 + 0.125, -5 + 0.125};
  const auto v = make_voxels<std::uint8_t>(labels.frame.voxel_count());
  std::size_t n = 0;
  for (int k = 0; k < 40; ++k)
    for (int j = 0; j < 40; ++j)
      for (int i = 0; i < 60; ++i, ++n) {
        const Vec3 p = labels.frame.world_from_index({double(i), double(j), double(k)});
        v[n] = p.x > 4 && p.z > 0.5 ? 7 : p.z < 0 && p.x < 3 ? 3 : 0;
      }
  labels.voxels = v;
  return std::make_shared<const StructureMap>(labels);
}

// Touched and injured from the face on: a hundredth of a millimetre before it not, a hundredth behind it yes.
TEST(Structures, AreTouchedAndInjuredFromTheFaceOn) {
  const auto map = floor_and_wall();
  for (const bool drill : {false, true}) {
    auto bone = no_bone();
    HapticRenderer r(quiet(), bone, {nullptr, nullptr, map}, 1e-3);
    const std::uint32_t touched = kStructureTouched, all = kStructureTouched | kStructureInjured;
    for (const double deep : {-0.05, -0.01, 0.01, 0.05, 0.3, 1.0}) {
      const auto record = r.step(at({0, 0, 2 - deep}, {0, 0, 1}, drill)).record;
      EXPECT_EQ(record.structure, 3u);
      EXPECT_NEAR(record.clearance_mm, -deep, 0.002);
      EXPECT_EQ(record.flags & all, deep < 0 ? 0u : drill ? all : touched) << deep;
    }
    const auto e = r.structure_events().at(3);
    EXPECT_EQ(e.ticks_touched, 4u);
    EXPECT_EQ(e.ticks_injured, drill ? 4u : 0u);
    EXPECT_NEAR(e.least_clearance_mm, -1, 0.002);
  }
}

// A record names the nearest; the counts are of each, also of one that is touched while another is touched deeper.
TEST(Structures, SeveralAtOnceAllCount) {
  auto bone = no_bone();
  HapticRenderer r(quiet(), bone, {nullptr, nullptr, floor_and_wall()}, 1e-3);
  const auto there = [&](double x, double z, bool drill, int ticks) {
    TickRecord record;
    for (int t = 0; t < ticks; ++t) record = r.step(at({x, 0, z}, {0, 0, 1}, drill)).record;
    return record;
  };
  EXPECT_EQ(there(0.5, 3.0, false, 5).structure, 3u);  // 1 mm above the floor, 1.5 beside the wall
  EXPECT_EQ(there(2.2, 3.0, false, 5).structure, 7u);  // touches the wall alone
  EXPECT_EQ(there(2.2, 1.5, true, 7).structure, 3u);   // both, the floor deeper
  const auto events = r.structure_events();
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events.at(3).ticks_touched, 7u);
  EXPECT_EQ(events.at(3).ticks_injured, 7u);
  EXPECT_EQ(events.at(7).ticks_touched, 12u);
  EXPECT_EQ(events.at(7).ticks_injured, 7u);
  EXPECT_NEAR(events.at(7).least_clearance_mm, -0.2, 0.01);
  EXPECT_NEAR(events.at(3).least_clearance_mm, -0.5, 0.05);
}

// What never came within reach of the burr's surface is not told of; what only just did, is.
TEST(Structures, OnlyThoseWithinReachAreListed) {
  auto bone = no_bone();
  HapticRenderer r(quiet(), bone, {nullptr, nullptr, floor_and_wall()}, 1e-3);
  for (const double z : {14.0, 13.0, 12.0}) static_cast<void>(r.step(at({-12, 0, z}, {0, 0, 1}, false)));
  EXPECT_TRUE(r.structure_events().empty());
  const auto record = r.step(at({-4.9, 0, 9.9}, {0, 0, 1}, false)).record;
  EXPECT_EQ(record.structure, 3u);
  EXPECT_NEAR(record.clearance_mm, 7.9, 0.02);
  EXPECT_EQ(r.structure_events().size(), 1u);
}

// A burr that does not turn, or whose hand is held, lost or has just jumped, touches but does not injure.
TEST(Structures, OnlyATurningBurrInjures) {
  const auto map = floor_and_wall();
  const auto pose = at({0, 0, 1.5}, {0, 0, 1}, true);
  const auto flags = [&](auto&& prepare, HapticSetup setup = quiet()) {
    auto bone = no_bone();
    HapticRenderer r(setup, bone, {nullptr, nullptr, map}, 1e-3);
    for (int t = 0; t < 10; ++t) static_cast<void>(r.step(pose));
    const auto before = r.structure_events().at(3).ticks_injured;
    DeviceSample s = pose;
    prepare(r, s);
    const auto f = r.step(s).record.flags;
    EXPECT_NE(f & kStructureTouched, 0u);
    EXPECT_EQ(r.structure_events().at(3).ticks_injured - before, (f & kStructureInjured) != 0 ? 1u : 0u);
    return f & kStructureInjured;
  };
  EXPECT_NE(flags([](HapticRenderer&, DeviceSample&) {}), 0u);
  EXPECT_EQ(flags([](HapticRenderer&, DeviceSample& s) { s.pedal = 0; }), 0u);
  EXPECT_EQ(flags([](HapticRenderer& r, DeviceSample&) { r.hold(true); }), 0u);
  EXPECT_EQ(flags([](HapticRenderer&, DeviceSample& s) { s.age_ms = 60; }), 0u);
  EXPECT_EQ(flags([](HapticRenderer&, DeviceSample& s) { s.position_mm[0] = NAN; }), 0u);
  EXPECT_EQ(flags([](HapticRenderer& r, DeviceSample& s) {
              static_cast<void>(r.step(at({0, 0, 60}, {0, 0, 1}, true)));
              s.position_mm[0] = 0.01F;
            }),
            0u);
  auto still = quiet();
  still.params.effects.speed_rpm = 0;
  EXPECT_EQ(flags([](HapticRenderer&, DeviceSample&) {}, still), 0u);
}

// Where the hand was torn to in one tick nothing is cut, however deep in bone that is; in the next it is.
TEST(Removal, NothingInTheTickOfAJump) {
  auto bone = test::slab(0.5);
  HapticRenderer r(quiet(), bone, {}, 1e-3);
  for (int t = 0; t < 20; ++t) static_cast<void>(r.step(at({0, 0, 40}, {0, 0, 1}, true)));
  const auto [jump, none] = r.step(at({0, 0, 1.2}, {0, 0, 1}, true));
  EXPECT_NE(jump.flags & kPoseJumped, 0u);
  EXPECT_GT(jump.normal_force_n, 0.5);
  EXPECT_EQ(none.size(), 0u);
  EXPECT_EQ(jump.removed_mm3, 0);
  const auto [next, some] = r.step(at({0, 0, 1.2}, {0, 0, 1}, true));
  EXPECT_GT(some.size(), 0u);
  EXPECT_GT(next.removed_mm3, 0);
}

// Bone cut in two that nobody has opened: the halves share the force, and together lose what the whole would.
TEST(Removal, BodiesShareTheForce) {
  const auto drilled = [](bool two, double* force_n) {
    auto setup = quiet();
    setup.params.effects.fail_safe = false;
    auto left = test::slab(0.5), right = test::slab(0.5);
    for (VoxelKey v = 0; two && v < left.brick_count() * BrickGrid::kVoxels; ++v) {
      (left.frame().world_from_index({double(left.coordinate(v).i), 0, 0}).x < 0 ? right : left).set(v, 0);
    }
    HapticRenderer r(setup, Anatomy{}, 1e-3);
    HapticScene scene;
    scene.add(std::make_shared<TouchedBone>(left, nullptr), {}, r.setup());
    if (two) scene.add(std::make_shared<TouchedBone>(right, nullptr), {}, r.setup());
    r.show(&scene);
    double removed = 0;
    *force_n = 0;
    for (int t = 0; t < 100; ++t) {
      const auto record = r.step(at({0, 0, 1.6 - 0.002 * t}, {0, 0, 1}, true)).record;
      removed += static_cast<double>(record.removed_mm3);
      *force_n += static_cast<double>(record.normal_force_n) / 100;
    }
    return removed;
  };
  double force_of_one = 0, force_of_two = 0;
  const double one = drilled(false, &force_of_one), two = drilled(true, &force_of_two);
  EXPECT_GT(one, 0.2);
  EXPECT_NEAR(two / one, 1, 0.03);
  EXPECT_NEAR(force_of_two / force_of_one, 1, 0.03);
}

}  // namespace
}  // namespace osteo
