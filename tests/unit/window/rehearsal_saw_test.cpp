// Saw, planned cuts and undo by keys and mouse, without a window.
#include <gtest/gtest.h>

#include "osteo/core/base/files.h"
#include "rehearsal_bar.h"

namespace osteo {
namespace {

using namespace test;

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

}  // namespace
}  // namespace osteo
