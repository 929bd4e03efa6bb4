// Numbers of 16 bits (IEEE 754 binary16), rounded to nearest even, as networks' sums are kept.
#pragma once
#include <bit>
#include <cstdint>

namespace osteo::inline imaging {

inline float float_from_half(std::uint16_t h) {
  const std::uint32_t sign = static_cast<std::uint32_t>(h & 0x8000U) << 16, rest = h & 0x7fffU;
  if (rest >= 0x7c00U) return std::bit_cast<float>(sign | 0x7f800000U | (rest & 0x3ffU) << 13);
  if (rest >= 0x400U) return std::bit_cast<float>(sign | ((rest << 13) + 0x38000000U));
  const float tiny = static_cast<float>(rest) * 0x1p-24F;
  return sign != 0 ? -tiny : tiny;
}

inline std::uint16_t half_from_float(float f) {
  const auto bits = std::bit_cast<std::uint32_t>(f);
  const auto sign = static_cast<std::uint16_t>(bits >> 16 & 0x8000U);
  const std::uint32_t rest = bits & 0x7fffffffU;
  if (rest > 0x7f800000U) return static_cast<std::uint16_t>(sign | 0x7e00U);
  if (rest >= 0x477ff000U) return static_cast<std::uint16_t>(sign | 0x7c00U);  // rounds to beyond 65504
  if (rest < 0x38800000U) {  // below the smallest normal: the sum's last bit is the half's
    const auto sum = std::bit_cast<std::uint32_t>(std::bit_cast<float>(rest) + 0.5F);
    return static_cast<std::uint16_t>(sign | (sum - 0x3f000000U));
  }
  const std::uint32_t odd = rest >> 13 & 1U;
  return static_cast<std::uint16_t>(sign | ((rest + 0xfffU + odd - 0x38000000U) >> 13));
}

/// Rounded once: the float between is rounded to odd.
inline std::uint16_t half_from_double(double d) {
  const auto f = static_cast<float>(d);
  auto bits = std::bit_cast<std::uint32_t>(f);
  if (const auto back = static_cast<double>(f); back != d) {
    if ((back < 0 ? -back : back) > (d < 0 ? -d : d)) --bits;
    bits |= 1U;
  }
  return half_from_float(std::bit_cast<float>(bits));
}

}  // namespace osteo::inline imaging
