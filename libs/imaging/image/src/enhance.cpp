#include "osteo/imaging/image/enhance.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/photo.hpp>
#include <vector>

#include "cv_slices.h"
#include "osteo/core/base/order.h"
#include "osteo/core/base/parallel.h"
#include "projections.h"

namespace osteo::inline imaging {
namespace {

constexpr int kLowestHu = -1024, kHighestHu = 3071;  // what is beyond is metal or padding, and stays
constexpr double kStrength = 0.8;  // of OpenCV's filter, for each HU of noise: measured (docs/validation/accuracy.md)

// Writes what `change` makes of each slice, which it gets as a copy in single precision, into a new volume.
template <class F>
Image each_slice(const Image& image, const Context& context, F&& change) {
  const auto n = static_cast<std::size_t>(image.frame.dims[0]) * static_cast<std::size_t>(image.frame.dims[1]);
  const auto voxels = make_voxels<std::int16_t>(image.frame.voxel_count());
  const auto slices = static_cast<std::size_t>(image.frame.dims[2]);
  std::atomic<std::size_t> done{0};
  parallel_for(slices, 1, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      std::copy_n(image.voxels.get() + k * n, n, voxels.get() + k * n);
      change(k, image::slice_of(image, {2, static_cast<int>(k)}), voxels.get() + k * n);
      context.progress(static_cast<double>(++done) / static_cast<double>(slices));
    }
  });
  return {image.frame, voxels};
}

std::int16_t rounded(float v) {
  return static_cast<std::int16_t>(std::clamp(std::floor(v + 0.5F), -32768.0F, 32767.0F));
}

// From 10 to 90 % along the gradient of `where`, of the edge in `values`; 0 where there is no clean one.
float edge_width(const cv::Mat& values, const cv::Mat& gx, const cv::Mat& gy, int i, int j, double mm_u, double mm_v) {
  constexpr int kSteps = 32;
  constexpr double kReachMm = 4;
  const double x = static_cast<double>(gx.at<float>(j, i)) / mm_u, y = static_cast<double>(gy.at<float>(j, i)) / mm_v,
               n = std::hypot(x, y);
  std::array<float, 2 * kSteps + 1> line{};
  for (int s = -kSteps; s <= kSteps; ++s) {
    const double d = kReachMm * s / kSteps, u = i + x / n * d / mm_u, v = j + y / n * d / mm_v;
    const int a = static_cast<int>(std::floor(u)), b = static_cast<int>(std::floor(v));
    if (a < 0 || b < 0 || a + 1 >= values.cols || b + 1 >= values.rows) return 0;
    const auto fu = static_cast<float>(u - a), fv = static_cast<float>(v - b);
    const auto at = [&](int p, int q) { return values.at<float>(q, p); };
    line[static_cast<std::size_t>(s + kSteps)] =
        (1 - fv) * ((1 - fu) * at(a, b) + fu * at(a + 1, b)) + fv * ((1 - fu) * at(a, b + 1) + fu * at(a + 1, b + 1));
  }
  // The foot and the top nearest to the middle, where the line no longer climbs.
  int lo = kSteps, hi = kSteps;
  while (lo > 0 && line[static_cast<std::size_t>(lo - 1)] < line[static_cast<std::size_t>(lo)]) --lo;
  while (hi < 2 * kSteps && line[static_cast<std::size_t>(hi + 1)] > line[static_cast<std::size_t>(hi)]) ++hi;
  const float foot = line[static_cast<std::size_t>(lo)], top = line[static_cast<std::size_t>(hi)];
  if (top - foot < 300 || lo == 0 || hi == 2 * kSteps) return 0;
  const auto crossing = [&](float level) {
    for (int s = lo; s < hi; ++s) {
      const float a = line[static_cast<std::size_t>(s)], b = line[static_cast<std::size_t>(s + 1)];
      if (a <= level && b > level) return static_cast<float>(s) + (level - a) / (b - a);
    }
    return static_cast<float>(hi);
  };
  return (crossing(foot + 0.9F * (top - foot)) - crossing(foot + 0.1F * (top - foot))) *
         static_cast<float>(kReachMm / kSteps);
}

// What must be added to sums so that they run straight across the trace of metal; 0 beside it.
cv::Mat across(const cv::Mat& sums, const cv::Mat& trace) {
  constexpr float kTouched = 0.05F;  // pixels of metal along the line
  cv::Mat missing = cv::Mat::zeros(sums.size(), CV_32F);
  for (int a = 0; a < sums.rows; ++a) {
    for (int i = 0; i < sums.cols;) {
      if (trace.at<float>(a, i) <= kTouched) {
        ++i;
        continue;
      }
      int end = i;
      while (end < sums.cols && trace.at<float>(a, end) > kTouched) ++end;
      const float before = i > 0 ? sums.at<float>(a, i - 1) : 0, after = end < sums.cols ? sums.at<float>(a, end) : 0;
      for (int m = i; m < end; ++m) {
        const float t = static_cast<float>(m - i + 1) / static_cast<float>(end - i + 1);
        missing.at<float>(a, m) = before + t * (after - before) - sums.at<float>(a, m);
      }
      i = end;
    }
  }
  return missing;
}

// Air, soft tissue, or the value of bone; metal as soft tissue. In HU above air.
cv::Mat tissue_classes(const cv::Mat& values, const cv::Mat& metal) {
  cv::Mat classes;
  cv::GaussianBlur(values, classes, {5, 5}, 1);
  for (int j = 0; j < classes.rows; ++j)
    for (int i = 0; i < classes.cols; ++i) {
      float& v = classes.at<float>(j, i);
      if (metal.at<float>(j, i) > 0.05F || (v >= 500 && v < 1400)) v = 1040;
      if (v < 500) v = 0;
      v = std::min(v, 3000.0F);
    }
  return classes;
}

}  // namespace

Sharpness sharpness_of(const Image& image, const Image& edges_of) {
  if (!same_place(image.frame, edges_of.frame))
    throw Error(ExitCode::usage, "edges are looked for in a scan on the same voxels");
  std::vector<float> noise, widths;
  // Some slices tell enough.
  const int step = std::max(1, image.frame.dims[2] / 24);
  for (int k = step / 2; k < image.frame.dims[2]; k += step) {
    cv::Mat values, where, gx, gy;
    image::slice_of(image, {2, k}).convertTo(values, CV_32F);
    image::slice_of(edges_of, {2, k}).convertTo(where, CV_32F);
    for (int j = 1; j + 1 < values.rows; j += 2)
      for (int i = 1; i + 1 < values.cols; i += 2) {
        const auto v = [&](int a, int b) { return values.at<float>(b, a); };
        bool soft = true;
        for (int n = 0; n < 9; ++n) {
          const float w = where.at<float>(j + n / 3 - 1, i + n % 3 - 1);
          soft = soft && w > -150 && w < 150;
        }
        // The difference of two second differences: what is smooth drops out (J. Immerkaer, CVIU 1996). 6 times the
        // noise wide.
        if (soft)
          noise.push_back(std::abs(v(i - 1, j - 1) - 2 * v(i, j - 1) + v(i + 1, j - 1) -
                                   2 * (v(i - 1, j) - 2 * v(i, j) + v(i + 1, j)) + v(i - 1, j + 1) - 2 * v(i, j + 1) +
                                   v(i + 1, j + 1)));
      }
    cv::GaussianBlur(where, where, {5, 5}, 1);
    cv::Sobel(where, gx, CV_32F, 1, 0);
    cv::Sobel(where, gy, CV_32F, 0, 1);
    for (int j = 2; j + 2 < values.rows; j += 2)
      for (int i = 2; i + 2 < values.cols; i += 2) {
        const float x = gx.at<float>(j, i), y = gy.at<float>(j, i);
        if (x * x + y * y < 1500.0F * 1500.0F) continue;  // eight times the change from pixel to pixel
        if (const float w = edge_width(values, gx, gy, i, j, image.frame.spacing_mm.x, image.frame.spacing_mm.y); w > 0)
          widths.push_back(w);
      }
  }
  // The median of a normal distribution's size is 0.6745 of its deviation.
  return {static_cast<double>(upper_median(std::move(noise))) / 0.6745 / 6,
          static_cast<double>(upper_median(std::move(widths)))};
}

Image denoise(const Image& image, const DenoiseParams& params, const Context& context) {
  const Sharpness before = sharpness_of(image, image);
  const auto strength = static_cast<float>(std::max(0.01, params.strength * kStrength * before.noise_hu));
  Image out = each_slice(image, context, [&](std::size_t, const cv::Mat& slice, std::int16_t* to) {
    cv::Mat shifted, smooth;
    slice.convertTo(shifted, CV_32F);
    shifted = cv::min(cv::max(shifted, static_cast<float>(kLowestHu)), static_cast<float>(kHighestHu)) - kLowestHu;
    // Sixteen steps a HU: rounding to whole ones would cost as much as is won.
    shifted.convertTo(shifted, CV_16U, 16);
    cv::fastNlMeansDenoising(shifted, smooth, std::vector<float>{16 * strength}, 5, 11, cv::NORM_L1);
    for (int j = 0; j < slice.rows; ++j)
      for (int i = 0; i < slice.cols; ++i) {
        const std::int16_t was = slice.at<std::int16_t>(j, i);
        if (was < kLowestHu || was > kHighestHu) continue;
        to[static_cast<std::size_t>(j) * static_cast<std::size_t>(slice.cols) + static_cast<std::size_t>(i)] =
            rounded(static_cast<float>(smooth.at<std::uint16_t>(j, i)) / 16 + kLowestHu);
      }
  });
  const Sharpness after = sharpness_of(out, image);
  context.report("noise_before_hu", before.noise_hu);
  context.report("noise_after_hu", after.noise_hu);
  context.report("edge_width_before_mm", before.edge_width_mm);
  context.report("edge_width_after_mm", after.edge_width_mm);
  return out;
}

Image reduce_metal(const Image& image, const MetalParams& params, const Context& context) {
  constexpr int kMaxPixels = 256;
  const Frame& f = image.frame;
  const double least = params.min_area_mm2 / (f.spacing_mm.x * f.spacing_mm.y);
  const auto slices = static_cast<std::size_t>(f.dims[2]);
  std::vector<std::int64_t> changed(slices);
  std::vector<double> by(slices);
  Image out = each_slice(image, context, [&](std::size_t k, const cv::Mat& slice, std::int16_t* to) {
    const cv::Mat metal = slice >= params.metal_hu;
    if (cv::countNonZero(metal) < std::max(1.0, least)) return;
    // A square of square pixels, in which air outside is 0.
    const double width = f.dims[0] * f.spacing_mm.x, height = f.dims[1] * f.spacing_mm.y,
                 edge = std::max(width, height);
    const double pixel = std::max(edge / kMaxPixels, std::min(f.spacing_mm.x, f.spacing_mm.y));
    const cv::Size size(std::max(1, static_cast<int>(std::lround(width / pixel))),
                        std::max(1, static_cast<int>(std::lround(height / pixel))));
    const int n = std::max(size.width, size.height), left = (n - size.width) / 2, top = (n - size.height) / 2;
    cv::Mat values, small, share, square, square_metal;
    slice.convertTo(values, CV_32F);
    values = cv::max(values, static_cast<float>(kLowestHu)) + 1000;
    cv::resize(values, small, size, 0, 0, cv::INTER_AREA);
    metal.convertTo(share, CV_32F, 1.0 / 255);
    cv::resize(share, share, size, 0, 0, cv::INTER_AREA);
    cv::copyMakeBorder(small, square, top, n - size.height - top, left, n - size.width - left, cv::BORDER_CONSTANT, 0);
    cv::copyMakeBorder(share, square_metal, top, n - size.height - top, left, n - size.width - left,
                       cv::BORDER_CONSTANT, 0);
    const cv::Mat sums = image::project(square), trace = image::project(square_metal);
    // First straight across the metal's trace, then once more across what a picture of mere tissue classes, taken from
    // the first result, leaves.
    cv::Mat correction = image::project_back(across(sums, trace), n);
    const cv::Mat classes = tissue_classes(square + correction, square_metal), expected = image::project(classes);
    correction = image::project_back(across(sums - expected, trace), n);
    cv::Mat full;
    cv::resize(correction(cv::Rect(left, top, size.width, size.height)), full, slice.size(), 0, 0, cv::INTER_LINEAR);
    // What lies within a pixel of metal is partly metal, and stays.
    cv::Mat near;
    cv::dilate(metal, near, cv::getStructuringElement(cv::MORPH_RECT, {3, 3}));
    for (int j = 0; j < slice.rows; ++j)
      for (int i = 0; i < slice.cols; ++i) {
        if (near.at<std::uint8_t>(j, i) != 0) continue;
        const std::int16_t was = slice.at<std::int16_t>(j, i),
                           now = rounded(std::max(static_cast<float>(was) + full.at<float>(j, i),
                                                  static_cast<float>(std::min<int>(was, kLowestHu))));
        to[static_cast<std::size_t>(j) * static_cast<std::size_t>(slice.cols) + static_cast<std::size_t>(i)] = now;
        changed[k] += now != was;
        by[k] += std::abs(now - was);
      }
  });
  std::int64_t voxels = 0, with_metal = 0;
  double sum = 0;
  for (std::size_t k = 0; k < slices; ++k) {
    voxels += changed[k];
    with_metal += changed[k] > 0;
    sum += by[k];
  }
  if (with_metal == 0)
    context.warn("no slice holds metal at or above " + format_number(params.metal_hu) + " HU: nothing was changed");
  context.report("slices_with_metal", with_metal);
  context.report("voxels_changed", voxels);
  context.report("mean_change_hu", voxels > 0 ? sum / static_cast<double>(voxels) : 0.0);
  return out;
}

}  // namespace osteo::inline imaging
