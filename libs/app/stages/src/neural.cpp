#include "neural.h"

#include "agreement.h"
#include "osteo/imaging/image/structures.h"
#include "segment.h"

namespace osteo::inline app {

StageInfo SegmentNetworkStage::info() {
  return {.name = "segment-network",
          .version = 4,
          .synopsis = "a label map by a trained network: an nnU-Net v2 folder, without Python",
          .description =
              "Reads the folder that nnU-Net v2 leaves of a training (plans.json, dataset.json, "
              "fold_*/checkpoint_final.pth), or one with an ONNX file and network.json, and runs it over the CT on "
              "this machine's processor: PlainConvUNet and "
              "ResidualEncoderUNet, 2d, 3d and cascades, labels or regions, folds and mirrored passes averaged. No "
              "code runs from a checkpoint. Memory is known before the first window. Structures of an ear are held "
              "against what 'find-structures' finds of them: where they differ it is said by name and place, and "
              "doubted. The result is a proposal to be looked at: "
              "docs/how-to/segment-network.md says what may not be concluded from it.",
          .inputs = {{"image", {DataKind::image}, "CT in HU, lying in memory as the training's images did"},
                     {"model",
                      {DataKind::source},
                      "nnU-Net's folder of one trained configuration, or one with network.json and an ONNX file"}},
          .outputs = {{"structures", {DataKind::labels}, "label map with the names of dataset.json"},
                      {"uncertainty",
                       {DataKind::labels},
                       "boundaries by how far they may be off: 1 to 0.3 mm, 2 to 0.6 mm, 3 to 1.2 mm, 4 more; wants a "
                       "calibration.json in the model's folder",
                       true}},
          .references = {"F. Isensee et al., nnU-Net: a self-configuring method for deep learning-based biomedical "
                         "image segmentation, Nat. Methods 18, 2021"},
          .example = "osteo segment-network ct.nrrd nnUNetTrainer__nnUNetPlans__3d_fullres labels.seg.nrrd"};
}

std::vector<Data> SegmentNetworkStage::run(const Params& params, std::span<const Data> inputs, const Context& context) {
  const auto& ct = std::get<Image>(inputs[0]);
  NetworkLabels found = segment_with_network(ct, std::get<Source>(inputs[1]).path, params, context.sub(0, 0.85));
  join_with_exact(ct, found, context.sub(0.85, 1));
  for (Structure& s : found.structures.structures) s.origin = origin_of(info());
  Labels named = name_structures(found.structures, {}, nullptr, context);
  for (Structure& s : named.structures) {
    if (const std::string why = implausible_shape(named, s); !why.empty())
      s.doubt += (s.doubt.empty() ? "" : "; ") + why;
  }
  std::vector<Data> out{std::move(named), {}};
  out[1] = std::move(found.uncertainty);
  return out;
}

}  // namespace osteo::inline app
