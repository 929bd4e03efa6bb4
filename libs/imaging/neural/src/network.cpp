#include "osteo/imaging/neural/detail/network.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <new>
#include <string>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/imaging/neural/detail/conv_kernel.h"

namespace osteo::inline imaging {
namespace {

constexpr int kRowsOfTask = 16;

int blocks_of(int channels) {
  return (channels + kChannels - 1) / kChannels;
}

struct Freed {
  void operator()(float* p) const { ::operator delete[](p, std::align_val_t{64}); }
};
using Floats = std::unique_ptr<float[], Freed>;

// Features in blocks of 16 channels, or of 1 (what goes in), with a border of zeros around each that no layer writes.
struct Features {
  int channels = 0, lanes = kChannels;
  Axes size{}, border{};
  Floats values;

  [[nodiscard]] int blocks() const { return (channels + lanes - 1) / lanes; }
  [[nodiscard]] std::ptrdiff_t row() const { return static_cast<std::ptrdiff_t>(size[2] + 2 * border[2]) * lanes; }
  [[nodiscard]] std::ptrdiff_t plane() const { return row() * (size[1] + 2 * border[1]); }
  [[nodiscard]] std::ptrdiff_t block() const { return plane() * (size[0] + 2 * border[0]); }
  [[nodiscard]] std::size_t count() const {
    return static_cast<std::size_t>(block()) * static_cast<std::size_t>(blocks());
  }
  [[nodiscard]] float* at(int b, int z, int y, int x) const {
    return values.get() + b * block() + (z + border[0]) * plane() + (y + border[1]) * row() +
           static_cast<std::ptrdiff_t>(x + border[2]) * lanes;
  }
};

using Held = std::shared_ptr<Features>;

struct Convolution {
  int in = 0, out = 0;
  Axes kernel{}, stride{};
  std::vector<int> blocks;     // channels of each block of inputs, in order
  std::vector<float> weights;  // output block, input block, z, y, x, channel, 16 outputs
  std::vector<float> bias;     // of whole blocks

  [[nodiscard]] std::ptrdiff_t taps() const { return std::ptrdiff_t{1} * kernel[0] * kernel[1] * kernel[2]; }
};

struct Norm {
  std::vector<float> weight, bias, mean, variance;  // of whole blocks; the last two of batches
};

struct Layer {
  Convolution convolution;
  Norm norm;
};

struct Block {  // of the residual encoder
  Layer first, second;
  bool pools = false, projects = false;
  Layer projection;
};

class Weights {
 public:
  Weights(const UnetPlan& plan, const Checkpoint& checkpoint) : plan_(plan), checkpoint_(checkpoint) {}

  // `lanes`: channels of a block of what comes in.
  Convolution convolution(const std::string& name, const std::vector<int>& in, int out, Axes kernel, Axes stride,
                          bool biased, bool transposed = false, int lanes = kChannels) const {
    Convolution c;
    for (const int n : in) {
      c.in += n;
      for (int at = 0; at < n; at += lanes) c.blocks.push_back(std::min(lanes, n - at));
    }
    c.out = out;
    c.kernel = kernel;
    c.stride = stride;
    std::vector<std::int64_t> shape{transposed ? c.in : out, transposed ? out : c.in};
    for (int a = plan_.flat ? 1 : 0; a < 3; ++a) shape.push_back(kernel[static_cast<std::size_t>(a)]);
    const std::vector<float>& w = values(name + ".weight", shape);
    const auto taps = static_cast<std::size_t>(c.taps());
    const auto size_in = static_cast<std::size_t>(c.in), size_out = static_cast<std::size_t>(out);
    const std::size_t per_output = size_in * taps * kChannels;
    c.weights.assign(per_output * static_cast<std::size_t>(blocks_of(out)), 0.0F);
    for (std::size_t o = 0; o < size_out; ++o) {
      std::size_t channel = 0;
      for (const int n : c.blocks) {
        const auto size = static_cast<std::size_t>(n);
        float* const to = c.weights.data() + o / kChannels * per_output + channel * taps * kChannels;
        for (std::size_t i = 0; i < size; ++i) {
          const std::size_t from = transposed ? (channel + i) * size_out + o : o * size_in + channel + i;
          for (std::size_t t = 0; t < taps; ++t) to[(t * size + i) * kChannels + o % kChannels] = w[from * taps + t];
        }
        channel += size;
      }
    }
    c.bias = biased ? vector(name + ".bias", out) : std::vector<float>(whole(out), 0.0F);
    return c;
  }

  Layer layer(const std::string& name, const std::vector<int>& in, int out, Axes kernel, Axes stride, bool biased,
              int lanes = kChannels) const {
    Layer l;
    l.convolution = convolution(name + ".conv", in, out, kernel, stride, biased, false, lanes);
    l.norm.weight = vector(name + ".norm.weight", out);
    l.norm.bias = vector(name + ".norm.bias", out);
    if (plan_.batch_norm) {
      l.norm.mean = vector(name + ".norm.running_mean", out);
      l.norm.variance = vector(name + ".norm.running_var", out);
    }
    return l;
  }

 private:
  static std::size_t whole(int channels) { return static_cast<std::size_t>(blocks_of(channels) * kChannels); }

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
};

}  // namespace

struct Network::Impl {
  UnetPlan plan;
  Axes border{};
  std::vector<std::vector<Layer>> encoder;  // plain
  Layer stem;                               // residual
  std::vector<std::vector<Block>> residual;
  std::vector<Convolution> up;  // from stage s + 1 to s
  std::vector<std::vector<Layer>> decoder;
  Convolution last;
  std::size_t weight_bytes = 0;

  // Features that are free, by their number of channels and size: their borders are zero still.
  struct Key {
    int channels, lanes;
    Axes size;
    auto operator<=>(const Key&) const = default;
  };
  std::multimap<Key, std::unique_ptr<Features>> free;
  std::size_t held = 0;   // bytes
  bool counting = false;  // only what a run would hold
  const Context* context = nullptr;
  const ConvKernel& kernel = conv_kernel();

  // Goes back to the free ones when nobody has it any more.
  Held take(int channels, const Axes& size, int lanes = kChannels) {
    const Key key{channels, lanes, size};
    std::unique_ptr<Features> f;
    if (const auto it = free.find(key); it != free.end()) {
      f = std::move(it->second);
      free.erase(it);
    } else {
      f = std::make_unique<Features>();
      f->channels = channels;
      f->lanes = lanes;
      f->size = size;
      f->border = border;
      held += f->count() * sizeof(float);
      if (!counting) {
        f->values.reset(static_cast<float*>(::operator new[](f->count() * sizeof(float), std::align_val_t{64})));
        std::fill_n(f->values.get(), f->count(), 0.0F);
      }
    }
    return {f.release(), [this, key](Features* done) { free.emplace(key, std::unique_ptr<Features>(done)); }};
  }

  // Tasks of outputs: two blocks, one plane, some rows. Within one, blocks of inputs come in order.
  template <class Body>
  void for_rows(int out_blocks, const Axes& size, const Body& body) const {
    const auto pairs = static_cast<std::size_t>((out_blocks + 1) / 2), planes = static_cast<std::size_t>(size[0]),
               parts = static_cast<std::size_t>((size[1] + kRowsOfTask - 1) / kRowsOfTask);
    parallel_for(pairs * planes * parts, 1, context->threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t task = begin; task < end; ++task) {
        const int y = static_cast<int>(task % parts) * kRowsOfTask;
        body(static_cast<int>(task / parts / planes) * 2, static_cast<int>(task / parts % planes), y,
             std::min(size[1], y + kRowsOfTask));
      }
    });
  }

  Held convolve(const Convolution& c, std::initializer_list<const Features*> inputs) {
    const Features& first = **inputs.begin();
    Axes size{};
    for (std::size_t a = 0; a < 3; ++a) size[a] = (first.size[a] - 1) / c.stride[a] + 1;
    Held held_out = take(c.out, size);
    Features& out = *held_out;
    if (counting) return held_out;
    context->check_cancelled();
    const std::ptrdiff_t per_output = c.in * c.taps() * kChannels;
    for_rows(out.blocks(), size, [&](int b, int z, int y0, int y1) {
      const bool pair = b + 1 < out.blocks();
      std::ptrdiff_t channel = 0;
      std::size_t number = 0;
      for (const Features* in : inputs) {
        ConvRow r;
        r.in_step = static_cast<std::ptrdiff_t>(c.stride[2]) * in->lanes;
        r.in_pixel = in->lanes;
        r.in_row = in->row();
        r.in_plane = in->plane();
        for (std::size_t a = 0; a < 3; ++a) r.kernel[a] = c.kernel[a];
        r.out_step = kChannels;
        r.width = size[2];
        for (int i = 0; i < in->blocks(); ++i, ++number) {
          r.channels = c.blocks[number];
          for (int k = 0; k < (pair ? 2 : 1); ++k) {
            r.weights[k] = c.weights.data() + (b + k) * per_output + channel * c.taps() * kChannels;
            r.start[k] = channel == 0 ? c.bias.data() + static_cast<std::ptrdiff_t>(b + k) * kChannels : nullptr;
          }
          for (int y = y0; y < y1; ++y) {
            r.in = in->at(i, z * c.stride[0] - c.kernel[0] / 2, y * c.stride[1] - c.kernel[1] / 2, -(c.kernel[2] / 2));
            for (int k = 0; k < (pair ? 2 : 1); ++k) r.out[k] = out.at(b + k, z, y, 0);
            kernel.row(r);
          }
          channel += r.channels;
        }
      }
    });
    return held_out;
  }

  // Kernel and stride are one: each output has one input.
  Held convolve_up(const Convolution& c, const Features& in) {
    Axes size{};
    for (std::size_t a = 0; a < 3; ++a) size[a] = in.size[a] * c.stride[a];
    Held held_out = take(c.out, size);
    Features& out = *held_out;
    if (counting) return held_out;
    context->check_cancelled();
    const std::ptrdiff_t per_output = c.in * c.taps() * kChannels;
    for_rows(out.blocks(), in.size, [&](int b, int z, int y0, int y1) {
      const bool pair = b + 1 < out.blocks();
      for (int tap = 0; tap < c.taps(); ++tap) {
        const int kz = tap / (c.kernel[1] * c.kernel[2]), ky = tap / c.kernel[2] % c.kernel[1], kx = tap % c.kernel[2];
        std::ptrdiff_t channel = 0;
        for (int i = 0; i < in.blocks(); ++i) {
          ConvRow r;
          r.channels = c.blocks[static_cast<std::size_t>(i)];
          r.in_step = kChannels;
          r.out_step = static_cast<std::ptrdiff_t>(c.stride[2]) * kChannels;
          r.width = in.size[2];
          for (int k = 0; k < (pair ? 2 : 1); ++k) {
            r.weights[k] =
                c.weights.data() + (b + k) * per_output + (channel * c.taps() + tap * r.channels) * kChannels;
            r.start[k] = i == 0 ? c.bias.data() + static_cast<std::ptrdiff_t>(b + k) * kChannels : nullptr;
          }
          for (int y = y0; y < y1; ++y) {
            r.in = in.at(i, z, y, 0);
            for (int k = 0; k < (pair ? 2 : 1); ++k)
              r.out[k] = out.at(b + k, z * c.stride[0] + kz, y * c.stride[1] + ky, kx);
            kernel.row(r);
          }
          channel += r.channels;
        }
      }
    });
    return held_out;
  }

  // In place. Sums of a channel: rows in float, planes and the whole in double, in order.
  void normalise(Features& f, const Norm& n, const Features* add, float slope) const {
    if (counting) return;
    const auto planes = static_cast<std::size_t>(f.size[0]);
    parallel_for(static_cast<std::size_t>(f.blocks()), 1, context->threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t at = begin; at < end; ++at) {
        const int b = static_cast<int>(at);
        const std::size_t first = at * kChannels;
        float scale[kChannels], shift[kChannels];
        if (plan.batch_norm) {
          for (std::size_t c = 0; c < kChannels; ++c) {
            const double by = n.weight[first + c] / std::sqrt(static_cast<double>(n.variance[first + c]) + plan.eps);
            scale[c] = static_cast<float>(by);
            shift[c] = static_cast<float>(n.bias[first + c] - n.mean[first + c] * by);
          }
        } else {
          const double count = static_cast<double>(planes) * f.size[1] * f.size[2];
          double sums[2][kChannels] = {};
          float mean[kChannels];
          for (int pass = 0; pass < 2; ++pass) {
            for (int z = 0; z < f.size[0]; ++z) {
              for (int y = 0; y < f.size[1]; ++y)
                kernel.sum(f.at(b, z, y, 0), f.size[2], pass == 0 ? nullptr : mean, sums[pass]);
            }
            if (pass == 0) {
              for (std::size_t c = 0; c < kChannels; ++c) mean[c] = static_cast<float>(sums[0][c] / count);
            }
          }
          for (std::size_t c = 0; c < kChannels; ++c) {
            const double by = n.weight[first + c] / std::sqrt(sums[1][c] / count + plan.eps);
            scale[c] = static_cast<float>(by);
            shift[c] = static_cast<float>(n.bias[first + c] - mean[c] * by);
          }
        }
        for (int z = 0; z < f.size[0]; ++z) {
          for (int y = 0; y < f.size[1]; ++y) {
            kernel.scale(f.at(b, z, y, 0), f.size[2], scale, shift, add != nullptr ? add->at(b, z, y, 0) : nullptr,
                         slope);
          }
        }
      }
    });
  }

  Held apply(const Layer& l, std::initializer_list<const Features*> inputs, const Features* add, bool bends) {
    Held f = convolve(l.convolution, inputs);
    normalise(*f, l.norm, add, bends ? static_cast<float>(plan.slope) : 1.0F);
    return f;
  }

  // Means over what a stride covers.
  Held pool(const Features& in, const Axes& stride) {
    Axes size{};
    for (std::size_t a = 0; a < 3; ++a) size[a] = in.size[a] / stride[a];
    Held held_out = take(in.channels, size);
    Features& out = *held_out;
    if (counting) return held_out;
    const auto covered = static_cast<float>(stride[0] * stride[1] * stride[2]);
    for_rows(out.blocks(), size, [&](int b0, int z, int y0, int y1) {
      for (int b = b0; b < std::min(b0 + 2, out.blocks()); ++b) {
        for (int y = y0; y < y1; ++y) {
          for (int x = 0; x < size[2]; ++x) {
            float sum[kChannels] = {};
            for (int k = 0; k < stride[0] * stride[1] * stride[2]; ++k) {
              const float* const from = in.at(b, z * stride[0] + k / (stride[1] * stride[2]),
                                              y * stride[1] + k / stride[2] % stride[1], x * stride[2] + k % stride[2]);
              for (int c = 0; c < kChannels; ++c) sum[c] += from[c];
            }
            float* const to = out.at(b, z, y, x);
            for (int c = 0; c < kChannels; ++c) to[c] = sum[c] / covered;
          }
        }
      }
    });
    return held_out;
  }

  Held apply(const Block& block, const Held& in, const Axes& stride) {
    Held middle = apply(block.first, {in.get()}, nullptr, true);
    Held skip = block.pools ? pool(*in, stride) : in;
    if (block.projects) skip = apply(block.projection, {skip.get()}, nullptr, false);
    return apply(block.second, {middle.get()}, skip.get(), true);
  }

  Held pass(Held x) {
    std::vector<Held> skips;
    const std::size_t count = plan.stages.size();
    if (plan.residual) x = apply(stem, {x.get()}, nullptr, true);
    for (std::size_t s = 0; s < count; ++s) {
      if (plan.residual) {
        for (std::size_t n = 0; n < residual[s].size(); ++n)
          x = apply(residual[s][n], x, n == 0 ? plan.stages[s].stride : Axes{1, 1, 1});
      } else {
        for (const Layer& l : encoder[s]) x = apply(l, {x.get()}, nullptr, true);
      }
      if (s + 1 < count) skips.push_back(x);
    }
    for (std::size_t s = count - 1; s-- > 0;) {
      x = convolve_up(up[s], *x);
      for (std::size_t n = 0; n < decoder[s].size(); ++n) {
        x = n == 0 ? apply(decoder[s][n], {x.get(), skips[s].get()}, nullptr, true)
                   : apply(decoder[s][n], {x.get()}, nullptr, true);
        if (n == 0) skips[s].reset();
      }
    }
    return convolve(last, {x.get()});
  }
};

Network::Network(const UnetPlan& plan, const Checkpoint& checkpoint) : impl_(std::make_unique<Impl>()) {
  Impl& m = *impl_;
  m.plan = plan;
  const Weights weights(m.plan, checkpoint);
  const std::size_t count = plan.stages.size();
  const auto number = [](std::size_t n) { return std::to_string(n); };
  for (const UnetStage& s : plan.stages) {
    for (std::size_t a = 0; a < 3; ++a) m.border[a] = std::max(m.border[a], s.kernel[a] / 2);
  }
  const Axes one{1, 1, 1};
  int channels = plan.channels;
  if (plan.residual) {
    const UnetStage& s = plan.stages[0];
    m.stem = weights.layer("encoder.stem.convs.0", {channels}, s.features, s.kernel, one, plan.conv_bias, 1);
    channels = s.features;
  }
  for (std::size_t n = 0; n < count; ++n) {
    const UnetStage& s = plan.stages[n];
    if (plan.residual) m.residual.emplace_back();
    if (!plan.residual) m.encoder.emplace_back();
    for (int b = 0; b < s.encoder_blocks; ++b) {
      const Axes stride = b == 0 ? s.stride : one;
      if (!plan.residual) {
        m.encoder[n].push_back(weights.layer("encoder.stages." + number(n) + ".0.convs." + std::to_string(b),
                                             {channels}, s.features, s.kernel, stride, plan.conv_bias,
                                             n + static_cast<std::size_t>(b) == 0 ? 1 : kChannels));
      } else {
        const std::string name = "encoder.stages." + number(n) + ".blocks." + std::to_string(b);
        Block block;
        block.first = weights.layer(name + ".conv1", {channels}, s.features, s.kernel, stride, plan.conv_bias);
        block.second = weights.layer(name + ".conv2", {s.features}, s.features, s.kernel, one, plan.conv_bias);
        block.pools = stride != one;
        block.projects = channels != s.features;
        if (block.projects)
          block.projection =
              weights.layer(name + (block.pools ? ".skip.1" : ".skip.0"), {channels}, s.features, one, one, false);
        m.residual[n].push_back(std::move(block));
      }
      channels = s.features;
    }
  }
  m.up.resize(count - 1);
  m.decoder.resize(count - 1);
  for (std::size_t n = count - 1; n-- > 0;) {
    const UnetStage& s = plan.stages[n];
    const std::string at = number(count - 2 - n);  // decoders are counted from the coarsest
    const Axes stride = plan.stages[n + 1].stride;
    m.up[n] =
        weights.convolution("decoder.transpconvs." + at, {channels}, s.features, stride, stride, plan.conv_bias, true);
    for (int c = 0; c < s.decoder_convolutions; ++c) {
      m.decoder[n].push_back(
          weights.layer("decoder.stages." + at + ".convs." + std::to_string(c),
                        c == 0 ? std::vector<int>{s.features, s.features} : std::vector<int>{s.features}, s.features,
                        s.kernel, one, plan.conv_bias));
    }
    channels = s.features;
  }
  m.last = weights.convolution("decoder.seg_layers." + number(count - 2), {channels}, plan.classes, one, one, true);
  for (const auto& [name, tensor] : checkpoint.weights) m.weight_bytes += tensor.values.size() * sizeof(float);
}

Network::~Network() = default;
Network::Network(Network&&) noexcept = default;
Network& Network::operator=(Network&&) noexcept = default;

void Network::run(std::span<const float> input, const Axes& size, std::span<float> logits, const Context& context) {
  Impl& m = *impl_;
  m.context = &context;
  Held in = m.take(m.plan.channels, size, 1);
  std::size_t from = 0;
  for (int c = 0; c < m.plan.channels; ++c) {
    for (int z = 0; z < size[0]; ++z) {
      for (int y = 0; y < size[1]; ++y, from += static_cast<std::size_t>(size[2]))
        std::copy_n(input.begin() + static_cast<std::ptrdiff_t>(from), size[2], in->at(c, z, y, 0));
    }
  }
  const Held out = m.pass(std::move(in));
  std::size_t to = 0;
  for (int c = 0; c < m.plan.classes; ++c) {
    for (int z = 0; z < size[0]; ++z) {
      for (int y = 0; y < size[1]; ++y) {
        const float* const row = out->at(c / kChannels, z, y, 0) + c % kChannels;
        for (int x = 0; x < size[2]; ++x) logits[to++] = row[static_cast<std::ptrdiff_t>(x) * kChannels];
      }
    }
  }
}

std::size_t Network::bytes(const Axes& size) {
  Impl& m = *impl_;
  m.free.clear();
  m.held = 0;
  m.counting = true;
  m.pass(m.take(m.plan.channels, size, 1)).reset();
  m.counting = false;
  m.free.clear();
  const std::size_t run = m.held;
  m.held = 0;
  return run + 2 * m.weight_bytes;
}

}  // namespace osteo::inline imaging
