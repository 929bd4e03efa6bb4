// A session looked at as of any time: the same bone as the file gives, whichever way one comes.
#include "osteo/session/scene/session_player.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "evidence/scene.h"
#include "osteo/core/base/error.h"
#include "osteo/session/scene/rehearsal.h"
#include "scratch.h"

namespace osteo {
namespace {

World block() {
  return test::solid_world(
      [](Vec3 p) {
        return std::min({4 - p.z, p.z + 4, 11 - std::abs(p.x), 11 - std::abs(p.y)});
      },
      0.5, 24);
}
SceneAction at(std::uint64_t tick, SceneAction a) {
  a.tick = tick;
  return a;
}
void record(const std::filesystem::path& file, std::vector<SceneAction> actions) {
  Script s;
  s.axis = {0, 0, 1};
  s.waypoints = {{0, {-6, 0, 7}, true},  {0.8, {-6, 0, 3}, true}, {0.9, {-6, 0, 7}, true},
                 {1.0, {5, 0, 7}, true}, {1.9, {5, 0, 2}, true},  {2.0, {5, 0, 7}, false}};
  RehearsalOptions o;
  o.session_file = file;
  o.haptics.device = SpringHand::traits();
  o.actions = std::move(actions);
  Rehearsal r(block(), std::make_unique<ScriptedDevice>(s, 1000), o, {});
  r.note("camera", "{\"n\":1}");
  (void)r.run_to_end({});
}

// As the session's own file has it, at the end of the frame that holds the time, which `t_s` then is.
std::string hash_at(const SessionReader& session, double& t_s) {
  World world = block();
  t_s = static_cast<double>(apply_recorded_until(session, world, static_cast<std::uint64_t>(t_s * 1000))) / 1000;
  return world.hash();
}

void expect_everywhere(const std::filesystem::path& file) {
  const SessionReader session(file);
  SessionPlayer player(session, block());
  EXPECT_NEAR(player.end_s(), 2.0, 0.01);
  EXPECT_EQ(player.scene().world()->hash(), session.outline().end->bone_hash);
  for (double t : {0.5, 1.7, 0.3, 0.0, 1.2, 2.0, 1.0, 1.1}) {
    const std::string hash = hash_at(session, t);
    player.go_to(t);
    EXPECT_EQ(player.now_s(), t);
    EXPECT_EQ(player.scene().world()->hash(), hash) << t << " s";
    // The surface follows: as if made from that bone.
    EXPECT_EQ(player.scene().readers().surface->hash(), SurfaceReader(*player.scene().world(), {}).hash()) << t << " s";
    ASSERT_NE(player.hand(0), nullptr);
    EXPECT_NEAR(static_cast<double>(player.hand(0)->tick) / 1000, t, 0.021) << t;
  }
  player.go_to(99);
  EXPECT_EQ(player.now_s(), player.end_s());
  player.go_to(-1);
  EXPECT_EQ(player.scene().world()->hash(), block().hash());
  ASSERT_NE(player.camera(), nullptr);
  EXPECT_EQ(*player.camera(), "{\"n\":1}");
}

TEST(SessionPlayer, GivesTheBoneOfAnyTimeForwardsAndBack) {
  const test::ScratchFolder scratch;
  record(scratch / "s.oss", {});
  expect_everywhere(scratch / "s.oss");
}

TEST(SessionPlayer, GoesAcrossSawCutsAndUndo) {
  const test::ScratchFolder scratch;
  record(scratch / "s.oss",
         {at(950, SceneAction::saw({{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1})),
          at(1050, SceneAction::plain(ActionKind::undo)), at(1100, SceneAction::plain(ActionKind::undo)),
          at(1600, SceneAction::saw({{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1}))});
  expect_everywhere(scratch / "s.oss");
}

TEST(SessionPlayer, RefusesAnotherBone) {
  const test::ScratchFolder scratch;
  record(scratch / "s.oss", {});
  const SessionReader session(scratch / "s.oss");
  EXPECT_THROW(SessionPlayer(session, test::solid_world([](Vec3 p) { return 5 - length(p); }, 0.5, 24)), Error);
}

}  // namespace
}  // namespace osteo
