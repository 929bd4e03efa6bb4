// A CT of a head whose every boundary is known exactly: the embedded default case and the truth of tests.
#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include "osteo/data/volume.h"
#include "osteo/image/head_anatomy.h"
#include "osteo/stage/stage.h"

namespace osteo {

enum class PhantomRegion : int { head, temporal, mandible };
template <>
struct EnumNames<PhantomRegion> {
  static constexpr std::array<std::string_view, 3> values{"head", "temporal", "mandible"};
};

struct PhantomParams {
  PhantomRegion region = PhantomRegion::head;
  double spacing_mm = 1.0;
  double slice_mm = 0;
  double noise_hu = 15;
  int individual = 0;
};

struct Phantom {
  Image ct;             ///< mean HU over the voxel, the scanner's point spread (1 4 1)/6 along each axis, Gaussian noise
  Labels labels;        ///< exact tissue at the voxel centre
  double bone_mm3 = 0;  ///< by the same 27 samples a voxel
};
/// A CT of `HeadAnatomy(params.individual)`. Same parameters and context.seed (of the noise), same bytes, for any number of threads.
/// Voxels that one tissue fills, which its margin tells, cost one sample for all of a block.
[[nodiscard]] Phantom make_phantom(const PhantomParams& params, const Context& context = {});

struct PhantomStage {
  using Params = PhantomParams;
  static void describe(Params& p, auto& visit) {
    visit({"region", "the whole head, a block around the left temporal bone, or the lower jaw with its joints"}, p.region);
    visit({"spacing_mm", "voxel size in the slice", "mm", 0.2, 4}, p.spacing_mm);
    visit({"slice_mm", "distance of slices (0: same as spacing_mm)", "mm", 0, 10}, p.slice_mm);
    visit({"noise_hu", "standard deviation of the noise", "HU", 0, 200}, p.noise_hu);
    visit({"individual", "whose head: 0 has mean sizes, another number varies them as people vary and places other air cells", "", 0,
           1000000},
          p.individual);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo
