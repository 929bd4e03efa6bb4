// Soft tissue under the tool: felt, deterministic in a replay, free where there is none.
#include "osteo/scene/soft_body.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <thread>

#include "bar.h"
#include "osteo/base/error.h"
#include "osteo/scene/rehearsal.h"
#include "osteo/session/session_file.h"
#include "tissue/block.h"

namespace osteo {
namespace {

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
    const auto file = std::filesystem::temp_directory_path() / "osteo_soft.oss";
    std::filesystem::remove(file);
    World world(test::bar(1, 0));
    const World start = world.copy();
    RehearsalOptions o;
    o.session_file = file;
    o.follow = {true, false, false};
    o.haptics.device = SpringHand::traits();
    o.soft = std::make_shared<SoftBody>(pad(), kPad);
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
    std::size_t yields = 0;
    for (const auto& a : session.actions) yields += a.action.is(ActionKind::yield) ? 1 : 0;
    EXPECT_GT(yields, 80u);
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
    EXPECT_LT(jump, 0.3);
    const ReplayResult again = replay(session, start.copy(), {}, {});
    EXPECT_TRUE(again.identical) << again.difference;
    // Dented while pressed, back again now.
    EXPECT_GT(o.soft->slow_motion(), 0);
    const auto x = o.soft->points_mm();
    double off = 0;
    const TetMesh rest = pad();
    for (std::size_t p = 0; p < x.size(); ++p) off = std::max(off, length(x[p] - from_floats(rest.points_mm[p])));
    EXPECT_LT(off, 0.3);
  }
}

TEST(SoftBody, WithoutItNothingIsDone) {
  const auto file = std::filesystem::temp_directory_path() / "osteo_soft_none.oss";
  std::filesystem::remove(file);
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
  const auto folder = std::filesystem::temp_directory_path() / "osteo_soft_case";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  EXPECT_EQ(soft_body_of(folder), nullptr);
  std::filesystem::copy_file(std::filesystem::path(OSTEO_SOURCE) / "pipelines/tissue/gear.json", folder / "tissue.json");
  EXPECT_THROW(static_cast<void>(soft_body_of(folder)), Error);
}

}  // namespace
}  // namespace osteo
