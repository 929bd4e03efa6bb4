// What the mouse does to the three cuts, without a screen.
#include "cuts_control.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "cuts_drawer.h"
#include "solid.h"

namespace osteo {
namespace {

struct Cuts {
  CutsControl control;
  Cuts() {
    for (int c = 0; c < CutsControl::kCuts; ++c) control.resize(c, 300, 200);
    control.set_bounds({-100, -90, -80}, {100, 90, 80}, 0.5);
    control.tool_is({10, 20, 30}, {0, 0, 1});
  }
  SlicePointer at(int cut, Vec3 mm, bool shift = false, bool ctrl = false) const {
    const auto p = control.view(cut).pixel(mm);
    return {cut, p[0], p[1], shift, ctrl};
  }
  void drag(SlicePointer from, SlicePointer to, SliceButton button) {
    control.press(from, button);
    control.move(to);
    control.release(to, button);
  }
};

void expect_near(Vec3 a, Vec3 b, double within = 1e-9) {
  EXPECT_LT(length(a - b), within) << a.x << ' ' << a.y << ' ' << a.z << " beside " << b.x << ' ' << b.y << ' ' << b.z;
}

TEST(CutsControl, FollowsTheToolButThePictureStandsUntilItLeavesIt) {
  Cuts c;
  expect_near(c.control.cross_mm(), {10, 20, 30});
  const Vec3 corner = c.control.view(0).world(0, 0);
  c.control.tool_is({12, 21, 30}, {0, 0, 1});
  expect_near(c.control.view(0).world(0, 0), corner);
  for (int cut = 0; cut < 3; ++cut) expect_near(c.control.view(cut).through_mm, {12, 21, 30});
  c.control.tool_is({70, 21, 30}, {0, 0, 1});
  const auto p = c.control.view(0).pixel({70, 21, 30});
  EXPECT_NEAR(p[0], 0.8 * 300, 1e-6);  // at the edge of what is kept, not jumped to the middle
  // Out in the air: the bone's side that is nearest to it.
  c.control.tool_is({400, 21, 30}, {0, 0, 1});
  expect_near(c.control.cross_mm(), {100, 21, 30});
  EXPECT_NEAR(c.control.view(0).pixel({100, 21, 30})[0], 0.8 * 300, 1e-6);
  // Not followed: it stays where it was put, until it follows again and is in the middle.
  c.control.go_to({0, 0, 0});
  c.control.tool_is({1, 2, 3}, {0, 0, 1});
  expect_near(c.control.cross_mm(), {0, 0, 0});
  c.control.follow(true);
  expect_near(c.control.cross_mm(), {1, 2, 3});
  expect_near(c.control.view(1).centre_mm, {1, 2, 3});
}

TEST(CutsControl, AClickLooksThereInAllThree) {
  Cuts c;
  const Vec3 there{-5, 20, 40};
  c.drag(c.at(1, there), c.at(1, there), SliceButton::left);
  expect_near(c.control.cross_mm(), there);
  EXPECT_FALSE(c.control.follows());
  for (int cut = 0; cut < 3; ++cut)
    EXPECT_NEAR(dot(c.control.view(cut).world(7, 9) - there, c.control.view(cut).normal()), 0, 1e-9);
  // Shift-move without a button; without Shift nothing moves.
  c.control.move(c.at(0, {1, 2, 40}));
  expect_near(c.control.cross_mm(), there);
  c.control.move(c.at(0, {3, 4, 40}, true));
  expect_near(c.control.cross_mm(), {3, 4, 40});
  // Not out of the bone's box.
  c.control.go_to({1000, -1000, 0});
  expect_near(c.control.cross_mm(), {100, -90, 0});
}

TEST(CutsControl, WheelScrollsAwayFromWhoLooksAndCtrlWheelZooms) {
  Cuts c;
  c.control.wheel({0, 10, 10}, 3);
  expect_near(c.control.cross_mm(), {10, 20, 31.5});
  EXPECT_FALSE(c.control.follows());
  c.control.wheel({1, 10, 10}, -2);
  expect_near(c.control.cross_mm(), {10, 19, 31.5});
  c.control.wheel({2, 10, 10}, 1);
  expect_near(c.control.cross_mm(), {9.5, 19, 31.5});
  for (int n = 0; n < 1000; ++n) c.control.wheel({0, 10, 10}, 5);
  EXPECT_EQ(c.control.cross_mm().z, 80);
  const Vec3 under = c.control.view(1).world(250, 30), cross = c.control.cross_mm();
  const double before = c.control.view(1).mm_per_pixel;
  c.control.wheel({1, 250, 30, false, true}, 2);
  expect_near(c.control.view(1).world(250, 30), under);
  EXPECT_NEAR(c.control.view(1).mm_per_pixel, before / (1.15 * 1.15), 1e-12);
  expect_near(c.control.cross_mm(), cross);
  for (int n = 0; n < 1000; ++n) c.control.wheel({1, 250, 30, false, true}, 2);
  EXPECT_EQ(c.control.view(1).mm_per_pixel, 0.005);
}

TEST(CutsControl, RightDragIsWindowAndLevelAndARightClickTakesThemBack) {
  Cuts c;
  c.control.take_preset(2);
  const HuWindow preset = grey_presets()[2].hu;
  EXPECT_EQ(c.control.hu, preset);
  c.drag({0, 100, 100}, {0, 150, 80}, SliceButton::right);
  EXPECT_NEAR(c.control.hu.width, preset.width + 200, 1e-9);
  EXPECT_NEAR(c.control.hu.level, preset.level + 80, 1e-9);
  EXPECT_TRUE(c.control.follows());                          // nothing else has changed
  c.drag({0, 100, 100}, {0, 101, 100}, SliceButton::right);  // a hand that shakes
  EXPECT_EQ(c.control.hu, preset);
  c.drag({0, 0, 0}, {0, -100000, 100000}, SliceButton::right);
  EXPECT_EQ(c.control.hu.width, 1);
  EXPECT_EQ(c.control.hu.level, -2000);
}

TEST(CutsControl, LeftDragMeasuresAndMiddleDragMoves) {
  Cuts c;
  const Vec3 cross = c.control.cross_mm();
  c.drag(c.at(0, {0, 10, 30}), c.at(0, {3, 14, 30}), SliceButton::left);
  ASSERT_TRUE(c.control.ruler());
  EXPECT_NEAR(c.control.ruler()->length_mm(), 5, 1e-9);
  expect_near(c.control.cross_mm(), cross);
  const Vec3 under = c.control.view(2).world(50, 60);
  c.drag({2, 50, 60}, {2, 80, 20}, SliceButton::middle);
  expect_near(c.control.view(2).world(80, 20), under);
  expect_near(c.control.cross_mm(), cross);
  // A click, which looks elsewhere, puts the ruler away.
  c.drag(c.at(0, {1, 1, 30}), c.at(0, {1, 1, 30}), SliceButton::left);
  EXPECT_FALSE(c.control.ruler());
  // What began beside the cuts does nothing in them.
  c.drag({-1, 0, 0}, {0, 30, 30}, SliceButton::left);
  EXPECT_FALSE(c.control.ruler());
}

TEST(CutsControl, OneTakesTheMiddleWithTheSameMillimetres) {
  Cuts c;
  c.control.double_click({1, 20, 20});
  EXPECT_EQ(c.control.enlarged(), 1);
  const double shown = 200 * c.control.view(1).mm_per_pixel;
  c.control.resize(1, 1200, 900);
  EXPECT_NEAR(900 * c.control.view(1).mm_per_pixel, shown, 1e-9);
  c.control.double_click({1, 20, 20});
  EXPECT_EQ(c.control.enlarged(), -1);
  c.control.move({});
  c.control.enlarge_or_back();  // by the key, with the mouse elsewhere: the last one
  EXPECT_EQ(c.control.enlarged(), 1);
}

TEST(CutsControl, AlongTheToolTwoPlanesHoldItsAxisAndOneLiesAcross) {
  Cuts c;
  c.control.take_planes(CutsControl::Planes::tool);
  Vec3 last_right;
  for (int n = 0; n <= 400; ++n) {
    // Over the top, through each of the body's axes.
    const double a = 2 * 3.14159265358979 * n / 400;
    const Vec3 axis = normalized({std::sin(a), 0.3 * std::sin(2 * a), std::cos(a)});
    c.control.tool_is({1, 2, 3}, axis);
    EXPECT_NEAR(std::abs(dot(c.control.view(0).normal(), axis)), 1, 1e-9);
    for (int cut = 1; cut < 3; ++cut) {
      const SliceView& v = c.control.view(cut);
      EXPECT_NEAR(dot(v.normal(), axis), 0, 1e-9);
      expect_near(v.axes().down, axis * -1, 1e-9);  // the handle up
      EXPECT_NEAR(length(v.axes().right), 1, 1e-9);
      // A point on the axis is in the cut, at the middle column of where the tip is.
      EXPECT_NEAR(v.pixel(Vec3{1, 2, 3} + axis * 20)[0], v.pixel({1, 2, 3})[0], 1e-6);
    }
    const Vec3 right = c.control.view(1).axes().right;
    if (n > 0) {  // never jumps
      EXPECT_GT(dot(right, last_right), 0.99) << n;
    }
    last_right = right;
  }
  EXPECT_NEAR(dot(c.control.view(1).normal(), c.control.view(2).normal()), 0, 1e-9);
  // Not followed, they stay as they are, and scroll along their own normals.
  c.control.follow(false);
  const Vec3 n = c.control.view(1).normal(), before = c.control.cross_mm();
  c.control.tool_is({1, 2, 3}, {1, 0, 0});
  c.control.wheel({1, 5, 5}, 2);
  expect_near(c.control.cross_mm(), before + n * 1.0);
  c.control.take_planes(CutsControl::Planes::body);
  expect_near(c.control.view(0).normal(), {0, 0, 1});
}

TEST(CutsControl, PointsUnderTheMouseAndEdgesOfTheBody) {
  Cuts c;
  c.control.move(c.at(2, {10, 33, 44}));
  ASSERT_TRUE(c.control.under_mouse());
  expect_near(*c.control.under_mouse(), {10, 33, 44});
  c.control.move({});
  EXPECT_FALSE(c.control.under_mouse());
  using Letters = std::array<std::string, 4>;
  EXPECT_EQ(edge_letters(c.control.view(0)), (Letters{"R", "L", "A", "P"}));
  EXPECT_EQ(edge_letters(c.control.view(1)), (Letters{"R", "L", "H", "F"}));
  EXPECT_EQ(edge_letters(c.control.view(2)), (Letters{"A", "P", "H", "F"}));
  SliceView oblique;
  oblique.oblique = SliceAxes{normalized({1, 0.5, 0}), {0, 0, -1}};
  EXPECT_EQ(edge_letters(oblique), (Letters{"RA", "LP", "H", "F"}));
}

// --- what is drawn when
// -------------------------------------------------------------------------------------------------------------------

std::vector<DrawnCut> draw_all(CutsDrawer& drawer, const std::array<std::optional<SliceView>, 3>& views,
                               const CutsScene& scene) {
  std::vector<DrawnCut> drawn;
  for (int n = 0; n < 2000; ++n) {
    for (DrawnCut& d : drawer.next(views, scene)) drawn.push_back(std::move(d));
    if (!drawer.busy() && n > 40) break;  // also what waits for its pause has had time to begin
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return drawn;
}

TEST(CutsDrawer, DrawsAgainOnlyWhatHasChanged) {
  auto body = std::make_shared<Body>();
  body->bone = test::solid(
      1, 12, [](Vec3 p) { return length(p) < 8; }, {}, 1);
  CutsScene scene;
  scene.parts = {{body, {}}};
  CutsDrawer drawer;
  drawer.show(nullptr, {}, {}, 0.4);
  std::array<std::optional<SliceView>, 3> views;
  for (int c = 0; c < 3; ++c) {
    views[static_cast<std::size_t>(c)].emplace();
    SliceView& v = *views[static_cast<std::size_t>(c)];
    v.plane = static_cast<Plane>(c);
    v.width = v.height = 40;
    v.mm_per_pixel = 0.1;
  }
  views[2].reset();  // not seen
  EXPECT_EQ(draw_all(drawer, views, scene).size(), 2u);
  EXPECT_EQ(draw_all(drawer, views, scene).size(), 0u);
  views[0]->through_mm.x = 3;  // the crosshair within the cut
  EXPECT_EQ(draw_all(drawer, views, scene).size(), 0u);
  views[0]->through_mm.z = 2;
  const auto scrolled = draw_all(drawer, views, scene);
  ASSERT_EQ(scrolled.size(), 1u);
  EXPECT_EQ(scrolled[0].cut, 0);
  // No finer than asked for, and no smaller than what is seen.
  EXPECT_EQ(scrolled[0].view.mm_per_pixel, 0.4);
  EXPECT_GE(scrolled[0].view.width * 0.4, 4.0);
  EXPECT_LE(scrolled[0].view.width, 12);
  scene.removed_mm3 = 1;
  EXPECT_EQ(draw_all(drawer, views, scene).size(), 2u);
  scene.hu.level += 10;
  EXPECT_EQ(draw_all(drawer, views, scene).size(), 2u);
  views[2] = views[1];
  EXPECT_EQ(draw_all(drawer, views, scene).size(), 1u);
}

// They begin on bone, so that none is black, and follow the tool from its first contact on.
TEST(CutsControl, BeginOnBoneAndFollowFromTheFirstContact) {
  CutsControl c;
  for (int v = 0; v < CutsControl::kCuts; ++v) c.resize(v, 200, 200);
  c.set_bounds({-50, -50, -50}, {50, 50, 50}, 0.5);
  c.begin_at({10, 5, -3});
  c.tool_is({40, 40, 40}, {0, 0, 1}, false);
  EXPECT_EQ(c.cross_mm(), (Vec3{10, 5, -3}));
  EXPECT_TRUE(c.waits() && c.follows());
  for (int v = 0; v < CutsControl::kCuts; ++v) EXPECT_NEAR(c.view(v).pixel({10, 5, -3})[0], 99.5, 1);
  c.tool_is({20, 20, 20}, {0, 0, 1}, true);
  EXPECT_EQ(c.cross_mm(), (Vec3{20, 20, 20}));
  c.tool_is({21, 20, 20}, {0, 0, 1}, false);  // and then all the time
  EXPECT_EQ(c.cross_mm(), (Vec3{21, 20, 20}));
  // Asked to follow, they do not wait.
  CutsControl d;
  d.set_bounds({-50, -50, -50}, {50, 50, 50}, 0.5);
  d.begin_at({0, 0, 0});
  d.tool_is({1, 2, 3}, {0, 0, 1}, false);
  d.follow(true);
  EXPECT_EQ(d.cross_mm(), (Vec3{1, 2, 3}));
}

}  // namespace
}  // namespace osteo
