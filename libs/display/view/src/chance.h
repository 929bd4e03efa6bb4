// Numbers by chance that follow from a cell alone, so that the same dust is drawn the same way. Private to
// libs/display/view.
#pragma once
#include <cstdint>

namespace osteo::inline display {

/// From 0 to 1, one after the other.
class Chance {
 public:
  Chance(std::int64_t i, std::int64_t j, std::int64_t k)
      : state_(static_cast<std::uint64_t>(i * 73856093 ^ j * 19349663 ^ k * 83492791)) {}
  float next() {  // splitmix64 (G. Steele, D. Lea, C. Flood 2014)
    state_ += 0x9e3779b97f4a7c15ULL;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return static_cast<float>((z ^ (z >> 31)) >> 40) / 16777216.0F;
  }

 private:
  std::uint64_t state_;
};

}  // namespace osteo::inline display
