// What the sources of the solids share.
#pragma once
#include <array>
#include <cstdint>

namespace osteo::inline assessment::truth {

/// Where the sines of a path begin, from its seed; all 0 for seed 1.
class Phases {
 public:
  explicit Phases(std::uint64_t seed);
  [[nodiscard]] double operator[](std::size_t i) const { return phase_[i]; }

 private:
  std::array<double, 4> phase_{};
};

}  // namespace osteo::inline assessment::truth
