// Soft tissue under the tool: felt, deterministic in a replay, free where there is none.
#include "osteo/session/scene/soft_tissue.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>
#include <thread>

#include "bar.h"
#include "folders.h"
#include "osteo/core/base/error.h"
#include "osteo/session/recording/session_file.h"
#include "osteo/session/scene/rehearsal.h"
#include "scratch.h"
#include "tissue/block.h"

namespace osteo {
namespace {

// The one body of a scene.
std::shared_ptr<SoftTissue> alone(std::unique_ptr<SoftBody> body) {
  auto tissue = std::make_shared<SoftTissue>();
  tissue->add("tissue", std::move(body));
  return tissue;
}
SoftPush update(SoftBody& body, const SoftTool& tool) {
  return body.update({&tool, 1}).front();
}

// A pad of 24 x 24 x 9 mm far above the bone, held at its underside.
constexpr const char* kPad =
    R"({"osteotome_tissue": 1, "material": {"young_kpa": 40, "poisson": 0.45}, "fixed": [{"box_mm": [[-1, -1, 59.9], [30, 30, 60.1]]}]})";
TetMesh pad() {
  const auto b = test::block(8, 8, 3, 3.0);
  TetMesh m;
  m.points_mm.resize(b.points.size());
  for (std::size_t p = 0; p < b.points.size(); ++p) m.points_mm[p] = to_floats(b.points[p] + Vec3{0, 0, 60});
  m.tets.resize(b.tets.size());
  for (std::size_t t = 0; t < b.tets.size(); ++t) m.tets[t] = b.tets[t];
  return m;
}

Script press() {
  Script s;
  s.tool = burr_index(BurrKind::diamond, 6);
  s.axis = {0, 0, 1};
  s.waypoints = {{0, {12, 12, 76}, false}, {0.5, {12, 12, 73}, false}, {1.2, {12, 12, 69}, false},
                 {2, {12, 12, 69}, false}, {2.5, {12, 12, 80}, false}, {3, {12, 12, 80}, false}};
  return s;
}

TEST(SoftBody, PushesBackAndIsReplayedToTheBit) {
  for (const bool by_the_clock : {false, true}) {
    const test::ScratchFolder scratch;
    const auto file = scratch / "stream.oss";
    World world(test::bar(1, 0));
    const World start = world.copy();
    RehearsalOptions o;
    o.session_file = file;
    o.follow = {true, false, false};
    o.haptics.device = SpringHand::traits();
    o.soft = alone(std::make_unique<SoftBody>(pad(), kPad));
    Rehearsal r(std::move(world), std::make_unique<ScriptedDevice>(press(), 1000), o, {});
    if (by_the_clock) {
      r.start();
      while (r.running()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
      r.stop();
    } else {
      r.run_to_end({});
    }
    const Session session = read_session(file);
    double most = 0, sideways = 0, jump = 0, last = 0;
    std::size_t pushes = 0;
    for (const auto& a : session.actions) pushes += a.action.is(ActionKind::soft_push) ? 1 : 0;
    // A hundred a second; in real time fewer, and so coarser, where other programs have the machine.
    EXPECT_GT(pushes, by_the_clock ? 0u : 80u);
    for (const TickRecord& t : session.ticks) {
      const Vec3 f = from_floats(t.force_n);
      if (f.z > most) sideways = std::hypot(f.x, f.y);
      most = std::max(most, f.z);
      jump = std::max(jump, std::abs(length(f) - last));
      last = length(f);
      EXPECT_EQ((t.flags & kSoftContact) != 0, length(f) > 1e-6 || (t.flags & kSoftContact) != 0);
    }
    EXPECT_GT(most, 0.05) << by_the_clock;
    EXPECT_LT(sideways, 0.3 * most);
    EXPECT_LT(last, 1e-3);
    if (!by_the_clock) {
      EXPECT_LT(jump, 0.3);
    }
    const ReplayResult again = replay(SessionReader(file), start.copy(), {}, {});
    EXPECT_TRUE(again.identical) << again.difference;
    // Dented while pressed, back again now.
    EXPECT_GT(o.soft->body(0).slow_motion(), 0);
    const auto x = o.soft->body(0).points_mm();
    double off = 0;
    const TetMesh rest = pad();
    for (std::size_t p = 0; p < x.size(); ++p) off = std::max(off, length(x[p] - from_floats(rest.points_mm[p])));
    EXPECT_LT(off, 0.3);
  }
}

// A burr that turns cuts its way in; the replay, which knows no tissue, still comes out the same. A skin loses what was
// cut, and the cut shows.
TEST(SoftBody, ATurningBurrCutsVoxelsOff) {
  const TetMesh rest = pad();
  const TriMesh skin = boundary_of(rest);
  double before[2], cut[2];
  for (const bool with_skin : {false, true}) {
    const test::ScratchFolder scratch;
    const auto file = scratch / "stream.oss";
    World world(test::bar(1, 0));
    const World start = world.copy();
    RehearsalOptions o;
    o.session_file = file;
    o.haptics.device = SpringHand::traits();
    o.soft = alone(std::make_unique<SoftBody>(pad(), kPad, std::nullopt, with_skin ? &skin : nullptr));
    const std::size_t triangles = o.soft->body(0).drawn().triangles.size();
    const std::uint64_t version = o.soft->body(0).version();
    Script s = press();
    s.tool = burr_index(BurrKind::cutting, 6);
    for (auto& w : s.waypoints) w.drill_on = true;
    Rehearsal r(std::move(world), std::make_unique<ScriptedDevice>(s, 1000), o, {});
    const RehearsalSummary summary = r.run_to_end({});
    EXPECT_EQ(summary.tissue_mm3, o.soft->cut_off_mm3());
    EXPECT_GT(o.soft->body(0).version(), version);
    const TriMesh& drawn = o.soft->body(0).drawn();
    EXPECT_NE(drawn.triangles.size(), triangles);
    const MeshCheck closed = check(drawn);
    if (!with_skin) {
      EXPECT_EQ(closed.open_edges, 0u);
    }
    for (const auto& t : drawn.triangles)
      for (const std::uint32_t p : t) ASSERT_LT(p, drawn.points_mm.size());
    before[with_skin] = volume_mm3(rest);
    cut[with_skin] = o.soft->cut_off_mm3();
    EXPECT_GE(cut[with_skin], 3 * 27.0);
    EXPECT_LT(cut[with_skin], 0.5 * before[with_skin]);
    // Nothing that is left lies in the burr's track any more than the tissue gives way.
    EXPECT_NEAR(std::fmod(cut[with_skin], 27.0), 0, 1e-3);
    const ReplayResult again = replay(SessionReader(file), start.copy(), {}, {});
    EXPECT_TRUE(again.identical) << again.difference;
  }
  EXPECT_EQ(cut[0], cut[1]);
}

// A pad hanging over bone, pressed onto it: the bone carries it, until it is drilled away.
TEST(SoftBody, BoneCarriesIt) {
  const auto b = test::block(8, 4, 3, 3.0);
  double top = -1e9;
  const World world(test::bar(1, 0));
  // The top of the bar, which lies around the origin.
  const Vec3 middle{};
  for (double z = middle.z; z < middle.z + 60; z += 0.1) {
    if (world.nearest({middle.x, middle.y, z}) > 0.5F) top = z;
  }
  TetMesh m;
  const Vec3 shift{middle.x - 12, middle.y - 6, top + 0.3};
  for (const Vec3& p : b.points) m.points_mm.push_back(to_floats(p + shift));
  for (const auto& t : b.tets) m.tets.push_back(t);
  char problem[300];
  std::snprintf(
      problem, sizeof problem,
      R"({"osteotome_tissue": 1, "material": {"young_kpa": 5, "poisson": 0.4}, "fixed": [{"box_mm": [[%f, -1e4, -1e4], [%f, 1e4, 1e4]]}]})",
      shift.x - 0.1, shift.x + 0.1);
  const auto deepest = [&](bool bone) {
    SoftBody soft(m, problem);
    if (bone) soft.meet(&world);
    const std::size_t burr = static_cast<std::size_t>(burr_index(BurrKind::diamond, 6));
    for (int n = 0; n < 100; ++n)
      update(soft, {{shift.x + 20, middle.y, top + 9.3 + 3 - 0.06 * std::min(n, 80)}, {0, 0, 1}, burr, false});
    double z = 1e9;
    for (const Vec3& p : soft.points_mm()) z = std::min(z, p.z);
    return z - top;
  };
  EXPECT_LT(deepest(false), -2);
  EXPECT_GT(deepest(true), -1);
  // A tool that jumps about, turning, presses it into the bone from all sides: nothing is thrown.
  SoftBody soft(m, problem);
  soft.meet(&world);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> u(0, 1);
  const auto burr = static_cast<std::size_t>(burr_index(BurrKind::cutting, 4));
  for (int n = 0; n < 400; ++n) {
    const Vec3 at = shift + Vec3{24 * u(random), 12 * u(random), 4 + 8 * u(random)};
    for (int k = 0; k < 3; ++k) update(soft, {at, normalized({u(random), u(random), 1}), burr, n > 200});
  }
  EXPECT_GT(soft.cut_off_mm3(), 0);
  for (const Vec3& p : soft.points_mm()) ASSERT_LT(length(p - shift), 60);
}

TEST(SoftBody, WithoutItNothingIsDone) {
  const test::ScratchFolder scratch;
  const auto file = scratch / "stream.oss";
  RehearsalOptions o;
  o.session_file = file;
  o.haptics.device = SpringHand::traits();
  Rehearsal r(World(test::bar(1, 0)), std::make_unique<ScriptedDevice>(press(), 1000), o, {});
  r.run_to_end({});
  const Session session = read_session(file);
  EXPECT_TRUE(session.actions.empty());
  for (const TickRecord& t : session.ticks) EXPECT_EQ(t.flags & kSoftContact, 0u);
}

TEST(SoftBody, ACaseThatListsItByHalvesIsRefused) {
  const test::ScratchFolder scratch;
  const auto& folder = scratch.path();
  EXPECT_EQ(soft_tissue_of(folder), nullptr);
  std::filesystem::copy_file(source_folder() / "pipelines/tissue/gear.json", folder / "tissue.json");
  EXPECT_THROW(static_cast<void>(soft_tissue_of(folder)), Error);
}

}  // namespace
}  // namespace osteo
