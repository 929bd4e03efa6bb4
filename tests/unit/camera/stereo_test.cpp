// Two eyes: where each sees a place, by projecting it through its own frustum.
#include "osteo/simulation/camera/stereo.h"

#include <gtest/gtest.h>

#include <cmath>

namespace osteo {
namespace {

const PictureArea kArea{100, 20, 900, 600};

// Pixel across of a place for an eye: an off-axis frustum by hand.
double pixel_x(const ScopeView& v, const StereoParams& s, int eye, Vec3 place) {
  const StereoEye e = stereo_eye(v, s, kArea, eye);
  const Vec3 d = place - e.eye_mm;
  const double depth = -dot(d, v.back), tangent = v.field_mm() / 2 / v.working_distance_mm * kArea.width / kArea.height;
  const double ndc = dot(d, v.right()) / depth / tangent - e.window_centre_x;
  return kArea.x + kArea.width / 2 * (1 + ndc);
}

TEST(Stereo, DisparityIsNoughtAtTheFocusAndAsTheFormulaSays) {
  ScopeView v;
  v.focus_mm = {5, -3, 8};
  look_from(v, {0.5, -0.7, 0.4});
  magnify(v, 6);
  for (const double convergence : {0.0, 4.0, -6.0}) {
    const StereoParams s{StereoMode::side_by_side, 24, convergence};
    for (const double nearer : {-20.0, 0.0, 4.0, -6.0, 15.0}) {
      const Vec3 place = v.focus_mm + v.back * nearer + v.right() * 6 - v.up * 3;
      const double seen = pixel_x(v, s, 0, place) - pixel_x(v, s, 1, place);
      EXPECT_NEAR(seen, disparity_px(v, s, kArea, place), 1e-9);
      if (nearer == convergence) {
        EXPECT_NEAR(seen, 0, 1e-9);
      }
      if (nearer > convergence) {
        EXPECT_GT(seen, 0) << "in front of the screen: crossed";
      }
    }
  }
  // 24 mm at 250 mm, 10 mm before the focus: 24 * 10 / 240 mm = 1 mm of the plane of the focus, 600 / 33.3 pixels.
  EXPECT_NEAR(disparity_px(v, {StereoMode::anaglyph, 24}, kArea, v.focus_mm + v.back * 10), 18, 1e-9);
  EXPECT_NEAR(disparity_px(v, {StereoMode::anaglyph, 24, 0, true}, kArea, v.focus_mm + v.back * 10), -18, 1e-9);
}

TEST(Stereo, EyesAreParallelAndTheBaseApart) {
  const ScopeView v;
  const StereoParams s{StereoMode::anaglyph, 24};
  const StereoEye l = stereo_eye(v, s, kArea, 0), r = stereo_eye(v, s, kArea, 1);
  EXPECT_LT(length((r.eye_mm - l.eye_mm) - v.right() * 24), 1e-12);
  EXPECT_NEAR(l.window_centre_x, -r.window_centre_x, 1e-12);
  EXPECT_GT(l.window_centre_x, 0);
}

TEST(Stereo, EveryPieceOfThePictureIsCoveredOnce) {
  for (const StereoMode mode : {StereoMode::side_by_side, StereoMode::top_bottom}) {
    double area = 0;
    for (const StereoPiece& p : stereo_pieces({mode}, 10, 0)) area += (p.to[2] - p.to[0]) * (p.to[3] - p.to[1]);
    EXPECT_NEAR(area, 1, 1e-12);
  }
  const auto anaglyph = stereo_pieces({StereoMode::anaglyph}, 10, 0);
  ASSERT_EQ(anaglyph.size(), 2U);
  EXPECT_EQ(anaglyph[0].channels, (std::array{true, false, false}));
  EXPECT_EQ(anaglyph[1].channels, (std::array{false, true, true}));
  for (const int first : {0, 1, 7}) {
    std::array<int, 9> eye{};
    for (const StereoPiece& p : stereo_pieces({StereoMode::interlaced}, 9, first)) {
      for (int row = 0; row < 9; ++row) {
        const double middle = (row + 0.5) / 9;
        if (middle > p.to[1] && middle < p.to[3]) {
          eye[static_cast<std::size_t>(row)] = p.eye;
          EXPECT_EQ(p.to, p.from) << "rows are not moved";
        }
      }
    }
    for (int row = 0; row < 9; ++row)
      EXPECT_EQ(eye[static_cast<std::size_t>(row)], (row + first) % 2) << first << ' ' << row;
  }
}

TEST(Stereo, TheMouseIsUnsqueezed) {
  for (const double x : {100.0 + 225, 100.0 + 450 + 225}) {
    EXPECT_NEAR(unsqueezed(StereoMode::side_by_side, kArea, x, 50)[0], 100 + 450, 1e-12);
  }
  EXPECT_NEAR(unsqueezed(StereoMode::top_bottom, kArea, 300, 20 + 300 + 150)[1], 20 + 300, 1e-12);
  EXPECT_EQ(unsqueezed(StereoMode::anaglyph, kArea, 300, 40), (std::array{300.0, 40.0}));
}

}  // namespace
}  // namespace osteo
