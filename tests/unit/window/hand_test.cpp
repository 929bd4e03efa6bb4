// The person's hand without a window: motions, tilts, pedals and buttons.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "button_assign.h"
#include "button_watch.h"
#include "mouse_hand.h"

namespace osteo {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
const ViewAxes kView{{0, 0, 120}, {0, 0, -1}, {1, 0, 0}, {0, 1, 0}};

// --- how far

// A drag of so many pixels moves the tool by pixels x mm a pixel x scale, along the view's axes.
TEST(HandMotion, ADragMovesTheToolByItsPixelsTimesTheScale) {
  ScopeView view;
  const PictureArea area{100, 50, 800, 600};
  const double mm_per_px = 1 / view.pixels_per_mm(area);
  const double dx = 37, dy = -21;  // right and, since y goes down, up
  for (const int one_to : {1, 2, 4, 8}) {
    for (const bool rest : {false, true}) {
      HandMotion motion;
      motion.one_to = one_to;
      motion.rest = rest;
      // First under the pointer, which is off the middle; then it drags.
      const MouseStep step = mouse_step(view, area, 333 + dx, 222 + dy, dx, dy, view.focus_mm);
      const Vec3 at = step.under_mm - step.by_mm;
      const Vec3 by = motion.moved(at, step) - at;
      const double s = (rest ? 0.2 : 1.0) / one_to;
      EXPECT_NEAR(dot(by, view.right()), dx * mm_per_px * s, 1e-9) << one_to << rest;
      EXPECT_NEAR(dot(by, view.up), -dy * mm_per_px * s, 1e-9) << one_to << rest;
      EXPECT_NEAR(dot(by, view.back), 0, 1e-9) << one_to << rest;
    }
  }
}

TEST(HandMotion, WithTheClutchTheToolStaysAndGoesOnFromThere) {
  HandMotion motion;
  const Vec3 at{1, 2, 3};
  EXPECT_EQ(motion.moved(at, {{5, 2, 3}, {4, 0, 0}}), (Vec3{5, 2, 3})) << "1:1, it is under the pointer";
  motion.clutch = true;
  EXPECT_EQ(motion.moved(at, {{9, 2, 3}, {4, 0, 0}}), at);
  EXPECT_EQ(motion.factor(), 0);
  motion.clutch = false;
  EXPECT_EQ(motion.moved(at, {{10, 2, 3}, {1, 0, 0}}), (Vec3{2, 2, 3}))
      << "not under the pointer, but as far as it goes";
  motion.meet();
  EXPECT_EQ(motion.moved(at, {{10, 2, 3}, {1, 0, 0}}), (Vec3{10, 2, 3})) << "brought there, they go together again";
}

TEST(HandMotion, AClutchWithoutAMotionPartsNothing) {
  HandMotion motion;
  motion.clutch = true;
  EXPECT_EQ(motion.moved({}, {{9, 9, 9}, {}}), Vec3{});
  EXPECT_FALSE(motion.parted());
}

TEST(HandMotion, StepsStopAtTheirEnds) {
  HandMotion motion;
  motion.step(1);
  EXPECT_EQ(motion.one_to, 1);
  for (const int wanted : {2, 4, 8, 8}) {
    motion.step(-1);
    EXPECT_EQ(motion.one_to, wanted);
  }
  motion.step(1);
  EXPECT_EQ(motion.one_to, 4);
}

// --- how it is held

double angle_between(Vec3 a, Vec3 b) {
  return std::atan2(length(cross(a, b)), dot(a, b));
}

TEST(HandHold, TheHandleComesFromTheRightAndFromTheLeftOfALeftHand) {
  HandHold hold;
  const Vec3 right = hold.axis(kView);
  EXPECT_NEAR(length(right), 1, 1e-12);
  EXPECT_GT(right.x, 0.5);
  EXPECT_GT(right.z, 0.5) << "towards the eye";
  hold.set_left(true);
  EXPECT_NEAR(length(hold.axis(kView) - Vec3{-right.x, right.y, right.z}), 0, 1e-12);
  EXPECT_NEAR(hold.tilted_rad(), 0, 1e-12);
  // What was tilted is mirrored with it.
  hold.tilt(0.2, 0.1);
  const Vec3 tilted = hold.axis(kView);
  hold.set_left(false);
  EXPECT_NEAR(length(hold.axis(kView) - Vec3{-tilted.x, tilted.y, tilted.z}), 0, 1e-12);
}

TEST(HandHold, TiltsGoWithTheMouseAndStay) {
  HandHold hold;
  const Vec3 before = hold.axis(kView);
  hold.tilt(10 * kDegree, 0);
  const Vec3 right = hold.axis(kView);
  EXPECT_GT(right.x, before.x);
  EXPECT_NEAR(right.y, before.y, 1e-12);
  EXPECT_NEAR(angle_between({before.x, 0, before.z}, {right.x, 0, right.z}), 10 * kDegree, 1e-9);
  hold.straight();
  EXPECT_NEAR(length(hold.axis(kView) - before), 0, 1e-12);
  hold.tilt(0, 10 * kDegree);
  EXPECT_GT(hold.axis(kView).y, before.y);
  EXPECT_NEAR(hold.axis(kView).x, before.x, 1e-12);
  // In another view it is held the same way, as that one shows it.
  const ViewAxes turned{{}, {1, 0, 0}, {0, 0, 1}, {0, 1, 0}};
  const Vec3 here = hold.axis(kView), there = hold.axis(turned);
  EXPECT_NEAR(dot(here, kView.right), dot(there, turned.right), 1e-12);
  EXPECT_NEAR(dot(here, kView.up), dot(there, turned.up), 1e-12);
  EXPECT_NEAR(dot(here, kView.forward), dot(there, turned.forward), 1e-12);
}

TEST(HandHold, RollGoesClockwiseAboutTheLineOfSight) {
  HandHold hold;
  const Vec3 before = hold.axis(kView);
  hold.roll(30 * kDegree);
  const Vec3 after = hold.axis(kView);
  EXPECT_NEAR(after.z, before.z, 1e-12);
  // From 12 o'clock towards 3: the angle in the picture, up being y, falls.
  const double turned = std::atan2(after.y, after.x) - std::atan2(before.y, before.x);
  EXPECT_NEAR(turned, -30 * kDegree, 1e-9);
  hold.roll(-30 * kDegree);
  EXPECT_NEAR(hold.tilted_rad(), 0, 1e-9);
}

TEST(HandHold, NeverFarBehindWhatOneLooksAt) {
  HandHold hold;
  for (int n = 0; n < 200; ++n) {
    hold.tilt(5 * kDegree, n % 3 == 0 ? -4 * kDegree : 0);
    const Vec3 axis = hold.axis(kView);
    EXPECT_NEAR(length(axis), 1, 1e-9);
    EXPECT_GT(axis.z, -std::sin(20 * kDegree) - 1e-9) << n;
  }
}

TEST(HandHold, APlateIsHeldFlatAndTheDrillAsBefore) {
  HandHold hold;
  hold.tilt(0.3, 0.2);
  const Vec3 drill = hold.axis(kView);
  hold.take(true);
  EXPECT_NEAR(length(hold.axis(kView) - kView.forward * -1), 0, 1e-12);
  hold.tilt(0.2, 0);
  EXPECT_NEAR(hold.tilted_rad(), 0.2, 1e-9);
  hold.take(false);
  EXPECT_NEAR(length(hold.axis(kView) - drill), 0, 1e-12);
  hold.take(true);
  EXPECT_NEAR(hold.tilted_rad(), 0, 1e-12) << "the next plate is flat again";
}

// --- what buttons are called and do

TEST(HandButtons, NamesGoBothWays) {
  for (const int b :
       {int{'A'}, 32, 290, 302, 320, 325, 331, 161, button::kPedal, button::kPedal + 2, button::kDevice + 1,
        button::kMouse + 3, button::kPad, button::kPadRightTrigger, button::kStick + 4, button::kAxis}) {
    const std::string name = button_name(b);
    ASSERT_TRUE(button_named(name)) << name;
    EXPECT_EQ(*button_named(name), b) << name;
  }
  EXPECT_EQ(button_name(button::kPedal), "pedal 1");
  EXPECT_EQ(button_name(302), "key F13");
  EXPECT_EQ(button_name(button::kPadRightTrigger), "pad right trigger");
  for (const char* wrong : {"", "pedal", "pedal 0", "pedal 99", "knee 1", "key", "key FOO", "pad Z", "Pedal 1"})
    EXPECT_FALSE(button_named(wrong)) << wrong;
}

TEST(HandButtons, EachButtonDoesOneThing) {
  HandButtons b = HandButtons::usual();
  EXPECT_EQ(b.mask(button::kPedal, HandFunction::drill), 1U);
  EXPECT_EQ(b.mask(button::kPedal, HandFunction::clutch), 2U);
  EXPECT_EQ(b.assign(button::kPedal + 1, HandFunction::drill), HandFunction::clutch);
  EXPECT_EQ(b.mask(button::kPedal, HandFunction::drill), 3U) << "a thing may have several";
  EXPECT_EQ(b.mask(button::kPedal, HandFunction::clutch), 0U);
  b.clear(button::kPedal);
  EXPECT_FALSE(b.function(button::kPedal));
  EXPECT_NE(b, HandButtons::usual());
}

// --- buttons as keys

struct Watched {
  HandButtons buttons = HandButtons::usual();
  Keyboard keyboard;
  ButtonWatch watch;
  Watched() { keyboard.bind(&buttons); }
  std::vector<Keyboard::Press> frame(std::vector<ButtonLevel> levels, bool attended = true) {
    watch.frame(levels, attended, buttons, keyboard);
    return keyboard.frame(false);
  }
};

TEST(ButtonWatch, APedalIsAKey) {
  Watched w;
  const int pedal = button::kPedal + 1;
  w.buttons.assign(pedal, HandFunction::undo);
  EXPECT_TRUE(w.frame({{pedal, 0}}).empty());
  const auto presses = w.frame({{pedal, 1}});
  ASSERT_EQ(presses.size(), 1U);
  EXPECT_EQ(presses[0].command, Command::undo);
  EXPECT_EQ(w.watch.pressed(), pedal);
  EXPECT_TRUE(w.frame({{pedal, 1}}).empty()) << "once";
  EXPECT_FALSE(w.watch.pressed());
  w.frame({{pedal, 0}});
  EXPECT_EQ(w.frame({{pedal, 1}}).size(), 1U);
}

TEST(ButtonWatch, ATriggerDrillsAsFarAsItIsDown) {
  Watched w;
  const int trigger = button::kPadRightTrigger;
  w.frame({{trigger, 0}});
  EXPECT_EQ(w.watch.drill(w.buttons, false), 0);
  for (const double level : {0.4, 1.0, 0.5, 0.1}) {
    w.frame({{trigger, level}});
    EXPECT_EQ(w.watch.drill(w.buttons, false), level);
  }
  w.frame({{trigger, 0.05}});
  EXPECT_EQ(w.watch.drill(w.buttons, false), 0);
  w.frame({{trigger, 0.1}});
  EXPECT_EQ(w.watch.drill(w.buttons, false), 0) << "one that trembles at its end is not pressed";
}

TEST(ButtonWatch, OfTwoForOneThingTheOtherGoesOn) {
  Watched w;
  const int a = button::kPedal + 1, b = button::kMouse + 3;  // both the clutch
  w.frame({{a, 0}, {b, 0}});
  w.frame({{a, 1}, {b, 1}});
  EXPECT_TRUE(w.keyboard.held(Command::clutch));
  w.frame({{a, 0}, {b, 1}});
  EXPECT_TRUE(w.keyboard.held(Command::clutch));
  w.keyboard.on('\'', Keyboard::Event::pressed);  // its key, too
  w.frame({{a, 0}, {b, 0}});
  EXPECT_TRUE(w.keyboard.held(Command::clutch));
  w.keyboard.on('\'', Keyboard::Event::released);
  w.frame({{a, 0}, {b, 0}});
  w.frame({{a, 0}, {b, 0}});
  EXPECT_FALSE(w.keyboard.held(Command::clutch));
  // Of two that drill the one that is farther down counts.
  const int pedal = button::kPedal, trigger = button::kPadRightTrigger;
  w.frame({{pedal, 0}, {trigger, 0}});
  w.frame({{pedal, 1}, {trigger, 0.3}});
  EXPECT_EQ(w.watch.drill(w.buttons, false), 1);
  w.frame({{pedal, 0}, {trigger, 0.3}});
  EXPECT_EQ(w.watch.drill(w.buttons, false), 0.3);
}

// A pedal under the foot while another window has the keys: let go, and not pressed again before it has come up.
TEST(ButtonWatch, WhatIsHeldWhenTheWindowIsLeftIsLetGo) {
  Watched w;
  const int drill = button::kPadRightTrigger, clutch = button::kPedal + 1;
  w.frame({{drill, 0}, {clutch, 0}});
  w.frame({{drill, 1}, {clutch, 1}});
  EXPECT_EQ(w.watch.drill(w.buttons, false), 1);
  EXPECT_TRUE(w.keyboard.held(Command::clutch));
  w.frame({{drill, 1}, {clutch, 1}}, false);
  EXPECT_EQ(w.watch.drill(w.buttons, false), 0);
  EXPECT_FALSE(w.keyboard.held(Command::clutch));
  w.frame({{drill, 1}, {clutch, 1}});
  EXPECT_EQ(w.watch.drill(w.buttons, false), 0) << "still down";
  EXPECT_FALSE(w.keyboard.held(Command::clutch));
  w.frame({{drill, 0}, {clutch, 0}});
  w.frame({{drill, 1}, {clutch, 1}});
  EXPECT_EQ(w.watch.drill(w.buttons, false), 1);
  EXPECT_TRUE(w.keyboard.held(Command::clutch));
}

TEST(ButtonWatch, ADeviceThatGoesLetsGo) {
  Watched w;
  const int drill = button::kPadRightTrigger, clutch = button::kPedal + 1;
  w.frame({{drill, 0}, {clutch, 0}});
  w.frame({{drill, 1}, {clutch, 1}});
  w.frame({});
  EXPECT_EQ(w.watch.drill(w.buttons, false), 0);
  EXPECT_FALSE(w.keyboard.held(Command::clutch));
  // It comes back held, or as an axis that rests there.
  w.frame({{drill, 1}, {clutch, 1}});
  EXPECT_EQ(w.watch.drill(w.buttons, false), 0);
  EXPECT_FALSE(w.keyboard.held(Command::clutch));
}

TEST(ButtonWatch, WhatTheDevicePressesItselfIsNotPressedTwice) {
  Watched w;
  w.frame({{button::kPedal, 0}, {button::kDevice, 0}});
  w.frame({{button::kPedal, 1}, {button::kDevice, 1}});
  EXPECT_EQ(w.watch.drill(w.buttons, true), 0);
  EXPECT_EQ(w.watch.drill(w.buttons, false), 1);
  EXPECT_FALSE(w.keyboard.held(Command::pedal));
}

TEST(ButtonWatch, WhatIsNoNumberOrOutOfRangeIsWithinIt) {
  Watched w;
  const int trigger = button::kPadRightTrigger;
  w.frame({{trigger, -3}});
  w.frame({{trigger, 7}});
  EXPECT_EQ(w.watch.drill(w.buttons, false), 1);
}

TEST(Keyboard, AKeyThatWasGivenAnotherThingDoesThatAlone) {
  Watched w;
  w.buttons.assign('A', HandFunction::drill);
  w.buttons.assign(302, HandFunction::undo);  // F13, which the table does not know
  w.keyboard.on('A', Keyboard::Event::pressed);
  w.keyboard.on(302, Keyboard::Event::pressed);
  const auto presses = w.keyboard.frame(false);
  ASSERT_EQ(presses.size(), 2U);
  EXPECT_EQ(presses[0].command, Command::pedal);
  EXPECT_EQ(presses[1].command, Command::undo);
  EXPECT_TRUE(w.keyboard.held(Command::pedal));
  w.keyboard.on('A', Keyboard::Event::repeated);
  EXPECT_TRUE(w.keyboard.frame(false).empty());
  // Given back while it is down: it comes up all the same.
  w.buttons.clear('A');
  w.keyboard.on('A', Keyboard::Event::released);
  static_cast<void>(w.keyboard.frame(false));
  EXPECT_FALSE(w.keyboard.held(Command::pedal));
}

TEST(Keyboard, AllIsLetGoAtOnce) {
  Keyboard k;
  k.on('V', Keyboard::Event::pressed);
  static_cast<void>(k.frame(false));
  k.let_go();
  static_cast<void>(k.frame(false));
  EXPECT_FALSE(k.held(Command::suck));
}

TEST(Keyboard, AltMakesAnotherKeyOfSome) {
  Keyboard k;
  k.on(263, Keyboard::Event::pressed, kWithAlt);  // Left
  k.on(265, Keyboard::Event::pressed, kWithAlt);  // Up
  k.on(265, Keyboard::Event::pressed);
  k.on('Z', Keyboard::Event::pressed, kWithAlt);
  const auto presses = k.frame(false);
  ASSERT_EQ(presses.size(), 4U);
  EXPECT_EQ(presses[0].command, Command::tilt);
  EXPECT_EQ(presses[1].command, Command::tilt);
  EXPECT_EQ(presses[1].value, 2);
  EXPECT_EQ(presses[2].command, Command::back);
  EXPECT_EQ(presses[3].command, Command::undo);
}

// --- giving them something to do

TEST(ButtonAssign, SaysWhatAButtonNoLongerDoes) {
  HandButtons b = HandButtons::usual();
  ButtonAssign assign;
  EXPECT_EQ(assign.take('A', b), "") << "nobody asked";
  assign.listen(HandFunction::undo);
  EXPECT_EQ(assign.take(button::kPedal + 1, b), "pedal 2: undo; no longer clutch");
  EXPECT_FALSE(assign.listens());
  EXPECT_EQ(b.function(button::kPedal + 1), HandFunction::undo);
  assign.listen(HandFunction::undo);
  EXPECT_EQ(assign.take(button::kPedal + 1, b), "pedal 2: undo, as before");
  // A key of the table.
  assign.listen(HandFunction::drill);
  const std::string said = assign.take('X', b);
  EXPECT_EQ(said.find("key X: drill; no longer: Saw"), 0U) << said;
  // One that does the same by the table.
  assign.listen(HandFunction::clutch);
  EXPECT_EQ(assign.take('\'', b), "key apostrophe: clutch");
}

TEST(ButtonAssign, RefusesWhatIsNeededToGetBack) {
  HandButtons b = HandButtons::usual();
  const HandButtons before = b;
  ButtonAssign assign;
  assign.listen(HandFunction::undo);
  for (const int key : {290, 299, 340, 341, 342, 346}) {  // F1, F10, Shift, Ctrl, Alt, right Alt
    EXPECT_NE(assign.take(key, b).find("press another"), std::string::npos) << key;
    EXPECT_EQ(assign.listens(), HandFunction::undo);
  }
  EXPECT_NE(assign.take(256, b).find("no button"), std::string::npos);
  EXPECT_FALSE(assign.listens());
  EXPECT_EQ(b, before);
  assign.listen(HandFunction::drill);
  EXPECT_NE(assign.take(261, b).find("no button now"), std::string::npos);
  EXPECT_TRUE(b.buttons_of(HandFunction::drill).empty());
}

}  // namespace
}  // namespace osteo
