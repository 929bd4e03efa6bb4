// Networks in ONNX files, beside a network.json that says what they expect: the second way in, for what nnU-Net has not
// trained.
#pragma once
#include <cstddef>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/imaging/neural/detail/model.h"

namespace osteo::inline imaging {

/// What network.json says. Example and keys: docs/how-to/segment-network.md.
struct OnnxModel {
  NetworkModel network;  ///< without a U-Net's stages
  std::string file;      ///< of the graph, beside network.json
  std::vector<int> mirror_axes;
};
/// Error(corrupt) names the key that is missing, not known or out of range.
[[nodiscard]] OnnxModel read_onnx_model(std::string_view network_json);

/// The graph of a file: convolutions (odd kernels, padded by half), transposed ones (kernel as wide as its stride),
/// instance and batch norm, leaky ReLU and ReLU, sums, joins of what convolutions take, means over strides. `beside`:
/// where the weights lie that the file keeps outside of itself. Nothing in it is run; memory: at most four times the
/// bytes of both. Error(corrupt) names the operation that is not supported, or what is damaged. `classes` and `patch`
/// are what network.json says, and are checked.
[[nodiscard]] NetworkSteps read_onnx(std::span<const std::byte> file, const std::filesystem::path& beside, int classes,
                                     const Axes& patch);

}  // namespace osteo::inline imaging
