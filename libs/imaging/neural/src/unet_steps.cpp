// The steps of nnU-Net's networks, from their plans and the weights of a checkpoint.
#include <string>

#include "network_steps.h"
#include "osteo/core/base/error.h"

namespace osteo::inline imaging {
namespace {

constexpr Axes kOne{1, 1, 1};

std::size_t whole(int channels) {
  return static_cast<std::size_t>(blocks_of(channels) * kChannels);
}

// Adds steps; each returns the value that it makes.
class Builder {
 public:
  Builder(const UnetPlan& plan, const Checkpoint& checkpoint) : plan_(plan), checkpoint_(checkpoint) {
    made_.channels = plan.channels;
    for (const auto& [name, tensor] : checkpoint.weights) made_.weight_bytes += tensor.values.size() * sizeof(float);
  }

  // Channels of each value that comes in.
  using In = std::vector<std::pair<int, int>>;

  int layer(const std::string& name, const In& in, int out, Axes kernel, Axes stride, bool biased, bool bends = true,
            int add = -1) {
    Step s;
    s.convolution = convolution(name + ".conv", in, out, kernel, stride, biased, false);
    s.norm.kind = plan_.batch_norm ? Norm::Kind::batch : Norm::Kind::instance;
    s.norm.eps = plan_.eps;
    s.norm.weight = vector(name + ".norm.weight", out);
    s.norm.bias = vector(name + ".norm.bias", out);
    if (plan_.batch_norm) {
      s.norm.mean = vector(name + ".norm.running_mean", out);
      s.norm.variance = vector(name + ".norm.running_var", out);
    }
    s.add = add;
    s.slope = bends ? static_cast<float>(plan_.slope) : 1.0F;
    return put(std::move(s), in);
  }

  int plain(const std::string& name, const In& in, int out, Axes kernel, Axes stride, bool biased, bool transposed) {
    Step s;
    s.kind = transposed ? Step::Kind::transposed : Step::Kind::convolution;
    s.convolution = convolution(name, in, out, kernel, stride, biased, transposed);
    return put(std::move(s), in);
  }

  int pool(int value, const Axes& stride) {
    Step s;
    s.kind = Step::Kind::pool;
    s.stride = stride;
    return put(std::move(s), {{value, 0}});
  }

  NetworkSteps take(int result) {
    made_.result = result;
    return std::move(made_);
  }

 private:
  int put(Step s, const In& in) {
    for (const auto& [value, channels] : in) s.in.push_back(value);
    made_.steps.push_back(std::move(s));
    return static_cast<int>(made_.steps.size());
  }

  Convolution convolution(const std::string& name, const In& in, int out, Axes kernel, Axes stride, bool biased,
                          bool transposed) const {
    std::vector<int> channels;
    int all = 0;
    for (const auto& [value, n] : in) {
      channels.push_back(n);
      all += n;
    }
    std::vector<std::int64_t> shape{transposed ? all : out, transposed ? out : all};
    for (int a = plan_.flat ? 1 : 0; a < 3; ++a) shape.push_back(kernel[static_cast<std::size_t>(a)]);
    return packed_convolution(values(name + ".weight", shape),
                              biased ? std::span<const float>(values(name + ".bias", {out})) : std::span<const float>(),
                              channels, out, kernel, stride, transposed, in[0].first == 0 ? 1 : kChannels);
  }

  const std::vector<float>& values(const std::string& name, const std::vector<std::int64_t>& shape) const {
    const auto it = checkpoint_.weights.find(name);
    if (it == checkpoint_.weights.end())
      throw Error(ExitCode::corrupt, "the checkpoint has no '" + name + "', which plans.json asks for",
                  "the checkpoint and plans.json must be of one training");
    if (it->second.shape != shape)
      throw Error(ExitCode::corrupt, "'" + name + "' of the checkpoint is not of the shape that plans.json asks for",
                  "the checkpoint and plans.json must be of one training");
    return it->second.values;
  }
  std::vector<float> vector(const std::string& name, int channels) const {
    std::vector<float> v = values(name, {channels});
    v.resize(whole(channels), 0.0F);
    return v;
  }

  const UnetPlan& plan_;
  const Checkpoint& checkpoint_;
  NetworkSteps made_;
};

// A block of the residual encoder: BasicBlockD of dynamic_network_architectures.
int block(Builder& b, const std::string& name, int in, int channels, const UnetStage& s, const Axes& stride,
          bool biased) {
  const int middle = b.layer(name + ".conv1", {{in, channels}}, s.features, s.kernel, stride, biased);
  const bool pools = stride != kOne;
  int skip = pools ? b.pool(in, stride) : in;
  if (channels != s.features)
    skip = b.layer(name + (pools ? ".skip.1" : ".skip.0"), {{skip, channels}}, s.features, kOne, kOne, false, false);
  return b.layer(name + ".conv2", {{middle, s.features}}, s.features, s.kernel, kOne, biased, true, skip);
}

}  // namespace

NetworkSteps unet_steps(const UnetPlan& plan, const Checkpoint& checkpoint) {
  Builder b(plan, checkpoint);
  const std::size_t count = plan.stages.size();
  const auto number = [](std::size_t n) { return std::to_string(n); };
  int channels = plan.channels, x = 0;
  if (plan.residual) {
    const UnetStage& s = plan.stages[0];
    x = b.layer("encoder.stem.convs.0", {{x, channels}}, s.features, s.kernel, kOne, plan.conv_bias);
    channels = s.features;
  }
  std::vector<int> skips;
  for (std::size_t n = 0; n < count; ++n) {
    const UnetStage& s = plan.stages[n];
    for (int at = 0; at < s.encoder_blocks; ++at) {
      const Axes stride = at == 0 ? s.stride : kOne;
      x = plan.residual ? block(b, "encoder.stages." + number(n) + ".blocks." + std::to_string(at), x, channels, s,
                                stride, plan.conv_bias)
                        : b.layer("encoder.stages." + number(n) + ".0.convs." + std::to_string(at), {{x, channels}},
                                  s.features, s.kernel, stride, plan.conv_bias);
      channels = s.features;
    }
    skips.push_back(x);
  }
  for (std::size_t n = count - 1; n-- > 0;) {
    const UnetStage& s = plan.stages[n];
    const std::string at = number(count - 2 - n);  // decoders are counted from the coarsest
    const Axes stride = plan.stages[n + 1].stride;
    x = b.plain("decoder.transpconvs." + at, {{x, channels}}, s.features, stride, stride, plan.conv_bias, true);
    for (int c = 0; c < s.decoder_convolutions; ++c) {
      Builder::In in{{x, s.features}};
      if (c == 0) in.emplace_back(skips[n], s.features);
      x = b.layer("decoder.stages." + at + ".convs." + std::to_string(c), in, s.features, s.kernel, kOne,
                  plan.conv_bias);
    }
    channels = s.features;
  }
  return b.take(
      b.plain("decoder.seg_layers." + number(count - 2), {{x, channels}}, plan.classes, kOne, kOne, true, false));
}

}  // namespace osteo::inline imaging
