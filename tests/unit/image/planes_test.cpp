#include "osteo/imaging/image/planes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "cv_slices.h"
#include "osteo/core/base/error.h"

namespace osteo {
namespace {

// A ring between two radii, soft edged, in every slice; off the middle, in pixels that are not square.
Image ring(double inner_mm, double outer_mm) {
  Frame f;
  f.dims = {90, 70, 5};
  f.spacing_mm = {0.8, 1.0, 2.5};
  f.origin_mm = {-36.2, -34.7, -4};
  const auto v = make_voxels<std::int16_t>(f.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < 5; ++k)
    for (int j = 0; j < 70; ++j)
      for (int i = 0; i < 90; ++i) {
        const Vec3 p = f.world_from_index({double(i), double(j), double(k)});
        const double r = std::hypot(p.x, p.y), d = std::min(outer_mm - r, r - inner_mm);
        v[at++] = static_cast<std::int16_t>(std::lround(500 + 500 * std::tanh(d / 1.2)));
      }
  return {f, v};
}

Labels mask_of(const Image& image, std::uint8_t value = 1) {
  const auto v = make_voxels<std::uint8_t>(image.frame.voxel_count());
  for (std::size_t i = 0; i < image.frame.voxel_count(); ++i) v[i] = image.voxels[i] >= 500 ? value : 0;
  return {{image.frame, v}, {{value, "ring", {1, 2, 3}}}};
}

std::size_t count(const Labels& labels, std::uint8_t value, int k) {
  std::size_t n = 0;
  for (int j = 0; j < labels.frame.dims[1]; ++j)
    for (int i = 0; i < labels.frame.dims[0]; ++i) n += labels.at(i, j, k) == value;
  return n;
}

TEST(Slices, AreWrappedWithoutACopy) {
  const Image image = ring(5, 12);
  const cv::Mat axial = image::slice_of(image, {2, 3}), coronal = image::slice_of(image, {1, 20}),
                sagittal = image::slice_of(image, {0, 33});
  EXPECT_EQ(axial.ptr<std::int16_t>(), image.voxels.get() + image.offset(0, 0, 3));
  EXPECT_EQ(coronal.ptr<std::int16_t>(2), image.voxels.get() + image.offset(0, 20, 2));
  EXPECT_EQ(axial.at<std::int16_t>(7, 11), image.at(11, 7, 3));
  EXPECT_EQ(coronal.at<std::int16_t>(4, 11), image.at(11, 20, 4));
  EXPECT_EQ(sagittal.at<std::int16_t>(4, 11), image.at(33, 11, 4));
  EXPECT_THROW(static_cast<void>(image::slice_of(image, {2, 5})), Error);
  EXPECT_THROW(static_cast<void>(image::slice_of(image, {3, 0})), Error);
}

TEST(Outlines, LieBetweenPixels) {
  const Image image = ring(9.3, 20.4);
  const std::vector<Outline> lines = outlines_of(image, {2, 2}, 500);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_FALSE(lines[0].hole);
  EXPECT_TRUE(lines[1].hole);
  for (const Outline& o : lines) {
    const double radius = o.hole ? 9.3 : 20.4;
    double off = 0, worst = 0;
    for (const Vec3& p : o.points_mm) {
      const double d = std::abs(std::hypot(p.x, p.y) - radius);
      off += d / static_cast<double>(o.points_mm.size());
      worst = std::max(worst, d);
      EXPECT_NEAR(p.z, image.frame.world_from_index({0, 0, 2}).z, 1e-9);
    }
    EXPECT_LT(off, 0.02);
    EXPECT_LT(worst, 0.08);
    EXPECT_NEAR(o.area_mm2 / (M_PI * radius * radius), 1, 0.005);
  }
}

TEST(Outlines, OfAMaskAreSmooth) {
  const std::vector<Outline> lines = outlines_of(mask_of(ring(9.3, 20.4), 4), {2, 2}, 4);
  ASSERT_EQ(lines.size(), 2u);
  double off = 0;
  for (const Vec3& p : lines[0].points_mm)
    off += std::abs(std::hypot(p.x, p.y) - 20.4) / static_cast<double>(lines[0].points_mm.size());
  EXPECT_LT(off, 0.25);  // a third of a pixel: a mask knows no better
  EXPECT_TRUE(outlines_of(mask_of(ring(9.3, 20.4), 4), {2, 2}, 5).empty());
}

TEST(Outlines, CloseAtTheBorder) {
  const Image image = ring(1, 60);  // covers every corner
  const std::vector<Outline> lines = outlines_of(image, {2, 0}, 500);
  ASSERT_GE(lines.size(), 1u);
  EXPECT_NEAR(lines[0].area_mm2, 90 * 0.8 * 70, 0.06 * 90 * 0.8 * 70);
}

TEST(Morphology, GrowsByMillimetres) {
  const Labels ball = mask_of(ring(-5, 12));
  for (const double r : {1.0, 2.5, 4.0}) {
    const Labels grown = morph_slices(ball, 1, Morphology::dilate, r);
    EXPECT_NEAR(static_cast<double>(count(grown, 1, 2)) * 0.8 / (M_PI * (12 + r) * (12 + r)), 1, 0.07) << r;
    const Labels less = morph_slices(ball, 1, Morphology::erode, r);
    EXPECT_NEAR(static_cast<double>(count(less, 1, 2)) * 0.8 / (M_PI * (12 - r) * (12 - r)), 1, 0.1) << r;
  }
  EXPECT_EQ(morph_slices(ball, 1, Morphology::close, 2).structures, ball.structures);
}

TEST(Morphology, LeavesOtherLabelsAlone) {
  Labels labels = mask_of(ring(-5, 12));
  const auto v = make_voxels<std::uint8_t>(labels.frame.voxel_count());
  std::copy_n(labels.voxels.get(), labels.frame.voxel_count(), v.get());
  v[labels.offset(62, 35, 2)] = 9;
  labels.voxels = v;
  const Labels grown = morph_slices(labels, 1, Morphology::dilate, 5);
  EXPECT_EQ(grown.at(62, 35, 2), 9);
  EXPECT_EQ(grown.at(61, 35, 2), 1);
}

TEST(Morphology, ClosesAGapAtTheBorderAndOpensASpeck) {
  Frame f;
  f.dims = {20, 20, 1};
  const auto v = make_voxels<std::uint8_t>(400);
  for (int i = 0; i < 400; ++i) v[i] = (i / 20 < 8 || i / 20 > 10) ? 1 : 0;
  const Labels gap{{f, v}};
  const Labels closed = morph_slices(gap, 1, Morphology::close, 2);
  EXPECT_EQ(count(closed, 1, 0), 392u);  // its ends stay open by a disc: beyond the border is nothing
  const auto w = make_voxels<std::uint8_t>(400);
  for (int i = 0; i < 400; ++i) w[i] = i == 210 || (i / 20 < 6 && i % 20 < 6) ? 1 : 0;
  const Labels opened = morph_slices({{f, w}}, 1, Morphology::open, 1);
  EXPECT_EQ(opened.at(10, 10, 0), 0);
  EXPECT_EQ(opened.at(3, 3, 0), 1);
}

TEST(Fill, FillsWhatASliceEncloses) {
  const Labels labels = mask_of(ring(9.3, 20.4), 3);
  const Labels all = fill_slices(labels, 3, 0);
  EXPECT_NEAR(static_cast<double>(count(all, 3, 2)) * 0.8 / (M_PI * 20.4 * 20.4), 1, 0.02);
  const Labels none = fill_slices(labels, 3, 100);  // the hole has 272 mm2
  EXPECT_TRUE(std::ranges::equal(none.span(), labels.span()));
  EXPECT_EQ(all.structures, labels.structures);
  // Across another axis, and for any number of threads.
  Context one, two;
  one.threads = 1;
  two.threads = 2;
  EXPECT_TRUE(std::ranges::equal(fill_slices(labels, 3, 0, 1, one).span(), fill_slices(labels, 3, 0, 1, two).span()));
}

TEST(Thumbnail, HasSquareMillimetresAndTheHeadUp) {
  const Image image = ring(5, 12);
  const Picture p = thumbnail(image, {2, 2}, 96, 0, 1000);
  EXPECT_EQ(p.width, 96);
  EXPECT_EQ(p.height, 93);  // 72 x 70 mm
  EXPECT_EQ(p.rgb.size(), static_cast<std::size_t>(3 * 96 * 93));
  // A mark at the top of the body is at the top of a coronal thumbnail.
  Image marked = image;
  const auto v = make_voxels<std::int16_t>(image.frame.voxel_count());
  std::fill_n(v.get(), image.frame.voxel_count(), std::int16_t{0});
  for (int i = 0; i < 90; ++i) v[image.offset(i, 30, 4)] = 1000;
  marked.voxels = v;
  const Picture up = thumbnail(marked, {1, 30}, 90, 0, 1000);
  EXPECT_GT(up.rgb[0], 100);
  EXPECT_LT(up.rgb[up.rgb.size() - 1], 20);
  EXPECT_THROW(static_cast<void>(thumbnail(image, {2, 2}, 0, 0, 1)), Error);
}

PlaneImage blobs(double dx, double dy, double angle) {
  PlaneImage p{120, 100, {}};
  const double cx = 59.5, cy = 49.5, c = std::cos(-angle), s = std::sin(-angle);
  for (int j = 0; j < p.height; ++j)
    for (int i = 0; i < p.width; ++i) {
      const double x = i - dx - cx, y = j - dy - cy, u = c * x - s * y, v = s * x + c * y;
      const auto blob = [&](double a, double b, double r) {
        return std::exp(-((u - a) * (u - a) + (v - b) * (v - b)) / (r * r));
      };
      p.values.push_back(static_cast<float>(blob(-12, 6, 9) + 0.7 * blob(14, -10, 6) + 0.5 * blob(8, 15, 12)));
    }
  return p;
}

TEST(PlaneMatch, PhaseFindsAShiftAndCorrelationATurn) {
  const PlaneMatch shift = match_by_phase(blobs(0, 0, 0), blobs(6.3, -4.6, 0));
  EXPECT_NEAR(shift.dx, 6.3, 0.7);
  EXPECT_NEAR(shift.dy, -4.6, 0.7);
  const PlaneMatch fine = match_by_correlation(blobs(0, 0, 0), blobs(6.3, -4.6, 0.14), shift);
  EXPECT_NEAR(fine.dx, 6.3, 0.05);
  EXPECT_NEAR(fine.dy, -4.6, 0.05);
  EXPECT_NEAR(fine.angle_rad, 0.14, 0.002);
  EXPECT_GT(fine.score, 0.99);
  // Nothing to go by.
  EXPECT_EQ(match_by_correlation(blobs(0, 0, 0), PlaneImage{120, 100, std::vector<float>(12000, 1.0F)}, {}).score, 0);
  EXPECT_THROW(static_cast<void>(match_by_phase(blobs(0, 0, 0), PlaneImage{8, 8, std::vector<float>(64)})), Error);
}

}  // namespace
}  // namespace osteo
