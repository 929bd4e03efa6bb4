// Time to reach a view: the measure, and the simulated person that it is tried on.
#include "osteo/simulation/camera/camera_trial.h"

#include <gtest/gtest.h>

#include <sstream>

namespace osteo {
namespace {

ScopeView start() {
  return overview({10, 20, 30}, 60, {0.94, -0.25, 0.22});
}

TEST(CameraTrial, TargetsAreWhereTheySayAndTheSameAgain) {
  const auto a = camera_targets(start(), 200, 7), b = camera_targets(start(), 200, 7);
  EXPECT_EQ(a, b);
  EXPECT_NE(a, camera_targets(start(), 200, 8));
  int at_ten = 0;
  for (const ScopeView& t : a) {
    EXPECT_LE(length(t.focus_mm - start().focus_mm), 25);
    EXPECT_GT(dot(t.back, start().back), 0.69);
    EXPECT_NEAR(t.right().z, 0, 1e-12);
    at_ten += t.magnification == 10 ? 1 : 0;
  }
  EXPECT_GT(at_ten, 40);
  EXPECT_LT(at_ten, 95);
}

TEST(CameraTrial, CountsTheTimeUntilItIsReachedAndHeld) {
  ScopeControl control;
  control.flights = false;
  control.jump(start());
  ScopeView to = start();
  to.focus_mm += to.right() * 20;
  magnify(to, 6);
  CameraTrial trial({to, start()});
  for (int n = 0; n < 60; ++n) EXPECT_FALSE(trial.advance(control, 1.0 / 60));
  control.pan(20, 0);
  control.zoom(6 / control.view().magnification);
  int held = 0;
  while (!trial.advance(control, 1.0 / 60)) ++held;
  EXPECT_NEAR(held / 60.0, 0.5, 0.05);
  ASSERT_EQ(trial.results().size(), 1U);
  EXPECT_NEAR(trial.results()[0].seconds, 1, 0.05) << "holding it is not counted";
  EXPECT_EQ(trial.results()[0].moves, 2U);
  EXPECT_EQ(trial.results()[0].by_kind[static_cast<std::size_t>(ScopeMove::pan)], 1U);
  trial.give_up(control);
  EXPECT_EQ(trial.target(), nullptr);
  EXPECT_FALSE(trial.advance(control, 1));
  const TrialSummary s = summary_of(trial.results());
  EXPECT_EQ(s.missed, 1U);
  EXPECT_EQ(s.targets, 2U);
  EXPECT_NEAR(s.median_s, 1, 0.05);
  std::istringstream csv(trial_csv(trial.results()));
  std::string line;
  std::getline(csv, line);
  EXPECT_EQ(line, "target,reached,seconds,moves,orbit,pan,zoom,focus,roll,working_distance,guide,flight");
  std::getline(csv, line);
  EXPECT_TRUE(line.starts_with("1,1,")) << line;
  std::getline(csv, line);
  EXPECT_TRUE(line.starts_with("2,0,")) << line;
}

TEST(CameraTrial, NearIsNotThere) {
  const ScopeView to = start();
  const TrialTolerance tolerance;
  for (const double over : {0.9, 1.1}) {
    ScopeView place = to, turned = to, zoomed = to;
    pan(place, over * tolerance.place * to.field_mm(), 0);
    orbit(turned, 0, over * tolerance.angle_rad);
    magnify(zoomed, to.magnification * (over > 1 ? 1.16 : 1.14));
    EXPECT_EQ(close_to(place, to, tolerance), over < 1);
    EXPECT_EQ(close_to(turned, to, tolerance), over < 1);
    EXPECT_EQ(close_to(zoomed, to, tolerance), over < 1);
  }
}

// A simulated person reaches what can be reached, the same each time; a worse hand takes longer.
TEST(CameraTrial, TheSimulatedPersonGetsThere) {
  const auto targets = camera_targets(start(), 40, 1);
  for (const CameraMode mode : {CameraMode::mouse, CameraMode::point, CameraMode::device, CameraMode::six,
                                CameraMode::rate, CameraMode::bookmarks}) {
    const auto results = simulate_trial(mode, start(), targets, {}, 3);
    const TrialSummary s = summary_of(results);
    EXPECT_EQ(s.targets, 40U);
    EXPECT_LE(s.missed, 1U) << static_cast<int>(mode);
    EXPECT_GT(s.median_s, 1) << "nobody is that quick";
    EXPECT_LT(s.median_s, 40);
    EXPECT_EQ(trial_csv(results), trial_csv(simulate_trial(mode, start(), targets, {}, 3)));
    if (mode == CameraMode::bookmarks) continue;
    SimulatedPerson worse;
    worse.noise = 0.3;
    worse.crosstalk = 0.3;
    worse.reaction_s = 0.5;
    EXPECT_GT(summary_of(simulate_trial(mode, start(), targets, worse, 3)).median_s, s.median_s)
        << static_cast<int>(mode);
  }
  SimulatedPerson nobody;
  nobody.most_s = 0.5;
  EXPECT_EQ(summary_of(simulate_trial(CameraMode::mouse, start(), targets, nobody, 3)).missed, 40U);
}

}  // namespace
}  // namespace osteo
