// Calibration by rendered views of the plate; the printed pages.
#include "osteo/simulation/marker/detail/camera.h"

#include <gtest/gtest.h>

#include "osteo/core/base/error.h"
#include "osteo/simulation/marker/sheet.h"
#include "render.h"

namespace osteo {
namespace {

using Look = CameraCalibration::Look;

// The plate's middle at `distance`, tilted about x and y, turned about its own axis.
RigidTransform plate_pose(double distance_mm, double about_x_deg, double about_y_deg, double turn_deg, Vec3 off = {}) {
  constexpr double k = std::numbers::pi / 180;
  RigidTransform p = rotation_about({}, {1, 0, 0}, about_x_deg * k) * rotation_about({}, {0, 1, 0}, about_y_deg * k) *
                     rotation_about({}, {0, 0, 1}, turn_deg * k);
  p.shift_mm = Vec3{0, 0, distance_mm} + off - p.rotation * Vec3{87.5, 122.5, 0};
  return p;
}

class Calibration : public ::testing::Test {
 protected:
  CameraModel camera_ = test::webcam(640, 480);
  test::Renderer renderer_{camera_, test::plate_face()};
  test::Look look_ = [] {
    test::Look l;
    l.samples = 2;
    return l;
  }();
  CameraCalibration calibration_;

  GrayPicture view(int i, double tilt_deg) {
    return renderer_.picture(
        plate_pose(480 + 30 * (i % 4), tilt_deg * std::sin(1.3 * i + 0.5), tilt_deg * std::cos(2.1 * i),
                   90 + 12 * (i % 5), {70 * std::sin(2.6 * i), 45 * std::cos(1.9 * i), 0}),
        look_);
  }
};

TEST_F(Calibration, ViewsFromAllSidesGiveTheCamera) {
  for (int i = 0; i < 14; ++i) EXPECT_EQ(calibration_.add(view(i, 35)), Look::taken) << i;
  EXPECT_EQ(calibration_.add(view(13, 35)), Look::like_another);
  const auto r = calibration_.solve();
  EXPECT_EQ(r.camera.views, 14);
  EXPECT_LT(r.camera.rms_px, 0.25);
  EXPECT_NEAR(r.camera.fx / camera_.fx, 1, 0.006);
  EXPECT_NEAR(r.camera.fy / camera_.fy, 1, 0.006);
  EXPECT_NEAR(r.camera.cx, camera_.cx, 8);
  EXPECT_NEAR(r.camera.cy, camera_.cy, 8);
  EXPECT_LT(r.focal_spread, 0.005);
  EXPECT_FALSE(r.camera.mirrored);
  // What counts: where points are seen from each other. A shift of all is a turn of the camera, which nobody knows
  // anyway.
  const auto middle = project(camera_, {0, 0, 400}), found = project(r.camera, {0, 0, 400});
  for (const Vec3 p : {Vec3{120, 60, 400}, Vec3{-130, -80, 420}, Vec3{-100, 90, 380}}) {
    const auto a = project(camera_, p), b = project(r.camera, p);
    EXPECT_LT(std::hypot(a[0] - middle[0] - b[0] + found[0], a[1] - middle[1] - b[1] + found[1]), 1.0) << p.x;
  }
}

TEST_F(Calibration, AMirroredCameraIsToldAndCalibratedAllTheSame) {
  for (int i = 0; i < 10; ++i) {
    GrayPicture p = view(i, 35);
    mirror(p);
    EXPECT_EQ(calibration_.add(p), Look::taken) << i;
  }
  const auto r = calibration_.solve();
  EXPECT_TRUE(r.camera.mirrored);
  EXPECT_NEAR(r.camera.fx / camera_.fx, 1, 0.008);
}

TEST_F(Calibration, RefusesTooFewViewsAndViewsThatDoNotVary) {
  EXPECT_EQ(calibration_.add(GrayPicture{640, 480, std::vector<std::uint8_t>(640 * 480, 90)}), Look::no_plate);
  EXPECT_THROW(static_cast<void>(calibration_.solve()), Error);
  EXPECT_THROW(calibration_.add(GrayPicture{320, 240, std::vector<std::uint8_t>(320 * 240, 90)}), Error);
  // Always flat before the camera: a near plate and a short lens look as a far one and a long one.
  for (int i = 0; i < 11; ++i)
    calibration_.add(
        renderer_.picture(plate_pose(480, 0, 0, 90, {-60 + 40.0 * (i % 4), -40 + 40.0 * (i / 4), 0}), look_));
  ASSERT_GE(calibration_.views(), CameraCalibration::kMinViews);
  try {
    static_cast<void>(calibration_.solve());
    const auto r = calibration_.solve();
    FAIL() << "the focal length cannot be known: " << r.focal_spread << " " << r.camera.fx << " for " << camera_.fx
           << " rms " << r.camera.rms_px;
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::failed);
    EXPECT_NE(std::string(e.what()).find("too much alike"), std::string::npos) << e.what();
  }
}

TEST(Sheet, EachPageReadsBackInItsTrueSize) {
  for (const Paper paper : {Paper::a4, Paper::letter}) {
    for (int page = 0; page < kMarkerPages; ++page) {
      const PageCheck c = check_page(paper, 2, page);
      EXPECT_EQ(c.markers, c.expected);
      EXPECT_EQ(c.expected, page == 0 ? 13 : 17);
      EXPECT_LT(c.worst_mm, 0.08);
    }
  }
  const std::string pdf = marker_pages_pdf(Paper::a4, 1);
  EXPECT_EQ(pdf.substr(0, 5), "%PDF-");
  EXPECT_EQ(pdf.find("CreationDate"), std::string::npos);
  EXPECT_TRUE(pdf == marker_pages_pdf(Paper::a4, 1));
  EXPECT_FALSE(pdf == marker_pages_pdf(Paper::a4, 2));
  EXPECT_THROW(static_cast<void>(marker_page(Paper::a4, 1, 2)), Error);
  EXPECT_THROW(static_cast<void>(marker_pages_pdf(Paper::a4, 0)), Error);
}

}  // namespace
}  // namespace osteo
