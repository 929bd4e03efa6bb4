// A label map from a CT by a trained network: an nnU-Net v2 result folder as it is, or an ONNX file; without Python.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/vec.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline imaging {

struct NetworkParams {
  std::vector<int> folds;    ///< which are averaged; empty: all that the folder has
  bool mirror = true;        ///< average over mirrored passes, along the axes that the training allowed
  double step = 0.5;         ///< windows overlap: a step is this part of a window; in (0, 1]
  double max_memory_gb = 8;  ///< 10^9 bytes; what is needed is known before the first window
};

struct NetworkLabels {
  Labels structures;   ///< in the CT's frame, with the names of dataset.json, and what is known of their certainty
  Labels uncertainty;  ///< at their boundaries: within how many mm they lie, in classes that are named; empty where
                       ///< the model's folder has no calibration of boundaries, or the network has regions
};

/// Whether the folder holds a model that segment_with_network() takes, by the names of its files.
[[nodiscard]] bool is_network_folder(const std::filesystem::path& folder);

/// A stretch of a structure's boundary that is in the last class of uncertainty.
struct UncertainPlace {
  Vec3 at_mm;  ///< a voxel of it, the nearest to its middle
  std::uint8_t structure = 0;
  std::size_t voxels = 0;  ///< that touch each other, also by a corner
};
/// The largest first, at most `most`, each of at least 4 voxels. Both maps in one frame: Error(usage) otherwise.
[[nodiscard]] std::vector<UncertainPlace> uncertain_places(const Labels& structures, const Labels& uncertainty,
                                                           std::size_t most);

/// Runs the network of `model` (plans.json, dataset.json, fold_*/checkpoint_final.pth; or network.json and an ONNX
/// file, docs/how-to/segment-network.md) over `ct`, which must be in HU and lie in memory as the training's images did:
/// nothing is turned, except where the plans say so. Follows nnU-Net 2.x step by step, its 16-bit sums included: crop
/// to what is not zero, normalise, resample, windows weighted by a Gaussian, mirrored passes, folds averaged, logits
/// resampled, labels or regions. The second stage of a cascade runs its first stage before, whose folder lies beside it
/// under nnU-Net's name for it. With a calibration.json in the folder, structures say how far they may be trusted.
/// Reports windows, memory, voxels. Same bits for any number of threads and any width of vectors. Cost: one pass of the
/// network a window, mirrored pass and fold; memory: weights, one window's features, 2 bytes a voxel and class of the
/// resampled grid. Errors: no_input (no such folder or file), corrupt (damaged, or of a kind that is not supported,
/// named), usage, resources (needs more than max_memory_gb), cancelled. F. Isensee et al., nnU-Net: a self-configuring
/// method ..., Nat. Methods 18, 2021.
[[nodiscard]] NetworkLabels segment_with_network(const Image& ct, const std::filesystem::path& model,
                                                 const NetworkParams& params = {}, const Context& context = {});

}  // namespace osteo::inline imaging
