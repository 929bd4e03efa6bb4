#include "osteo/simulation/marker/detail/tracker.h"

#include <gtest/gtest.h>

#include "osteo/core/base/error.h"
#include "render.h"

namespace osteo {
namespace {

using test::Look;
using test::pen_pose;
using test::Renderer;
using State = PenSight::State;

std::vector<MarkerCorners> exact_corners(const CameraModel& camera, const RigidTransform& pose, std::size_t most = 13) {
  std::vector<MarkerCorners> seen;
  for (const MarkerPatch& p : pen_markers(1)) {
    if (dot(pose.rotation * p.out(), pose(p.centre_mm)) > 0 || seen.size() == most) continue;
    MarkerCorners c{p, {}};
    for (std::size_t i = 0; i < 4; ++i) c.pixel[i] = project(camera, pose(p.corner_mm(i)));
    seen.push_back(c);
  }
  return seen;
}

TEST(Pose, ExactCornersGiveThePoseToAMillionth) {
  const CameraModel camera = test::webcam(1280, 720);
  for (int i = 0; i < 60; ++i) {
    const RigidTransform pose = pen_pose(220 + 8.0 * i, 37.0 * i, 60 * std::sin(i), 40 * std::cos(1.7 * i),
                                         {30 * std::sin(2.0 * i), 25 * std::cos(3.0 * i), 0});
    const PenSight s = pose_of(camera, exact_corners(camera, pose));
    ASSERT_EQ(s.state, State::seen) << i;
    EXPECT_LT(length(s.camera_from_body.shift_mm - pose.shift_mm), 1e-6) << i;
    EXPECT_LT(length(s.camera_from_body(PenBody::kUsualTipMm) - pose(PenBody::kUsualTipMm)), 2e-6) << i;
    EXPECT_LT(s.rms_px, 1e-6);
  }
}

TEST(Pose, AFlatMarkerFromAfarIsAmbiguousUntilSomethingBeforeSaysWhich) {
  const CameraModel camera = test::webcam(640, 480);
  // Leant by 20 degrees; the mirrored lean explains the corners nearly as well.
  const RigidTransform pose = pen_pose(600, -90, 0, 20);
  auto seen = exact_corners(camera, pose);
  std::erase_if(seen, [&](const MarkerCorners& c) {
    return dot(pose.rotation * c.patch.out(), normalized(pose.shift_mm)) > -0.8;
  });
  ASSERT_EQ(seen.size(), 2U);
  seen.pop_back();
  for (auto& p : seen[0].pixel)
    p = {std::round(p[0] * 4) / 4, std::round(p[1] * 4) / 4};  // as well as a camera knows them
  EXPECT_EQ(pose_of(camera, seen).state, State::ambiguous);
  const PenSight s = pose_of(camera, seen, &pose);
  ASSERT_EQ(s.state, State::seen);
  EXPECT_LT(test::angle_deg(s.camera_from_body.rotation, pose.rotation), 8);
}

TEST(Pose, AMarkerThatDoesNotFitIsLeftOut) {
  const CameraModel camera = test::webcam(1280, 720);
  const RigidTransform pose = pen_pose(350, 20, 15, 10);
  auto seen = exact_corners(camera, pose);
  ASSERT_GE(seen.size(), 4U);
  for (auto& p : seen[1].pixel) p[0] += 25;
  const PenSight s = pose_of(camera, seen);
  ASSERT_EQ(s.state, State::seen);
  EXPECT_EQ(s.markers_left_out, 1);
  EXPECT_LT(length(s.camera_from_body.shift_mm - pose.shift_mm), 1e-6);
}

TEST(Pose, CornersOfAnotherBodyAreNotAPose) {
  const CameraModel camera = test::webcam(1280, 720);
  auto seen = exact_corners(camera, pen_pose(350, 20, 15, 10));
  // The print was glued in another order.
  std::swap(seen[0].patch, seen[2].patch);
  std::swap(seen[1].patch, seen[3].patch);
  EXPECT_NE(pose_of(camera, seen).state, State::seen);
  EXPECT_EQ(pose_of(camera, {}).state, State::nothing);
}

TEST(Pose, TheCovarianceIsWhatCornersWithNoiseScatterBy) {
  const CameraModel camera = test::webcam(1280, 720);
  const RigidTransform pose = pen_pose(400, 10, 10, 15);
  const auto exact = exact_corners(camera, pose);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.2);
  double square[3] = {}, predicted[3] = {};
  constexpr int kTimes = 400;
  for (int i = 0; i < kTimes; ++i) {
    auto seen = exact;
    for (auto& c : seen) {
      for (auto& p : c.pixel) p = {p[0] + noise(random), p[1] + noise(random)};
    }
    const PenSight s = pose_of(camera, seen, &pose);
    for (std::size_t a = 0; a < 3; ++a) {
      square[a] += std::pow(s.camera_from_body.shift_mm[a] - pose.shift_mm[a], 2) / kTimes;
      predicted[a] += 0.04 * s.covariance_a_px2[7 * (a + 3)] / kTimes;
    }
  }
  for (std::size_t a = 0; a < 3; ++a) EXPECT_NEAR(std::sqrt(square[a] / predicted[a]), 1, 0.12) << a;
}

TEST(Tracker, SeesThePenFromAllSidesInPicturesOfAWebcam) {
  const CameraModel camera = test::webcam(1280, 720);
  Renderer renderer(camera, test::pen_faces());
  PenTracker tracker(camera, 1);
  double square = 0, worst = 0;
  constexpr int kPictures = 12;
  for (int i = 0; i < kPictures; ++i) {
    const RigidTransform pose =
        pen_pose(300 + 6.0 * i, 15.0 * i, 25 * std::sin(i), 20 * std::cos(2.0 * i), {40 * std::sin(0.5 * i), 20, 0});
    const PenSight s = tracker.look(renderer.picture(pose, Look{}));
    ASSERT_EQ(s.state, State::seen) << i;
    const double off = length(s.camera_from_body(PenBody::kUsualTipMm) - pose(PenBody::kUsualTipMm));
    square += off * off;
    worst = std::max(worst, off);
  }
  EXPECT_LT(std::sqrt(square / kPictures), 1.0);
  EXPECT_LT(worst, 3.0);
}

TEST(Tracker, TellsWhyItSeesNothing) {
  const CameraModel camera = test::webcam(640, 480);
  const RigidTransform pose = pen_pose(330, 20, 10, 10);
  Renderer renderer(camera, test::pen_faces());
  const GrayPicture good = renderer.picture(pose, Look{});
  Look dark;
  dark.exposure = 0.08;
  dark.noise = 2;
  PenTracker tracker(camera, 1);
  const PenSight in_the_dark = tracker.look(renderer.picture(pose, dark));
  EXPECT_EQ(in_the_dark.state, State::nothing);
  EXPECT_TRUE(in_the_dark.dark);
  EXPECT_FALSE(tracker.look(good).dark);

  PenTracker second(camera, 2);
  const PenSight other = second.look(good);
  EXPECT_EQ(other.state, State::nothing);
  EXPECT_TRUE(other.other_pen);

  GrayPicture small{320, 240, std::vector<std::uint8_t>(320 * 240, 100)};
  EXPECT_THROW(static_cast<void>(tracker.look(small)), Error);
  EXPECT_THROW(PenTracker(camera, 4), Error);
}

TEST(Tracker, TurnsAMirroredPictureBack) {
  const CameraModel camera = test::webcam(640, 480);
  const RigidTransform pose = pen_pose(330, 20, 10, 10);
  Renderer renderer(camera, test::pen_faces());
  GrayPicture picture = renderer.picture(pose, Look{});
  mirror(picture);
  PenTracker tracker(camera, 1);
  PenSight s;
  int pictures = 0;
  for (; pictures < 20 && s.state != State::seen; ++pictures) s = tracker.look(picture);
  ASSERT_EQ(s.state, State::seen);
  EXPECT_TRUE(s.mirrored);
  EXPECT_GT(pictures, 3);  // not at the first that is not read
  EXPECT_LT(length(s.camera_from_body(PenBody::kUsualTipMm) - pose(PenBody::kUsualTipMm)), 3);
}

TEST(Tracker, FollowsAPenOfWhichAHandHidesHalf) {
  const CameraModel camera = test::webcam(1280, 720);
  const RigidTransform pose = pen_pose(320, 20, 10, 10);
  Renderer renderer(camera, test::pen_faces());
  Look look;
  const auto middle = project(camera, pose.shift_mm);
  look.hidden = {static_cast<int>(middle[0]) - 200, static_cast<int>(middle[1]) + 8, 400, 300};
  PenTracker tracker(camera, 1);
  const PenSight s = tracker.look(renderer.picture(pose, look));
  ASSERT_EQ(s.state, State::seen);
  EXPECT_LT(s.markers, 5);
  EXPECT_LT(length(s.camera_from_body(PenBody::kUsualTipMm) - pose(PenBody::kUsualTipMm)), 3);
}

TEST(Tracker, OfTwoPensWithTheSamePrintItKeepsTheOneItFollows) {
  const CameraModel camera = test::webcam(1280, 720);
  const RigidTransform mine = pen_pose(320, 20, 10, 10, {-80, 0, 0}), other = pen_pose(320, 50, 0, 0, {90, 0, 0});
  std::vector<test::Face> both = test::pen_faces();
  const RigidTransform beside = mine.inverse() * other;
  for (test::Face f : test::pen_faces()) {
    f.centre_mm = beside(f.centre_mm);
    f.right = beside.rotation * f.right;
    f.up = beside.rotation * f.up;
    both.push_back(f);
  }
  Renderer alone(camera, test::pen_faces()), together(camera, both);
  PenTracker fresh(camera, 1), following(camera, 1);
  const GrayPicture picture = together.picture(mine, Look{});
  EXPECT_EQ(fresh.look(picture).state, State::doubled);
  ASSERT_EQ(following.look(alone.picture(mine, Look{})).state, State::seen);
  const PenSight s = following.look(picture);
  ASSERT_EQ(s.state, State::seen);
  EXPECT_LT(length(s.camera_from_body.shift_mm - mine.shift_mm), 2);
}

}  // namespace
}  // namespace osteo
