// The microscope's optics and moves against exact values.
#include "osteo/simulation/camera/microscope.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace osteo {
namespace {

const PictureArea kArea{270, 0, 800, 860};

double apart(Vec3 a, Vec3 b) {
  return length(a - b);
}

void expect_frame(const ScopeView& v) {
  EXPECT_NEAR(length(v.back), 1, 1e-12);
  EXPECT_NEAR(length(v.up), 1, 1e-12);
  EXPECT_NEAR(dot(v.back, v.up), 0, 1e-12);
}

// The focus is in the middle: seen from the eye, straight ahead.
double off_middle(const ScopeView& v) {
  const Vec3 to = normalized(v.focus_mm - v.eye_mm());
  return std::hypot(dot(to, v.right()), dot(to, v.up));
}

ScopeView some_view() {
  ScopeView v;
  v.focus_mm = {12, -34, 56};
  look_from(v, {0.8, -0.5, 0.3});
  magnify(v, 6);
  return v;
}

TEST(Microscope, FieldOfViewIsTheFieldNumberOverTheMagnification) {
  ScopeView v = some_view();
  const double fields[] = {50, 200.0 / 6, 20, 12.5, 8}, degrees[] = {11.42, 7.63, 4.58, 2.86, 1.83};
  for (std::size_t n = 0; n < kMagnifications.size(); ++n) {
    magnify(v, kMagnifications[n]);
    EXPECT_DOUBLE_EQ(v.field_mm(), fields[n]);
    EXPECT_NEAR(v.field_angle_rad() * 180 / std::numbers::pi, degrees[n], 0.01);
  }
  for (double m = 0.21; m < 40; m *= 1.07) {
    magnify(v, m);
    EXPECT_DOUBLE_EQ(v.magnification * v.field_mm(), kFieldNumberMm);
    // And it is what the picture shows: the field across its shorter side.
    const auto left = v.pixel(v.focus_mm - v.right() * (v.field_mm() / 2), kArea);
    ASSERT_TRUE(left);
    EXPECT_NEAR((*left)[0], kArea.x, 1e-8);
  }
  magnify(v, 1000);
  EXPECT_EQ(v.magnification, kMaxMagnification);
}

TEST(Microscope, ParfocalZoomKeepsEyeFocusAndDirections) {
  ScopeView v = some_view();
  const ScopeView before = v;
  const Vec3 place = v.focus_mm + v.right() * 3 + v.up * -2;
  const Vec3 direction = normalized(place - v.eye_mm());
  magnify(v, 25);
  EXPECT_EQ(v.eye_mm(), before.eye_mm());
  EXPECT_EQ(v.focus_mm, before.focus_mm);
  EXPECT_EQ(normalized(place - v.eye_mm()), direction);
  // In the picture it goes straight away from the middle, in proportion.
  const auto a = before.pixel(place, kArea), b = v.pixel(place, kArea);
  ASSERT_TRUE(a && b);
  const double x = kArea.x + kArea.width / 2, y = kArea.y + kArea.height / 2;
  EXPECT_NEAR(((*b)[0] - x) / ((*a)[0] - x), 25.0 / 6, 1e-9);
  EXPECT_NEAR(((*b)[1] - y) / ((*a)[1] - y), 25.0 / 6, 1e-9);
}

TEST(Microscope, TheChangerClicksFromWhereverItIs) {
  ScopeView v;
  magnify(v, 0.9);
  double seen[7];
  for (double& m : seen) {
    step_magnification(v, 1);
    m = v.magnification;
  }
  EXPECT_EQ(seen[0], 4);
  EXPECT_EQ(seen[1], 6);
  EXPECT_EQ(seen[4], 25);
  EXPECT_EQ(seen[6], 25) << "there is no more";
  magnify(v, 11);
  step_magnification(v, -1);
  EXPECT_EQ(v.magnification, 10);
  for (int n = 0; n < 5; ++n) step_magnification(v, -1);
  EXPECT_EQ(v.magnification, 4);
}

TEST(Microscope, OrbitKeepsTheFocusInTheMiddle) {
  for (const bool upright : {true, false}) {
    ScopeView v = some_view();
    v.upright = upright;
    std::mt19937 random(4);
    std::uniform_real_distribution<double> by(-0.4, 0.4);
    for (int n = 0; n < 5000; ++n) {
      const ScopeView before = v;
      orbit(v, by(random), by(random));
      ASSERT_LT(off_middle(v), 1e-9);
      ASSERT_LT(apart(v.focus_mm, before.focus_mm), 1e-12);
      ASSERT_NEAR(length(v.eye_mm() - v.focus_mm), 250, 1e-9);
      if (upright) {
        ASSERT_NEAR(v.right().z, 0, 1e-12);
        ASSERT_GT(v.up.z, 0.017);
      }
    }
    expect_frame(v);
  }
}

TEST(Microscope, OrbitGoesToTheRightAndUp) {
  for (const bool upright : {true, false}) {
    ScopeView v;
    look_from(v, {1, 0, 0});  // from the patient's left: right is to the back
    v.upright = upright;
    EXPECT_LT(apart(v.right(), {0, 1, 0}), 1e-12);
    ScopeView r = v, u = v;
    orbit(r, 0.5, 0);
    EXPECT_LT(apart(r.back, {std::cos(0.5), std::sin(0.5), 0}), 1e-12);
    orbit(u, 0, 0.5);
    EXPECT_LT(apart(u.back, {std::cos(0.5), 0, std::sin(0.5)}), 1e-12);
  }
}

TEST(Microscope, UprightStopsBelowTheTopAndKnowsItsWayFromThere) {
  ScopeView v = some_view();
  orbit(v, 0, 10);
  EXPECT_NEAR(std::asin(v.back.z), 89 * std::numbers::pi / 180, 1e-9);
  orbit(v, 0, -10);
  EXPECT_NEAR(std::asin(v.back.z), -89 * std::numbers::pi / 180, 1e-9);
  look_from(v, {0, 0, 1});
  EXPECT_LT(v.up.y, -0.99) << "seen from above the face is up";
  expect_frame(v);
}

TEST(Microscope, PanKeepsTheWorkingDistanceAndTheDirection) {
  ScopeView v = some_view();
  const ScopeView before = v;
  pan(v, 3, -4);
  EXPECT_NEAR(apart(v.focus_mm, before.focus_mm), 5, 1e-12);
  EXPECT_NEAR(dot(v.focus_mm - before.focus_mm, v.back), 0, 1e-12);
  EXPECT_EQ(v.back, before.back);
  EXPECT_NEAR(apart(v.eye_mm(), v.focus_mm), 250, 1e-9);
}

TEST(Microscope, FocusGoesAlongTheAxis) {
  ScopeView v = some_view();
  const ScopeView before = v;
  focus_deeper(v, 7);
  EXPECT_LT(apart(v.focus_mm, before.focus_mm - before.back * 7), 1e-12);
  EXPECT_NEAR(apart(v.eye_mm(), v.focus_mm), 250, 1e-9);
  // Autofocus: a place anywhere in the picture comes into the plane of the focus, the view does not swing.
  const Vec3 bone = before.focus_mm + before.back * 11 + before.right() * 2;
  focus_on_depth_of(v, bone);
  EXPECT_NEAR(dot(bone - v.focus_mm, v.back), 0, 1e-12);
  EXPECT_EQ(v.back, before.back);
  set_working_distance(v, 300);
  EXPECT_NEAR(apart(v.eye_mm(), v.focus_mm), 300, 1e-9);
  EXPECT_DOUBLE_EQ(v.field_mm(), before.field_mm());
}

TEST(Microscope, RollTurnsThePictureAlone) {
  ScopeView v = some_view();
  const ScopeView before = v;
  roll(v, std::numbers::pi / 2);
  EXPECT_EQ(v.focus_mm, before.focus_mm);
  EXPECT_LT(apart(v.back, before.back), 1e-12);
  EXPECT_LT(apart(v.up, before.right() * -1), 1e-12);
  EXPECT_FALSE(v.upright);
  level(v);
  EXPECT_LT(apart(v.up, before.up), 1e-12);
}

TEST(Microscope, SixDegreesAtOnce) {
  ScopeView v = some_view();
  v.upright = false;
  const ScopeView before = v;
  move(v, {{1, 2, 3}, {0, 0, 0.3}});
  EXPECT_LT(apart(v.focus_mm, before.focus_mm + before.right() * 1 + before.up * 2 + before.back * 3), 1e-12);
  EXPECT_NEAR(length(turn_between(before, v)), 0.3, 1e-12);
  EXPECT_NEAR(turn_between(before, v).z, 0.3, 1e-12);
  v = before;
  move(v, {{}, {0.2, -0.1, 0.4}});
  EXPECT_LT(apart(turn_between(before, v), {0.2, -0.1, 0.4}), 1e-12);
  expect_frame(v);
  // Upright nothing tilts the head.
  v = some_view();
  move(v, {{}, {0.2, -0.1, 0.4}});
  EXPECT_NEAR(v.right().z, 0, 1e-12);
}

TEST(Microscope, PixelsAndPlacesAreInverse) {
  const ScopeView v = some_view();
  for (const double depth : {-20.0, 0.0, 35.0}) {
    const Vec3 place = v.focus_mm + v.right() * 4 + v.up * -7 + v.back * depth;
    const auto p = v.pixel(place, kArea);
    ASSERT_TRUE(p);
    EXPECT_LT(apart(v.at_depth_of(place, kArea, (*p)[0], (*p)[1]), place), 1e-9);
    EXPECT_LT(apart(v.ray(kArea, (*p)[0], (*p)[1]), normalized(place - v.eye_mm())), 1e-12);
  }
  EXPECT_FALSE(v.pixel(v.eye_mm() + v.back * 10, kArea)) << "behind the eye";
}

TEST(Microscope, BetweenTwoViewsIsStraightAndExactAtTheEnds) {
  const ScopeView a = some_view();
  ScopeView b = a;
  b.focus_mm = {0, 0, 0};
  look_from(b, {-1, 0.2, 0.1});
  magnify(b, 16);
  EXPECT_EQ(between(a, b, 0), a);
  EXPECT_EQ(between(a, b, 1), b);
  const ScopeView m = between(a, b, 0.5);
  EXPECT_LT(apart(m.focus_mm, (a.focus_mm + b.focus_mm) * 0.5), 1e-12);
  EXPECT_NEAR(m.magnification, std::sqrt(6.0 * 16), 1e-12);
  EXPECT_NEAR(length(turn_between(a, m)), length(turn_between(m, b)), 1e-9);
  EXPECT_NEAR(length(turn_between(a, m)) * 2, length(turn_between(a, b)), 1e-9);
  expect_frame(m);
  // Half a turn has no axis of its own, but ends where it should.
  b = a;
  look_from(b, {-a.back.x, -a.back.y, a.back.z});
  const ScopeView almost = between(a, b, 1 - 1e-9);
  EXPECT_LT(apart(almost.back, b.back), 1e-6);
  EXPECT_LT(apart(almost.up, b.up), 1e-6);
  roll(b = a, std::numbers::pi);
  EXPECT_NEAR(view_error(a, b).angle_rad, std::numbers::pi, 1e-6);
}

TEST(Microscope, OverviewShowsTheHead) {
  const ScopeView v = overview({1, 2, 3}, 120, {0.94, -0.25, 0.22});
  EXPECT_NEAR(v.field_mm(), 2 * 400 * std::tan(std::numbers::pi / 12), 1e-9);
  EXPECT_NEAR(v.working_distance_mm, 400, 1e-9);
  EXPECT_EQ(v.focus_mm, (Vec3{1, 2, 3}));
  EXPECT_NEAR(overview({}, 10, {1, 0, 0}).working_distance_mm, 250, 1e-9);
}

TEST(Microscope, ScaleBarsAreRound) {
  for (const double ppm : {0.7, 3.0, 17.2, 100.0, 400.0}) {
    const ScaleBar bar = scale_bar(ppm, 160);
    EXPECT_LE(bar.length_px, 160 * (1 + 1e-9));
    EXPECT_GT(bar.length_px, 60);
    EXPECT_NEAR(bar.length_px / ppm, bar.length_mm, 1e-12);
  }
  EXPECT_DOUBLE_EQ(scale_bar(16, 160).length_mm, 10);
  EXPECT_DOUBLE_EQ(scale_bar(16.1, 160).length_mm, 5);
}

}  // namespace
}  // namespace osteo
