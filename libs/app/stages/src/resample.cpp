#include "osteo/geometry/grid/resample.h"

#include "bone.h"

namespace osteo::inline app {

StageInfo ResampleStage::info() {
  return {.name = "resample",
          .version = 6,
          .synopsis = "CT and bone mask to isotropic sparse bone density (OpenVDB)",
          .description =
              "Finds the bone boundary between the voxels of the CT and gives each output voxel the share of it that "
              "is bone. "
              "The volume of bone is kept and reported. Only voxels with bone are stored. Between slices that lie far "
              "apart the boundary "
              "follows "
              "their outlines (--between values: not, as before version 6); no detail is added that the slices do not "
              "show.",
          .inputs = {{"image", {DataKind::image}, "CT in HU"},
                     {"mask", {DataKind::labels}, "bone mask on the same voxels"}},
          .outputs = {{"bone", {DataKind::grid}, "bone density, 0 to 1"},
                      {"hu", {DataKind::grid}, "CT value in the voxels that hold bone", true}},
          .references = {"D. Morris, Haptics and Physical Simulation for Virtual Bone Surgery, 2006, section 3.2.1",
                         "R. Keys, Cubic Convolution Interpolation for Digital Image Processing, IEEE TASSP 1981",
                         "G. Herman et al., Shape-based interpolation, IEEE Computer Graphics and Applications 1992",
                         "K. Museth, VDB: High-Resolution Sparse Volumes with Dynamic Topology, ACM TOG 2013"},
          .example = "osteo resample ct.nrrd bone.nrrd bone.vdb --spacing-mm 0.5"};
}

std::vector<Data> ResampleStage::run(const Params& params, std::span<const Data> inputs, const Context& context) {
  ResampledBone bone = resample_bone(std::get<Image>(inputs[0]), std::get<Labels>(inputs[1]), params, context);
  return {bone.density, bone.hu};
}

}  // namespace osteo::inline app
