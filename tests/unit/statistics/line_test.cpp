// Intervals that are drawn, against the formulas in NumPy with Student's quantiles from tables.
#include "osteo/core/statistics/curves.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "osteo/core/base/error.h"

namespace osteo::statistics {
namespace {

const std::vector<double> kX{1, 2, 3, 4, 5, 7}, kY{2.1, 3.9, 6.2, 7.8, 10.1, 13.5};

TEST(Line, AndItsInterval) {
  const FittedLine line = fitted_line(kX, kY);
  EXPECT_NEAR(line.slope, 1.921428571428571, 1e-12);
  EXPECT_NEAR(line.intercept, 0.2214285714285733, 1e-12);
  EXPECT_NEAR(line.at(6).interval.lo, 11.36801350370943, 1e-9);
  EXPECT_NEAR(line.at(6).interval.hi, 12.13198649629057, 1e-9);
  const std::vector<double> flat{2, 2, 2};
  EXPECT_TRUE(std::isnan(fitted_line(flat, flat).slope));
  EXPECT_TRUE(std::isnan(fitted_line(flat, flat).at(1).value));
  EXPECT_THROW((void)fitted_line(kX, flat), Error);
}

TEST(Mean, Interval) {
  EXPECT_NEAR(mean_interval(kY).lo, 2.9059279904671964, 1e-9);
  EXPECT_NEAR(mean_interval(kY).hi, 11.627405342866137, 1e-9);
  EXPECT_TRUE(std::isnan(mean_interval(std::vector<double>{1}).lo));
}

}  // namespace
}  // namespace osteo::statistics
