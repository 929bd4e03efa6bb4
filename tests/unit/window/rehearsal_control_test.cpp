// What the window's mouse and keys do, without a window.
#include "rehearsal_control.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "bar.h"
#include "scratch.h"

namespace osteo {
namespace {

// Runs rehearsals of a bar of bone as the program does those of a case.
struct Sitting {
  test::ScratchFolder scratch;
  World first{test::bar(0.5, 0.2)}, last = first.copy();
  std::unique_ptr<Rehearsal> running;
  int begun = 0, shown = 0;
  std::optional<Error> fails_to_begin, fails_to_show, fails_to_save, failed;

  WindowActions actions() {
    WindowActions a;
    a.save = [this] {
      if (!running) return;
      const std::unique_ptr<Rehearsal> over = std::move(running);
      over->stop();
      over->look([&](const World& world, SceneReaders&) { last = world.copy(); });
      if (fails_to_save) throw Error(*std::exchange(fails_to_save, {}));
    };
    a.begin = [this](bool from_case, const HandView& view) {
      if (fails_to_begin) throw Error(*std::exchange(fails_to_begin, {}));
      World world = (from_case ? first : last).copy();
      const HandPose pose = FreeWays(world, skin_of_instrument(static_cast<std::size_t>(view.tool))).waiting(view.eye, view.axis);
      const HandGoal start{pose.at_mm, to_floats(pose.axis), 0, static_cast<std::uint8_t>(view.tool)};
      RehearsalOptions options;
      options.follow = {true, true, true};
      options.haptics.device = SpringHand::traits();
      options.haptics.more_devices = {SpringHand::traits()};
      options.session_file = scratch / (std::to_string(++begun) + ".oss");
      std::vector<std::unique_ptr<Device>> hands;
      hands.push_back(std::make_unique<MouseDevice>(start));
      hands.push_back(std::make_unique<MouseDevice>(HandGoal{pose.at_mm + Vec3{0, 0, 50}}));
      running = std::make_unique<Rehearsal>(std::move(world), std::move(hands), options, Context{});
      running->start();
      return start;
    };
    a.rehearsal = [this] { return running.get(); };
    a.folder = [this] { return scratch / "none"; };
    a.failure = [this] { return failed; };
    a.stop = [] { return false; };
    return a;
  }
  RehearsalControl control() {
    return RehearsalControl(actions(), burr_index(BurrKind::cutting, 4, BurrShape::ball), [this](Rehearsal&) {
      ++shown;
      if (fails_to_show) throw Error(*std::exchange(fails_to_show, {}));
    });
  }
};

// From above, as the bar lies; x to the right.
const ViewAxes kFromAbove{{0, 0, 120}, {0, 0, -1}, {1, 0, 0}, {0, 1, 0}};

void press(RehearsalControl& control, Command command, int value = 0, const std::optional<Vec3>& direction = {}) {
  control.command({command, value}, direction);
}

// Frames at sixty a second until it is so; false after a while.
bool frames_until(RehearsalControl& control, const std::function<bool()>& so, HandInput input = {}) {
  input.seconds = 1 / 60.0;
  for (int n = 0; n < 4000; ++n) {
    control.watch();
    control.look_from(kFromAbove);
    control.hold(input);
    if (so()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

template <class F>
auto of_world(RehearsalControl& control, F&& f) {
  decltype(f(std::declval<const World&>())) value{};
  control.rehearsal().look([&](const World& world, SceneReaders&) { value = f(world); });
  return value;
}
std::size_t steps(RehearsalControl& control) {
  return of_world(control, [](const World& w) { return w.undo_steps(); });
}

TEST(RehearsalControl, ZTakesBackTheLastStrokeAndThenTheCut) {
  Sitting sitting;
  RehearsalControl control = sitting.control();
  control.look_from(kFromAbove);
  ASSERT_TRUE(control.begin(true, false));
  EXPECT_EQ(sitting.shown, 1);
  EXPECT_GT(control.radius_mm(), 10);
  const auto hash = [&] { return of_world(control, [](const World& w) { return w.hash(); }); };
  const std::string whole = hash();
  // A cut, with the saw as one sees it.
  press(control, Command::saw);
  EXPECT_EQ(control.tools().tool(), HandTools::Tool::saw);
  EXPECT_EQ(control.tools().cut().normal, kFromAbove.right);
  SawCut cut = control.tools().cut();
  cut.at_mm = {8, 0, 0};
  control.tools().set_cut(cut);
  press(control, Command::perform);
  ASSERT_TRUE(frames_until(control, [&] { return steps(control) == 1; }));
  const std::string sawn = hash();
  EXPECT_NE(sawn, whole);
  press(control, Command::put_away);
  EXPECT_EQ(control.tools().tool(), HandTools::Tool::drill);
  ASSERT_TRUE(frames_until(control, [&] { return !control.leading(); }));
  // A stroke: the hand comes down with the button held.
  control.move_hand({0, 0, 5.5});
  HandInput drills;
  drills.pressed = drills.on_bone = true;
  ASSERT_TRUE(frames_until(
      control, [&] { return control.rehearsal().removed_mm3() > 0.5; }, drills));
  control.move_hand({0, 0, 20});
  ASSERT_TRUE(frames_until(control, [&] { return control.rehearsal().latest().device.position_mm[2] > 15; }));
  EXPECT_EQ(steps(control), 2u);
  EXPECT_NE(hash(), sawn);
  press(control, Command::undo);
  ASSERT_TRUE(frames_until(control, [&] { return steps(control) == 1; }));
  EXPECT_EQ(hash(), sawn);
  press(control, Command::undo);
  ASSERT_TRUE(frames_until(control, [&] { return steps(control) == 0; }));
  EXPECT_EQ(hash(), whole);
  press(control, Command::undo);
  std::string note;
  ASSERT_TRUE(frames_until(control, [&] { return !(note = control.tools().note(control.rehearsal())).empty(); }));
  EXPECT_EQ(note, "undo: there is nothing to take back");
  sitting.running->stop();
}

TEST(RehearsalControl, KeysChooseTheBurrAndLatchTheDrill) {
  Sitting sitting;
  RehearsalControl control = sitting.control();
  control.look_from(kFromAbove);
  ASSERT_TRUE(control.begin(true, false));
  const auto burr = [&] { return burr_library()[static_cast<std::size_t>(control.tool())]; };
  press(control, Command::diameter, 6);
  press(control, Command::diamond);
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
  sitting.running->stop();
}

TEST(RehearsalControl, SuckerAndWaterGoWithTheirKeys) {
  Sitting sitting;
  RehearsalControl control = sitting.control();
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
  sitting.running->stop();
  const Session session = read_session(sitting.scratch / "1.oss");
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
  Sitting sitting;
  RehearsalControl control = sitting.control();
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
  sitting.running->stop();
}

TEST(RehearsalControl, SavesGoesOnAndBeginsAnew) {
  Sitting sitting;
  RehearsalControl control = sitting.control();
  control.look_from(kFromAbove);
  ASSERT_TRUE(control.begin(true, false));
  const double whole = sitting.first.volume_mm3();
  control.rehearsal().act(SceneAction::saw({{5, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1}));
  ASSERT_TRUE(frames_until(control, [&] { return steps(control) == 1; }));
  press(control, Command::saw);
  press(control, Command::save);
  EXPECT_EQ(sitting.begun, 2);
  EXPECT_EQ(sitting.shown, 2);
  EXPECT_EQ(control.tools().tool(), HandTools::Tool::drill);
  EXPECT_NE(control.message().find("saved"), std::string::npos);
  EXPECT_LT(of_world(control, [](const World& w) { return w.volume_mm3(); }), whole - 50);
  press(control, Command::reset);
  EXPECT_EQ(of_world(control, [](const World& w) { return w.volume_mm3(); }), whole);
  EXPECT_FALSE(control.failure());
  EXPECT_FALSE(control.lost());
  sitting.running->stop();
}

TEST(RehearsalControl, EndsAndGoesOnFromThere) {
  Sitting sitting;
  RehearsalControl control = sitting.control();
  control.look_from(kFromAbove);
  ASSERT_TRUE(control.begin(true, false));
  control.latch(true);
  EXPECT_TRUE(control.end());
  EXPECT_EQ(sitting.running, nullptr);
  EXPECT_FALSE(control.latched());
  control.watch();  // that nothing runs is no failure
  EXPECT_FALSE(control.failure());
  ASSERT_TRUE(control.begin(false, false));
  EXPECT_EQ(sitting.begun, 2);
  // What could not be saved is told, and lost.
  sitting.fails_to_save = Error(ExitCode::cannot_write, "disk full");
  EXPECT_FALSE(control.end());
  ASSERT_TRUE(control.failure());
  EXPECT_STREQ(control.failure()->what(), "disk full");
  EXPECT_TRUE(control.lost());
}

TEST(RehearsalControl, WhatFailsIsToldAndCanBePutRight) {
  Sitting sitting;
  RehearsalControl control = sitting.control();
  control.look_from(kFromAbove);
  sitting.fails_to_begin = Error(ExitCode::no_input, "no case");
  EXPECT_FALSE(control.begin(true, false));
  ASSERT_TRUE(control.failure());
  EXPECT_STREQ(control.failure()->what(), "no case");
  EXPECT_EQ(sitting.running, nullptr);
  // What cannot be shown does not run on unseen.
  sitting.fails_to_show = Error(ExitCode::resources, "no texture");
  EXPECT_FALSE(control.begin(true, false));
  EXPECT_STREQ(control.failure()->what(), "no texture");
  EXPECT_EQ(sitting.running, nullptr);
  EXPECT_FALSE(control.lost());
  ASSERT_TRUE(control.begin(true, false));
  EXPECT_FALSE(control.failure());
  // The recording fails: the session is closed, and that is lost.
  sitting.failed = Error(ExitCode::cannot_write, "disk full");
  control.watch();
  ASSERT_TRUE(control.failure());
  EXPECT_STREQ(control.failure()->what(), "disk full");
  EXPECT_TRUE(control.lost());
  EXPECT_EQ(sitting.running, nullptr);
  sitting.failed.reset();
  ASSERT_TRUE(control.begin(false, false));
  // It cannot be saved: nothing new is begun before someone says so.
  sitting.fails_to_save = Error(ExitCode::cannot_write, "still full");
  control.save();
  EXPECT_STREQ(control.failure()->what(), "still full");
  EXPECT_EQ(sitting.begun, 3);
  ASSERT_TRUE(control.begin(true, false));
  // A rehearsal that ends by itself is told of.
  ASSERT_TRUE(frames_until(control, [&] { return sitting.running->latest().tick > 10; }));
  sitting.running->stop();
  control.watch();
  ASSERT_TRUE(control.failure());
  EXPECT_NE(std::string(control.failure()->what()).find("ended by itself"), std::string::npos);
}

}  // namespace
}  // namespace osteo
