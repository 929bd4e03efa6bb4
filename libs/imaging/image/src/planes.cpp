#include "osteo/imaging/image/planes.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "cv_slices.h"
#include "osteo/core/base/parallel.h"

namespace osteo::inline imaging {
namespace {

constexpr int kFiner = 4;

std::vector<Outline> outlines(const cv::Mat& values, const Frame& frame, SliceAt slice, float level) {
  const image::SliceLayout l = image::layout_of(frame, slice);
  // A border of what is outside closes lines at the edge.
  cv::Mat framed, fine, mask;
  cv::copyMakeBorder(values, framed, 1, 1, 1, 1, cv::BORDER_REPLICATE);
  double least = 0;
  cv::minMaxLoc(values, &least);
  framed.row(0) = framed.row(framed.rows - 1) = framed.col(0) = framed.col(framed.cols - 1) =
      std::min(static_cast<float>(least), level - 1e-3F);
  cv::resize(framed, fine, {}, kFiner, kFiner, cv::INTER_CUBIC);
  cv::compare(fine, level, mask, cv::CMP_GE);
  std::vector<std::vector<cv::Point>> lines;
  std::vector<cv::Vec4i> family;
  cv::findContours(mask, lines, family, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE);
  const auto at = [&](int x, int y) {
    return fine.at<float>(std::clamp(y, 0, fine.rows - 1), std::clamp(x, 0, fine.cols - 1));
  };
  std::vector<Outline> out;
  for (std::size_t n = 0; n < lines.size(); ++n) {
    if (lines[n].size() < 3) continue;
    Outline o;
    o.hole = family[n][3] >= 0;
    double area = 0, lx = 0, ly = 0;
    std::vector<std::pair<double, double>> flat;
    for (const cv::Point& p : lines[n]) {
      const double gx = 0.5 * static_cast<double>(at(p.x + 1, p.y) - at(p.x - 1, p.y)),
                   gy = 0.5 * static_cast<double>(at(p.x, p.y + 1) - at(p.x, p.y - 1));
      const double g2 = gx * gx + gy * gy;
      // The line runs through pixels just inside; the level lies less than one of them away.
      double step = g2 > 0 ? static_cast<double>(level - at(p.x, p.y)) / g2 : 0;
      const double most = g2 > 0 ? 1 / std::sqrt(g2) : 0;
      step = std::clamp(step, -most, most);
      flat.emplace_back((p.x + step * gx + 0.5) / kFiner - 0.5 - 1, (p.y + step * gy + 0.5) / kFiner - 0.5 - 1);
    }
    lx = flat.back().first;
    ly = flat.back().second;
    for (const auto& [x, y] : flat) {
      area += 0.5 * (lx * y - x * ly);
      lx = x;
      ly = y;
      Vec3 index;
      index[static_cast<std::size_t>(slice.axis)] = slice.index;
      index[static_cast<std::size_t>(l.u)] = x;
      index[static_cast<std::size_t>(l.v)] = y;
      o.points_mm.push_back(frame.world_from_index(index));
    }
    o.area_mm2 = std::abs(area) * l.mm_u * l.mm_v;
    out.push_back(std::move(o));
  }
  std::stable_sort(out.begin(), out.end(), [](const Outline& a, const Outline& b) { return !a.hole && b.hole; });
  return out;
}

// Calls change(mask of the value in a slice, 0 or 255) for each slice, and puts what it returns into a copy of the
// labels.
template <class F>
Labels each_slice(const Labels& labels, std::uint8_t value, int axis, const Context& context, F&& change) {
  static_cast<void>(image::layout_of(labels.frame, {axis, 0}));
  const std::size_t n = labels.frame.voxel_count();
  const auto voxels = make_voxels<std::uint8_t>(n);
  std::copy_n(labels.voxels.get(), n, voxels.get());
  parallel_for(
      static_cast<std::size_t>(labels.frame.dims[static_cast<std::size_t>(axis)]), 1, context.threads,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
          context.check_cancelled();
          const SliceAt slice{axis, static_cast<int>(k)};
          const cv::Mat mask = image::slice_of(labels, slice) == value;
          if (cv::countNonZero(mask) == 0) continue;
          const cv::Mat changed = change(mask);
          const image::SliceLayout l = image::layout_of(labels.frame, slice);
          for (int j = 0; j < l.height; ++j)
            for (int i = 0; i < l.width; ++i) {
              std::uint8_t& x =
                  voxels[l.begin + static_cast<std::size_t>(i) * l.step_u + static_cast<std::size_t>(j) * l.step_v];
              const bool now = changed.at<std::uint8_t>(j, i) != 0;
              if (x == value && !now) x = 0;
              if (x == 0 && now) x = value;
            }
        }
      });
  Labels out;
  out.frame = labels.frame;
  out.structures = labels.structures;
  out.voxels = voxels;
  return out;
}

cv::Mat mat_of(const PlaneImage& p) {
  image::without_own_threads();
  if (p.width < 8 || p.height < 8 ||
      p.values.size() != static_cast<std::size_t>(p.width) * static_cast<std::size_t>(p.height))
    throw Error(ExitCode::usage, "a plane to be matched has at least 8 x 8 values");
  return {p.height, p.width, CV_32F, const_cast<float*>(p.values.data())};
}

}  // namespace

std::vector<Outline> outlines_of(const Image& image, SliceAt slice, double level) {
  cv::Mat values;
  image::slice_of(image, slice).convertTo(values, CV_32F);
  return outlines(values, image.frame, slice, static_cast<float>(level));
}

std::vector<Outline> outlines_of(const Labels& labels, SliceAt slice, std::uint8_t value) {
  const cv::Mat all = image::slice_of(labels, slice);
  const cv::Mat mask = value == 0 ? cv::Mat(all != 0) : cv::Mat(all == value);
  cv::Mat values;
  mask.convertTo(values, CV_32F, 1.0 / 255);
  cv::GaussianBlur(values, values, {5, 5}, 0.7, 0.7, cv::BORDER_REPLICATE);
  return outlines(values, labels.frame, slice, 0.5F);
}

Labels morph_slices(const Labels& labels, std::uint8_t value, Morphology what, double radius_mm, int axis,
                    const Context& context) {
  const image::SliceLayout l = image::layout_of(labels.frame, {axis, 0});
  const int ru = static_cast<int>(radius_mm / l.mm_u + 1e-6), rv = static_cast<int>(radius_mm / l.mm_v + 1e-6);
  // A disc in mm; OpenCV's own ellipse is rounded otherwise.
  cv::Mat disc(2 * rv + 1, 2 * ru + 1, CV_8U);
  for (int j = -rv; j <= rv; ++j)
    for (int i = -ru; i <= ru; ++i) {
      const double x = i * l.mm_u, y = j * l.mm_v;
      disc.at<std::uint8_t>(j + rv, i + ru) = x * x + y * y <= radius_mm * radius_mm + 1e-9 ? 1 : 0;
    }
  static constexpr std::array kOf{cv::MORPH_DILATE, cv::MORPH_ERODE, cv::MORPH_OPEN, cv::MORPH_CLOSE};
  return each_slice(labels, value, axis, context, [&](const cv::Mat& mask) {
    // Room around, so that closing may leave the slice and come back.
    cv::Mat wide, out;
    cv::copyMakeBorder(mask, wide, rv + 1, rv + 1, ru + 1, ru + 1, cv::BORDER_CONSTANT, 0);
    cv::morphologyEx(wide, out, kOf[static_cast<std::size_t>(what)], disc, {-1, -1}, 1, cv::BORDER_CONSTANT, 0);
    return cv::Mat(out, {ru + 1, rv + 1, mask.cols, mask.rows}).clone();
  });
}

Labels fill_slices(const Labels& labels, std::uint8_t value, double most_mm2, int axis, const Context& context) {
  const image::SliceLayout l = image::layout_of(labels.frame, {axis, 0});
  const double most = most_mm2 > 0 ? most_mm2 / (l.mm_u * l.mm_v) + 1e-6 : 1e300;
  return each_slice(labels, value, axis, context, [&](const cv::Mat& mask) {
    cv::Mat outside, parts, facts, middles;
    cv::copyMakeBorder(mask == 0, outside, 1, 1, 1, 1, cv::BORDER_CONSTANT, 255);
    const int n = cv::connectedComponentsWithStats(outside, parts, facts, middles, 4, CV_32S);
    const int around = parts.at<int>(0, 0);
    std::vector<char> enclosed(static_cast<std::size_t>(n));
    for (int c = 1; c < n; ++c)
      enclosed[static_cast<std::size_t>(c)] = c != around && facts.at<int>(c, cv::CC_STAT_AREA) <= most;
    cv::Mat out = mask.clone();
    for (int j = 0; j < mask.rows; ++j)
      for (int i = 0; i < mask.cols; ++i)
        if (enclosed[static_cast<std::size_t>(parts.at<int>(j + 1, i + 1))] != 0) out.at<std::uint8_t>(j, i) = 255;
    return out;
  });
}

Picture thumbnail(const Image& image, SliceAt slice, int pixels, double lo, double hi) {
  const image::SliceLayout l = image::layout_of(image.frame, slice);
  if (pixels < 1 || !(hi > lo))
    throw Error(ExitCode::usage, "a thumbnail needs at least a pixel, and a window whose end lies above its beginning");
  const double width = l.width * l.mm_u, height = l.height * l.mm_v, scale = pixels / std::max(width, height);
  cv::Mat grey, small;
  image::slice_of(image, slice).convertTo(grey, CV_32F, 255 / (hi - lo), -255 * lo / (hi - lo));
  grey = cv::min(cv::max(grey, 0.0F), 255.0F);
  cv::resize(grey, small,
             {std::max(1, static_cast<int>(std::lround(width * scale))),
              std::max(1, static_cast<int>(std::lround(height * scale)))},
             0, 0, cv::INTER_AREA);
  // Head up and front up, whichever way the axes run.
  const auto up = [&](int axis) {
    const Vec3& d = image.frame.direction.column[static_cast<std::size_t>(axis)];
    const bool along_z = std::abs(d.z) > std::max(std::abs(d.x), std::abs(d.y));
    return along_z ? d.z > 0 : d.y < 0;
  };
  if (up(l.v)) cv::flip(small, small, 0);
  Picture p;
  p.width = small.cols;
  p.height = small.rows;
  for (int j = 0; j < small.rows; ++j)
    for (int i = 0; i < small.cols; ++i) {
      const auto g = static_cast<std::uint8_t>(std::lround(small.at<float>(j, i)));
      p.rgb.insert(p.rgb.end(), {g, g, g});
    }
  return p;
}

PlaneMatch match_by_phase(const PlaneImage& first, const PlaneImage& second) {
  const cv::Mat a = mat_of(first), b = mat_of(second);
  if (a.size() != b.size()) throw Error(ExitCode::usage, "planes to be matched have one size");
  cv::Mat window;
  cv::createHanningWindow(window, a.size(), CV_32F);
  double score = 0;
  const cv::Point2d shift = cv::phaseCorrelate(a, b, window, &score);
  if (!std::isfinite(shift.x) || !std::isfinite(shift.y)) return {};
  return {shift.x, shift.y, 0, score};
}

PlaneMatch match_by_correlation(const PlaneImage& first, const PlaneImage& second, const PlaneMatch& guess) {
  const cv::Mat a = mat_of(first), b = mat_of(second);
  // OpenCV turns about the corner.
  const double cx = 0.5 * (a.cols - 1), cy = 0.5 * (a.rows - 1), c = std::cos(guess.angle_rad),
               s = std::sin(guess.angle_rad);
  cv::Mat warp =
      (cv::Mat_<float>(2, 3) << c, -s, cx + guess.dx - c * cx + s * cy, s, c, cy + guess.dy - s * cx - c * cy);
  try {
    const double score = cv::findTransformECC(a, b, warp, cv::MOTION_EUCLIDEAN,
                                              {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 200, 1e-7});
    const auto m = [&](int i, int j) { return static_cast<double>(warp.at<float>(i, j)); };
    return {m(0, 0) * cx + m(0, 1) * cy + m(0, 2) - cx, m(1, 0) * cx + m(1, 1) * cy + m(1, 2) - cy,
            std::atan2(m(1, 0), m(0, 0)), score};
  } catch (const cv::Exception&) {
    return {};  // what OpenCV throws where the correlation cannot be raised
  }
}

}  // namespace osteo::inline imaging
