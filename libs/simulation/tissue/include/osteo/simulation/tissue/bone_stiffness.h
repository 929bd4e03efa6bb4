// How stiff bone is, from its density in a CT: one Young's modulus a tetrahedron.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/tet_mesh.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline simulation {

/// Young's modulus E in MPa by density in g/cm3, as measured on specimens of bone.
/// morgan_2003: E = 6850 r^1.49, r apparent, femoral neck (E. Morgan, H. Bayraktar, T. Keaveny, J. Biomech. 36, 2003).
/// keller_1994: E = 10500 r^2.29, r of ash, femur (T. Keller, J. Biomech. 27, 1994).
/// carter_hayes_1977: E = 3790 s^0.06 r^3, r apparent, at a strain rate s of 0.01/s (D. Carter, W. Hayes, J. Bone Joint
/// Surg. 59-A, 1977). keyak_1998: of ash: 33900 r^2.20 up to 0.27, 5307 r + 469 up to 0.6, 10200 r^2.01 above (J. Keyak
/// et al., J. Biomech. 31, 1998). These were measured on long bones; none is of a skull.
enum class StiffnessLaw : int { morgan_2003, keller_1994, carter_hayes_1977, keyak_1998 };
[[nodiscard]] constexpr std::array<std::string_view, 4> enum_names(StiffnessLaw) {
  return {"morgan_2003", "keller_1994", "carter_hayes_1977", "keyak_1998"};
}

/// What bone weighs. apparent: as the laws' specimens, hydrated and without marrow. in_situ: with what fills its pores
/// in the body, 1.017 + 0.000592 HU g/cm3 from 100 HU on (W. Schneider, T. Bortfeld, W. Schlegel, Phys. Med. Biol. 45,
/// 2000), below on straight lines through water and air; the scanner's calibration has no say there.
enum class BoneWeight : int { apparent, in_situ };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(BoneWeight) {
  return {"apparent", "in_situ"};
}

struct BoneDensity {
  StiffnessLaw law = StiffnessLaw::morgan_2003;
  /// Mineral in g/cm3 at 1000 HU above that at 0 HU, and at 0 HU: the line of the scanner's calibration phantom.
  double per_1000_hu = 0.8, at_0_hu = 0;
  /// Density of ash from that of the phantom's mineral: (r + 0.09) / 1.14 (E. Schileo et al., J. Biomech. 41, 2008);
  /// else the same.
  bool ash_correction = true;
  BoneWeight weight = BoneWeight::apparent;
  double min_mpa = 1, max_mpa = 30'000;  ///< what comes out beyond is set to these
};

/// g/cm3; never below 0.
[[nodiscard]] double ash_density(double hu, const BoneDensity& density);
/// Of ash by 0.598 (Schileo 2008), g/cm3.
[[nodiscard]] double apparent_density(double hu, const BoneDensity& density);
/// g/cm3, by density.weight; never below 0.
[[nodiscard]] double weighed_density(double hu, const BoneDensity& density);
/// MPa, not limited; 0 where there is no mineral.
[[nodiscard]] double young_mpa(double hu, const BoneDensity& density);

struct BoneStiffness {
  std::vector<double> young_mpa;      ///< one a tetrahedron
  std::vector<float> hu;              ///< mean of each
  std::vector<double> density_kg_m3;  ///< of each, by BoneDensity::weight: the mean of its material, so that all weighs
                                      ///< as much as before
  double volume_mm3 = 0, mass_g = 0;
  std::size_t materials = 0;  ///< different moduli
  /// Share of the volume whose law gave less or more than the limits.
  double share_below = 0, share_above = 0;
  double share_outside =
      0;  ///< of the volume: more than half a voxel outside of the CT, where the values at its border were taken
};

/// The mean over each tetrahedron of the modulus at its places (not the modulus of the mean HU: F. Taddei et al., Med.
/// Eng. Phys. 29, 2007), sampled at most half a voxel apart, linear between voxel centres; then gathered into materials
/// `step` apart (0.02: 2 %), each with the mean of its tetrahedra by volume, so that the whole is as stiff as before;
/// 0: each its own. Error(usage): limits or density not finite, not positive, or in the wrong order; tetrahedra more
/// than half a voxel outside of the CT. O(volume in voxels), in parallel; same bytes for any thread count.
[[nodiscard]] BoneStiffness bone_stiffness(const TetMesh& mesh, const Image& ct, const BoneDensity& density,
                                           double step = 0.02, const Context& context = {});

}  // namespace osteo::inline simulation
