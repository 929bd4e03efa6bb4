// A head with temporal bones whose every boundary is known exactly: the embedded default case and the truth of tests.
#pragma once
#include <cstdint>
#include <string_view>

#include "osteo/base/context.h"
#include "osteo/base/param.h"
#include "osteo/data/volume.h"

namespace osteo {

/// Label values of the phantom. Bone is `is_bone(label)`.
enum class Tissue : std::uint8_t {
  air = 0,
  soft = 1,
  cortical = 2,
  cellular = 3,
  mandible = 4,
  ossicle = 5,
  facial_nerve = 6,
  sigmoid_sinus = 7,
  left_marker = 8,  ///< a bead on the patient's left side only: tells left from right
};
inline constexpr int kTissueCount = 9;
[[nodiscard]] std::string_view tissue_name(Tissue tissue);
[[nodiscard]] double tissue_hu(Tissue tissue);
[[nodiscard]] constexpr bool is_bone(Tissue t) {
  return t == Tissue::cortical || t == Tissue::cellular || t == Tissue::mandible || t == Tissue::ossicle || t == Tissue::left_marker;
}

/// The exact tissue at a point; the head's centre is the origin. O(1), about 0.1 us.
[[nodiscard]] Tissue phantom_tissue(Vec3 lps_mm);

enum class PhantomRegion : int { head, temporal };
template <>
struct EnumNames<PhantomRegion> {
  static constexpr std::array<std::string_view, 2> values{"head", "temporal"};
};

struct PhantomParams {
  PhantomRegion region = PhantomRegion::head;
  double spacing_mm = 1.0;
  double slice_mm = 0;
  double noise_hu = 15;
};

struct Phantom {
  Image ct;             ///< mean HU over the voxel, the scanner's point spread (1 4 1)/6 along each axis, Gaussian noise
  Labels labels;        ///< exact tissue at the voxel centre
  double bone_mm3 = 0;  ///< by the same 27 samples a voxel
};
/// Same parameters and context.seed (of the noise), same bytes, for any number of threads.
[[nodiscard]] Phantom make_phantom(const PhantomParams& params, const Context& context = {});

}  // namespace osteo
