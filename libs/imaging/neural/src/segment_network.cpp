#include "osteo/imaging/neural/segment_network.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/parallel.h"
#include "osteo/core/base/param.h"
#include "osteo/imaging/neural/detail/half.h"
#include "osteo/imaging/neural/detail/predict.h"
#include "osteo/imaging/neural/detail/trust.h"
#include "osteo/imaging/neural/detail/windows.h"

namespace osteo::inline imaging {
namespace {

std::size_t offset(const Axes& size, int z, int y, int x) {
  return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size[1]) + static_cast<std::size_t>(y)) *
             static_cast<std::size_t>(size[2]) +
         static_cast<std::size_t>(x);
}

fs::path fold_folder(const fs::path& model, int fold) {
  return model / (fold < 0 ? "fold_all" : "fold_" + std::to_string(fold));
}

// The image as the network's axes see it: axis a is the image's transpose[a] of z, y, x.
class Turned {
 public:
  Turned(const Frame& frame, const std::array<int, 3>& transpose) {
    const Axes dims{frame.dims[2], frame.dims[1], frame.dims[0]};
    const std::array<double, 3> mm{frame.spacing_mm.z, frame.spacing_mm.y, frame.spacing_mm.x};
    const std::array<std::size_t, 3> steps{
        static_cast<std::size_t>(frame.dims[0]) * static_cast<std::size_t>(frame.dims[1]),
        static_cast<std::size_t>(frame.dims[0]), 1};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto from = static_cast<std::size_t>(transpose[a]);
      size[a] = dims[from];
      spacing_mm[a] = mm[from];
      step_[a] = steps[from];
    }
  }
  [[nodiscard]] std::size_t at(int z, int y, int x) const {
    return static_cast<std::size_t>(z) * step_[0] + static_cast<std::size_t>(y) * step_[1] +
           static_cast<std::size_t>(x) * step_[2];
  }
  Axes size{};
  std::array<double, 3> spacing_mm{};

 private:
  std::array<std::size_t, 3> step_{};
};

void crop_to_content(const Image& ct, const Turned& turned, NetworkLogits& out) {
  Axes last{-1, -1, -1};
  out.first = turned.size;
  for (int z = 0; z < turned.size[0]; ++z) {
    for (int y = 0; y < turned.size[1]; ++y) {
      for (int x = 0; x < turned.size[2]; ++x) {
        if (ct.voxels[turned.at(z, y, x)] == 0) continue;
        const Axes n{z, y, x};
        for (std::size_t a = 0; a < 3; ++a) {
          out.first[a] = std::min(out.first[a], n[a]);
          last[a] = std::max(last[a], n[a]);
        }
      }
    }
  }
  if (last[0] < 0) throw Error(ExitCode::no_input, "the image is zero everywhere", "give a CT in HU");
  for (std::size_t a = 0; a < 3; ++a) out.cropped[a] = last[a] - out.first[a] + 1;
}

void normalise(std::vector<float>& values, const NetworkModel& model) {
  double mean = model.mean, deviation = model.deviation;
  if (model.normalisation == Normalisation::none) return;
  if (model.normalisation == Normalisation::ct) {
    const auto low = static_cast<float>(model.lower), high = static_cast<float>(model.upper);
    for (float& v : values) v = std::min(std::max(v, low), high);
  } else if (model.normalisation == Normalisation::z_score) {
    double sum = 0, squares = 0;
    for (const float v : values) sum += static_cast<double>(v);
    mean = sum / static_cast<double>(values.size());
    for (const float v : values) squares += (static_cast<double>(v) - mean) * (static_cast<double>(v) - mean);
    deviation = std::max(std::sqrt(squares / static_cast<double>(values.size())), 1e-8);
  } else {
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    mean = static_cast<double>(*low);
    deviation = std::max(static_cast<double>(*high) - mean, 1e-8);
  }
  const auto less = static_cast<float>(mean), by = static_cast<float>(deviation);
  for (float& v : values) v = (v - less) / by;
}

// Which axes are turned in each pass, as bits: none, each, each two, all.
std::vector<unsigned> mirrored_passes(const std::vector<int>& axes, bool flat) {
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
Row turned_row(const Axes& size, int z, int y, unsigned turned) {
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

template <class T>
std::vector<T> padded(const std::vector<T>& data, const Axes& size, const Axes& to, const Axes& before) {
  std::vector<T> out(voxels_of(to), T{0});
  for (int z = 0; z < size[0]; ++z) {
    for (int y = 0; y < size[1]; ++y)
      std::copy_n(data.begin() + static_cast<std::ptrdiff_t>(offset(size, z, y, 0)), size[2],
                  out.begin() + static_cast<std::ptrdiff_t>(offset(to, z + before[0], y + before[1], before[2])));
  }
  return out;
}

// Zeros from which a way of zeros leads out of the image: not image, but what was written around it.
std::vector<bool> outside_of(const Image& ct, const Turned& turned) {
  std::vector<bool> outside(voxels_of(turned.size), false);
  std::vector<Axes> open;
  const auto visit = [&](const Axes& n) {
    const std::size_t at = offset(turned.size, n[0], n[1], n[2]);
    if (outside[at] || ct.voxels[turned.at(n[0], n[1], n[2])] != 0) return;
    outside[at] = true;
    open.push_back(n);
  };
  for (int z = 0; z < turned.size[0]; ++z) {
    for (int y = 0; y < turned.size[1]; ++y) {
      const bool face = z == 0 || y == 0 || z == turned.size[0] - 1 || y == turned.size[1] - 1;
      const int step = face ? 1 : std::max(turned.size[2] - 1, 1);
      for (int x = 0; x < turned.size[2]; x += step) visit({z, y, x});
    }
  }
  while (!open.empty()) {
    const Axes n = open.back();
    open.pop_back();
    for (std::size_t a = 0; a < 3; ++a) {
      for (const int way : {-1, 1}) {
        Axes next = n;
        next[a] += way;
        if (next[a] >= 0 && next[a] < turned.size[a]) visit(next);
      }
    }
  }
  return outside;
}

// What the stage before has found, on this network's grid. -1 is what lies outside of the image.
std::vector<std::int16_t> previous_on_grid(const Image& ct, const Labels& found, const Turned& turned,
                                           const NetworkLogits& out, const Context& context) {
  const std::vector<bool> outside = outside_of(ct, turned);
  std::vector<std::int16_t> labels(voxels_of(out.cropped));
  for (int z = 0; z < out.cropped[0]; ++z) {
    for (int y = 0; y < out.cropped[1]; ++y) {
      for (int x = 0; x < out.cropped[2]; ++x) {
        const Axes n{z + out.first[0], y + out.first[1], x + out.first[2]};
        const int label = found.voxels[turned.at(n[0], n[1], n[2])];
        labels[offset(out.cropped, z, y, x)] =
            static_cast<std::int16_t>(label == 0 && outside[offset(turned.size, n[0], n[1], n[2])] ? -1 : label);
      }
    }
  }
  return resample_labels(labels, out.cropped, out.size, separate_axis(out.image_mm, out.grid_mm), context);
}

// nnU-Net keeps TRAINER__PLANS__CONFIGURATION folders beside each other.
fs::path folder_of_stage(const fs::path& folder, const std::string& configuration, const std::string& previous) {
  std::error_code ignored;
  fs::path whole = fs::weakly_canonical(folder, ignored);
  if (whole.filename().empty()) whole = whole.parent_path();
  const std::string name = whole.filename().string(), end = "__" + configuration;
  const fs::path wanted =
      whole.parent_path() / ((name.ends_with(end) ? name.substr(0, name.size() - end.size()) : name) + "__" + previous);
  if (!fs::is_directory(wanted))
    throw Error(ExitCode::no_input,
                "the network is the second stage of a cascade, and its first stage is missing: " + wanted.string(),
                "put the folder of '" + previous + "' beside it, under the name that nnU-Net gave it");
  return wanted;
}

std::string gb_text(double bytes) {
  return format_number(std::ceil(bytes / 1e8) / 10) + " GB";
}

}  // namespace

std::vector<int> network_folds(const fs::path& model) {
  std::vector<int> folds;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(model, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with("fold_") || !fs::exists(entry.path() / "checkpoint_final.pth")) continue;
    const std::string number = name.substr(5);
    if (!number.empty() && number.size() < 4 && number.find_first_not_of("0123456789") == std::string::npos)
      folds.push_back(std::stoi(number));
  }
  std::sort(folds.begin(), folds.end());
  if (folds.empty() && fs::exists(model / "fold_all" / "checkpoint_final.pth")) folds.push_back(-1);
  if (folds.empty())
    throw Error(ExitCode::no_input, model.string() + " has no fold_*/checkpoint_final.pth",
                "give the folder of a trained configuration, such as nnUNetTrainer__nnUNetPlans__3d_fullres");
  return folds;
}

namespace {

NetworkLogits logits_of_stage(const Image& ct, const fs::path& folder, NetworkModel& model, const NetworkParams& params,
                              bool first_stage, const Context& around) {
  if (!(params.step > 0 && params.step <= 1)) throw Error(ExitCode::usage, "--step is not above 0 and at most 1");
  std::vector<int> folds = network_folds(folder);
  if (!params.folds.empty()) {
    for (const int f : params.folds) {
      if (std::find(folds.begin(), folds.end(), f) == folds.end())
        throw Error(ExitCode::usage, "there is no fold " + std::to_string(f) + " in " + folder.string());
    }
    folds = params.folds;
  }
  Checkpoint checkpoint = read_checkpoint(fold_folder(folder, folds[0]) / "checkpoint_final.pth");
  model = read_network_model(read_text(folder / "plans.json"), read_text(folder / "dataset.json"),
                             checkpoint.configuration);

  std::optional<Labels> previous;
  Context context = around;
  if (!model.previous_stage.empty()) {
    if (first_stage) throw Error(ExitCode::corrupt, "the first stage of a cascade has a stage before it itself");
    NetworkModel before;
    const fs::path at = folder_of_stage(folder, checkpoint.configuration, model.previous_stage);
    const NetworkLogits found = logits_of_stage(ct, at, before, params, true, around.sub(0, 0.4));
    previous = labels_of_logits(found, before, ct.frame, around);
    context = around.sub(0.4, 1);
  }
  const auto report = [&](std::string_view key, ReportValue value) {
    context.report(first_stage ? "first_stage_" + std::string(key) : std::string(key), std::move(value));
  };

  const Turned turned(ct.frame, model.transpose);
  NetworkLogits out;
  crop_to_content(ct, turned, out);
  out.image_mm = turned.spacing_mm;
  out.grid_mm = turned.spacing_mm;
  for (std::size_t a = model.unet.flat ? 1 : 0; a < 3; ++a)
    out.grid_mm[a] = model.spacing_mm[a - (model.unet.flat ? 1 : 0)];
  double grid_voxels = 1, padded_voxels = 1, between = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    const double n = std::max(std::nearbyint(out.image_mm[a] / out.grid_mm[a] * out.cropped[a]), 1.0);
    out.size[a] = static_cast<int>(std::min(n, 1e6));
    grid_voxels *= n;
    padded_voxels *= std::max<double>(n, model.patch[a]);
    between *= std::max<double>(n, out.cropped[a]);
  }
  std::optional<Network> network(std::in_place, model.unet, checkpoint);
  const auto image_voxels = static_cast<double>(voxels_of(out.cropped));
  const double classes = model.unet.classes, patch = static_cast<double>(voxels_of(model.patch));
  const double resampling = 4 * (image_voxels + 2 * between),
               windows = 4 * grid_voxels + 6 * padded_voxels +
                         (folds.size() > 1 || padded_voxels > grid_voxels ? 4 : 2) * classes * padded_voxels +
                         (4 * model.unet.channels + 8 * classes) * patch +
                         static_cast<double>(network->bytes(model.patch));
  // Of a cascade: labels found, the image's outside, and labels on both grids.
  const double cascade =
      previous ? 2 * static_cast<double>(ct.frame.voxel_count()) + 2 * (image_voxels + grid_voxels + padded_voxels) : 0;
  const double bytes = std::max(resampling, windows) + cascade + 3 * static_cast<double>(ct.frame.voxel_count());
  report("memory_mb", std::ceil(bytes / 1e6));
  if (bytes > params.max_memory_gb * 1e9)
    throw Error(ExitCode::resources, "the network needs " + gb_text(bytes) + " of memory for this image",
                "crop the image to what is looked for, or raise --max-memory-gb");

  std::vector<float> data(voxels_of(out.cropped));
  for (int z = 0; z < out.cropped[0]; ++z) {
    for (int y = 0; y < out.cropped[1]; ++y) {
      for (int x = 0; x < out.cropped[2]; ++x)
        data[offset(out.cropped, z, y, x)] =
            static_cast<float>(ct.voxels[turned.at(z + out.first[0], y + out.first[1], x + out.first[2])]);
    }
  }
  normalise(data, model);
  data = resample_cubic(std::move(data), out.cropped, out.size, separate_axis(out.image_mm, out.grid_mm), context);
  Axes size{}, before{};
  for (std::size_t a = 0; a < 3; ++a) {
    size[a] = std::max(out.size[a], model.patch[a]);
    before[a] = (size[a] - out.size[a]) / 2;
  }
  if (size != out.size) data = padded(data, out.size, size, before);
  std::vector<std::int16_t> labels;
  if (previous) {
    labels = previous_on_grid(ct, *previous, turned, out, context);
    previous.reset();
    if (size != out.size) labels = padded(labels, out.size, size, before);
  }

  std::vector<int> axes = params.mirror ? checkpoint.mirror_axes : std::vector<int>{};
  if (std::any_of(axes.begin(), axes.end(), [&](int a) { return a > (model.unet.flat ? 1 : 2); }))
    throw Error(ExitCode::corrupt, "the checkpoint mirrors an axis that its network has not");
  std::sort(axes.begin(), axes.end());
  if (std::adjacent_find(axes.begin(), axes.end()) != axes.end())
    throw Error(ExitCode::corrupt, "the checkpoint mirrors an axis twice");
  const auto passes = mirrored_passes(axes, model.unet.flat);
  const Sliding sliding(model, data, labels, size, params);
  report("windows", static_cast<std::int64_t>(sliding.windows()));
  report("passes", static_cast<std::int64_t>(passes.size() * folds.size()));

  std::vector<std::uint16_t> total;
  for (std::size_t f = 0; f < folds.size(); ++f) {
    if (f > 0) {
      network.reset();
      checkpoint = read_checkpoint(fold_folder(folder, folds[f]) / "checkpoint_final.pth");
      network.emplace(model.unet, checkpoint);
    }
    checkpoint.weights.clear();  // the network has its own by now
    const auto share = [&](std::size_t n) { return 0.9 * static_cast<double>(n) / static_cast<double>(folds.size()); };
    auto sums = sliding.run(*network, passes, context.sub(share(f), share(f + 1)));
    if (f == 0) {
      total = std::move(sums);
    } else {
      for (std::size_t n = 0; n < total.size(); ++n)
        total[n] = half_from_float(float_from_half(total[n]) + float_from_half(sums[n]));
    }
  }
  if (folds.size() > 1) {
    const auto by = static_cast<float>(folds.size());
    for (std::uint16_t& v : total) v = half_from_float(float_from_half(v) / by);
  }
  if (size == out.size) {
    out.values = std::move(total);
    return out;
  }
  for (int c = 0; c < model.unet.classes; ++c) {
    for (int z = 0; z < out.size[0]; ++z) {
      for (int y = 0; y < out.size[1]; ++y) {
        const auto from =
            total.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(c) * voxels_of(size) +
                                                        offset(size, z + before[0], y + before[1], before[2]));
        out.values.insert(out.values.end(), from, from + out.size[2]);
      }
    }
  }
  return out;
}

}  // namespace

NetworkLogits network_logits(const Image& ct, const fs::path& folder, NetworkModel& model, const NetworkParams& params,
                             const Context& context) {
  return logits_of_stage(ct, folder, model, params, false, context);
}

Labels labels_of_logits(const NetworkLogits& logits, const NetworkModel& model, const Frame& frame,
                        const Context& context) {
  const int separate = separate_axis(logits.grid_mm, logits.image_mm);
  std::array<std::vector<LinearTap>, 3> taps;
  for (std::size_t a = 0; a < 3; ++a)
    taps[a] = linear_taps(logits.size[a], logits.cropped[a], static_cast<int>(a) == separate);
  const Turned turned(frame, model.transpose);
  const auto voxels = make_voxels<std::uint8_t>(frame.voxel_count());
  std::fill_n(voxels.get(), frame.voxel_count(), std::uint8_t{0});
  const bool same = logits.size == logits.cropped;
  const auto plane = static_cast<std::size_t>(logits.cropped[1]) * static_cast<std::size_t>(logits.cropped[2]);
  const std::size_t grid = voxels_of(logits.size);
  const auto columns = static_cast<std::size_t>(logits.cropped[2]);
  parallel_for(
      static_cast<std::size_t>(logits.cropped[0]), 1, context.threads, [&](std::size_t begin, std::size_t end) {
        context.check_cancelled();
        std::vector<float> best(plane);
        std::vector<std::uint8_t> label(plane);
        for (std::size_t z = begin; z < end; ++z) {
          std::fill(label.begin(), label.end(), std::uint8_t{0});
          for (std::size_t c = 0; c < model.values.size(); ++c) {
            const std::uint16_t* const from = logits.values.data() + c * grid;
            const auto value = [&](int k, int j, int i) {
              return static_cast<double>(float_from_half(from[offset(logits.size, k, j, i)]));
            };
            for (std::size_t n = 0; n < plane; ++n) {
              const LinearTap &tz = taps[0][z], &ty = taps[1][n / columns], &tx = taps[2][n % columns];
              float v = 0;
              if (same) {
                v = float_from_half(from[offset(logits.size, tz.low, ty.low, tx.low)]);
              } else {
                const auto line = [&](int k, int j) {
                  return value(k, j, tx.low) * (1 - tx.share) + value(k, j, tx.high) * tx.share;
                };
                const auto face = [&](int k) { return line(k, ty.low) * (1 - ty.share) + line(k, ty.high) * ty.share; };
                v = float_from_half(half_from_double(face(tz.low) * (1 - tz.share) + face(tz.high) * tz.share));
              }
              if (model.regions) {
                if (1 / (1 + std::exp(-v)) > 0.5F) label[n] = static_cast<std::uint8_t>(model.values[c]);
              } else if (c == 0 || v > best[n]) {
                best[n] = v;
                label[n] = static_cast<std::uint8_t>(model.values[c]);
              }
            }
          }
          for (std::size_t n = 0; n < plane; ++n)
            voxels[turned.at(static_cast<int>(z) + logits.first[0], static_cast<int>(n / columns) + logits.first[1],
                             static_cast<int>(n % columns) + logits.first[2])] = label[n];
        }
      });
  Labels labels;
  labels.frame = frame;
  labels.voxels = voxels;
  for (const auto& [value, name] : model.names)
    labels.structures.push_back({.value = static_cast<std::uint8_t>(value), .name = name});
  return labels;
}

namespace {

// What a calibration says of this result. Without one nothing is known, and nothing is said.
void report_trust(const NetworkLogits& logits, const NetworkModel& model, const NetworkCalibration& calibration,
                  const Context& context) {
  std::string expected, doubted;
  for (const StructureTrust& t : trust_in(logits, model, calibration, context)) {
    expected += (expected.empty() ? "" : ", ") + t.name + " " + format_number(std::round(100 * t.expected_dice) / 100);
    if (!t.doubt.empty()) doubted += (doubted.empty() ? "" : ", ") + t.name + " (" + t.doubt + ")";
  }
  context.report("expected_dice", expected);
  if (doubted.empty()) return;
  context.report("not_to_be_trusted", doubted);
  context.warn("not to be trusted here: " + doubted);
}

}  // namespace

Labels segment_with_network(const Image& ct, const fs::path& model, const NetworkParams& params,
                            const Context& context) {
  require_valid(ct.frame);
  if (!fs::is_directory(model)) {
    throw Error(ExitCode::no_input, model.string() + " is not a folder",
                "give nnU-Net's folder of a trained configuration, with plans.json, dataset.json and fold_0");
  }
  NetworkModel of;
  const NetworkLogits logits = network_logits(ct, model, of, params, context);
  if (const fs::path path = model / "calibration.json"; fs::exists(path))
    report_trust(logits, of, read_network_calibration(read_text(path), of), context);
  context.progress(0.9, "labels");
  Labels labels = labels_of_logits(logits, of, ct.frame, context);
  std::array<bool, 256> met{};
  for (const std::uint8_t v : labels.span()) met[v] = true;
  std::string missing;
  for (const Structure& s : labels.structures) {
    if (!met[s.value]) missing += (missing.empty() ? "" : ", ") + s.name;
  }
  if (!missing.empty()) context.report("not_found", missing);
  context.progress(1);
  return labels;
}

}  // namespace osteo::inline imaging
