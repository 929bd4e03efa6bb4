// Numbers by chance that follow from a cell alone, so that the same dust is drawn the same way. Private to
// libs/display/view.
#pragma once
#include <cmath>
#include <cstdint>

#include "osteo/simulation/bone/dust.h"

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

/// Whether what is in a cell of dust or water is drawn. Both fall by a cell a step, 50 mm/s, where chips and drops are
/// eight times as fast after a centimetre: of a stream an eighth is in the air at once. All that the model holds there
/// would be a ribbon that hangs from the bone. Others in each picture, for they pass.
inline bool is_drawn(const Dust& dust, Ijk cell, double cell_mm) {
  constexpr double kFreeMm = 4;
  constexpr float kInAir = 1.0F / 8;
  if (!dust.falls(cell, static_cast<int>(std::lround(kFreeMm / cell_mm)))) return true;
  return Chance(cell.i + static_cast<std::int64_t>(dust.version()) * 31, cell.j, cell.k).next() <= kInAir;
}

}  // namespace osteo::inline display
