// Drill burrs: shape as volume samples, and how much bone they remove.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "osteo/base/param.h"
#include "osteo/data/vec.h"

namespace osteo {

enum class BurrKind : int { cutting, diamond };
template <>
struct EnumNames<BurrKind> {
  static constexpr std::array<std::string_view, 2> values{"cutting", "diamond"};
};

/// Removal of a sample at latitude L (angle from the equator seen along the burr's axis):
///   rate = force * max(0, rate_mm3_per_s_per_n - falloff * |L|)   (D. Morris 2006, section 3.2.3.6)
/// The two constants are guesses ordered as the thesis says (cutting burrs: faster, more dependent on angle); no measured
/// values were found. A burr of another diameter scales the rate with its diameter, as the speed of its surface does.
struct Burr {
  BurrKind kind = BurrKind::cutting;
  double diameter_mm = 4;
  double rate_mm3_per_s_per_n = 6;
  double falloff_mm3_per_s_per_n_per_rad = 3;
  [[nodiscard]] std::string name() const;  ///< "cutting 4 mm"
};

/// The library: cutting and diamond, 1 to 7 mm. A tool is named by its index here, also in session files.
[[nodiscard]] const std::vector<Burr>& burr_library();
/// Error(usage) when there is none.
[[nodiscard]] int burr_index(BurrKind kind, double diameter_mm);
/// Changes whenever the library does: stored in session files, since indices would mean other burrs.
inline constexpr int kBurrLibraryVersion = 1;

/// About 3000 points of a cubic lattice inside the ball, each standing for an equal share of its volume.
struct BurrSamples {
  std::vector<std::array<float, 3>> offset_mm;  ///< from the centre, tool axis along +z
  std::vector<float> efficiency;                ///< 0 to 1: removal rate at this latitude over the rate at the equator
  double sample_volume_mm3 = 0;
};
[[nodiscard]] BurrSamples sample_burr(const Burr& burr);

}  // namespace osteo
