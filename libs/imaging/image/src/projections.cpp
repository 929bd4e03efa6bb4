#include "projections.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace osteo::inline imaging::image {
namespace {

int width_of(int pixels) {
  return 2 * static_cast<int>(std::ceil(0.5 * std::sqrt(2.0) * pixels)) + 3;
}

// From a square of `from` pixels to one of `to`, turned about both middles.
cv::Mat turning(int from, int to, double degrees) {
  const double a = degrees * CV_PI / 180, c = std::cos(a), s = std::sin(a), f = 0.5 * (from - 1), t = 0.5 * (to - 1);
  return (cv::Mat_<double>(2, 3) << c, -s, t - c * f + s * f, s, c, t - s * f - c * f);
}

}  // namespace

cv::Mat project(const cv::Mat& picture) {
  const int n = width_of(picture.cols);
  cv::Mat rows(kAngles, n, CV_32F), turned, sums;
  for (int a = 0; a < kAngles; ++a) {
    cv::warpAffine(picture, turned, turning(picture.cols, n, a * 180.0 / kAngles), {n, n}, cv::INTER_LINEAR,
                   cv::BORDER_CONSTANT, 0);
    cv::reduce(turned, sums, 0, cv::REDUCE_SUM, CV_32F);
    sums.copyTo(rows.row(a));
  }
  return rows;
}

cv::Mat project_back(const cv::Mat& rows, int pixels) {
  const int n = rows.cols, wide = cv::getOptimalDFTSize(2 * n);
  // The ramp as the transform of its samples, so that a constant keeps its value (A. Kak, M. Slaney 1988, section 3.3).
  cv::Mat ramp = cv::Mat::zeros(1, wide, CV_32F);
  ramp.at<float>(0, 0) = 0.25F;
  for (int i = 1; i < wide / 2; i += 2) {
    const auto v = static_cast<float>(-1 / (CV_PI * CV_PI * i * i));
    ramp.at<float>(0, i) = v;
    ramp.at<float>(0, wide - i) = v;
  }
  cv::Mat of_ramp, padded, spectrum, filtered;
  cv::dft(ramp, of_ramp, cv::DFT_ROWS);
  cv::copyMakeBorder(rows, padded, 0, 0, 0, wide - n, cv::BORDER_CONSTANT, 0);
  cv::dft(padded, spectrum, cv::DFT_ROWS);
  cv::mulSpectrums(spectrum, cv::repeat(of_ramp, rows.rows, 1), spectrum, cv::DFT_ROWS);
  cv::idft(spectrum, filtered, cv::DFT_ROWS | cv::DFT_SCALE);
  cv::Mat picture = cv::Mat::zeros(pixels, pixels, CV_32F), spread, turned;
  for (int a = 0; a < kAngles; ++a) {
    cv::repeat(filtered(cv::Rect(0, a, n, 1)), n, 1, spread);
    cv::warpAffine(spread, turned, turning(n, pixels, -a * 180.0 / kAngles), {pixels, pixels}, cv::INTER_LINEAR,
                   cv::BORDER_CONSTANT, 0);
    picture += turned;
  }
  return picture * (CV_PI / kAngles);
}

}  // namespace osteo::inline imaging::image
