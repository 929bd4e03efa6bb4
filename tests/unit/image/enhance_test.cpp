#include "osteo/imaging/image/enhance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "osteo/imaging/image/phantom.h"
#include "projections.h"

namespace osteo {
namespace {

Image head_slice(double noise_hu) {
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 1;
  p.slice_mm = 10;
  p.noise_hu = noise_hu;
  return make_phantom(p).ct;
}

TEST(Denoise, TakesNoiseAndLeavesEdges) {
  const Image noisy = head_slice(40), truth = head_slice(0);
  const Sharpness before = sharpness_of(noisy, noisy);
  EXPECT_NEAR(before.noise_hu, 40, 4);
  for (const double strength : {0.5, 1.0}) {
    const Image quiet = denoise(noisy, {.strength = strength});
    const Sharpness after = sharpness_of(quiet, noisy);
    double was = 0, is = 0;
    for (std::size_t i = 0; i < truth.frame.voxel_count(); ++i) {
      was += std::pow(noisy.voxels[i] - truth.voxels[i], 2);
      is += std::pow(quiet.voxels[i] - truth.voxels[i], 2);
    }
    std::printf("strength %.1f: noise %.1f to %.1f HU, edges %.2f to %.2f mm, off the truth %.1f to %.1f HU RMS\n",
                strength, before.noise_hu, after.noise_hu, before.edge_width_mm, after.edge_width_mm,
                std::sqrt(was / static_cast<double>(truth.frame.voxel_count())),
                std::sqrt(is / static_cast<double>(truth.frame.voxel_count())));
    if (strength != 1) continue;
    EXPECT_LT(after.noise_hu, 0.5 * before.noise_hu);
    EXPECT_LT(after.edge_width_mm, 1.15 * before.edge_width_mm);
    EXPECT_LT(is, 0.5 * was);
  }
}

TEST(Denoise, SameBytesForAnyThreadCountAndMetalStays) {
  Image image = head_slice(40);
  const auto v = make_voxels<std::int16_t>(image.frame.voxel_count());
  std::copy_n(image.voxels.get(), image.frame.voxel_count(), v.get());
  v[image.offset(30, 30, 3)] = 12000;
  v[image.offset(31, 30, 3)] = -2000;
  image.voxels = v;
  Context one, two;
  one.threads = 1;
  two.threads = 2;
  const Image a = denoise(image, {}, one), b = denoise(image, {}, two);
  EXPECT_TRUE(std::ranges::equal(a.span(), b.span()));
  EXPECT_EQ(a.at(30, 30, 3), 12000);
  EXPECT_EQ(a.at(31, 30, 3), -2000);
}

TEST(Projections, ComeBack) {
  cv::Mat disc = cv::Mat::zeros(128, 128, CV_32F);
  for (int j = 0; j < 128; ++j)
    for (int i = 0; i < 128; ++i)
      disc.at<float>(j, i) = static_cast<float>(500 + 500 * std::tanh((40 - std::hypot(i - 60.5, j - 66.5)) / 1.5));
  const cv::Mat back = image::project_back(image::project(disc), 128);
  double off = 0;
  for (int j = 30; j < 100; ++j)
    for (int i = 30; i < 95; ++i) off += std::abs(back.at<float>(j, i) - disc.at<float>(j, i)) / (70 * 65);
  EXPECT_LT(off, 15);
}

// A slice of soft tissue with bone, and two fillings whose rays lose photons and harden: made with projections of its
// own resolution.
struct Streaked {
  Image truth, image;
};
Streaked streaked() {
  constexpr int n = 300;
  Frame f;
  f.dims = {n, n, 2};
  f.spacing_mm = {0.7, 0.7, 1};
  cv::Mat clean = cv::Mat::zeros(n, n, CV_32F), metal = cv::Mat::zeros(n, n, CV_32F);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const double x = (i - 149.5) * 0.7, y = (j - 149.5) * 0.7;
      const auto disc = [&](double a, double b, double r) {
        return 0.5 * (1 + std::tanh((r - std::hypot(x - a, y - b)) / 0.6));
      };
      const double head = disc(0, 0, 85), jaw = disc(0, -25, 45) - disc(0, -22, 36),
                   spine = disc(0, 45, 16) - disc(0, 45, 7);
      clean.at<float>(j, i) = static_cast<float>(1040 * head + 900 * jaw + 700 * spine);
      metal.at<float>(j, i) = static_cast<float>(25000 * (disc(-37, -30, 3) + disc(36, -34, 3.5)));
    }
  const cv::Mat through = image::project(metal);
  cv::Mat error = cv::Mat::zeros(through.size(), CV_32F);
  std::mt19937 random(4);
  std::normal_distribution<float> noise(0, 1);
  for (int a = 0; a < through.rows; ++a)
    for (int s = 0; s < through.cols; ++s) {
      const float p = through.at<float>(a, s);
      // Hardening takes from long ways through metal more than in proportion; starvation adds noise.
      error.at<float>(a, s) = -p * p * 1.2e-6F + 0.02F * p * noise(random);
    }
  const cv::Mat wrong = clean + metal + image::project_back(error, n);
  const auto truth = make_voxels<std::int16_t>(f.voxel_count()), voxels = make_voxels<std::int16_t>(f.voxel_count());
  for (int k = 0; k < 2; ++k)
    for (int i = 0; i < n * n; ++i) {
      const auto at = static_cast<std::size_t>(k * n * n + i);
      const float t = clean.at<float>(i / n, i % n) - 1000, m = metal.at<float>(i / n, i % n);
      truth[at] = static_cast<std::int16_t>(std::lround(t + m));
      voxels[at] = k == 1 ? static_cast<std::int16_t>(std::lround(t))
                          : static_cast<std::int16_t>(
                                std::lround(std::clamp(wrong.at<float>(i / n, i % n) - 1000, -1024.0F, 30000.0F)));
    }
  return {{f, truth}, {f, voxels}};
}

TEST(ReduceMetal, WeakensStreaks) {
  const Streaked s = streaked();
  Context context;
  const Image mended = reduce_metal(s.image, {}, context);
  // In the head, away from metal, where streaks run, on the first slice.
  double was = 0, is = 0, n = 0, was_far = 0, is_far = 0, bone_was = 0, bone_is = 0, bone = 0;
  for (int j = 0; j < 300; ++j)
    for (int i = 0; i < 300; ++i) {
      const double x = (i - 149.5) * 0.7, y = (j - 149.5) * 0.7;
      if (std::hypot(x, y) > 80 || std::hypot(x + 37, y + 30) < 6 || std::hypot(x - 36, y + 34) < 6) continue;
      const double a = s.image.at(i, j, 0) - s.truth.at(i, j, 0), b = mended.at(i, j, 0) - s.truth.at(i, j, 0);
      was += a * a;
      is += b * b;
      was_far = std::max(was_far, std::abs(a));
      is_far = std::max(is_far, std::abs(b));
      ++n;
      if (s.truth.at(i, j, 0) < 600) continue;
      bone_was += std::abs(a);
      bone_is += std::abs(b);
      ++bone;
    }
  std::printf("streaks: %.1f to %.1f HU RMS, worst %.0f to %.0f; in bone %.1f to %.1f mean\n", std::sqrt(was / n),
              std::sqrt(is / n), was_far, is_far, bone_was / bone, bone_is / bone);
  EXPECT_GT(std::sqrt(was / n), 60);  // or nothing would have been shown
  EXPECT_LT(std::sqrt(is / n), 0.7 * std::sqrt(was / n));
  // Metal and the slice without it are as they were.
  EXPECT_EQ(mended.at(97, 107, 0), s.image.at(97, 107, 0));
  for (int i = 0; i < 300 * 300; i += 17) EXPECT_EQ(mended.voxels[300 * 300 + i], s.image.voxels[300 * 300 + i]);
  std::int64_t slices = 0;
  for (const auto& [key, value] : context.take_report())
    if (key == "slices_with_metal") slices = std::get<std::int64_t>(value);
  EXPECT_EQ(slices, 1);
}

TEST(ReduceMetal, SaysThatThereIsNone) {
  std::string warned;
  Context context;
  context.on_log([&](LogLevel, std::string_view text) { warned += text; });
  const Image image = head_slice(5);
  const Image out = reduce_metal(image, {.metal_hu = 9000}, context);
  EXPECT_TRUE(std::ranges::equal(out.span(), image.span()));
  EXPECT_NE(warned.find("no slice holds metal"), std::string::npos);
}

}  // namespace
}  // namespace osteo
