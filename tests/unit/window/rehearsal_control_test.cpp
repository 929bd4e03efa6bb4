// The drill under the window's mouse and keys: burr, pedal, tilt, motion; without a window.
#include <gtest/gtest.h>

#include "rehearsal_bar.h"

namespace osteo {
namespace {

using namespace test;

TEST(RehearsalControl, KeysChooseTheBurrAndLatchTheDrill) {
  SessionRunner session_runner;
  RehearsalControl control = session_runner.control();
  control.look_from(kFromAbove);
  ASSERT_TRUE(control.begin(true, false));
  const auto burr = [&] { return burr_library()[static_cast<std::size_t>(control.tool())]; };
  press(control, Command::diameter, 6);
  press(control, Command::burr_kind, static_cast<int>(BurrKind::diamond));
  EXPECT_EQ(burr().diameter_mm, 6);
  EXPECT_EQ(burr().kind, BurrKind::diamond);
  press(control, Command::cylinder);
  EXPECT_EQ(burr().shape, BurrShape::cylinder);
  ASSERT_TRUE(frames_until(control, [&] { return control.rehearsal().latest().device.tool == control.tool(); }));
  press(control, Command::drill);
  EXPECT_TRUE(control.latched());
  ASSERT_TRUE(frames_until(control, [&] { return control.rehearsal().latest().device.pedal != 0; }));
  // On its way the drill is off, and keeps its burr.
  press(control, Command::lift);
  EXPECT_TRUE(control.leading());
  EXPECT_FALSE(control.latched());
  const int tool = control.tool();
  press(control, Command::ball);
  EXPECT_EQ(control.tool(), tool);
  EXPECT_NE(control.message().find("on its way"), std::string::npos);
  press(control, Command::drill);
  EXPECT_FALSE(control.latched());
  ASSERT_TRUE(frames_until(control, [&] { return !control.leading(); }));
  EXPECT_EQ(control.message(), "drill lifted out");
  EXPECT_EQ(control.rehearsal().latest().device.pedal, 0);
  // To the bone that is looked at; beside it there is none.
  press(control, Command::bring, 0, normalized(Vec3{60, 60, -100}));
  EXPECT_EQ(control.message(), "no bone under the mouse");
  press(control, Command::bring, 0, Vec3{0, 0, -1});
  ASSERT_TRUE(frames_until(control, [&] { return !control.leading(); }));
  EXPECT_LT(control.rehearsal().latest().device.position_mm[2], 12);
  // The window's own keys are not taken.
  EXPECT_FALSE(control.command({Command::quit, 0}, {}));
  EXPECT_FALSE(control.command({Command::screenshot, 0}, {}));
  session_runner.running->stop();
}

// A tilt turns the handle about the burr's centre: the burr stays where it is. It stays tilted, and what was recorded
// says so.
TEST(RehearsalControl, ATiltLeavesTheBurrWhereItIs) {
  SessionRunner session_runner;
  RehearsalControl control = session_runner.control();
  control.look_from(kFromAbove);
  ASSERT_TRUE(control.begin(true, false));
  const auto tick = [&] { return control.rehearsal().latest(); };
  const auto axis = [&] { return from_floats(tick().device.axis); };
  ASSERT_TRUE(frames_until(
      control, [&] { return tick().tick > 300 && length(axis() - control.handle().axis(kFromAbove)) < 2e-3; }));
  const Vec3 at = from_floats(tick().device.position_mm), before = axis();
  for (int n = 0; n < 5; ++n) press(control, Command::tilt, 1);  // 15 degrees to the right
  press(control, Command::roll, 1);
  const Vec3 wanted = control.handle().axis(kFromAbove);
  EXPECT_GT(length(wanted - before), 0.1);
  ASSERT_TRUE(frames_until(control, [&] { return length(axis() - wanted) < 2e-3; }));
  EXPECT_LT(length(from_floats(tick().device.position_mm) - at), 1e-3);
  const std::uint64_t then = tick().tick;
  ASSERT_TRUE(frames_until(control, [&] { return tick().tick > then + 200; }));
  EXPECT_LT(length(axis() - wanted), 2e-3);
  EXPECT_LT(length(from_floats(tick().device.position_mm) - at), 1e-3);
  press(control, Command::straight);
  ASSERT_TRUE(frames_until(control, [&] { return length(axis() - before) < 2e-3; }));
  session_runner.running->stop();
}

TEST(RehearsalControl, MotionsAreScaledAndTheClutchHoldsTheDrill) {
  SessionRunner session_runner;
  RehearsalControl control = session_runner.control();
  control.look_from(kFromAbove);
  ASSERT_TRUE(control.begin(true, false));
  HandInput input;
  const auto frame = [&] { control.hold(input); };
  frame();
  const Vec3 start = control.goal_mm();
  const MouseStep step{start + Vec3{8, 4, 0}, {8, 4, 0}};
  press(control, Command::motion, -1);
  press(control, Command::motion, -1);
  EXPECT_EQ(control.message(), "motion of the hand 1:4");
  control.drag_hand(step);
  EXPECT_LT(length(control.goal_mm() - (start + Vec3{2, 1, 0})), 1e-12);
  control.push_hand(2);
  EXPECT_LT(length(control.goal_mm() - (start + Vec3{2, 1, -0.5})), 1e-12) << "into the depth too";
  input.wrist_rest = true;
  frame();
  control.drag_hand(step);
  EXPECT_LT(length(control.goal_mm() - (start + Vec3{2.4, 1.2, -0.5})), 1e-12);
  input.wrist_rest = false;
  input.clutch = true;
  frame();
  const Vec3 held = control.goal_mm(), axis = control.handle().axis(kFromAbove);
  control.drag_hand(step);
  control.push_hand(5);
  press(control, Command::deeper);
  press(control, Command::tilt, 1);
  PadMotion pad;
  pad.right_mm_s = 40;
  input.pad = pad;
  input.seconds = 0.1;
  frame();
  EXPECT_EQ(control.goal_mm(), held);
  EXPECT_EQ(control.handle().axis(kFromAbove), axis);
  session_runner.running->stop();
}

// How far a pedal is down, times what the person lets the burr have, is in the stream.
TEST(RehearsalControl, APedalDrillsAsFarAsItIsDown) {
  SessionRunner session_runner;
  RehearsalControl control = session_runner.control();
  control.look_from(kFromAbove);
  ASSERT_TRUE(control.begin(true, false));
  HandInput input;
  const auto pedal = [&] { return control.rehearsal().latest().device.pedal; };
  input.drill = 0.5;
  EXPECT_TRUE(frames_until(
      control, [&] { return pedal() == 128; }, input));
  for (const int wanted : {191, 128, 64, 64}) {
    press(control, Command::burr_speed, -1);
    input.drill = 1;
    EXPECT_TRUE(frames_until(
        control, [&] { return pedal() == wanted; }, input))
        << wanted;
  }
  // Held on the way it does not drill where it arrives.
  press(control, Command::lift);
  EXPECT_TRUE(frames_until(
      control, [&] { return !control.leading(); }, input));
  EXPECT_TRUE(frames_until(
      control, [&] { return pedal() == 0; }, input));
  for (int n = 0; n < 10; ++n) control.hold(input);
  EXPECT_EQ(pedal(), 0);
  EXPECT_TRUE(frames_until(control, [&] { return pedal() == 0; }));
  EXPECT_TRUE(frames_until(
      control, [&] { return pedal() == 64; }, input));
  session_runner.running->stop();
}

TEST(RehearsalControl, TheBurrIsChangedStepByStep) {
  SessionRunner session_runner;
  RehearsalControl control = session_runner.control();
  control.look_from(kFromAbove);
  ASSERT_TRUE(control.begin(true, false));
  const auto burr = [&] { return burr_library()[static_cast<std::size_t>(control.tool())].name(); };
  press(control, Command::other_burr);
  EXPECT_EQ(burr(), "diamond 4 mm");
  press(control, Command::next_burr, 1);
  EXPECT_EQ(burr(), "diamond 5 mm");
  for (int n = 0; n < 5; ++n) press(control, Command::next_burr, -1);
  EXPECT_EQ(burr(), "diamond 7 mm") << "behind the smallest comes the largest";
  press(control, Command::other_burr);
  EXPECT_EQ(burr(), "cutting 7 mm");
  session_runner.running->stop();
}

}  // namespace
}  // namespace osteo
