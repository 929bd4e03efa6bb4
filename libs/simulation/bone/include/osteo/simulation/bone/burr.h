// Drill burrs: shape, and how much bone they remove.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "osteo/core/base/param.h"
#include "osteo/core/data/vec.h"
#include "osteo/simulation/bone/burr_kind.h"
#include "osteo/simulation/bone/round_cone.h"

namespace osteo::inline simulation {

enum class BurrShape : int { ball, cylinder, taper };
[[nodiscard]] constexpr std::array<std::string_view, 3> enum_names(BurrShape) {
  return {"ball", "cylinder", "taper"};
}

/// Removal at latitude L (angle from the equator seen along the burr's axis), at the nominal speed:
///   rate = force * max(0, rate_mm3_per_s_per_n - falloff * |L|)   (D. Morris 2006, section 3.2.3.6)
/// The two constants are guesses ordered as the thesis says (cutting burrs: faster, more dependent on angle); no
/// measured values were found. A burr of another diameter scales the rate with its diameter, as the speed of its
/// surface does; so does another speed. The proportions of cylinders (1.5 diameters between the centres of their domes)
/// and tapers (half the diameter at the tip, 2 diameters long) are those usual in catalogues, not of one make.
struct Burr {
  BurrKind kind = BurrKind::cutting;
  double diameter_mm = 4;
  double rate_mm3_per_s_per_n = 6;
  double falloff_mm3_per_s_per_n_per_rad = 3;
  BurrShape shape = BurrShape::ball;
  double length_mm =
      0;  ///< of a saw's edge, a cylinder, between the centres of its domes; 0: a burr's, as its diameter has it
  static constexpr double kNominalRpm = 60000;

  [[nodiscard]] std::string name() const;  ///< "cutting 4 mm", "diamond taper 3 mm", "saw 25 mm"
  /// The head, its tip's centre at the origin, handle along +z.
  [[nodiscard]] RoundCone head() const;
  /// The shaft behind it, as thick as a surgical drill's (2.35 mm) or, behind a small burr, 0.7 of the burr.
  [[nodiscard]] RoundCone shaft() const;
};

/// The library: every kind (kBurrKinds) as balls, cylinders and tapers of 1 to 7 mm; the balls come first. Numbers in
/// it are of this build: files go by names.
[[nodiscard]] const std::vector<Burr>& burr_library();
/// Error(usage) when there is none.
[[nodiscard]] int burr_index(BurrKind kind, double diameter_mm, BurrShape shape = BurrShape::ball);
/// Changes with what burrs of the library remove: stored in session files, since the same poses would come out
/// differently. A burr beside the others changes nothing of theirs.
inline constexpr int kBurrLibraryVersion = 3;

/// About 3000 points of a cubic lattice inside a head, each standing for an equal share of its volume.
struct BurrSamples {
  std::vector<std::array<float, 3>> offset_mm;  ///< from the tip's centre, handle along +z
  std::vector<std::array<float, 3>> inward;     ///< unit, to the nearest point of the axis
  std::vector<float> efficiency;                ///< 0 to 1: removal rate at this latitude over the rate at the equator
  double sample_volume_mm3 = 0;
};
/// `falloff_per_rad`: share of the efficiency lost for each radian of latitude.
[[nodiscard]] BurrSamples sample_head(const RoundCone& head, double falloff_per_rad);

/// Points spread evenly over the surface of a head, a spiral of equal areas.
struct BurrSurface {
  std::vector<std::array<float, 3>> offset_mm, inward;
  std::vector<float> efficiency, reach_mm;  ///< reach: to the axis along `inward`
  double sample_area_mm2 = 0;
};
[[nodiscard]] BurrSurface sample_head_surface(const RoundCone& head, double falloff_per_rad, int samples);

}  // namespace osteo::inline simulation
