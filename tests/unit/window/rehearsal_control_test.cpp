// What the window's mouse and keys do, without a window.
#include "rehearsal_control.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "bar.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/translate.h"
#include "osteo/session/recording/session_file.h"
#include "scratch.h"

namespace osteo {
namespace {

// Runs rehearsals of a bar of bone as the program does those of a case.
struct SessionRunner {
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
      const HandPose pose =
          PathPlanner(world, skin_of_instrument(static_cast<std::size_t>(view.tool))).waiting(view.eye, view.axis);
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
  SessionRunner session_runner;
  RehearsalControl control = session_runner.control();
  control.look_from(kFromAbove);
  ASSERT_TRUE(control.begin(true, false));
  EXPECT_EQ(session_runner.shown, 1);
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
  ASSERT_TRUE(frames_until(control, [&] { return !(note = control.tools().note(control.rehearsal()).shown).empty(); }));
  EXPECT_EQ(note, "undo: there is nothing to take back");
  session_runner.running->stop();
}

TEST(RehearsalControl, APlannedCutIsChosenAndOneIsKept) {
  const test::ScratchFolder scratch;
  const auto file = scratch.path() / kPlannedCutsFile;
  write_file(file, planned_cuts_json(std::vector<PlannedCut>{{"body", {{8, 0, 0}, {2, 0, 0}, {0, 0, 1}, 1}, 1.5}}));
  SessionRunner session_runner;
  RehearsalControl control = session_runner.control();
  control.look_from(kFromAbove);
  HandTools& tools = control.tools();
  tools.plan(planned_cuts_of(scratch.path()), file);
  ASSERT_TRUE(control.begin(true, false));
  ASSERT_EQ(tools.planned().size(), 1u);
  press(control, Command::saw);
  tools.choose_planned(0);
  EXPECT_EQ(tools.note(control.rehearsal()).shown, "saw at the planned cut 'body'");
  tools.take_saw(control.rehearsal());
  ASSERT_TRUE(
      frames_until(control, [&] { return of_world(control, [](const World& w) { return w.cutting_guide().on(); }); }));
  EXPECT_EQ(of_world(control, [](const World& w) { return w.cutting_guide(); }),
            (CuttingGuide{{8, 0, 0}, {1, 0, 0}, 1.5}));
  tools.put_saw_away(control.rehearsal());
  // Another beside it, where meanwhile somebody added a third.
  write_file(file, planned_cuts_json(std::vector<PlannedCut>{
                       tools.planned()[0],
                       {"theirs", {{1, 2, 3}, {0, 1, 0}}, 2, {{1, 2.5, 9}, {0, 3, 0.2}, 2, 0.1, {0.5, 1, 7}, 18}}}));
  SawCut cut = tools.cut();
  cut.at_mm = {-4, 0.1, 1.0 / 3};
  tools.set_cut(cut);
  tools.keep_planned("ramus");
  const auto kept = load_planned_cuts(file);
  ASSERT_EQ(kept.size(), 3u);
  EXPECT_EQ(kept[1].name, "theirs");
  EXPECT_EQ(kept[2].name, "ramus");
  EXPECT_EQ(kept[2].cut.at_mm, cut.at_mm) << "to the last bit";
  EXPECT_EQ(tools.planned().size(), 3u);
  // Of a printed guide: its slot to the last bit; the saw is in it until the plane is moved.
  EXPECT_EQ(kept[1].slot, (CuttingGuide{{1, 2.5, 9}, {0, 3, 0.2}, 2, 0.1, {0.5, 1, 7}, 18}));
  tools.choose_planned(1);
  const CuttingGuide printed = tools.guide();
  EXPECT_EQ(printed.at_mm, (Vec3{1, 2.5, 9}));
  EXPECT_NEAR(length(printed.normal), 1, 1e-12);
  EXPECT_NEAR(dot(printed.up_mm, printed.normal), 0, 1e-12);
  EXPECT_EQ(printed.play_mm, 0.1);
  SawCut moved = tools.cut();
  moved.at_mm.x += 0.5;
  tools.set_cut(moved);
  EXPECT_EQ(tools.guide().play_mm, 0);
  EXPECT_EQ(tools.guide().at_mm, moved.at_mm);
  // A name twice, none, a folder that is not there: said, and the file stays as it is.
  const std::string before = read_text(file);
  tools.keep_planned("ramus");
  EXPECT_EQ(tools.note(control.rehearsal()).shown, "there is a planned cut 'ramus' already");
  tools.keep_planned("");
  EXPECT_EQ(tools.note(control.rehearsal()).shown, "a planned cut needs a name");
  EXPECT_EQ(read_text(file), before);
  tools.plan({}, scratch.path() / "gone" / "x.json");
  tools.keep_planned("lost");
  EXPECT_NE(tools.note(control.rehearsal()).shown.find("gone"), std::string::npos)
      << tools.note(control.rehearsal()).shown;
  EXPECT_TRUE(tools.planned().empty());
  session_runner.running->stop();
}

TEST(RehearsalControl, TheSawIsTakenIntoTheHandAndHeldInItsPlane) {
  SessionRunner session_runner;
  RehearsalControl control = session_runner.control();
  control.look_from(kFromAbove);
  ASSERT_TRUE(control.begin(true, false));
  press(control, Command::saw);
  SawCut cut = control.tools().cut();
  cut.at_mm = {8, 0, 0};
  control.tools().set_cut(cut);
  control.tools().take_saw(control.rehearsal());
  EXPECT_TRUE(control.tools().saw_in_hand());
  EXPECT_EQ(control.tools().tool(), HandTools::Tool::drill) << "the hand moves it";
  const auto saw = static_cast<std::uint8_t>(instrument_index("saw 25 mm"));
  ASSERT_TRUE(
      frames_until(control, [&] { return control.rehearsal().latest().device.tool == saw && !control.leading(); }));
  EXPECT_EQ(of_world(control, [](const World& w) { return w.cutting_guide(); }),
            (CuttingGuide{{8, 0, 0}, {1, 0, 0}, 3}));
  // A hand beside the plane cuts in it.
  control.move_hand({9.5, 0, 8});
  ASSERT_TRUE(frames_until(control, [&] { return (control.rehearsal().latest().flags & kInSlot) != 0; }));
  control.move_hand({9.5, 0, 3.5});
  HandInput runs;
  runs.pressed = runs.on_bone = true;
  ASSERT_TRUE(frames_until(
      control, [&] { return control.rehearsal().removed_mm3() > 0.2; }, runs));
  const TickRecord tick = control.rehearsal().latest();
  EXPECT_NEAR(tick.device.position_mm[0] + tick.shown_offset_mm[0], 8, 0.3);
  EXPECT_LT(tick.force_n[0], 0) << "the hand is pulled to the plane";
  // The guide's plane is what the mouse turns the handle into.
  EXPECT_NEAR(tick.device.axis[0], 0, 0.02);
  // Led away, it is let go of until it is there.
  press(control, Command::lift);
  ASSERT_TRUE(frames_until(control, [&] { return !control.leading(); }));
  EXPECT_EQ(control.message(), "saw lifted out");
  ASSERT_TRUE(
      frames_until(control, [&] { return of_world(control, [](const World& w) { return w.cutting_guide().on(); }); }));
  // A burr puts it away, and takes the guide off; so does its own key.
  control.move_hand({9.5, 0, 20});
  ASSERT_TRUE(frames_until(control, [&] { return control.rehearsal().latest().device.position_mm[2] > 15; }));
  press(control, Command::burr_kind, static_cast<int>(BurrKind::diamond));
  EXPECT_FALSE(control.tools().saw_in_hand());
  ASSERT_TRUE(
      frames_until(control, [&] { return !of_world(control, [](const World& w) { return w.cutting_guide().on(); }); }));
  ASSERT_TRUE(frames_until(
      control, [&] { return control.rehearsal().latest().device.tool == burr_index(BurrKind::diamond, 4); }));
  control.tools().take_saw(control.rehearsal());
  press(control, Command::saw);
  EXPECT_FALSE(control.tools().saw_in_hand());
  EXPECT_EQ(control.tools().tool(), HandTools::Tool::drill);
  session_runner.running->stop();
}

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

TEST(RehearsalControl, SavesGoesOnAndBeginsAnew) {
  SessionRunner session_runner;
  RehearsalControl control = session_runner.control();
  control.look_from(kFromAbove);
  ASSERT_TRUE(control.begin(true, false));
  const double whole = session_runner.first.volume_mm3();
  control.rehearsal().act(SceneAction::saw({{5, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1}));
  ASSERT_TRUE(frames_until(control, [&] { return steps(control) == 1; }));
  press(control, Command::saw);
  press(control, Command::save);
  EXPECT_EQ(session_runner.begun, 2);
  EXPECT_EQ(session_runner.shown, 2);
  EXPECT_EQ(control.tools().tool(), HandTools::Tool::drill);
  EXPECT_NE(control.message().find("saved"), std::string::npos);
  EXPECT_LT(of_world(control, [](const World& w) { return w.volume_mm3(); }), whole - 50);
  press(control, Command::reset);
  EXPECT_EQ(of_world(control, [](const World& w) { return w.volume_mm3(); }), whole);
  EXPECT_FALSE(control.failure());
  EXPECT_FALSE(control.lost());
  session_runner.running->stop();
}

TEST(RehearsalControl, EndsAndGoesOnFromThere) {
  SessionRunner session_runner;
  RehearsalControl control = session_runner.control();
  control.look_from(kFromAbove);
  ASSERT_TRUE(control.begin(true, false));
  control.latch(true);
  EXPECT_TRUE(control.end());
  EXPECT_EQ(session_runner.running, nullptr);
  EXPECT_FALSE(control.latched());
  control.watch();  // that nothing runs is no failure
  EXPECT_FALSE(control.failure());
  ASSERT_TRUE(control.begin(false, false));
  EXPECT_EQ(session_runner.begun, 2);
  // What could not be saved is told, and lost.
  session_runner.fails_to_save = Error(ExitCode::cannot_write, "disk full");
  EXPECT_FALSE(control.end());
  ASSERT_TRUE(control.failure());
  EXPECT_STREQ(control.failure()->what(), "disk full");
  EXPECT_TRUE(control.lost());
}

TEST(RehearsalControl, WhatFailsIsToldAndCanBePutRight) {
  SessionRunner session_runner;
  RehearsalControl control = session_runner.control();
  control.look_from(kFromAbove);
  session_runner.fails_to_begin = Error(ExitCode::no_input, "no case");
  EXPECT_FALSE(control.begin(true, false));
  ASSERT_TRUE(control.failure());
  EXPECT_STREQ(control.failure()->what(), "no case");
  EXPECT_EQ(session_runner.running, nullptr);
  // What cannot be shown does not run on unseen.
  session_runner.fails_to_show = Error(ExitCode::resources, "no texture");
  EXPECT_FALSE(control.begin(true, false));
  EXPECT_STREQ(control.failure()->what(), "no texture");
  EXPECT_EQ(session_runner.running, nullptr);
  EXPECT_FALSE(control.lost());
  ASSERT_TRUE(control.begin(true, false));
  EXPECT_FALSE(control.failure());
  // The recording fails: the session is closed, and that is lost.
  session_runner.failed = Error(ExitCode::cannot_write, "disk full");
  control.watch();
  ASSERT_TRUE(control.failure());
  EXPECT_STREQ(control.failure()->what(), "disk full");
  EXPECT_TRUE(control.lost());
  EXPECT_EQ(session_runner.running, nullptr);
  session_runner.failed.reset();
  ASSERT_TRUE(control.begin(false, false));
  // It cannot be saved: nothing new is begun before someone says so.
  session_runner.fails_to_save = Error(ExitCode::cannot_write, "still full");
  control.save();
  EXPECT_STREQ(control.failure()->what(), "still full");
  EXPECT_EQ(session_runner.begun, 3);
  ASSERT_TRUE(control.begin(true, false));
  // A rehearsal that ends by itself is told of.
  ASSERT_TRUE(frames_until(control, [&] { return session_runner.running->latest().tick > 10; }));
  session_runner.running->stop();
  control.watch();
  ASSERT_TRUE(control.failure());
  EXPECT_NE(std::string(control.failure()->what()).find("ended by itself"), std::string::npos);
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

TEST(RehearsalControl, ASessionKeepsItsMessagesInEnglishInAnyLanguage) {
  SessionRunner session_runner;
  RehearsalControl control = session_runner.control();
  control.look_from(kFromAbove);
  std::vector<std::string> shown;
  {
    const InLanguage german(Language::german);
    ASSERT_TRUE(control.begin(true, false));
    const auto said = [&] { shown.push_back(control.message()); };
    press(control, Command::burr_speed, -1);
    said();
    press(control, Command::second_hand);
    said();
    press(control, Command::saw);
    said();
    control.tools().keep_planned("");
    ASSERT_TRUE(frames_until(control, [&] { return control.message() != shown.back(); }));
    said();
    control.say([] { return shown_number(2.5, 1) + " mm"; });
    said();
  }
  session_runner.running.reset();
  const SessionReader file(session_runner.scratch / "1.oss");
  std::vector<std::string> kept;
  auto parts = file.parts();
  while (const SessionPart* const part = parts.next()) {
    for (const Note& note : part->notes) {
      const auto text = note.kind == "message" ? Json::parse(note.json) : std::nullopt;
      if (text && text->text() != nullptr) kept.push_back(*text->text());
    }
  }
  ASSERT_EQ(kept.size(), shown.size());
  EXPECT_EQ(kept[0], "burr at most at 75 % of its speed");
  EXPECT_EQ(kept[1].find("second hand: "), 0U) << kept[1];
  EXPECT_EQ(kept[2].find("saw: "), 0U) << kept[2];
  EXPECT_EQ(kept[3], "a planned cut needs a name");
  EXPECT_EQ(kept[4], "2.5 mm");
  for (std::size_t n = 0; n < kept.size(); ++n) EXPECT_NE(kept[n], shown[n]) << "on screen it is German";
  EXPECT_EQ(shown[4], "2,5 mm");
}

}  // namespace
}  // namespace osteo
