// A dense block of voxels. A value: copies share the voxels, which nobody changes once the volume is made.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/data/frame.h"

namespace osteo {

template <class T>
struct Volume {
  Frame frame;
  std::shared_ptr<const T[]> voxels;  ///< x fastest, then y, then z; frame.voxel_count() of them

  [[nodiscard]] std::span<const T> span() const { return {voxels.get(), frame.voxel_count()}; }
  [[nodiscard]] std::size_t offset(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(frame.dims[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(frame.dims[0]) +
           static_cast<std::size_t>(i);
  }
  [[nodiscard]] T at(int i, int j, int k) const { return voxels[offset(i, j, k)]; }
};

/// CT in Hounsfield units, rounded to whole HU.
using Image = Volume<std::int16_t>;
/// What a value of a label map stands for.
struct Structure {
  std::uint8_t value = 1;
  std::string name;                          ///< "facial nerve"; never empty
  std::array<std::uint8_t, 3> rgb{0, 0, 0};  ///< black: none was given
  /// What drew it, like "tube, version 2" or "by hand", with ", corrected by hand" behind it; empty: not known.
  std::string origin{};
  /// Its boundary lies within so many mm of where it was drawn, in 95 % of places, as what drew it says; infinity: it
  /// cannot say that of any distance. 0: nothing is known.
  double within_mm = 0;
  /// Why what drew it says that it is not to be trusted here; empty: it does not say so.
  std::string doubt{};
  friend bool operator==(const Structure&, const Structure&) = default;
};
inline constexpr std::string_view kDrawnByHand = "by hand", kCorrectedByHand = ", corrected by hand";
/// 0 is background; a mask has only 1 besides; a label map has one value a structure.
struct Labels : Volume<std::uint8_t> {
  std::vector<Structure> structures{};  ///< in order of their values; empty when the file named none
};

/// Trilinear between voxel centres at a point in index coordinates; outside, the value at the border.
[[nodiscard]] double sample_linear(const Image& image, Vec3 index);

/// Uninitialised voxels to fill before they become a Volume.
template <class T>
[[nodiscard]] std::shared_ptr<T[]> make_voxels(std::size_t count) {
  return std::make_shared_for_overwrite<T[]>(count);
}

}  // namespace osteo
