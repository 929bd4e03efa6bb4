#include "osteo/core/base/portable_math.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace osteo::portable {
namespace {

constexpr double kPi = std::numbers::pi, kHalfPi = kPi / 2;

// Of r within an eighth of a turn, by Taylor's series: what is left out is below 1e-19 and 3e-18.
SinCos of_small(double r) noexcept {
  const double z = r * r;
  constexpr double kSin[8] = {-1 / 6.0,        1 / 120.0,        -1 / 5040.0,          1 / 362880.0,
                              -1 / 39916800.0, 1 / 6227020800.0, -1 / 1307674368000.0, 1 / 355687428096000.0};
  constexpr double kCos[7] = {1 / 24.0,        -1 / 720.0,         1 / 40320.0,         -1 / 3628800.0,
                              1 / 479001600.0, -1 / 87178291200.0, 1 / 20922789888000.0};
  double s = kSin[7], c = kCos[6];
  for (int i = 6; i >= 0; --i) s = s * z + kSin[i];
  for (int i = 5; i >= 0; --i) c = c * z + kCos[i];
  // 1 - z/2 rounds; what it loses is put back with the rest.
  const double half = 0.5 * z, w = 1 - half;
  return {r + r * (z * s), w + (((1 - w) - half) + z * (z * c))};
}

SinCos turned(SinCos a, double quarters) noexcept {
  const double q = quarters - 4 * std::floor(quarters / 4);
  if (q == 0) return a;
  if (q == 1) return {a.cos, -a.sin};
  if (q == 2) return {-a.sin, -a.cos};
  return {-a.cos, a.sin};
}

// 0 <= x <= 1: the nearest eighth's angle, and the series for the rest, of which at most 1/16 is left.
double atan_of_unit(double x) noexcept {
  constexpr double kEighths[9] = {0x0p+0,
                                  0x1.fd5ba9aac2f6ep-4,
                                  0x1.f5b75f92c80ddp-3,
                                  0x1.6f61941e4def1p-2,
                                  0x1.dac670561bb4fp-2,
                                  0x1.1e00babdefeb4p-1,
                                  0x1.4978fa3269ee1p-1,
                                  0x1.700a7c5784634p-1,
                                  0x1.921fb54442d18p-1};
  const int k = static_cast<int>(8 * x + 0.5);
  const double at = k / 8.0, u = (x - at) / (1 + x * at), z = u * u;
  double s = 1 / 13.0;
  for (const double n : {11.0, 9.0, 7.0, 5.0, 3.0}) s = 1 / n - z * s;
  return kEighths[k] + (u - u * (z * s));
}

}  // namespace

SinCos sin_cos(double angle) noexcept {
  // Beyond: by the double nearest to a turn, exactly.
  if (!(std::abs(angle) <= 1e6)) angle = std::fmod(angle, 2 * kPi);
  const double n = std::floor(angle * (2 / kPi) + 0.5);
  // A quarter of a turn in three parts; n times the first two is exact.
  return turned(of_small(((angle - n * 0x1.921fb54400000p+0) - n * 0x1.0b4611a600000p-34) - n * 0x1.3198a2e037073p-69),
                n);
}

SinCos sin_cos_turns(double turns) noexcept {
  const double n = std::floor(4 * turns + 0.5);
  return turned(of_small(2 * kPi * (turns - n / 4)), n);
}

double atan2(double y, double x) noexcept {
  if (!std::isfinite(x) || !std::isfinite(y)) return std::numeric_limits<double>::quiet_NaN();
  const double ax = std::abs(x), ay = std::abs(y);
  if (ax == 0 && ay == 0) return 0;
  double a = ax >= ay ? atan_of_unit(ay / ax) : kHalfPi - atan_of_unit(ax / ay);
  if (x < 0) a = kPi - a;
  return std::copysign(a, y);
}

double acos(double x) noexcept {
  return std::abs(x) <= 1 ? 2 * atan2(std::sqrt(1 - x), std::sqrt(1 + x)) : std::numeric_limits<double>::quiet_NaN();
}

double asin(double x) noexcept {
  return std::abs(x) <= 1 ? atan2(x, std::sqrt((1 - x) * (1 + x))) : std::numeric_limits<double>::quiet_NaN();
}

double cbrt(double x) noexcept {
  if (x == 0 || !std::isfinite(x)) return x;
  int exponent = 0;
  const double m = std::frexp(std::abs(x), &exponent);  // [0.5, 1)
  const int third = (exponent >= 0 ? exponent + 2 : exponent) / 3;
  const double y = std::ldexp(m, exponent - 3 * third);  // [0.125, 1)
  // Halley's steps: within 9 % at first, then 5e-4, 1e-10, all that a double holds.
  double r = 0.43 + 0.6 * y;
  for (int i = 0; i < 3; ++i) {
    const double cube = r * r * r;
    r = r * ((cube + y + y) / (cube + cube + y));
  }
  return std::copysign(std::ldexp(r, third), x);
}

namespace {

// The logarithm of 2 in two parts: a whole number below 2^20 times the first is exact.
constexpr double kLn2 = 0x1.62e42fee00000p-1, kLn2Rest = 0x1.a39ef35793c76p-33;

}  // namespace

double exp(double x) noexcept {
  if (std::isnan(x)) return x;
  if (x < -708) return 0;
  if (x > 709) return std::numeric_limits<double>::infinity();
  const double n = std::floor(x * 0x1.71547652b82fep+0 + 0.5), r = (x - n * kLn2) - n * kLn2Rest;
  // Taylor's series for |r| < 0.35: what is left out is below 2e-19.
  double s = 1;
  for (int k = 14; k >= 2; --k) s = 1 + r / k * s;
  return std::ldexp(1 + r * s, static_cast<int>(n));
}

double log(double x) noexcept {
  if (!(x > 0)) return x == 0 ? -std::numeric_limits<double>::infinity() : std::numeric_limits<double>::quiet_NaN();
  if (!std::isfinite(x)) return x;
  int exponent = 0;
  double m = std::frexp(x, &exponent);  // to [0.707, 1.414)
  if (m < std::numbers::sqrt2 / 2) m *= 2, --exponent;
  // log m = 2 artanh f, |f| < 0.172: what is left out is below 1e-19.
  const double f = (m - 1) / (m + 1), z = f * f;
  double s = 1 / 23.0;
  for (int k = 21; k >= 3; k -= 2) s = 1.0 / k + z * s;
  return exponent * kLn2 + (2 * f + (2 * f * (z * s) + exponent * kLn2Rest));
}

double pow(double x, double y) noexcept {
  if (y == 0) return 1;
  if (x == 0) return y > 0 ? 0 : std::numeric_limits<double>::infinity();
  return exp(y * log(x));
}

}  // namespace osteo::portable
