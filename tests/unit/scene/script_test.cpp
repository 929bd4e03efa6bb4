// Scripts in front of a scene: what is late, rejected, doubtful or no pose at all is done or told.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <thread>

#include "bar.h"
#include "osteo/core/base/files.h"
#include "osteo/session/recording/script.h"
#include "osteo/session/recording/session_file.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/session/scene/session_folder.h"
#include "osteo/simulation/bone/plates.h"

namespace osteo {
namespace {

std::filesystem::path fresh(const std::string& name) {
  const auto path =
      std::filesystem::temp_directory_path() / ("osteo-script-" + std::to_string(::getpid()) + "-" + name);
  std::filesystem::remove_all(path);
  return path;
}

// Down onto the bar's upper face (z = 4), and there it stays, turning.
Script press() {
  Script s;
  s.axis = {0, 0, 1};
  s.waypoints = {{0, {9, 0, 8}, true}, {0.2, {9, 0, 5}, true}, {0.4, {9, 0, 5}, true}};
  return s;
}

RehearsalSummary run(const Script& script, bool by_the_clock, const std::filesystem::path& file = {},
                     bool dust = false) {
  RehearsalOptions o;
  o.session_file = file;
  o.follow = {true, true, dust};
  o.haptics.device = SpringHand::traits();
  o.actions = actions_of(script, 1000);
  Rehearsal r(World(test::bar(0.5, 0)), devices_of(script, 1000), o, {});
  if (!by_the_clock) return r.run_to_end({});
  r.start();
  while (r.running()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  return r.stop();
}

TEST(ScriptedScene, ActionsAfterTheLastWaypointAreDoneWithTheDrillAtRest) {
  Script script = press();
  script.actions = {{0.3, SceneAction::saw({{-4, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1})},
                    {0.7, SceneAction::split(20)},
                    {1.0, SceneAction::move(1, {{}, {0, 30, 0}})}};
  EXPECT_EQ(script.seconds(), 1.0);
  for (const bool by_the_clock : {false, true}) {
    const auto file = fresh("late.oss");
    const RehearsalSummary s = run(script, by_the_clock, file);
    EXPECT_TRUE(s.notes.empty()) << s.notes.front().why;
    EXPECT_EQ(s.bodies, 2u);
    EXPECT_EQ(s.ticks, 1001u);
    const Session session = read_session(file);
    // By the clock a busy machine may take the bone apart after the piece was to move; else the order is the script's.
    const auto is_move = [](const auto& a) { return a.action.is(ActionKind::move); };
    EXPECT_TRUE(by_the_clock ? std::ranges::any_of(session.actions, is_move) : is_move(session.actions.back()));
    double before = 0, after = 0;
    for (const TickRecord& t : session.ticks) {
      EXPECT_EQ(t.device.pedal, t.tick < 400 ? 255 : 0) << t.tick;
      // By 0.35 s it has run out.
      (t.tick < 750 ? before : after) += static_cast<double>(t.removed_mm3);
    }
    EXPECT_GT(before, 0.01);
    EXPECT_EQ(after, 0) << "it drilled on while it waited";
    std::filesystem::remove(file);
  }
}

TEST(ScriptedScene, EveryRefusalIsInTheSummaryWithItsTime) {
  Script script = press();
  const auto mini = static_cast<std::uint32_t>(plate_index("miniplate-4"));
  script.actions = {{0.05, SceneAction::saw({{500, 0, 0}, {1, 0, 0}})},
                    {0.1, SceneAction::attach(mini, {{}, {900, 0, 4}}, 0)},
                    {0.15, SceneAction::saw({{-4, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1})},
                    {0.2, SceneAction::detach(7)}};
  for (int n = 0; n < 5; ++n) script.actions.push_back({0.25 + 0.01 * n, SceneAction::move(9, {})});
  for (const bool by_the_clock : {false, true}) {
    RehearsalSummary s = run(script, by_the_clock);
    ASSERT_EQ(s.notes.size(), 4u);
    EXPECT_TRUE(s.refused());
    const std::pair<ActionKind, std::uint64_t> expected[] = {
        {ActionKind::saw, 50}, {ActionKind::attach, 100}, {ActionKind::detach, 200}, {ActionKind::move, 250}};
    for (std::size_t n = 0; n < 4; ++n) {
      EXPECT_EQ(s.notes[n].kind, expected[n].first);
      EXPECT_GE(s.notes[n].tick, expected[n].second);
      EXPECT_FALSE(s.notes[n].done);
      EXPECT_EQ(s.notes[n].times, n == 3 ? 5u : 1u);
    }
    if (by_the_clock) continue;
    s.warnings = {"a doubt"};
    const auto folder = fresh("session");
    const std::string text = write_summary(create_session_folder(folder, "nowhere", {}), s, 1000, "cutting 4 mm", {});
    EXPECT_EQ(text, read_text(folder / "summary.json"));
    for (const char* const part :
         {"\"actions_refused\"", "\"tick\": 50", "\"t_s\": 0.05", "\"action\": \"saw\"", "the saw meets no bone",
          "there is no piece 9", "\"times\": 5", "\"warnings\"", "a doubt"})
      EXPECT_NE(text.find(part), std::string::npos) << part;
    EXPECT_EQ(text.find("actions_done_otherwise"), std::string::npos);
    std::filesystem::remove_all(folder);
  }
}

TEST(ScriptedScene, WhatIsDoneOtherwiseThanAskedIsNoRefusalButTold) {
  Script script = press();
  const auto distractor = static_cast<std::uint32_t>(plate_index("distractor"));
  script.actions = {{0.1, SceneAction::saw({{-4, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1})},
                    {0.15, SceneAction::split(20)},
                    {0.2, SceneAction::attach(distractor, {{}, {-4, 0, 4}}, 0, 1)},
                    {0.3, SceneAction::open(1, 99)}};
  const RehearsalSummary s = run(script, false);
  ASSERT_EQ(s.notes.size(), 1u);
  EXPECT_TRUE(s.notes[0].done);
  EXPECT_FALSE(s.refused());
  EXPECT_EQ(s.fixtures.front().opening_mm, 20);
}

// A device that loses itself: from tick 100 on its pose is no number, or beyond what a number holds.
class LostDevice final : public Device {
 public:
  explicit LostDevice(double odd) : odd_(odd) {}
  DeviceSample read(std::uint64_t tick, double, Vec3) noexcept override {
    DeviceSample s;
    s.position_mm = to_floats(Vec3{tick < 100 ? 9 : odd_, 0, 8});
    return s;
  }
  [[nodiscard]] bool active(std::uint64_t tick) const noexcept override { return tick < 400; }

 private:
  double odd_;
};

TEST(ScriptedScene, PosesThatAreNoneAreCounted) {
  for (const double odd : {9.0, 1e300, std::nan("")}) {
    RehearsalOptions o;
    Rehearsal r(World(test::bar(0.5, 0)), std::make_unique<LostDevice>(odd), o, {});
    const RehearsalSummary s = r.run_to_end({});
    EXPECT_EQ(s.ticks, 400u);
    EXPECT_EQ(s.unusable_poses, odd == 9.0 ? 0u : 300u) << odd;
  }
}

TEST(ScriptedScene, WarningsAboutAScript) {
  const World world(test::bar(0.5, 0));
  const auto warnings = [&](Script s, bool dust = false, bool laid = false) {
    std::string all;
    for (const std::string& d : warnings_about(s, world, dust, laid)) all += d + "\n";
    return all;
  };
  Script s = press();
  EXPECT_EQ(warnings(s), "");
  for (auto& w : s.waypoints) w.at_mm = w.at_mm * 0.001;
  EXPECT_NE(warnings(s).find("metres"), std::string::npos);
  s = press();
  for (auto& w : s.waypoints) w.at_mm.x += 5000;
  EXPECT_NE(warnings(s).find("never comes nearer than"), std::string::npos);
  // On its way from far to far it passes the bone.
  s.waypoints = {{0, {-5000, 0, 0}, true}, {1, {5000, 0, 0}, true}};
  EXPECT_EQ(warnings(s), "");
  s = press();
  s.actions = {{0.1, SceneAction::irrigate({0, 0, 5}, 5, 1)}};
  EXPECT_NE(warnings(s).find("--dust"), std::string::npos);
  EXPECT_EQ(warnings(s, true), "");
  s.actions.push_back({0.05, SceneAction::simulate(Simulated::heat, true)});
  EXPECT_NE(warnings(s).find("--dust"), std::string::npos);
  s.actions.push_back({0.05, SceneAction::simulate(Simulated::dust, true)});
  EXPECT_EQ(warnings(s), "") << "it begins there";
  // As the patient lies.
  EXPECT_EQ(warnings(s, false, true), "");
  s.actions = {{0.05, SceneAction::simulate(Simulated::dust, false)}};
  EXPECT_NE(warnings(s, false, true).find("how the patient lies"), std::string::npos) << "it never begins";
  EXPECT_EQ(warnings(s, true, true), "");
}

}  // namespace
}  // namespace osteo
