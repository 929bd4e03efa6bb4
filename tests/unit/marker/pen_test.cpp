// The tip of a pen, the filter behind the pictures, cameras and pens as files.
#include "osteo/simulation/marker/detail/pen.h"

#include <gtest/gtest.h>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/simulation/marker/detail/camera.h"
#include "osteo/simulation/marker/detail/filter.h"
#include "render.h"

namespace osteo {
namespace {

namespace fs = std::filesystem;
using test::pen_pose;

// Turned about its tip.
std::vector<RigidTransform> pivoting(Vec3 tip, Vec3 pivot, int poses, double lean_deg) {
  std::vector<RigidTransform> all;
  for (int i = 0; i < poses; ++i) {
    RigidTransform p = pen_pose(0, 40.0 * i, lean_deg * std::sin(0.7 * i), lean_deg * std::cos(1.1 * i));
    p.shift_mm = pivot - p.rotation * tip;
    all.push_back(p);
  }
  return all;
}

template <class F>
std::string complaint(F&& f) {
  try {
    f();
  } catch (const Error& e) {
    return std::string(e.what()) + "; " + e.advice();
  }
  return {};
}

TEST(Pivot, ExactPosesGiveTheTipExactly) {
  const Vec3 tip{3, -2, -117}, pivot{12, 60, 380};
  const PivotFit fit = fit_pivot(pivoting(tip, pivot, 60, 30));
  EXPECT_LT(length(fit.tip_mm - tip), 1e-9);
  EXPECT_LT(length(fit.pivot_mm - pivot), 1e-9);
  EXPECT_LT(fit.rms_mm, 1e-9);
  EXPECT_GT(fit.tilt_deg, 40);
}

TEST(Pivot, ASlipIsLeftOutAndNoiseIsTold) {
  const Vec3 tip{0, 0, -110}, pivot{0, 50, 400};
  auto poses = pivoting(tip, pivot, 100, 30);
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 0.3);
  for (auto& p : poses) p.shift_mm += Vec3{noise(random), noise(random), noise(random)};
  for (std::size_t i = 0; i < 8; ++i) poses[i].shift_mm += Vec3{15, 0, 0};
  const PivotFit fit = fit_pivot(poses);
  EXPECT_GE(fit.left_out, 8);
  EXPECT_LT(length(fit.tip_mm - tip), 0.4);
  EXPECT_NEAR(fit.rms_mm, 0.3 * std::sqrt(3.0), 0.12);
}

TEST(Pivot, RefusesWhatCannotTellTheTip) {
  const Vec3 tip{0, 0, -110}, pivot{0, 50, 400};
  EXPECT_NE(complaint([&] { static_cast<void>(fit_pivot(pivoting(tip, pivot, 12, 30))); }).find("12 pictures"),
            std::string::npos);
  EXPECT_NE(complaint([&] { static_cast<void>(fit_pivot(pivoting(tip, pivot, 60, 5))); }).find("tilted by"),
            std::string::npos);
  auto poses = pivoting(tip, pivot, 60, 30);
  for (std::size_t i = 0; i < poses.size(); ++i)
    poses[i].shift_mm += Vec3{10 * std::sin(i * 0.9), 10 * std::cos(i * 1.3), 0};
  EXPECT_NE(complaint([&] { static_cast<void>(fit_pivot(poses)); }).find("wandered"), std::string::npos);
}

PenSight sight_of(const RigidTransform& pose, double lateral_mm, double depth_mm, double turn_rad) {
  PenSight s;
  s.state = PenSight::State::seen;
  s.camera_from_body = pose;
  s.rms_px = 1;  // the covariance as it is
  for (std::size_t i = 0; i < 6; ++i)
    s.covariance_a_px2[7 * i] = i < 3 ? turn_rad * turn_rad : i < 5 ? lateral_mm * lateral_mm : depth_mm * depth_mm;
  return s;
}

TEST(Filter, AtRestItSmoothsAndInEvenMotionItDoesNotLag) {
  const Vec3 tip = PenBody::kUsualTipMm;
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0, 1);
  PenFilter rest(tip);
  double raw = 0, smooth = 0;
  for (int i = 0; i < 300; ++i) {
    RigidTransform pose = pen_pose(400, 20, 10, 5);
    const Vec3 truth = pose(tip);
    pose.shift_mm += Vec3{0.1 * noise(random), 0.1 * noise(random), 1.0 * noise(random)};
    rest.add(i / 60.0, sight_of(pose, 0.1, 1.0, 1e-4));
    if (i < 60) continue;
    raw += std::pow(length(pose(tip) - truth), 2);
    smooth += std::pow(length(rest.motion().tip_mm - truth), 2);
  }
  EXPECT_LT(smooth, 0.5 * raw);

  PenFilter moving(tip);
  RigidTransform pose;
  const Vec3 velocity{80, -40, 20};
  for (int i = 0; i <= 60; ++i) {
    pose = pen_pose(400, 20 + 0.5 * i, 10, 5, velocity * (i / 60.0));
    moving.add(i / 60.0, sight_of(pose, 0.05, 0.3, 1e-3));
  }
  // The tip lies off the axis of the turn by nothing: it moves straight.
  EXPECT_LT(length(moving.motion().tip_mm - pose(tip)), 0.05);
  const RigidTransform later = pen_pose(400, 50 + 0.5 * 1.8, 10, 5, velocity * (1 + 0.03));
  EXPECT_LT(length(moving.motion().tip_at(1.03) - later(tip)), 0.1);
  EXPECT_LT(test::angle_deg(moving.motion().rotation_at(1.03), later.rotation), 0.1);
  // No farther than it may.
  EXPECT_NEAR(length(moving.motion().tip_at(9) - moving.motion().tip_mm), PenMotion::kMaxAheadS * length(velocity),
              0.5);
}

TEST(Filter, AfterAGapItStartsAnew) {
  const Vec3 tip = PenBody::kUsualTipMm;
  PenFilter filter(tip);
  EXPECT_FALSE(filter.started());
  for (int i = 0; i < 20; ++i) filter.add(i / 30.0, sight_of(pen_pose(400, 20, 0, 0, {5.0 * i, 0, 0}), 0.1, 1, 1e-3));
  EXPECT_GT(length(filter.motion().velocity_mm_s), 100);
  const RigidTransform there = pen_pose(300, 80, 20, 0, {-90, 0, 0});
  filter.add(2, sight_of(there, 0.1, 1, 1e-3));
  EXPECT_EQ(length(filter.motion().tip_mm - there(tip)), 0);
  EXPECT_EQ(length(filter.motion().velocity_mm_s), 0);
}

class Files : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
  fs::path write(const std::string& text) {
    const fs::path p = folder_.path() / "x.json";
    write_file(p, text);
    return p;
  }
};

TEST_F(Files, ACameraComesBackAsItWas) {
  CameraModel c = test::webcam(1280, 720);
  c.mirrored = true;
  c.fps = 60;
  c.latency_ms = 42;
  c.rms_px = 0.31;
  c.views = 17;
  const CameraModel d = load_camera(write(camera_json(c)));
  EXPECT_EQ(d.width, 1280);
  EXPECT_EQ(d.fx, c.fx);
  EXPECT_EQ(d.cy, c.cy);
  EXPECT_EQ(d.distortion, c.distortion);
  EXPECT_TRUE(d.mirrored);
  EXPECT_EQ(d.delay_ms(), 42);
  EXPECT_EQ(d.views, 17);
}

TEST_F(Files, WhatIsWrongInACameraIsSaidWithItsLine) {
  std::string text = camera_json(test::webcam(640, 480));
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string t = text;
    t.replace(t.find(from), from.size(), to);
    const fs::path p = write(t);
    return complaint([&] { static_cast<void>(load_camera(p)); });
  };
  EXPECT_NE(with("\"fps\"", "\"fsp\"").find("fsp"), std::string::npos);
  EXPECT_NE(with("\"fps\"", "\"fsp\"").find("line"), std::string::npos);
  EXPECT_NE(with("\"width\": 640", "\"width\": -3").find("width"), std::string::npos);
  EXPECT_NE(with("\"fx\"", "\"fz\"").find("fz"), std::string::npos);
  EXPECT_NE(with("\"osteotome_camera\": 1", "\"osteotome_camera\": 2").find("osteotome_camera"), std::string::npos);
  EXPECT_NE(with("\"cx\": ", "\"cx\": 9").find("lens"), std::string::npos);
  EXPECT_NE(complaint([&] { static_cast<void>(load_camera(folder_.path() / "nowhere.json")); }).find("nowhere.json"),
            std::string::npos);
}

TEST_F(Files, APenComesBackAsItWas) {
  const Pen p{2, 0.985, {1, 2, -103.5}, 0.4};
  const Pen q = load_pen(write(pen_json(p)));
  EXPECT_EQ(q.pen, 2);
  EXPECT_EQ(q.scale, 0.985);
  EXPECT_EQ(q.tip_mm, p.tip_mm);
  EXPECT_EQ(q.rms_mm, 0.4);
  const fs::path none = write("{\"osteotome_pen\": 1, \"pen\": 1}");
  EXPECT_NE(complaint([&] { static_cast<void>(load_pen(none)); }).find("tip_mm"), std::string::npos);
  const fs::path fourth = write("{\"osteotome_pen\": 1, \"pen\": 4, \"tip_mm\": [0, 0, -100]}");
  EXPECT_NE(complaint([&] { static_cast<void>(load_pen(fourth)); }).find("pen"), std::string::npos);
}

}  // namespace
}  // namespace osteo
