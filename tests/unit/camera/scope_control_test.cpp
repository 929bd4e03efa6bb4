// Arm, flights, undo, a device that moves the camera.
#include "osteo/simulation/camera/scope_control.h"

#include <gtest/gtest.h>

#include <cmath>

namespace osteo {
namespace {

TEST(ScopeArm, GoesTheSameWayAtAnyFrameRate) {
  const auto way = [](int frames_a_second) {
    ScopeArm arm;
    Vec3 moved, turned;
    for (int n = 0; n < 2 * frames_a_second; ++n) {
      // Pulled for half a second, then let go.
      const bool pulled = 2 * n < frames_a_second;
      const auto drive = pulled ? std::optional(ScopeRates{{100, 0, -30}, {0, 1, 0}}) : std::nullopt;
      const ScopeMotion m = arm.advance(drive, 1.0 / frames_a_second);
      moved += m.shift_mm;
      turned += m.turn_rad;
    }
    EXPECT_FALSE(arm.moves()) << "friction brings it to rest for good";
    return std::pair{moved, turned};
  };
  const auto [a, at] = way(10);
  for (const int rate : {20, 60, 144, 1000}) {
    const auto [b, bt] = way(rate);
    EXPECT_LT(length(a - b), 1e-9) << rate;
    EXPECT_LT(length(at - bt), 1e-9) << rate;
  }
  EXPECT_LT(a.x, 100 * 0.5) << "dry friction takes some of what inertia gives back";
  EXPECT_GT(a.x, 0.8 * 100 * 0.5);
}

// Against small steps of the equation of motion.
TEST(ScopeArm, RunsOutAsItsEquationSays) {
  ScopeArm arm;
  static_cast<void>(arm.advance(ScopeRates{{100, 0, 0}, {}}, 10));
  EXPECT_NEAR(arm.velocity().move_mm_s.x, 100, 1e-9);
  double v = 100, x = 0;
  constexpr double kStep = 1e-6;
  for (double t = 0; t < 0.1; t += kStep) {
    x += v * kStep;
    v = std::max(0.0, v - kStep * (v / arm.params.inertia_s + arm.params.friction_mm_s2));
  }
  const ScopeMotion m = arm.advance(std::nullopt, 0.1);
  EXPECT_NEAR(m.shift_mm.x, x, 1e-3);
  EXPECT_NEAR(arm.velocity().move_mm_s.x, v, 1e-3);
  arm.brake();
  EXPECT_FALSE(arm.moves());
  EXPECT_EQ(arm.advance(std::nullopt, 1).shift_mm, Vec3{});
}

TEST(ScopeArm, RapidMovesAreLimited) {
  ScopeArm arm;
  static_cast<void>(arm.advance(ScopeRates{{1e6, 0, 0}, {0, 1e6, 0}}, 10));
  EXPECT_NEAR(length(arm.velocity().move_mm_s), arm.params.most_mm_s, 1e-9);
  EXPECT_NEAR(length(arm.velocity().turn_rad_s), arm.params.most_rad_s, 1e-9);
}

TEST(ScopeControl, FliesInFourTenthsOfASecondOrAtOnce) {
  for (const int rate : {7, 60}) {
    ScopeControl c;
    c.jump(overview({}, 100, {1, 0, 0}));
    ScopeView to = c.view();
    to.focus_mm = {40, 0, 10};
    magnify(to, 10);
    c.go(to);
    EXPECT_TRUE(c.flies());
    double seconds = 0;
    while (c.flies() && seconds < 5) {
      c.advance(1.0 / rate);
      seconds += 1.0 / rate;
    }
    EXPECT_EQ(c.view(), to);
    EXPECT_NEAR(seconds, 0.4, 1.0 / rate + 1e-9);
  }
  ScopeControl c;
  c.flights = false;
  ScopeView to = c.view();
  magnify(to, 10);
  c.go(to);
  EXPECT_FALSE(c.flies());
  EXPECT_EQ(c.view(), to);
}

TEST(ScopeControl, TakesBackMoveByMove) {
  ScopeControl c;
  c.flights = false;
  const ScopeView first = c.view();
  for (int n = 0; n < 30; ++n) {  // one drag
    c.orbit(0.01, 0.002);
    c.advance(0.016);
  }
  const ScopeView turned = c.view();
  for (int n = 0; n < 4; ++n) {
    c.zoom(1.1);
    c.advance(0.016);
  }
  c.advance(1);  // a pause: what comes is another move
  const ScopeView near = c.view();
  c.zoom(1.1);
  EXPECT_EQ(c.undo_steps(), 3U);
  EXPECT_TRUE(c.undo());
  EXPECT_EQ(c.view(), near);
  EXPECT_TRUE(c.undo());
  EXPECT_EQ(c.view(), turned);
  EXPECT_TRUE(c.undo());
  EXPECT_EQ(c.view(), first);
  EXPECT_FALSE(c.undo());
}

TEST(ScopeControl, AHandEndsAFlightWhereItIs) {
  ScopeControl c;
  ScopeView to = c.view();
  to.focus_mm = {100, 0, 0};
  look_from(to, {0, -1, 0.5});
  c.go(to);
  c.advance(0.2);
  c.pan(1, 0);
  EXPECT_FALSE(c.flies());
  EXPECT_NEAR(c.view().focus_mm.x, 50, 1.5);
  EXPECT_NEAR(c.view().right().z, 0, 1e-12) << "upright again";
  c.undo();
  c.advance(1);
  EXPECT_NEAR(c.view().focus_mm.x, 50, 1e-9) << "the flight is not undone with it";
}

TEST(ScopeControl, Bookmarks) {
  ScopeControl c;
  EXPECT_FALSE(c.go_to_bookmark(1));
  c.set_bookmark(1);
  const ScopeView kept = c.view();
  c.orbit(1, 0.3);
  c.zoom(3);
  EXPECT_TRUE(c.go_to_bookmark(1));
  c.advance(1);
  EXPECT_EQ(c.view(), kept);
  c.jump(overview({5, 5, 5}, 100, {1, 0, 0}));
  EXPECT_FALSE(c.undo()) << "another bone: nothing to go back to";
}

TEST(ScopeControl, LooksAtAndAlongTheDrill) {
  ScopeControl c;
  c.look_at({3, 4, 5});
  c.advance(1);
  EXPECT_EQ(c.view().focus_mm, (Vec3{3, 4, 5}));
  const Vec3 handle = normalized({0.6, -0.3, 0.5});
  c.look_along({1, 2, 3}, handle);
  c.advance(1);
  EXPECT_LT(length(c.view().back - handle), 1e-12) << "the eye is where the hand is";
  // Free, along the picture's own up: still a frame.
  c.set_upright(false);
  c.advance(1);
  c.look_along({1, 2, 3}, c.view().up);
  c.advance(1);
  EXPECT_NEAR(dot(c.view().back, c.view().up), 0, 1e-12);
  EXPECT_NEAR(length(c.view().up), 1, 1e-12);
}

// The modes of the thesis: the device's translation moves the camera or turns it; how far goes with the field.
TEST(ScopeControl, ADeviceMovesOrTurnsTheCamera) {
  ScopeControl c;
  c.arm.params.inertia_s = 0;
  ScopeView v = c.view();
  v.upright = false;
  c.jump(v);
  c.guide(CameraGuide::shift, {{20, 0, 0}, {0, 1, 0}}, 0.1);
  EXPECT_LT(length(c.view().focus_mm - v.right() * (20 * 0.01 * v.field_mm())), 1e-9);
  EXPECT_EQ(c.view().back, v.back) << "the device's own turn does not count";
  c.jump(v);
  c.guide(CameraGuide::turn, {{10, 0, 0}, {}}, 0.1);
  EXPECT_EQ(c.view().focus_mm, v.focus_mm);
  EXPECT_GT(dot(c.view().back, v.right()), 0.1) << "right moves the eye to the right";
  c.jump(v);
  c.guide(CameraGuide::turn, {{0, 10, 0}, {}}, 0.1);
  EXPECT_GT(dot(c.view().back, v.up), 0.1) << "and up moves it up";
  c.jump(v);
  c.guide(CameraGuide::six, {{5, 0, 0}, {0, 0, 0.1}}, 0.1);
  EXPECT_NEAR(length(turn_between(v, c.view())), 0.1, 1e-9);
  EXPECT_GT(length(c.view().focus_mm - v.focus_mm), 1);
}

TEST(ScopeControl, InertiaGoesOnWhileTheBrakeIsReleasedAndNotAfter) {
  ScopeControl c;
  for (int n = 0; n < 6; ++n) c.guide(CameraGuide::shift, {{4, 0, 0}, {}}, 1.0 / 60);
  const Vec3 let_go = c.view().focus_mm;
  c.guide(CameraGuide::shift, {}, 1.0 / 60);
  EXPECT_GT(length(c.view().focus_mm - let_go), 0.1) << "it goes on";
  c.brake();
  const Vec3 braked = c.view().focus_mm;
  c.guide(CameraGuide::shift, {}, 1.0 / 60);
  EXPECT_EQ(c.view().focus_mm, braked);
}

TEST(ScopeControl, RatesAreFieldsASecond) {
  ScopeControl c;
  c.arm.params.inertia_s = 0;
  const ScopeView v = c.view();
  for (int n = 0; n < 60; ++n) c.drive({1, 0, 0}, {}, 1.0 / 60);
  EXPECT_NEAR(length(c.view().focus_mm - v.focus_mm), v.field_mm(), 1e-9);
  const std::size_t steps = c.undo_steps();
  c.drive({}, {}, 1.0 / 60);
  c.drive({}, {}, 1.0 / 60);
  EXPECT_EQ(c.undo_steps(), steps) << "a puck at rest is no move";
}

}  // namespace
}  // namespace osteo
