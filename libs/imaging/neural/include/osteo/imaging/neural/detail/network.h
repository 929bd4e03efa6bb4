// A U-Net of nnU-Net v2: plain or with a residual encoder, of two or three dimensions.
#pragma once
#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/imaging/neural/detail/checkpoint.h"

namespace osteo::inline imaging {

/// Three numbers of an array's axes, the slowest first. A flat network has 1 at the first.
using Axes = std::array<int, 3>;
[[nodiscard]] inline std::size_t voxels_of(const Axes& a) {
  return static_cast<std::size_t>(a[0]) * static_cast<std::size_t>(a[1]) * static_cast<std::size_t>(a[2]);
}

struct UnetStage {
  Axes kernel{3, 3, 3}, stride{1, 1, 1};  ///< kernels are odd, at most 7; strides 1 to 8
  int features = 0;                       ///< 1 to 4096
  int encoder_blocks = 0;                 ///< convolutions, or blocks of two
  int decoder_convolutions = 0;           ///< of the decoder at this stage; none at the last
};

struct UnetPlan {
  bool flat = false;      ///< of two dimensions
  bool residual = false;  ///< ResidualEncoderUNet
  bool batch_norm = false;
  bool conv_bias = true;
  double eps = 1e-5, slope = 0.01;
  int channels = 1, classes = 2;
  std::vector<UnetStage> stages;  ///< the finest first
};

struct NetworkSteps;

class Network {
 public:
  /// Weights by their names in the checkpoint. Error(corrupt) for one that is missing or of another shape.
  Network(const UnetPlan& plan, const Checkpoint& checkpoint);
  explicit Network(NetworkSteps steps);
  ~Network();
  Network(Network&&) noexcept;
  Network& operator=(Network&&) noexcept;

  /// Logits, class by class, of channels by `size` inputs. Each axis of `size` is a multiple of the product of its
  /// strides. Not for several threads at once; context.threads are used inside, and cancel is asked between layers.
  void run(std::span<const float> input, const Axes& size, std::span<float> logits, const Context& context);
  /// Bytes that a run of this size holds besides input and logits, and of the weights, twice: as read, and as used.
  [[nodiscard]] std::size_t bytes(const Axes& size);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteo::inline imaging
