// The axes of an image in the order in which a network takes them.
#pragma once
#include <array>
#include <cstddef>

#include "osteo/core/data/frame.h"
#include "osteo/imaging/neural/detail/network.h"

namespace osteo::inline imaging {

inline std::size_t offset(const Axes& size, int z, int y, int x) {
  return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size[1]) + static_cast<std::size_t>(y)) *
             static_cast<std::size_t>(size[2]) +
         static_cast<std::size_t>(x);
}

// The image as the network's axes see it: axis a is the image's transpose[a] of z, y, x.
class Turned {
 public:
  Turned(const Frame& frame, const std::array<int, 3>& transpose) {
    const Axes dims{frame.dims[2], frame.dims[1], frame.dims[0]};
    const std::array<double, 3> mm{frame.spacing_mm.z, frame.spacing_mm.y, frame.spacing_mm.x};
    const std::array<std::size_t, 3> steps{
        static_cast<std::size_t>(frame.dims[0]) * static_cast<std::size_t>(frame.dims[1]),
        static_cast<std::size_t>(frame.dims[0]), 1};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto from = static_cast<std::size_t>(transpose[a]);
      size[a] = dims[from];
      spacing_mm[a] = mm[from];
      step_[a] = steps[from];
    }
  }
  [[nodiscard]] std::size_t at(int z, int y, int x) const {
    return static_cast<std::size_t>(z) * step_[0] + static_cast<std::size_t>(y) * step_[1] +
           static_cast<std::size_t>(x) * step_[2];
  }
  Axes size{};
  std::array<double, 3> spacing_mm{};

 private:
  std::array<std::size_t, 3> step_{};
};

}  // namespace osteo::inline imaging
