// Functions of the mathematics library whose last bits differ between its versions and, in one version, between
// processors with and without FMA. These are made of additions, multiplications, divisions and roots alone, each of
// which IEEE 754 rounds in one way, so they give the same bits everywhere. All that the servo, a replay or what they
// start from is computed with uses these; the test same-bits.symbols checks it. Errors are absolute, measured by the
// tests against a wider type. What is not finite gives what is not finite.
#pragma once
#include <cmath>

namespace osteo::portable {

struct SinCos {
  double sin = 0, cos = 1;
};
/// Of an angle in radians: off by at most 2e-16 up to 1e6, beyond that by the angle's share of 1e-16. Exact at 0.
[[nodiscard]] SinCos sin_cos(double angle) noexcept;
/// Of an angle in whole turns, from -1e6 to 1e6: off by at most 3e-16. Exact at quarters of a turn.
[[nodiscard]] SinCos sin_cos_turns(double turns) noexcept;

/// The angle of the direction (x, y), -pi to pi: off by at most 6e-16. 0 for (0, 0). Where |x| and |y| lie between
/// 1e-150 and 1e150, or are 0.
[[nodiscard]] double atan2(double y, double x) noexcept;
/// 0 to pi, x in [-1, 1]: off by at most 1e-15.
[[nodiscard]] double acos(double x) noexcept;
/// -pi/2 to pi/2, x in [-1, 1]: off by at most 5e-16.
[[nodiscard]] double asin(double x) noexcept;

/// sqrt(x^2 + y^2): off by at most 2.3e-16 of itself. Where |x| and |y| lie between 1e-150 and 1e150, or are 0.
[[nodiscard]] inline double hypot(double x, double y) noexcept {
  return std::sqrt(x * x + y * y);
}
/// Off by at most 5e-16 of itself.
[[nodiscard]] double cbrt(double x) noexcept;

/// Off by at most 4e-16 of itself, from -708 to 709; beyond: 0 and infinity.
[[nodiscard]] double exp(double x) noexcept;
/// Off by at most 3e-16 or, where that is more, 3e-16 of itself; x normal. -infinity for 0.
[[nodiscard]] double log(double x) noexcept;
/// x to the power y, x >= 0: off by at most (1 + |y log x|) 5e-16 of itself. 1 where y is 0.
[[nodiscard]] double pow(double x, double y) noexcept;

}  // namespace osteo::portable
