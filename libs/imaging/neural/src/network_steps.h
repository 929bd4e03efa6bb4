// What a network does, step by step: made of a U-Net's plan or of an ONNX graph, run by Network.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "osteo/imaging/neural/detail/conv_kernel.h"
#include "osteo/imaging/neural/detail/network.h"

namespace osteo::inline imaging {

inline int blocks_of(int channels) {
  return (channels + kChannels - 1) / kChannels;
}

struct Convolution {
  int in = 0, out = 0;
  Axes kernel{}, stride{};
  std::vector<int> blocks;     // channels of each block of inputs, in order
  std::vector<float> weights;  // output block, input block, z, y, x, channel, 16 outputs
  std::vector<float> bias;     // of whole blocks

  [[nodiscard]] std::ptrdiff_t taps() const { return std::ptrdiff_t{1} * kernel[0] * kernel[1] * kernel[2]; }
};

/// Weights as files have them: outputs (of a transposed one, inputs) slowest, then inputs, then taps. `in`: channels of
/// each input, which lie in blocks of `lanes`; `bias` may be empty.
[[nodiscard]] Convolution packed_convolution(std::span<const float> weights, std::span<const float> bias,
                                             const std::vector<int>& in, int out, Axes kernel, Axes stride,
                                             bool transposed = false, int lanes = kChannels);

struct Norm {
  enum class Kind { none, instance, batch } kind = Kind::none;
  std::vector<float> weight, bias, mean, variance;  // of whole blocks; the last two of batches
  double eps = 1e-5;
};

/// Makes one value of others: a convolution, or means over what a stride covers; then, in place, a norm, another value
/// added, and what is below zero times `slope`.
struct Step {
  enum class Kind { convolution, transposed, pool } kind = Kind::convolution;
  std::vector<int> in;  // values: 0 is the network's input, n + 1 what step n makes; a convolution takes several as one
  Convolution convolution;
  Axes stride{1, 1, 1};  // of a pool
  Norm norm;
  int add = -1;
  float slope = 1;
};

struct NetworkSteps {
  int channels = 1;  // of the input
  std::vector<Step> steps;
  int result = 0;  // a value
  std::size_t weight_bytes = 0;
};

[[nodiscard]] NetworkSteps unet_steps(const UnetPlan& plan, const Checkpoint& checkpoint);

}  // namespace osteo::inline imaging
