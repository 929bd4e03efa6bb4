// The second hand: suction, water, the mouse that moves it; without a window.
#include <gtest/gtest.h>

#include "rehearsal_bar.h"

namespace osteo {
namespace {

using namespace test;

TEST(RehearsalControl, SuckerAndWaterGoWithTheirKeys) {
  SessionRunner session_runner;
  RehearsalControl control = session_runner.control();
  control.look_from(kFromAbove);
  ASSERT_TRUE(control.begin(true, false));
  const auto for_a_while = [&] {
    const std::uint64_t tick = control.rehearsal().latest().tick;
    ASSERT_TRUE(frames_until(control, [&] { return control.rehearsal().latest().tick > tick + 50; }));
  };
  control.wash(true, false);
  EXPECT_TRUE(control.sucking());
  EXPECT_FALSE(control.washing());
  for_a_while();
  control.wash(false, true);
  EXPECT_FALSE(control.sucking());
  EXPECT_TRUE(control.washing());
  for_a_while();
  control.wash(false, false);
  control.wash(false, false);  // nothing more
  for_a_while();
  session_runner.running->stop();
  const Session session = read_session(session_runner.scratch / "1.oss");
  // What the second hand held with its pedal down, in turn.
  std::vector<InstrumentKind> held;
  for (const TickRecord& t : session.ticks) {
    if (t.hand != 1 || t.device.pedal == 0) continue;
    const InstrumentKind kind = instrument_of(t.device.tool).kind;
    if (held.empty() || held.back() != kind) held.push_back(kind);
  }
  EXPECT_EQ(held, (std::vector{InstrumentKind::sucker, InstrumentKind::irrigator}));
  EXPECT_EQ(session.ticks.back().device.pedal, 0);
}

TEST(RehearsalControl, TheSecondHandTakesTheNextInstrumentAndPutsItAway) {
  SessionRunner session_runner;
  RehearsalControl control = session_runner.control();
  control.look_from(kFromAbove);
  ASSERT_TRUE(control.begin(true, false));
  control.wash(false, false);
  EXPECT_TRUE(control.second_hand_empty());
  for (const InstrumentKind kind : {InstrumentKind::sucker, InstrumentKind::irrigator, InstrumentKind::probe}) {
    press(control, Command::second_hand);
    EXPECT_NE(control.message().find("second hand"), std::string::npos);
    const auto holds = [&] {
      control.wash(false, false);
      return instrument_of(control.rehearsal().latest(1).device.tool).kind == kind;
    };
    EXPECT_TRUE(frames_until(control, holds)) << static_cast<int>(kind);
    EXPECT_FALSE(control.second_hand_empty());
    EXPECT_EQ(control.rehearsal().latest(1).device.pedal, 0) << "it is held ready";
  }
  press(control, Command::second_hand);
  control.wash(false, false);
  EXPECT_TRUE(control.second_hand_empty());
  control.wash(true, false);
  EXPECT_FALSE(control.second_hand_empty()) << "the sucker comes while it is asked for";
  session_runner.running->stop();
}

// The mouse takes the second hand along; it stays there, works there, and with nothing in it goes back to the burr.
TEST(RehearsalControl, TheMouseMovesTheSecondHand) {
  SessionRunner session_runner;
  RehearsalControl control = session_runner.control();
  control.look_from(kFromAbove);
  ASSERT_TRUE(control.begin(true, false));
  const auto second = [&] { return from_floats(control.rehearsal().latest(1).device.position_mm); };
  control.wash(false, false);
  ASSERT_TRUE(frames_until(control, [&] { return control.rehearsal().latest().tick > 50; }));
  const Vec3 drill = control.goal_mm();
  control.drag_second({0, 3, 0});
  EXPECT_NE(control.message().find("suction tube"), std::string::npos) << control.message();
  const Vec3 there = control.second_mm() + Vec3{2, 0, 1};
  control.drag_second({2, 0, 1});
  EXPECT_EQ(control.second_mm(), there);
  HandInput input;
  input.second_hand = input.pressed = input.on_bone = true;
  const auto so = [&] {
    control.wash(false, false);
    return length(second() - there) < 0.05 && control.rehearsal().latest(1).device.pedal == 255;
  };
  EXPECT_TRUE(frames_until(control, so, input));
  EXPECT_TRUE(control.sucking());
  EXPECT_EQ(control.rehearsal().latest().device.pedal, 0) << "the button is the second hand's";
  EXPECT_EQ(control.goal_mm(), drill);
  // The drill goes away, the sucker stays.
  control.move_hand(drill + Vec3{10, 0, 0});
  ASSERT_TRUE(frames_until(control, [&] { return control.rehearsal().latest().device.position_mm[0] > drill.x + 9; }));
  control.wash(false, false);
  EXPECT_EQ(control.second_mm(), there);
  for (int n = 0; n < 3; ++n) press(control, Command::second_hand);
  EXPECT_EQ(control.message(), "second hand: nothing");
  control.wash(false, false);
  EXPECT_TRUE(control.second_hand_empty());
  const auto back = [&] {
    control.wash(false, false);
    return length(second() - there) > 15;
  };
  EXPECT_TRUE(frames_until(control, back));
  session_runner.running->stop();
}

// From the side where the drill's handle is not.
TEST(RehearsalControl, ALeftHandHasTheSecondOneAtItsRight) {
  SessionRunner session_runner;
  RehearsalControl control = session_runner.control();
  control.look_from(kFromAbove);
  ASSERT_TRUE(control.begin(true, false));
  for (const bool left : {false, true}) {
    control.handle().set_left(left);
    const auto so = [&] {
      control.wash(true, false);
      const TickRecord drill = control.rehearsal().latest(), second = control.rehearsal().latest(1);
      const float across = drill.device.axis[0], beside = second.device.position_mm[0] - drill.device.position_mm[0];
      return left ? across < -0.5F && beside > 1 : across > 0.5F && beside < -1;
    };
    EXPECT_TRUE(frames_until(control, so)) << left;
  }
  session_runner.running->stop();
}

}  // namespace
}  // namespace osteo
