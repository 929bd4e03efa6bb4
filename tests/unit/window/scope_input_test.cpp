// Mouse, keys and devices on the microscope, without a window.
#include "scope_input.h"

#include <gtest/gtest.h>

#include <cmath>

namespace osteo {
namespace {

constexpr double kFrame = 1.0 / 60;

ScopeScene some_scene() {
  ScopeScene scene{{10, 0, 5}, 80, {40, -5, 12}, normalized({0.7, -0.4, 0.5}), {}};
  // Bone is a ball of 60 mm.
  scene.bone = [](Vec3 from, Vec3 direction) -> std::optional<Vec3> {
    const Vec3 to = from - Vec3{10, 0, 5};
    const double b = dot(to, direction), c = dot(to, to) - 60 * 60, d = b * b - c;
    return d < 0 || b > 0 ? std::nullopt : std::optional(from + direction * (-b - std::sqrt(d)));
  };
  return scene;
}

ScopeInput some_input() {
  ScopeInput input;
  input.area = {270, 0, 800, 860};
  input.overview(StandardView::left, some_scene(), false);
  return input;
}

std::string press(ScopeInput& input, Command command, int value = 0, bool shift = false,
                  std::optional<Vec3> under = {}) {
  LocalText said;
  EXPECT_TRUE(input.key({command, value, shift}, some_scene(), under, said));
  input.advance(Keyboard(), false, {}, 1);
  return said.shown;
}

TEST(ScopeInput, TheMiddleButtonKeepsTheFocusPlaneUnderTheMouse) {
  ScopeInput input = some_input();
  const Vec3 under = input.view().at_depth_of(input.view().focus_mm, input.area, 500, 300);
  ScopeMouse m{530, 280, 30, -20};
  m.middle = true;
  EXPECT_TRUE(input.mouse(m, false, kFrame));
  const auto p = input.view().pixel(under, input.area);
  ASSERT_TRUE(p);
  EXPECT_NEAR((*p)[0], 530, 1e-9);
  EXPECT_NEAR((*p)[1], 280, 1e-9);
}

TEST(ScopeInput, ButtonsAndWheel) {
  ScopeInput input = some_input();
  const ScopeView before = input.view();
  EXPECT_FALSE(input.mouse({500, 300, 5, 5}, false, kFrame)) << "that is the hand's";
  ScopeMouse wheel{500, 300};
  wheel.wheel = 1;
  // Depth: with Shift, or while the button drills.
  wheel.shift = true;
  EXPECT_FALSE(input.mouse(wheel, false, kFrame));
  wheel.shift = false;
  wheel.works = true;
  EXPECT_FALSE(input.mouse(wheel, false, kFrame));
  EXPECT_EQ(input.view(), before);
  wheel.works = false;
  EXPECT_TRUE(input.mouse(wheel, false, kFrame));
  EXPECT_NEAR(input.view().magnification, 1.1 * before.magnification, 1e-12);
  EXPECT_EQ(input.view().eye_mm(), before.eye_mm());
  // The hand keeps what the mouse went meanwhile; and the old way goes on, also while the button drills.
  wheel.dx = 3;
  EXPECT_FALSE(input.mouse(wheel, false, kFrame));
  EXPECT_NEAR(input.view().magnification, 1.21 * before.magnification, 1e-12);
  wheel.dx = 0;
  wheel.ctrl = wheel.works = true;
  EXPECT_TRUE(input.mouse(wheel, false, kFrame));
  EXPECT_NEAR(input.view().magnification, 1.331 * before.magnification, 1e-12);
  wheel.works = false;
  wheel.shift = true;
  EXPECT_TRUE(input.mouse(wheel, false, kFrame));
  EXPECT_LT(dot(input.view().focus_mm - before.focus_mm, before.back), 0) << "deeper";
  ScopeMouse drag{500, 300, 20, 0};
  drag.right = true;
  EXPECT_TRUE(input.mouse(drag, false, kFrame));
  EXPECT_LT(dot(input.view().back, before.right()), 0) << "what is seen goes to the right";
  drag.shift = true;
  EXPECT_TRUE(input.mouse(drag, false, kFrame));
  EXPECT_GT(std::abs(input.view().right().z), 0.05) << "rolled";
}

TEST(ScopeInput, KeysMagnifyAndFocus) {
  ScopeInput input = some_input();
  press(input, Command::magnify, 1);
  EXPECT_EQ(input.view().magnification, 4);
  EXPECT_NEAR(length(input.view().focus_mm - Vec3{10, 0, 5}), 60, 1e-6) << "and the bone is in focus";
  press(input, Command::magnify, 1);
  EXPECT_EQ(input.view().magnification, 6);
  const Vec3 before = input.view().focus_mm;
  press(input, Command::focus, 1);
  EXPECT_NEAR(length(input.view().focus_mm - before), 0.02 * input.view().field_mm(), 1e-9);
  // Autofocus: onto the ball's front.
  EXPECT_EQ(press(input, Command::autofocus), "");
  EXPECT_NEAR(length(input.view().focus_mm - Vec3{10, 0, 5}), 60, 1e-6);
  // And looking there.
  const Vec3 aside = normalized(Vec3{10, 0, 5} + input.view().up * 20 - input.view().eye_mm());
  EXPECT_EQ(press(input, Command::look_there, 0, false, aside), "");
  EXPECT_NEAR(length(input.view().focus_mm - Vec3{10, 0, 5}), 60, 1e-6);
  EXPECT_NE(press(input, Command::look_there), "") << "no mouse over the view";
  EXPECT_NE(press(input, Command::look_there, 0, false, input.view().back), "") << "no bone";
}

TEST(ScopeInput, KeysForViews) {
  ScopeInput input = some_input();
  EXPECT_NE(press(input, Command::bookmark, 1), "") << "nothing is kept, and that is said";
  press(input, Command::look_at_drill);
  EXPECT_EQ(input.view().focus_mm, some_scene().drill_mm);
  EXPECT_NE(press(input, Command::bookmark, 1, true), "");
  const ScopeView kept = input.view();
  press(input, Command::look_at_drill, 0, true);
  EXPECT_LT(length(input.view().back - some_scene().handle), 1e-12) << "along the handle";
  EXPECT_EQ(press(input, Command::bookmark, 1), "");
  EXPECT_EQ(input.view(), kept);
  press(input, Command::camera_back);
  EXPECT_LT(length(input.view().back - some_scene().handle), 1e-12);
  press(input, Command::home);
  EXPECT_EQ(input.view().focus_mm, some_scene().centre_mm);
  for (int n = 0; n < 10; ++n) press(input, Command::camera_back);
  EXPECT_NE(press(input, Command::camera_back), "");
  LocalText said;
  EXPECT_FALSE(input.key({Command::bring, 0}, some_scene(), {}, said)) << "not the camera's";
}

TEST(ScopeInput, StandardViews) {
  ScopeInput input = some_input();
  const auto from = [&](StandardView view) {
    input.overview(view, some_scene(), true);
    input.advance(Keyboard(), false, {}, 1);
    return input.view();
  };
  EXPECT_GT(from(StandardView::left).back.x, 0.9);
  EXPECT_LT(from(StandardView::right).back.x, -0.9);
  EXPECT_LT(from(StandardView::front).back.y, -0.9);
  const ScopeView above = from(StandardView::above);
  EXPECT_GT(above.back.z, 0.99);
  EXPECT_LT(above.up.y, -0.99) << "the face is up";
  // The surgeon's: the face up, on the side that was looked at.
  static_cast<void>(from(StandardView::right));
  const ScopeView surgeon = from(StandardView::surgeon);
  EXPECT_LT(surgeon.back.x, -0.9);
  EXPECT_LT(surgeon.up.y, -0.9);
  EXPECT_FALSE(surgeon.upright);
  static_cast<void>(from(StandardView::left));
  EXPECT_GT(from(StandardView::surgeon).right().z, 0.9) << "left ear: the crown is at the right";
}

// O held: the mouse is the device; then it is the hand again, and the camera rests.
TEST(ScopeInput, TheDeviceMovesTheCameraWhileItIsLent) {
  ScopeInput input = some_input();
  const ScopeView before = input.view();
  input.lend(true);
  for (int n = 0; n < 20; ++n) EXPECT_TRUE(input.mouse({500, 300, 10, 0}, true, kFrame));
  EXPECT_GT(dot(input.view().focus_mm - before.focus_mm, before.right()), 1);
  EXPECT_EQ(input.view().back, before.back);
  input.lend(false);
  const ScopeView braked = input.view();
  input.advance(Keyboard(), false, {}, kFrame);
  EXPECT_EQ(input.view(), braked);
  // With Shift it turns.
  input.lend(true);
  for (int n = 0; n < 20; ++n) input.mouse({500, 300, 10, 0, 0, false, false, false, true}, true, kFrame);
  EXPECT_LT(length(input.view().focus_mm - braked.focus_mm), 1e-9);
  EXPECT_GT(dot(input.view().back, braked.right()), 0.05);
}

TEST(ScopeInput, AnArmMovesItByItsMotionNotByItsPlace) {
  ScopeInput input = some_input();
  input.control.arm.params.inertia_s = 0;
  const ScopeView before = input.view();
  CameraDevices arm;
  arm.hand_mm = Vec3{1000, 0, 0};
  input.advance(Keyboard(), false, arm, kFrame);
  EXPECT_EQ(input.view(), before) << "it is not lent";
  input.lend(true);
  input.advance(Keyboard(), false, arm, kFrame);
  EXPECT_EQ(input.view(), before) << "where it is does not matter";
  arm.hand_mm = Vec3{1005, 0, 0};
  input.advance(Keyboard(), false, arm, kFrame);
  EXPECT_NEAR(dot(input.view().focus_mm - before.focus_mm, before.right()), 0.05 * before.field_mm(), 1e-9);
  // Let go and taken up elsewhere: the clutch.
  input.lend(false);
  input.lend(true);
  const ScopeView there = input.view();
  arm.hand_mm = Vec3{0, 50, 0};
  input.advance(Keyboard(), false, arm, kFrame);
  EXPECT_EQ(input.view(), there);
}

TEST(ScopeInput, APuckDrivesAndKeysTurn) {
  ScopeInput input = some_input();
  const ScopeView before = input.view();
  CameraDevices puck;
  puck.push = Vec3{0, 1, 0};
  for (int n = 0; n < 60; ++n) input.advance(Keyboard(), false, puck, kFrame);
  EXPECT_NEAR(dot(input.view().focus_mm - before.focus_mm, before.up), before.field_mm(), 0.1 * before.field_mm());
  Keyboard keys;
  keys.on(326, Keyboard::Event::pressed);
  static_cast<void>(keys.frame(false));
  const ScopeView rest = input.view();
  for (int n = 0; n < 60; ++n) input.advance(keys, false, {}, kFrame);
  EXPECT_GT(dot(input.view().back, rest.right()), 0.3);
}

TEST(ScopeInput, WordsOfTheView) {
  ScopeView v;
  magnify(v, 10);
  EXPECT_EQ(scope_text(v), "10.0x  field 20.0 mm  WD 250 mm");
  EXPECT_EQ(scope_text(overview({}, 120, {1, 0, 0})), "eye 0.9x  field 214 mm  at 400 mm");
}

}  // namespace
}  // namespace osteo
