#include "osteo/core/base/portable_math.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>

namespace osteo {
namespace {

static_assert(std::numeric_limits<long double>::digits > 60, "the reference must hold more than a double");
constexpr long double kPi = std::numbers::pi_v<long double>;

// The largest difference to the wider type over a range, evenly and crowded towards its middle.
template <class Ours, class Theirs>
double worst(double lo, double hi, Ours ours, Theirs theirs, bool relative = false) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> even(lo, hi), decades(-12, 0);
  long double most = 0;
  for (int n = 0; n < 400'000; ++n) {
    double x = even(random);
    if (n % 2 == 1) x *= std::pow(10, decades(random));
    const long double truth = theirs(static_cast<long double>(x)),
                      off = std::abs(static_cast<long double>(ours(x)) - truth);
    most = std::max(most, relative ? off / std::abs(truth) : off);
  }
  return static_cast<double>(most);
}

TEST(PortableMath, IsAsExactAsItSays) {
  using namespace portable;
  for (const double range : {0.8, 7.0, 1000.0, 1e6}) {
    EXPECT_LT(worst(
                  -range, range, [](double x) { return sin_cos(x).sin; }, [](long double x) { return std::sin(x); }),
              2e-16)
        << range;
    EXPECT_LT(worst(
                  -range, range, [](double x) { return sin_cos(x).cos; }, [](long double x) { return std::cos(x); }),
              2e-16)
        << range;
  }
  for (const double range : {1.0, 1000.0}) {
    EXPECT_LT(worst(
                  -range, range, [](double x) { return sin_cos_turns(x).sin; },
                  [](long double x) { return std::sin(2 * kPi * (x - std::round(x))); }),
              3e-16);
    EXPECT_LT(worst(
                  -range, range, [](double x) { return sin_cos_turns(x).cos; },
                  [](long double x) { return std::cos(2 * kPi * (x - std::round(x))); }),
              3e-16);
  }
  EXPECT_LT(worst(
                -1, 1, [](double x) { return portable::acos(x); }, [](long double x) { return std::acos(x); }),
            1e-15);
  EXPECT_LT(worst(
                -1, 1, [](double x) { return portable::asin(x); }, [](long double x) { return std::asin(x); }),
            5e-16);
  for (const double x : {-3.0, -1e-9, 0.0, 1e-12, 0.7, 40.0}) {
    EXPECT_LT(worst(
                  -50, 50, [&](double y) { return portable::atan2(y, x); },
                  [&](long double y) { return std::atan2(y, static_cast<long double>(x)); }),
              6e-16)
        << x;
    EXPECT_LT(worst(
                  -50, 50, [&](double y) { return portable::hypot(x, y); },
                  [&](long double y) { return std::hypot(static_cast<long double>(x), y); }, true),
              2.3e-16)
        << x;
  }
  for (const double range : {1.0, 1e-6, 1e9, 1e300})
    EXPECT_LT(worst(
                  -range, range, [](double x) { return portable::cbrt(x); }, [](long double x) { return std::cbrt(x); },
                  true),
              5e-16)
        << range;
  for (const double range : {1e-3, 1.0, 30.0, 700.0})
    EXPECT_LT(
        worst(
            -range, range, [](double x) { return portable::exp(x); }, [](long double x) { return std::exp(x); }, true),
        4e-16)
        << range;
  EXPECT_LT(worst(
                0.3, 3, [](double x) { return portable::log(x); }, [](long double x) { return std::log(x); }),
            3e-16 * 28);  // down to 3e-13
  EXPECT_LT(worst(
                0.9, 1.1, [](double x) { return portable::log(x) / std::max(1.0, std::abs(std::log(x))); },
                [](long double x) { return std::log(x) / std::max(1.0L, std::abs(std::log(x))); }),
            3e-16);
  EXPECT_LT(worst(
                1, 1e300, [](double x) { return portable::log(x); }, [](long double x) { return std::log(x); }, true),
            3e-16);
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> base(0, 5), exponent(-4, 4);
  for (int n = 0; n < 200'000; ++n) {
    const double x = base(random), y = exponent(random);
    const long double truth = std::pow(static_cast<long double>(x), static_cast<long double>(y));
    const auto off = static_cast<double>(std::abs(portable::pow(x, y) / truth - 1));
    ASSERT_LT(off, (1 + std::abs(y * std::log(x))) * 5e-16) << x << " " << y;
  }
}

TEST(PortableMath, SpecialPlaces) {
  using namespace portable;
  const double pi = std::numbers::pi, inf = std::numeric_limits<double>::infinity();
  for (int quarter = -9; quarter <= 9; ++quarter) {
    const SinCos a = sin_cos_turns(quarter / 4.0);
    const int q = ((quarter % 4) + 4) % 4;
    EXPECT_EQ(a.sin, q == 1 ? 1 : q == 3 ? -1 : 0);
    EXPECT_EQ(a.cos, q == 0 ? 1 : q == 2 ? -1 : 0);
  }
  EXPECT_EQ(sin_cos(0).sin, 0);
  EXPECT_EQ(sin_cos(0).cos, 1);
  EXPECT_EQ(portable::acos(1), 0);
  EXPECT_NEAR(portable::acos(-1), pi, 1e-15);
  EXPECT_EQ(portable::asin(-1), -pi / 2);
  EXPECT_EQ(portable::atan2(0, 0), 0);
  EXPECT_EQ(portable::atan2(0, -2), pi);
  EXPECT_EQ(portable::atan2(-3, 0), -pi / 2);
  EXPECT_EQ(portable::cbrt(0), 0);
  EXPECT_NEAR(portable::cbrt(-27), -3, 1.5e-15);
  EXPECT_EQ(portable::hypot(3, 4), 5);
  for (const double x : {inf, -inf, std::nan("")}) {
    EXPECT_FALSE(std::isfinite(sin_cos(x).sin) || std::isfinite(sin_cos(x).cos) || std::isfinite(sin_cos_turns(x).sin));
    EXPECT_FALSE(std::isfinite(portable::atan2(x, 1)) || std::isfinite(portable::acos(x)) ||
                 std::isfinite(portable::cbrt(x)));
  }
  EXPECT_TRUE(std::isnan(portable::acos(1.0000001)));
  EXPECT_EQ(portable::exp(0), 1);
  EXPECT_EQ(portable::exp(-800), 0);
  EXPECT_EQ(portable::exp(800), inf);
  EXPECT_EQ(portable::log(1), 0);
  EXPECT_EQ(portable::log(0), -inf);
  EXPECT_TRUE(std::isnan(portable::log(-1)) && std::isnan(portable::exp(std::nan(""))));
  EXPECT_EQ(portable::pow(0, 2), 0);
  EXPECT_EQ(portable::pow(0, 0), 1);
  EXPECT_EQ(portable::pow(1, 1e9), 1);
  for (const double x : {1.1e6, 1e15, 1e300, -1e300}) {
    const SinCos a = sin_cos(x);
    EXPECT_NEAR(a.sin * a.sin + a.cos * a.cos, 1, 1e-15) << x;
  }
}

// The bits themselves, on whatever machine and with whatever library this runs.
TEST(PortableMath, BitsAreTheSameEverywhere) {
  using namespace portable;
  std::uint64_t sum = 14695981039346656037U, state = 1;
  const auto add = [&](double v) { sum = (sum ^ std::bit_cast<std::uint64_t>(v)) * 1099511628211U; };
  for (int n = 0; n < 200'000; ++n) {
    state = state * 6364136223846793005U + 1442695040888963407U;
    const double u = static_cast<double>(state >> 11) * 0x1p-52 - 1;  // [-1, 1)
    const SinCos a = sin_cos(20 * u), b = sin_cos_turns(u);
    for (const double v : {a.sin, a.cos, b.sin, b.cos, portable::acos(u), portable::asin(u), portable::atan2(u, 0.3),
                           portable::hypot(u, 0.7), portable::cbrt(u), portable::exp(9 * u), portable::log(1.5 + u),
                           portable::pow(1.5 + u, 1.7)})
      add(v);
  }
  EXPECT_EQ(sum, 6375800630601067770U);
}

}  // namespace
}  // namespace osteo
