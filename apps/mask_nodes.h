// Where in the pipeline of a case the CT and the mask are that people correct; for osteo and osteo-edit.
#pragma once
#include <algorithm>

#include "osteo/core/base/error.h"
#include "osteo/imaging/pipeline/pipeline.h"

namespace osteo {

struct MaskNodes {
  PipelineNode::Input image, mask;
};
/// What the stage that makes bone.vdb takes. Error(usage) for a pipeline without a mask.
[[nodiscard]] inline MaskNodes mask_nodes(const Pipeline& pipeline) {
  const auto makes_bone = [](const PipelineNode& n) {
    return n.stage == "resample" && n.inputs.contains("mask") && !n.inputs.at("mask").node.empty() &&
           n.inputs.contains("image");
  };
  auto bone = std::find_if(pipeline.nodes.begin(), pipeline.nodes.end(),
                           [&](const PipelineNode& n) { return n.id == "bone" && makes_bone(n); });
  if (bone == pipeline.nodes.end()) bone = std::find_if(pipeline.nodes.begin(), pipeline.nodes.end(), makes_bone);
  if (bone == pipeline.nodes.end()) {
    throw Error(ExitCode::usage, "the pipeline of this case has no mask that could be edited",
                "prepare the case with the built-in pipeline (--no-pipeline)");
  }
  return {bone->inputs.at("image"), bone->inputs.at("mask")};
}

}  // namespace osteo
