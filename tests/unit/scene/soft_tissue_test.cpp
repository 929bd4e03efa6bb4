// Several bodies of soft tissue and several hands: felt together, asleep while nothing is near, held aside, pressed
// deep.
#include "osteo/session/scene/soft_tissue.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <thread>

#include "bar.h"
#include "osteo/core/base/error.h"
#include "osteo/imaging/io/tet_io.h"
#include "osteo/session/recording/session_file.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/simulation/bone/instrument.h"
#include "scratch.h"
#include "tissue/block.h"

namespace osteo {
namespace {

namespace fs = std::filesystem;

// Of nx x ny x nz voxels from `corner` on.
TetMesh voxels(int nx, int ny, int nz, double h, Vec3 corner) {
  const auto b = test::block(nx, ny, nz, h);
  TetMesh m;
  for (const Vec3& p : b.points) m.points_mm.push_back(to_floats(p + corner));
  for (const auto& t : b.tets) m.tets.push_back(t);
  return m;
}

// Held in boxes, or by bone alone.
std::string problem(double young_kpa, const std::string& boxes = "") {
  return R"({"osteotome_tissue": 1, "material": {"young_kpa": )" + std::to_string(young_kpa) +
         R"(, "poisson": 0.45}, "fixed": [)" + (boxes.empty() ? "" : R"({"box_mm": )" + boxes + "}") + "]}";
}

// A pad of 24 x 24 x 9 mm with its underside, which is held, at z = 60: far from the bar.
std::unique_ptr<SoftBody> pad(double young_kpa = 40, double h = 3, Vec3 corner = {0, 0, 60}) {
  char box[200];
  std::snprintf(box, sizeof box, "[[-1e3, -1e3, %f], [1e3, 1e3, %f]]", corner.z - 0.1, corner.z + 0.1);
  const int n = static_cast<int>(24 / h);
  return std::make_unique<SoftBody>(voxels(n, n, static_cast<int>(9 / h), h, corner), problem(young_kpa, box));
}

std::uint8_t diamond(double diameter_mm) {
  return static_cast<std::uint8_t>(burr_index(BurrKind::diamond, diameter_mm));
}
std::uint8_t instrument(const char* name) {
  return static_cast<std::uint8_t>(instrument_index(name));
}
const SoftTool kFar{{0, 0, 500}, {0, 0, 1}, 0, false};

SoftPush update(SoftBody& body, const SoftTool& tool) {
  return body.update({&tool, 1}).front();
}
std::vector<SceneAction> update(SoftTissue& tissue, const SoftTool& tool) {
  return tissue.update({&tool, 1});
}

double upper_face(const World& world) {
  double top = 0;
  for (double z = 0; z < 60; z += 0.01) {
    if (world.nearest({0, 0, z}) > 0.5F) top = z;
  }
  return top;
}

double farthest(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double most = 0;
  for (std::size_t p = 0; p < a.size(); ++p) most = std::max(most, length(a[p] - b[p]));
  return most;
}

// How often the surface goes round a place: 1 inside, 0 outside (A. van Oosterom, J. Strackee 1983).
double winding(const TriMesh& surface, Vec3 at) {
  double sum = 0;
  for (const auto& t : surface.triangles) {
    const Vec3 a = from_floats(surface.points_mm[t[0]]) - at, b = from_floats(surface.points_mm[t[1]]) - at,
               c = from_floats(surface.points_mm[t[2]]) - at;
    const double la = length(a), lb = length(b), lc = length(c);
    sum += 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return sum / (4 * std::numbers::pi);
}

// A pad that lies on bone and has grown on it, pressed by a burr of 3 mm three radii deep: without grip the surface
// slipped round the burr beyond two, and it was found inside the body with next to no force.
TEST(SoftTissue, ABurrPressedThreeRadiiDeepDoesNotSlipThrough) {
  const World world(test::bar(1, 0));
  const double top = upper_face(world), h = 1.5, r = 1.5, thick = 9;
  struct Press {
    double young_kpa, x, y;
  };
  for (const Press& press : {Press{40, 0, 0}, Press{20, 0.4, 0.3}, Press{5, 0.75, 0.75}}) {
    SoftBody body(voxels(16, 8, 6, h, {-12, -6, top - 0.8}), problem(press.young_kpa));
    body.meet(&world);
    const double surface = top - 0.8 + thick;
    double before = 0, at_two = 0;
    for (int n = 0; n <= 90; ++n) {
      const double deep = 0.05 * n;  // 5 mm/s
      const Vec3 tip{press.x, press.y, surface + r - deep};
      const SoftPush push = update(body, {tip, {0, 0, 1}, diamond(3), false});
      if (n % 10 != 0) continue;
      const double force = length(push.force_n);
      EXPECT_GE(force, 0.98 * before) << press.young_kpa << " kPa, " << deep / r << " radii deep";
      if (n > 0) {
        EXPECT_GT(push.force_n.z, 0.95 * force) << deep / r;
      }
      EXPECT_LT(std::abs(winding(body.drawn(), tip)), 0.5)
          << press.young_kpa << " kPa: inside at " << deep / r << " radii";
      before = force;
      if (n == 60) at_two = force;
    }
    EXPECT_GT(before, 1.3 * at_two) << "three radii push harder than two";
    // Taken out again it is whole: nothing stays caught on the burr.
    const std::vector<Vec3> dented = body.points_mm();
    for (int n = 0; n < 60; ++n)
      update(body, {{press.x, press.y, surface + r - 4.5 + 0.2 * n}, {0, 0, 1}, diamond(3), false});
    for (int n = 0; n < 60; ++n) update(body, kFar);
    std::vector<Vec3> rest;
    for (const auto& p : voxels(16, 8, 6, h, {-12, -6, top - 0.8}).points_mm) rest.push_back(from_floats(p));
    EXPECT_GT(farthest(dented, rest), 3);
    EXPECT_LT(farthest(body.points_mm(), rest), 0.3) << press.young_kpa;
  }
}

// A tool that teleports while it has dug in drags nothing along.
TEST(SoftTissue, WhatHasDugInLetsGoOfAToolThatJumps) {
  const auto body = pad(20, 1.5);
  for (int n = 0; n <= 80; ++n) update(*body, {{12, 12, 70.5 - 0.05 * n}, {0, 0, 1}, diamond(3), false});
  EXPECT_GT(length(update(*body, {{12, 12, 66.5}, {0, 0, 1}, diamond(3), false}).force_n), 0.05);
  for (int n = 0; n < 60; ++n) {
    const SoftPush push = update(*body, {{12, 20, 71}, {0, 0, 1}, diamond(3), false});
    EXPECT_LT(length(push.force_n), 0.01);
  }
}

// Two pads one above the other with the tool between them: what it feels is their sum, and each rises along its own
// way.
TEST(SoftTissue, ForcesOfAllBodiesOnAToolAreOnePlane) {
  const SoftTool tool{{12, 12, 72}, {1, 0, 0}, diamond(6), false};
  const auto tilted = [](bool above) {  // one below, and one beside the tool
    return above ? std::make_unique<SoftBody>(voxels(8, 8, 3, 3, {14.2, 0, 62}),
                                              problem(20, "[[37, -1e3, -1e3], [39, 1e3, 1e3]]"))
                 : std::make_unique<SoftBody>(voxels(8, 8, 3, 3, {0, 0, 61}),
                                              problem(40, "[[-1e3, -1e3, 60.9], [1e3, 1e3, 61.1]]"));
  };
  SoftTissue both;
  both.add("below", tilted(false));
  both.add("beside", tilted(true));
  const auto below = tilted(false), beside = tilted(true);
  std::vector<SceneAction> felt;
  SoftPush push[2];
  for (int n = 0; n < 60; ++n) {
    felt = update(both, tool);
    push[0] = below->update({&tool, 1}, SoftBody::kMaxWork - beside->work()).front();
    push[1] = update(*beside, tool);
  }
  ASSERT_EQ(both.facts()[0].of_real_time, below->slow_motion()) << "it has what the softer one leaves";
  ASSERT_EQ(both.facts()[1].of_real_time, beside->slow_motion());
  ASSERT_GT(length(push[0].force_n), 0.003);
  ASSERT_GT(length(push[1].force_n), 0.003);
  ASSERT_EQ(felt.size(), 1u);
  EXPECT_EQ(felt[0].hand, 0u);
  const Vec3 sum = push[0].force_n + push[1].force_n, along = normalized(sum);
  double stiffness = 0;
  for (const SoftPush& p : push) {
    const double share = dot(normalized(p.force_n), along);
    stiffness += p.stiffness_n_per_mm * share * share;
  }
  EXPECT_NEAR(felt[0].values[6], length(sum), 1e-9);
  for (std::size_t a = 0; a < 3; ++a) EXPECT_NEAR(felt[0].values[3 + a], along[a], 1e-9);
  EXPECT_NEAR(felt[0].values[7], stiffness, 1e-9);
  EXPECT_LT(stiffness, push[0].stiffness_n_per_mm + push[1].stiffness_n_per_mm);
}

// The same body twice at one place is twice as stiff to the hand, and nothing is thrown: bodies do not feel each other.
TEST(SoftTissue, BodiesThatOverlapAddUp) {
  SoftTissue twice;
  twice.add("one", pad(5));
  twice.add("the same", pad(5));
  const auto once = pad(5);
  for (int n = 0; n < 80; ++n) {
    const SoftTool tool{{12, 12, 72.5 - 0.04 * n}, {0, 0, 1}, diamond(6), false};
    const auto felt = update(twice, tool);
    const SoftPush alone = update(*once, tool);
    ASSERT_EQ(felt.size(), length(alone.force_n) > 0 ? 1u : 0u) << n;
    if (felt.empty()) continue;
    ASSERT_DOUBLE_EQ(felt[0].values[6], 2 * length(alone.force_n));
    ASSERT_DOUBLE_EQ(felt[0].values[7], 2 * alone.stiffness_n_per_mm);
  }
  EXPECT_EQ(twice.body(0).points_mm(), once->points_mm());
  EXPECT_EQ(twice.body(1).points_mm(), once->points_mm());
}

// At rest and far from every tool it costs nothing; a tool that comes near finds it as if it had been awake all the
// time.
TEST(SoftTissue, SleepsUntilAToolComesNear) {
  SoftTissue tissue;
  tissue.add("flap", pad());
  SoftBody& body = tissue.body(0);
  // Pressed and let go: it goes to sleep when it has come to rest, not before.
  for (int n = 0; n < 40; ++n) update(tissue, {{12, 12, 71}, {0, 0, 1}, diamond(6), false});
  const std::vector<Vec3> pressed = body.points_mm();
  int n = 0;
  for (; n < 1000 && !body.asleep(); ++n) update(tissue, kFar);
  EXPECT_GT(n, 50);
  ASSERT_LT(n, 300);
  EXPECT_TRUE(tissue.facts()[0].asleep);
  const std::vector<Vec3> asleep = body.points_mm();
  EXPECT_GT(farthest(pressed, asleep), 0.5);
  std::vector<Vec3> rest;
  for (const auto& p : voxels(8, 8, 3, 3, {0, 0, 60}).points_mm) rest.push_back(from_floats(p));
  EXPECT_LT(farthest(rest, asleep), 0.02);
  const std::uint64_t updates = body.updates();
  for (int k = 0; k < 500; ++k) EXPECT_TRUE(update(tissue, kFar).empty());
  EXPECT_EQ(body.updates(), updates);
  // What is no number is not near.
  update(tissue, {{NAN, 0, 0}, {0, 0, 1}, diamond(6), false});
  EXPECT_EQ(body.updates(), updates);
  update(tissue, {{12, 12, 69 + 3 + SoftBody::kNearMm - 0.1}, {0, 0, 1}, diamond(6), false});
  EXPECT_EQ(body.updates(), updates + 1);
  EXPECT_FALSE(body.asleep());
  const auto fresh = pad();
  double most = 0;
  for (int k = 0; k < 40; ++k) {
    const SoftTool tool{{12, 12, 72 - 0.03 * k}, {0, 0, 1}, diamond(6), false};
    const auto felt = update(tissue, tool);
    const SoftPush alone = update(*fresh, tool);
    most = std::max(most, length(alone.force_n));
    EXPECT_NEAR(felt.empty() ? 0 : felt[0].values[6], length(alone.force_n), 0.01 * most + 1e-3);
  }
  EXPECT_GT(most, 0.05);
}

// What it has grown on is drilled away by another hand while it sleeps: it wakes, and is held no more.
TEST(SoftTissue, WakesWhenItsBoneIsDrilledAway) {
  for (const bool drilled : {false, true}) {
    const World world(test::bar(1, 0));
    const double top = upper_face(world);
    SoftTissue tissue;
    tissue.add("gland", std::make_unique<SoftBody>(voxels(4, 4, 3, 2, {-4, -4, top - 0.8}), problem(10)));
    tissue.meet(&world);
    SoftBody& body = tissue.body(0);
    for (int n = 0; n < 300 && !body.asleep(); ++n) update(tissue, kFar);
    ASSERT_TRUE(body.asleep());
    if (drilled) {
      BrickGrid& bone = world.bodies().front().body->bone;
      for (VoxelKey v = 0; v < bone.brick_count() * BrickGrid::kVoxels; ++v) bone.set(v, 0);
      // Reported of elsewhere first.
      TickRecord tick;
      tick.device.position_mm = to_floats({0, 0, -60});
      tick.device.tool = diamond(3);
      const VoxelChange change;
      tissue.tick(tick, {&change, 1});
      EXPECT_TRUE(body.asleep());
      tick.device.position_mm = to_floats({0, 0, -3});
      tissue.tick(tick, {});
      EXPECT_TRUE(body.asleep()) << "nothing was removed";
      tissue.tick(tick, {&change, 1});
      EXPECT_FALSE(body.asleep());
    }
    // Pushed aside and left alone.
    for (int n = 0; n <= 60; ++n) update(tissue, {{-7 + 0.05 * n, 0, top + 2.2}, {0, 0, 1}, diamond(6), false});
    const std::vector<Vec3> before = body.points_mm();
    for (int n = 0; n < 200; ++n) update(tissue, kFar);
    Vec3 middle{};
    for (const Vec3& p : body.points_mm()) middle += p / static_cast<double>(before.size());
    if (drilled) {
      EXPECT_GT(middle.x, 1);
    } else {
      EXPECT_LT(std::abs(middle.x), 0.1);
    }
  }
}

// Those that need less than their part leave it to the others; one alone has all.
TEST(SoftTissue, BodiesShareWhatAnUpdateMayTake) {
  SoftTissue tissue;
  tissue.add("large", pad(40, 1.5));
  tissue.add("large too", pad(40, 1.5, {0, 0, 90}));
  tissue.add("small", pad(5, 3, {0, 0, 120}));
  const double alone = pad(40, 1.5)->slow_motion(), small = pad(5, 3)->slow_motion();
  ASSERT_LT(alone, 0.5);
  ASSERT_GT(small, 0.99);
  update(tissue, kFar);
  const auto facts = tissue.facts();
  EXPECT_EQ(facts[2].of_real_time, small);
  EXPECT_EQ(facts[0].of_real_time, facts[1].of_real_time);
  const double rest = (SoftBody::kMaxWork - tissue.body(2).work()) / SoftBody::kMaxWork;
  EXPECT_NEAR(facts[0].of_real_time, alone * rest / 2, 0.05 * alone);
  // The others asleep, the first has all of it.
  const SoftTool tool{{12, 12, 72.2}, {0, 0, 1}, diamond(6), false};
  // What lies still goes to sleep within a second, however short its steps: rounding does not keep it awake.
  for (int n = 0; n < 100 && !(tissue.body(1).asleep() && tissue.body(2).asleep()); ++n) update(tissue, tool);
  ASSERT_TRUE(tissue.body(1).asleep());
  update(tissue, tool);
  EXPECT_FALSE(tissue.facts()[0].asleep);
  EXPECT_EQ(tissue.facts()[0].of_real_time, alone);
}

RehearsalOptions options(const fs::path& file, std::shared_ptr<SoftTissue> tissue, std::size_t hands) {
  RehearsalOptions o;
  o.session_file = file;
  o.haptics.device = SpringHand::traits();
  o.haptics.more_devices.assign(hands - 1, SpringHand::traits());
  o.soft = std::move(tissue);
  return o;
}

Strokes strokes(std::uint8_t tool, Vec3 axis, std::vector<Strokes::Waypoint> waypoints) {
  Strokes s;
  s.tool = tool;
  s.axis = axis;
  s.waypoints = std::move(waypoints);
  return s;
}

std::vector<std::unique_ptr<Device>> devices(const std::vector<Strokes>& hands) {
  std::vector<std::unique_ptr<Device>> all;
  for (const Strokes& s : hands) all.push_back(std::make_unique<ScriptedDevice>(s, 1000));
  return all;
}

// Under a sanitizer an update of these bodies may take longer than the strokes.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kInstrumented = true;
#else
constexpr bool kInstrumented = false;
#endif

// Two hands in two bodies: each feels its own, with its own plane, and a replay, which knows no tissue, comes out the
// same.
TEST(SoftTissue, EachHandFeelsItsOwn) {
  for (const bool by_the_clock : {false, true}) {
    const test::ScratchFolder scratch;
    const fs::path file = scratch / "stream.oss";
    World world(test::bar(1, 0));
    const World start = world.copy();
    auto tissue = std::make_shared<SoftTissue>();
    tissue->add("left flap", pad(40, 3, {0, 0, 60}));
    tissue->add("right flap", pad(10, 3, {0, 60, 60}));
    const std::vector<Strokes> hands{
        strokes(diamond(6), {0, 0, 1},
                {{0, {12, 12, 76}}, {0.4, {12, 12, 70}}, {1, {12, 12, 70}}, {1.4, {12, 12, 80}}}),
        strokes(instrument("sucker 12 Fr"), {0, 0, 1},
                {{0, {12, 72, 76}}, {0.4, {12, 72, 69}}, {1, {12, 72, 69}}, {1.4, {12, 72, 69}}})};
    Rehearsal r(std::move(world), devices(hands), options(file, tissue, 2), {});
    if (by_the_clock) {
      r.start();
      // Whoever looks at it meanwhile, in a window or for a panel.
      std::size_t looked = 0;
      while (r.running()) {
        r.look([&](const World&, SceneReaders&) {
          for (std::size_t b = 0; b < r.soft()->size(); ++b) looked += r.soft()->body(b).drawn().points_mm.size();
        });
        EXPECT_EQ(r.tissue().size(), 2u);
        EXPECT_EQ(r.tissue_mm3(), 0);
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
      EXPECT_GT(looked, 0u);
      r.stop();
    } else {
      r.run_to_end({});
    }
    const Session session = read_session(file);
    double most[2] = {}, last[2] = {};
    for (const TickRecord& t : session.ticks) {
      most[t.hand] = std::max(most[t.hand], from_floats(t.force_n).z);
      last[t.hand] = length(from_floats(t.force_n));
    }
    // In real time planes are fewer where other programs have the machine, and so coarser.
    const bool in_time = !by_the_clock || !kInstrumented;
    if (in_time) EXPECT_GT(most[0], by_the_clock ? 0 : 0.1);
    if (in_time) EXPECT_GT(most[1], by_the_clock ? 0 : 0.02);
    EXPECT_LT(last[0], 1e-3) << "it has left";
    if (!by_the_clock) {
      EXPECT_LT(most[1], 0.7 * most[0]) << "softer, and a thinner tool";
      EXPECT_GT(last[1], 0.01) << "it has not";
    }
    std::size_t planes[2] = {};
    for (const auto& a : session.actions) {
      if (!a.action.is(ActionKind::soft_push)) continue;
      ASSERT_LT(a.action.hand, 2u);
      ++planes[a.action.hand];
      if (a.action.values[6] > 0) {
        EXPECT_NEAR(a.action.values[1], a.action.hand == 0 ? 12 : 72, 2);
      }
    }
    if (in_time) EXPECT_GT(planes[0], by_the_clock ? 0u : 60u);
    if (in_time)
      EXPECT_GT(planes[1], by_the_clock ? 0u : 60u) << "a machine that is late for every update starves no hand";
    const ReplayResult again = replay(SessionReader(file), start.copy(), {}, {});
    EXPECT_TRUE(again.identical) << again.difference;
  }
}

// A flap lies over the place where the burr is to drill. With a sucker of the second hand that holds it aside the burr
// drills bone and meets no tissue; without, it cuts its way through the flap.
TEST(SoftTissue, TheSecondHandHoldsAFlapAside) {
  const World of(test::bar(0.5, 0));
  const double top = upper_face(of);
  const double h = 1.5;
  double tissue_mm3[2], removed_mm3[2], felt[2];
  std::string hashes[2];
  for (const bool held : {false, true}) {
    for (const bool again : {false, true}) {
      if (again && !held) continue;
      const test::ScratchFolder scratch;
      const fs::path file = scratch / "stream.oss";
      World world(test::bar(0.5, 0));
      const World start = world.copy();
      auto tissue = std::make_shared<SoftTissue>();
      // 24 mm long, 6 mm wide, 4.5 mm high, held at one end, half a millimetre above the bone; it lies over the place.
      tissue->add("flap", std::make_unique<SoftBody>(voxels(16, 4, 3, h, {-20, -3, top + 0.5}),
                                                     problem(60, "[[-21, -1e3, -1e3], [-19.9, 1e3, 1e3]]")));
      std::vector<Strokes> hands{strokes(static_cast<std::uint8_t>(burr_index(BurrKind::cutting, 3)), {0, 0, 1},
                                         {{0, {2, 0, top + 16}, false},
                                          {1.6, {2, 0, top + 16}, true},
                                          {2.4, {2, 0, top + 1.4}, true},
                                          {4, {2, 0, top + 0.6}, true}})};
      // From the side, handle to the side: it meets the flap at half its height, and stays.
      if (held)
        hands.push_back(
            strokes(instrument("sucker 12 Fr"), {0, 1, 0},
                    {{0, {-3, 7, top + 2.75}}, {1.4, {-3, -3.5, top + 2.75}}, {4, {-3, -3.5, top + 2.75}}}));
      Rehearsal r(std::move(world), devices(hands), options(file, tissue, hands.size()), {});
      const RehearsalSummary s = r.run_to_end({});
      tissue_mm3[held] = s.tissue_mm3;
      removed_mm3[held] = s.removed_mm3;
      const Session session = read_session(file);
      felt[held] = 0;
      double retractor = 0;
      for (const auto& a : session.actions) {
        if (!a.action.is(ActionKind::soft_push)) continue;
        (a.action.hand == 0 ? felt[held] : retractor) =
            std::max(a.action.hand == 0 ? felt[held] : retractor, a.action.values[6]);
      }
      EXPECT_EQ(retractor > 0.005, held) << retractor;
      ASSERT_EQ(s.tissue.size(), 1u);
      EXPECT_EQ(s.tissue[0].name, "flap");
      EXPECT_EQ(s.tissue[0].cut_off_mm3, s.tissue_mm3);
      if (again) {
        EXPECT_EQ(s.bone_hash, hashes[held]) << "the same script gives the same";
        const ReplayResult replayed = replay(SessionReader(file), start.copy(), {}, {});
        EXPECT_TRUE(replayed.identical) << replayed.difference;
      }
      hashes[held] = s.bone_hash;
    }
  }
  EXPECT_GT(tissue_mm3[false], 3 * h * h * h);
  EXPECT_GT(felt[false], 0.005);
  EXPECT_EQ(tissue_mm3[true], 0);
  EXPECT_EQ(felt[true], 0);
  EXPECT_GT(removed_mm3[true], 1);
}

// A piece of bone that is moved into a sleeping body pushes it away: by what the world does, not by a tool.
TEST(SoftTissue, WakesWhenBoneIsMovedIntoIt) {
  const test::ScratchFolder scratch;
  World world(test::bar(1, 0));
  const double top = upper_face(world);
  const World start = world.copy();
  auto tissue = std::make_shared<SoftTissue>();
  char box[100];
  std::snprintf(box, sizeof box, "[[-1e3, -1e3, %f], [1e3, 1e3, %f]]", top + 6.9, top + 7.1);
  const TetMesh mesh = voxels(4, 4, 3, 2, {-4, -4, top + 1});
  tissue->add("dura", std::make_unique<SoftBody>(mesh, problem(10, box)));
  RehearsalOptions o = options(scratch / "stream.oss", tissue, 1);
  SceneAction up = SceneAction::move(world.bodies().front().body->id, {{}, {0, 0, 2.5}});
  up.tick = 1500;
  o.actions = {up};
  struct Watch final : Reader {
    const SoftTissue* tissue = nullptr;
    bool slept = false;
    void tick(const TickRecord& t, std::span<const VoxelChange>) override {
      if (t.tick == 1490) slept = tissue->facts()[0].asleep;
    }
  } watch;
  watch.tissue = tissue.get();
  const std::vector<Strokes> hands{strokes(diamond(3), {0, 0, 1}, {{0, {0, 0, 90}}, {3, {0, 0, 90}}})};
  Rehearsal r(std::move(world), devices(hands), o, {});
  r.add_reader(watch);
  const RehearsalSummary s = r.run_to_end({});
  EXPECT_FALSE(s.refused());
  EXPECT_TRUE(watch.slept);
  EXPECT_GT(tissue->body(0).updates(), 110u) << "half a second, and again";
  double lowest = 1e9;
  for (const Vec3& p : tissue->body(0).points_mm()) lowest = std::min(lowest, p.z);
  EXPECT_GT(lowest, top + 1 + 0.7) << "its underside lay 1.5 mm deep in bone otherwise";
  const ReplayResult again = replay(SessionReader(scratch / "stream.oss"), start.copy(), {}, {});
  EXPECT_TRUE(again.identical) << again.difference;
}

// Files of a case.

class Listed : public testing::Test {
 protected:
  fs::path folder() const { return scratch_.path(); }
  void put(const fs::path& where, double young_kpa = 20) const {
    fs::create_directories(where);
    save_tets(voxels(2, 2, 2, 3, {0, 0, 60}), where / "tissue.vtu");
    std::ofstream(where / "tissue.json") << problem(young_kpa);
  }
  // Reported with this word in it.
  void refused(const std::string& word, ExitCode code) const {
    try {
      static_cast<void>(soft_tissue_of(folder()));
      FAIL() << "taken: " << word;
    } catch (const Error& e) {
      EXPECT_NE((std::string(e.what()) + e.advice()).find(word), std::string::npos) << e.what();
      EXPECT_EQ(e.code(), code) << e.what();
    }
  }
  test::ScratchFolder scratch_;
};

TEST_F(Listed, NothingIsNothing) {
  EXPECT_EQ(soft_tissue_of(folder()), nullptr);
  fs::create_directory(folder() / "tissue");
  EXPECT_EQ(soft_tissue_of(folder()), nullptr);
}

TEST_F(Listed, BodiesByTheNamesOfTheirFolders) {
  put(folder());
  put(folder() / "tissue" / "temporalis muscle");
  put(folder() / "tissue" / "constants");
  put(folder() / "tissue" / "\xc3\xa9pid\xc3\xa8rme %s");
  std::ofstream(folder() / "tissue" / ".DS_Store") << "left by a file manager";
  const auto tissue = soft_tissue_of(folder());
  ASSERT_NE(tissue, nullptr);
  ASSERT_EQ(tissue->size(), 4u);
  EXPECT_EQ(tissue->name(0), "tissue");
  EXPECT_EQ(tissue->name(1), "constants");
  EXPECT_EQ(tissue->name(2), "temporalis muscle");
  EXPECT_EQ(tissue->name(3), "\xc3\xa9pid\xc3\xa8rme %s");
}

TEST_F(Listed, ByFoldersAlone) {
  put(folder() / "tissue" / "flap");
  ASSERT_EQ(soft_tissue_of(folder())->size(), 1u);
}

TEST_F(Listed, HalvesAreRefusedByName) {
  put(folder() / "tissue" / "a b");
  fs::remove(folder() / "tissue" / "a b" / "tissue.vtu");
  refused("tissue/a b/tissue.vtu", ExitCode::no_input);
  put(folder() / "tissue" / "a b");
  fs::remove(folder() / "tissue" / "a b" / "tissue.json");
  refused("tissue/a b/tissue.json", ExitCode::no_input);
  fs::remove_all(folder() / "tissue" / "a b");
  fs::create_directory(folder() / "tissue" / "empty");
  refused("tissue/empty/tissue.vtu", ExitCode::no_input);
  fs::remove_all(folder() / "tissue");
  // What only goes with a body, without one.
  for (const char* const alone : {"tissue-constants.json", "tissue.ply"}) {
    std::ofstream(folder() / alone) << "{}";
    refused(alone, ExitCode::no_input);
    fs::remove(folder() / alone);
  }
  EXPECT_EQ(soft_tissue_of(folder()), nullptr);
}

TEST_F(Listed, WhatIsNoBodyIsRefusedByName) {
  put(folder() / "tissue" / "flap");
  std::ofstream(folder() / "tissue" / "gland.vtu") << "put beside";
  refused("gland.vtu", ExitCode::usage);
  fs::remove(folder() / "tissue" / "gland.vtu");
  std::ofstream(folder() / "tissue" / "flap" / "tissue.json") << "{}";
  refused("'flap'", ExitCode::usage);
  put(folder() / "tissue" / "flap");
  put(folder() / "tissue" / "tissue");
  EXPECT_EQ(soft_tissue_of(folder())->size(), 2u);
  put(folder());
  refused("two bodies", ExitCode::usage);
  fs::remove_all(folder() / "tissue");
  put(folder() / "tissue" / "a\nb");
  refused("one line", ExitCode::usage);
  fs::remove_all(folder() / "tissue");
  std::ofstream(folder() / "tissue") << "a file";
  refused("no folder", ExitCode::usage);
}

}  // namespace
}  // namespace osteo
