// A network over all windows of an image, with mirrored passes, in nnU-Net's 16-bit sums.
#pragma once
#include <algorithm>
#include <bit>
#include <cstdint>
#include <string>
#include <vector>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/imaging/neural/detail/half.h"
#include "osteo/imaging/neural/detail/model.h"
#include "osteo/imaging/neural/detail/windows.h"
#include "osteo/imaging/neural/segment_network.h"
#include "turned.h"

namespace osteo::inline imaging {

// Which axes are turned in each pass, as bits: none, each, each two, all.
inline std::vector<unsigned> mirrored_passes(const std::vector<int>& axes, bool flat) {
  std::vector<unsigned> passes{0};
  for (unsigned size = 1; size <= axes.size(); ++size) {
    // Subsets in order of their first member, then their second.
    std::vector<std::vector<std::size_t>> subsets;
    for (unsigned bits = 1; bits < 1U << axes.size(); ++bits) {
      if (std::popcount(bits) != static_cast<int>(size)) continue;
      std::vector<std::size_t> members;
      for (std::size_t i = 0; i < axes.size(); ++i) {
        if ((bits >> i & 1U) != 0) members.push_back(i);
      }
      subsets.push_back(members);
    }
    std::sort(subsets.begin(), subsets.end());
    for (const auto& members : subsets) {
      unsigned turned = 0;
      for (const std::size_t i : members) turned |= 1U << (axes[i] + (flat ? 1 : 0));
      passes.push_back(turned);
    }
  }
  return passes;
}

// One row of a window where axes are turned: its first value and the way to the next.
struct Row {
  std::size_t first = 0;
  std::ptrdiff_t step = 1;
};
inline Row turned_row(const Axes& size, int z, int y, unsigned turned) {
  const bool back = (turned & 4U) != 0;
  return {offset(size, (turned & 1U) != 0 ? size[0] - 1 - z : z, (turned & 2U) != 0 ? size[1] - 1 - y : y,
                 back ? size[2] - 1 : 0),
          back ? -1 : 1};
}

struct Window {
  Axes first{};
};

// Sums of one fold over all windows; `data` is padded to at least a window, and so are `labels`, what the stage before
// has found (of a cascade; else empty).
class Sliding {
 public:
  Sliding(const NetworkModel& model, const std::vector<float>& data, const std::vector<std::int16_t>& labels,
          const Axes& size, const NetworkParams& params)
      : model_(model),
        data_(data),
        labels_(labels),
        size_(size),
        weights_(window_weights(model.patch, model.unet.flat)) {
    std::array<std::vector<int>, 3> starts;
    for (std::size_t a = 0; a < 3; ++a) {
      if (a == 0 && model.unet.flat) {
        for (int z = 0; z < size[0]; ++z) starts[a].push_back(z);
      } else {
        starts[a] = window_starts(size[a], model.patch[a], params.step);
      }
    }
    for (const int z : starts[0])
      for (const int y : starts[1])
        for (const int x : starts[2]) windows_.push_back({{z, y, x}});
  }

  [[nodiscard]] std::size_t windows() const { return windows_.size(); }

  std::vector<std::uint16_t> run(Network& network, const std::vector<unsigned>& passes, const Context& context) const {
    const std::size_t voxels = voxels_of(size_), patch = voxels_of(model_.patch);
    const auto classes = static_cast<std::size_t>(model_.unet.classes);
    std::vector<std::uint16_t> sums(classes * voxels, 0), weight(voxels, 0);
    std::vector<float> input(static_cast<std::size_t>(model_.unet.channels) * patch), logits(classes * patch),
        sum(passes.size() > 1 ? classes * patch : 0);
    for (std::size_t w = 0; w < windows_.size(); ++w) {
      context.progress(static_cast<double>(w) / static_cast<double>(windows_.size()),
                       "window " + std::to_string(w + 1) + " of " + std::to_string(windows_.size()));
      const Axes& first = windows_[w].first;
      for (std::size_t p = 0; p < passes.size(); ++p) {
        cut(first, passes[p], input);
        network.run(input, model_.patch, logits, context);
        if (passes.size() > 1) add_turned(logits, passes[p], p == 0, sum, context);
      }
      std::vector<float>& mean = passes.size() > 1 ? sum : logits;
      if (passes.size() > 1) {
        const auto by = static_cast<float>(passes.size());
        for (float& v : mean) v /= by;
      }
      collect(mean, first, sums, weight, context);
    }
    bool finite = true;
    for (std::size_t c = 0; c < classes; ++c) {
      for (std::size_t v = 0; v < voxels; ++v) {
        std::uint16_t& s = sums[c * voxels + v];
        s = half_from_float(float_from_half(s) / float_from_half(weight[v]));
        finite = finite && (s & 0x7c00U) != 0x7c00U;
      }
    }
    if (!finite)
      throw Error(ExitCode::failed, "the network's output is beyond what 16-bit sums hold",
                  "is the image in HU, and of the kind that the network was trained with?");
    return sums;
  }

 private:
  void cut(const Axes& first, unsigned turned, std::vector<float>& input) const {
    const std::size_t patch = voxels_of(model_.patch);
    for (int z = 0; z < model_.patch[0]; ++z) {
      for (int y = 0; y < model_.patch[1]; ++y) {
        const std::size_t from = offset(size_, first[0] + z, first[1] + y, first[2]);
        const Row row = turned_row(model_.patch, z, y, turned);
        for (int x = 0; x < model_.patch[2]; ++x) {
          const std::size_t to = row.first + static_cast<std::size_t>(x * row.step);
          input[to] = data_[from + static_cast<std::size_t>(x)];
          for (std::size_t c = 0; c < model_.previous_labels.size(); ++c)
            input[(c + 1) * patch + to] =
                labels_[from + static_cast<std::size_t>(x)] == model_.previous_labels[c] ? 1.0F : 0.0F;
        }
      }
    }
  }

  template <class Body>
  void for_planes(const Context& context, const Body& body) const {
    const auto planes = static_cast<std::size_t>(model_.patch[0]);
    parallel_for(planes * static_cast<std::size_t>(model_.unet.classes), 1, context.threads,
                 [&](std::size_t begin, std::size_t end) {
                   for (std::size_t n = begin; n < end; ++n) body(n / planes, static_cast<int>(n % planes));
                 });
  }

  void add_turned(const std::vector<float>& logits, unsigned turned, bool begins, std::vector<float>& sum,
                  const Context& context) const {
    const std::size_t patch = voxels_of(model_.patch);
    for_planes(context, [&](std::size_t c, int z) {
      for (int y = 0; y < model_.patch[1]; ++y) {
        const Row row = turned_row(model_.patch, z, y, turned);
        float* const to = sum.data() + c * patch + offset(model_.patch, z, y, 0);
        const float* const from = logits.data() + c * patch + row.first;
        for (int x = 0; x < model_.patch[2]; ++x) to[x] = (begins ? 0.0F : to[x]) + from[x * row.step];
      }
    });
  }

  void collect(const std::vector<float>& mean, const Axes& first, std::vector<std::uint16_t>& sums,
               std::vector<std::uint16_t>& weight, const Context& context) const {
    const std::size_t patch = voxels_of(model_.patch), voxels = voxels_of(size_);
    for_planes(context, [&](std::size_t c, int z) {
      for (int y = 0; y < model_.patch[1]; ++y) {
        const std::size_t from = offset(model_.patch, z, y, 0),
                          to = offset(size_, first[0] + z, first[1] + y, first[2]);
        for (std::size_t x = 0; x < static_cast<std::size_t>(model_.patch[2]); ++x) {
          const float by = float_from_half(weights_[from + x]);
          std::uint16_t& s = sums[c * voxels + to + x];
          s = half_from_float(float_from_half(s) + mean[c * patch + from + x] * by);
          if (c == 0) {
            std::uint16_t& n = weight[to + x];
            n = half_from_float(float_from_half(n) + by);
          }
        }
      }
    });
  }

  const NetworkModel& model_;
  const std::vector<float>& data_;
  const std::vector<std::int16_t>& labels_;
  Axes size_;
  std::vector<std::uint16_t> weights_;
  std::vector<Window> windows_;
};

}  // namespace osteo::inline imaging
