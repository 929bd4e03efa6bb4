#include "enhance.h"

namespace osteo::inline app {

StageInfo DenoiseStage::info() {
  return {.name = "denoise",
          .version = 1,
          .synopsis = "less noise in a CT, with what it costs stated",
          .description =
              "Non-local means in each slice: a pixel becomes the mean of pixels nearby whose surroundings look alike. "
              "It reports the noise of "
              "soft tissue and the width of edges before and after. Never done by default: thin, faint walls of bone "
              "that look like nothing "
              "else nearby can lose contrast. Values of metal and padding stay.",
          .inputs = {{"image", {DataKind::image}, "CT in HU"}},
          .outputs = {{"image", {DataKind::image}, "the CT with less noise"}},
          .references = {"A. Buades et al., A non-local algorithm for image denoising, CVPR 2005"},
          .example = "osteo denoise ct.nrrd quiet.nrrd --strength 0.7"};
}

std::vector<Data> DenoiseStage::run(const Params& params, std::span<const Data> inputs, const Context& context) {
  return {denoise(std::get<Image>(inputs[0]), params, context)};
}

StageInfo ReduceMetalStage::info() {
  return {
      .name = "reduce-metal",
      .version = 1,
      .synopsis = "streaks of metal weakened on the slices that hold it",
      .description =
          "Sums along all lines through the metal are filled in from the lines beside it, and the difference is "
          "projected back onto the "
          "slice. Metal itself and slices without it stay as they are. Never done by default: it starts from the "
          "picture, not from the "
          "scanner's raw data, so streaks are weakened, not gone, and bone in line with metal is blurred. 'threshold "
          "--metal-mm' clears "
          "streaks from the bone instead and changes no value.",
      .inputs = {{"image", {DataKind::image}, "CT in HU, slices as the scanner made them"}},
      .outputs = {{"image", {DataKind::image}, "the CT with weaker streaks"}},
      .references =
          {"W. Kalender et al., Reduction of CT artifacts caused by metallic implants, Radiology 1987",
           "E. Meyer et al., Normalized metal artifact reduction (NMAR) in computed tomography, Medical Physics 2010"},
      .example = "osteo reduce-metal ct.nrrd without-streaks.nrrd --metal-hu 2500"};
}

std::vector<Data> ReduceMetalStage::run(const Params& params, std::span<const Data> inputs, const Context& context) {
  return {reduce_metal(std::get<Image>(inputs[0]), params, context)};
}

}  // namespace osteo::inline app
