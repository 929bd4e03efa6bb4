// The parts of an ONNX file that a network is made of, as the file has them: protocol buffers, read by hand, since a
// graph and its weights are all that is wanted. https://onnx.ai/onnx/repo-docs/IR.html
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "osteo/imaging/neural/detail/checkpoint.h"

namespace osteo::inline imaging {

struct OnnxAttribute {
  double number = 0;                  // a float, or a whole number
  std::vector<std::int64_t> numbers;  // of a list
  std::string text;
  NetworkTensor tensor;
};

struct OnnxNode {
  std::string name, kind;  // "Conv"
  std::vector<std::string> inputs, outputs;
  std::map<std::string, OnnxAttribute> attributes;
};

struct OnnxGraph {
  std::vector<OnnxNode> nodes;  // each after those whose outputs it takes
  std::map<std::string, NetworkTensor> tensors;
  std::vector<std::string> inputs, outputs;  // without those that are tensors
};

/// Error(corrupt): what is damaged, or kept in a way that is not supported.
[[nodiscard]] OnnxGraph read_onnx_graph(std::span<const std::byte> file, const std::filesystem::path& beside);

}  // namespace osteo::inline imaging
