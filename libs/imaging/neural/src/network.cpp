#include "osteo/imaging/neural/detail/network.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <new>
#include <string>

#include "network_steps.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"

namespace osteo::inline imaging {
namespace {

constexpr int kRowsOfTask = 16;

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

}  // namespace

Convolution packed_convolution(std::span<const float> weights, std::span<const float> bias, const std::vector<int>& in,
                               int out, Axes kernel, Axes stride, bool transposed, int lanes) {
  Convolution c;
  for (const int n : in) {
    c.in += n;
    for (int at = 0; at < n; at += lanes) c.blocks.push_back(std::min(lanes, n - at));
  }
  c.out = out;
  c.kernel = kernel;
  c.stride = stride;
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
        for (std::size_t t = 0; t < taps; ++t)
          to[(t * size + i) * kChannels + o % kChannels] = weights[from * taps + t];
      }
      channel += size;
    }
  }
  c.bias.assign(static_cast<std::size_t>(blocks_of(out) * kChannels), 0.0F);
  std::copy(bias.begin(), bias.end(), c.bias.begin());
  return c;
}

struct Network::Impl {
  NetworkSteps made;
  std::vector<std::size_t> last_use;  // of each value: the step after which it is free
  Axes border{};

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

  Held convolve(const Convolution& c, const std::vector<const Features*>& inputs) {
    const Features& first = *inputs.front();
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
    if (counting || (n.kind == Norm::Kind::none && add == nullptr && slope == 1)) return;
    const auto planes = static_cast<std::size_t>(f.size[0]);
    parallel_for(static_cast<std::size_t>(f.blocks()), 1, context->threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t at = begin; at < end; ++at) {
        const int b = static_cast<int>(at);
        const std::size_t first = at * kChannels;
        float scale[kChannels], shift[kChannels];
        if (n.kind == Norm::Kind::none) {
          std::fill_n(scale, kChannels, 1.0F);
          std::fill_n(shift, kChannels, 0.0F);
        } else if (n.kind == Norm::Kind::batch) {
          for (std::size_t c = 0; c < kChannels; ++c) {
            const double by = n.weight[first + c] / std::sqrt(static_cast<double>(n.variance[first + c]) + n.eps);
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
            const double by = n.weight[first + c] / std::sqrt(sums[1][c] / count + n.eps);
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

  Held pass(Held input) {
    std::vector<Held> values(made.steps.size() + 1);
    values[0] = std::move(input);
    for (std::size_t n = 0; n < made.steps.size(); ++n) {
      const Step& s = made.steps[n];
      const auto value = [&](int v) { return values[static_cast<std::size_t>(v)].get(); };
      std::vector<const Features*> in;
      for (const int v : s.in) in.push_back(value(v));
      Held& out = values[n + 1];
      out = s.kind == Step::Kind::convolution  ? convolve(s.convolution, in)
            : s.kind == Step::Kind::transposed ? convolve_up(s.convolution, *in[0])
                                               : pool(*in[0], s.stride);
      normalise(*out, s.norm, s.add < 0 ? nullptr : value(s.add), s.slope);
      for (std::size_t v = 0; v <= n; ++v)
        if (last_use[v] == n) values[v].reset();
    }
    return values[static_cast<std::size_t>(made.result)];
  }
};

Network::Network(const UnetPlan& plan, const Checkpoint& checkpoint) : Network(unet_steps(plan, checkpoint)) {}

Network::Network(NetworkSteps steps) : impl_(std::make_unique<Impl>()) {
  Impl& m = *impl_;
  m.made = std::move(steps);
  m.last_use.assign(m.made.steps.size() + 1, m.made.steps.size());
  for (std::size_t n = 0; n < m.made.steps.size(); ++n) {
    const Step& s = m.made.steps[n];
    for (const int v : s.in) m.last_use[static_cast<std::size_t>(v)] = n;
    if (s.add >= 0) m.last_use[static_cast<std::size_t>(s.add)] = n;
    if (s.kind != Step::Kind::convolution) continue;
    for (std::size_t a = 0; a < 3; ++a) m.border[a] = std::max(m.border[a], s.convolution.kernel[a] / 2);
  }
  m.last_use[static_cast<std::size_t>(m.made.result)] = m.made.steps.size();
}

Network::~Network() = default;
Network::Network(Network&&) noexcept = default;
Network& Network::operator=(Network&&) noexcept = default;

void Network::run(std::span<const float> input, const Axes& size, std::span<float> logits, const Context& context) {
  Impl& m = *impl_;
  m.context = &context;
  Held in = m.take(m.made.channels, size, 1);
  std::size_t from = 0;
  for (int c = 0; c < m.made.channels; ++c) {
    for (int z = 0; z < size[0]; ++z) {
      for (int y = 0; y < size[1]; ++y, from += static_cast<std::size_t>(size[2]))
        std::copy_n(input.begin() + static_cast<std::ptrdiff_t>(from), size[2], in->at(c, z, y, 0));
    }
  }
  const Held out = m.pass(std::move(in));
  std::size_t to = 0;
  for (int c = 0; c < out->channels; ++c) {
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
  m.pass(m.take(m.made.channels, size, 1)).reset();
  m.counting = false;
  m.free.clear();
  const std::size_t run = m.held;
  m.held = 0;
  return run + 2 * m.made.weight_bytes;
}

}  // namespace osteo::inline imaging
