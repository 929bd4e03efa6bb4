// A session that is over, looked at again, and hints by choice: logic without a screen.
#include "review_control.h"

#include <gtest/gtest.h>

#include <thread>

#include "evidence/scene.h"
#include "hint_controller.h"
#include "osteo/core/base/error.h"
#include "osteo/session/scene/rehearsal.h"
#include "review_panel.h"
#include "review_scene.h"
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
SessionReview review_of_two_seconds(const std::filesystem::path& file) {
  Script s;
  s.axis = {0, 0, 1};
  s.waypoints = {{0, {0, 0, 7}, true}, {0.2, {0, 0, 5.5}, true}, {1.5, {0, 0, 1}, true}, {2, {0, 0, 7}, false}};
  RehearsalOptions o;
  o.session_file = file;
  o.haptics.device = SpringHand::traits();
  Rehearsal r(block(), std::make_unique<ScriptedDevice>(s, 1000), o, {});
  (void)r.run_to_end({});
  SessionReview review;
  review.player = std::make_unique<SessionPlayer>(SessionReader(file), block());
  ReviewFinding f;
  f.text = "twice";
  f.times_s = {0.5, 1.2};
  f.at_mm = Vec3{1, 2, 3};
  f.places_mm = {{0, 0, 1}, {0, 0, 2}};
  review.findings = {f, {}};
  return review;
}
void wait_for(ReviewControl& control) {
  while (control.poll() == ReviewControl::State::making) std::this_thread::sleep_for(std::chrono::milliseconds(5));
}
struct Ready {
  test::ScratchFolder scratch;
  ReviewControl control;
  Ready() {
    control.begin([this](const Context&) { return review_of_two_seconds(scratch / "s.oss"); });
    wait_for(control);
  }
};

TEST(ReviewControl, GoesThroughTimeByKeys) {
  Ready r;
  ReviewControl& c = r.control;
  ASSERT_EQ(c.state(), ReviewControl::State::ready);
  EXPECT_NEAR(c.now_s(), 2, 0.01);
  EXPECT_FALSE(c.key({Command::earlier, 0})) << "not shown yet";
  EXPECT_TRUE(c.key({Command::timeline, 0}));
  EXPECT_TRUE(c.shown());
  EXPECT_TRUE(c.key({Command::earlier, 0}));
  EXPECT_NEAR(c.now_s(), 1, 0.01);
  EXPECT_TRUE(c.take_moved());
  EXPECT_FALSE(c.take_moved());
  EXPECT_TRUE(c.key({Command::earlier, 0, true}));
  EXPECT_EQ(c.now_s(), 0);
  EXPECT_EQ(c.review().player->scene().world()->hash(), block().hash());
  EXPECT_TRUE(c.key({Command::back, 0}));
  EXPECT_EQ(c.speed(), 2);
  EXPECT_TRUE(c.key({Command::drill, 0}));
  EXPECT_TRUE(c.playing());
  c.advance(0.25);
  EXPECT_NEAR(c.now_s(), 0.5, 1e-9);
  c.advance(5);
  EXPECT_FALSE(c.playing()) << "it ends at the end";
  EXPECT_EQ(c.now_s(), c.review().player->end_s());
  c.play(true);
  EXPECT_EQ(c.now_s(), 0) << "and begins again from the beginning";
  for (int n = 0; n < 9; ++n) c.change_speed(1);
  EXPECT_EQ(c.speed(), ReviewControl::kSpeeds.back());
  EXPECT_FALSE(c.key({Command::quit, 0}));
  EXPECT_TRUE(c.key({Command::timeline, 0}));
  EXPECT_FALSE(c.shown() || c.playing());
}

TEST(ReviewControl, LooksAtAFindingsMomentsOneAfterAnother) {
  Ready r;
  ReviewControl& c = r.control;
  EXPECT_FALSE(c.take_places());
  c.choose(0);
  EXPECT_EQ(c.now_s(), 0.5);
  EXPECT_EQ(c.take_look(), (Vec3{1, 2, 3}));
  EXPECT_FALSE(c.take_look());
  EXPECT_EQ(c.take_places()->size(), 2U);
  EXPECT_FALSE(c.take_places());
  c.choose(0);
  EXPECT_EQ(c.now_s(), 1.2);
  EXPECT_FALSE(c.take_places()) << "still the same";
  c.choose(0);
  EXPECT_EQ(c.now_s(), 0.5);
  c.choose(1);  // tells neither time nor place
  EXPECT_EQ(c.now_s(), 0.5);
  EXPECT_TRUE(c.take_places()->empty());
  c.choose(7);
  EXPECT_EQ(c.chosen(), -1);
}

// The page begins with at most three, and with none that is only to be known.
TEST(ReviewControl, ThreeFindingsMatter) {
  using Weight = ReviewFinding::Weight;
  const auto of = [](std::initializer_list<Weight> weights) {
    std::vector<ReviewFinding> all;
    for (const Weight w : weights) all.emplace_back().weight = w;
    return all;
  };
  EXPECT_EQ(shown_findings(of({Weight::serious, Weight::caution, Weight::note, Weight::good, Weight::good})),
            (std::vector<std::size_t>{0, 1, 3}));
  EXPECT_TRUE(serious(of({Weight::caution})));
  EXPECT_TRUE(shown_findings(of({Weight::note})).empty());
  EXPECT_FALSE(serious(of({Weight::note, Weight::good})));
}

TEST(ReviewControl, TheWorstIsLookedAtByItself) {
  test::ScratchFolder scratch;
  ReviewControl c;
  c.begin([&](const Context&) {
    SessionReview r = review_of_two_seconds(scratch / "s.oss");
    r.findings[0].weight = ReviewFinding::Weight::serious;
    return r;
  });
  wait_for(c);
  const double end_s = c.now_s();
  c.present();
  EXPECT_EQ(c.chosen(), 0);
  EXPECT_EQ(c.now_s(), end_s) << "the bone as it was left";
  EXPECT_EQ(c.take_look(), (Vec3{1, 2, 3}));
  EXPECT_EQ(c.take_places()->size(), 2U);
  // Where nothing is serious, nothing is pointed at.
  Ready r;
  r.control.present();
  EXPECT_EQ(r.control.chosen(), -1);
}

TEST(ReviewControl, WhatFailsIsSaidAndWhatIsNotWantedIsStopped) {
  ReviewControl c;
  EXPECT_EQ(c.poll(), ReviewControl::State::none);
  c.begin([](const Context&) -> SessionReview { throw Error(ExitCode::corrupt, "damaged"); });
  wait_for(c);
  EXPECT_EQ(c.state(), ReviewControl::State::failed);
  EXPECT_EQ(c.failure(), "damaged");
  EXPECT_TRUE(c.key({Command::timeline, 0}));
  EXPECT_FALSE(c.shown());
  c.choose(0);
  c.play(true);
  EXPECT_FALSE(c.playing());
  c.begin([](const Context& context) -> SessionReview {
    for (;;) context.progress(0.5);
  });
  c.end();  // returns
  EXPECT_EQ(c.poll(), ReviewControl::State::none);
}

TEST(ReviewScene, CourseTakesTheLowerEdgeOfThePictureOnlyWhereItIsShown) {
  ReviewScene scene;
  ViewLayout layout = lay_out(Layout::review, 1024, 700, 16);
  const ScreenBox view = layout.view;
  scene.lay_out(layout, 16);
  EXPECT_EQ(layout.view, view);
}

TEST(Hints, AreTurnedOffOneByOne) {
  const std::vector<HintRule>& all = usual_hints();
  EXPECT_EQ(hints_left(all, "").size(), all.size());
  const std::string off = with_hint(with_hint("", all[0].id, false), all[2].id, false);
  ASSERT_EQ(hints_left(all, off).size(), all.size() - 2);
  EXPECT_EQ(hints_left(all, off)[0].id, all[1].id);
  EXPECT_EQ(with_hint(with_hint(off, all[0].id, true), all[2].id, true), "");
  EXPECT_EQ(with_hint(off, all[0].id, false).size(), off.size());
  EXPECT_EQ(hint_note({"force", "press \"less\"", "nerve", 1}),
            R"({"id":"force","words":"press \"less\"","structure":"nerve"})");
}

}  // namespace
}  // namespace osteo
