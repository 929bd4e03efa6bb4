// The logits of a network over a CT, and what is made of them.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "osteo/core/data/volume.h"
#include "osteo/imaging/neural/detail/model.h"
#include "osteo/imaging/neural/segment_network.h"

namespace osteo::inline imaging {

/// On the network's grid, whose axes are the image's after the transpose.
struct NetworkLogits {
  Axes size{}, cropped{}, first{};  ///< of the grid; of the image's part that is not zero, and its first voxel
  std::array<double, 3> image_mm{}, grid_mm{};
  std::vector<std::uint16_t> values;  ///< 16-bit numbers, class by class
};

/// The folder's folds, in order: numbers, or -1 for fold_all where there is no other.
[[nodiscard]] std::vector<int> network_folds(const std::filesystem::path& model);
/// Called with the model once it is known, before the first window.
using NetworkKnown = std::function<void(const NetworkModel& model)>;
[[nodiscard]] NetworkLogits network_logits(const Image& ct, const std::filesystem::path& folder, NetworkModel& model,
                                           const NetworkParams& params, const Context& context,
                                           const NetworkKnown& known = {});
[[nodiscard]] Labels labels_of_logits(const NetworkLogits& logits, const NetworkModel& model, const Frame& frame,
                                      const Context& context);

}  // namespace osteo::inline imaging
