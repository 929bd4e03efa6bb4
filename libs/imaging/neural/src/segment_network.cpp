#include "osteo/imaging/neural/segment_network.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "network_steps.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/parallel.h"
#include "osteo/core/base/param.h"
#include "osteo/imaging/neural/detail/half.h"
#include "osteo/imaging/neural/detail/onnx.h"
#include "osteo/imaging/neural/detail/predict.h"
#include "osteo/imaging/neural/detail/trust.h"
#include "osteo/imaging/neural/detail/windows.h"
#include "sliding.h"
#include "turned.h"

namespace osteo::inline imaging {
namespace {

constexpr const char* kOnnxModel = "network.json";

fs::path fold_folder(const fs::path& model, int fold) {
  return model / (fold < 0 ? "fold_all" : "fold_" + std::to_string(fold));
}

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

bool is_network_folder(const fs::path& folder) {
  std::error_code ignored;
  const auto has = [&](const char* name) { return fs::is_regular_file(folder / name, ignored); };
  return (has("plans.json") && has("dataset.json")) || has(kOnnxModel);
}

std::vector<int> network_folds(const fs::path& model) {
  if (fs::exists(model / kOnnxModel)) return {0};
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

// The first of a folder's networks, and what is said of all of them.
void open_network(const fs::path& folder, int fold, NetworkModel& model, std::string& configuration,
                  std::vector<int>& mirror_axes, std::optional<Network>& network) {
  if (fs::exists(folder / kOnnxModel)) {
    const OnnxModel onnx = read_onnx_model(read_text(folder / kOnnxModel));
    model = onnx.network;
    mirror_axes = onnx.mirror_axes;
    network.emplace(read_onnx(read_file(folder / onnx.file), folder, model.unet.classes, model.patch));
    return;
  }
  const Checkpoint checkpoint = read_checkpoint(fold_folder(folder, fold) / "checkpoint_final.pth");
  model = read_network_model(read_text(folder / "plans.json"), read_text(folder / "dataset.json"),
                             checkpoint.configuration);
  configuration = checkpoint.configuration;
  mirror_axes = checkpoint.mirror_axes;
  network.emplace(model.unet, checkpoint);
}

NetworkLogits logits_of_stage(const Image& ct, const fs::path& folder, NetworkModel& model, const NetworkParams& params,
                              bool first_stage, const Context& around, const NetworkKnown& known = {}) {
  if (!(params.step > 0 && params.step <= 1)) throw Error(ExitCode::usage, "--step is not above 0 and at most 1");
  std::vector<int> folds = network_folds(folder);
  if (!params.folds.empty()) {
    for (const int f : params.folds) {
      if (std::find(folds.begin(), folds.end(), f) == folds.end())
        throw Error(ExitCode::usage, "there is no fold " + std::to_string(f) + " in " + folder.string());
    }
    folds = params.folds;
  }
  std::string configuration;
  std::vector<int> mirror_axes;
  std::optional<Network> network;
  open_network(folder, folds[0], model, configuration, mirror_axes, network);
  if (known) known(model);

  std::optional<Labels> previous;
  Context context = around;
  if (!model.previous_stage.empty()) {
    if (first_stage) throw Error(ExitCode::corrupt, "the first stage of a cascade has a stage before it itself");
    NetworkModel before;
    const fs::path at = folder_of_stage(folder, configuration, model.previous_stage);
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

  std::vector<int> axes = params.mirror ? mirror_axes : std::vector<int>{};
  if (std::any_of(axes.begin(), axes.end(), [&](int a) { return a > (model.unet.flat ? 1 : 2); }))
    throw Error(ExitCode::corrupt, "the model mirrors an axis that its network has not");
  std::sort(axes.begin(), axes.end());
  if (std::adjacent_find(axes.begin(), axes.end()) != axes.end())
    throw Error(ExitCode::corrupt, "the model mirrors an axis twice");
  const auto passes = mirrored_passes(axes, model.unet.flat);
  const Sliding sliding(model, data, labels, size, params);
  report("windows", static_cast<std::int64_t>(sliding.windows()));
  report("passes", static_cast<std::int64_t>(passes.size() * folds.size()));

  std::vector<std::uint16_t> total;
  for (std::size_t f = 0; f < folds.size(); ++f) {
    if (f > 0) {
      network.reset();
      network.emplace(model.unet, read_checkpoint(fold_folder(folder, folds[f]) / "checkpoint_final.pth"));
    }
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
                             const Context& context, const NetworkKnown& known) {
  return logits_of_stage(ct, folder, model, params, false, context, known);
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
void judge(NetworkLabels& found, const NetworkLogits& logits, const NetworkModel& model,
           const NetworkCalibration& calibration, const Context& context) {
  const auto structure = [&](const std::string& name) {
    return std::find_if(found.structures.structures.begin(), found.structures.structures.end(),
                        [&](const Structure& s) { return s.name == name; });
  };
  std::string expected, doubted, within;
  const auto add = [](std::string& to, const std::string& text) { to += (to.empty() ? "" : ", ") + text; };
  for (const StructureTrust& t : trust_in(logits, model, calibration, context)) {
    add(expected, t.name + " " + format_number(std::round(100 * t.expected_dice) / 100));
    if (t.doubt.empty()) continue;
    add(doubted, t.name + " (" + t.doubt + ")");
    structure(t.name)->doubt = t.doubt;
  }
  if (auto boundary = boundary_uncertainty(found.structures, logits, model, calibration, context)) {
    for (const StructureBoundary& s : boundary->structures) {
      add(within, s.name + " " + (std::isfinite(s.within_mm) ? format_number(s.within_mm) : "not known"));
      structure(s.name)->within_mm = s.within_mm;
    }
    found.uncertainty = std::move(boundary->classes);
  }
  context.report("expected_dice", expected);
  context.report("boundary_within_mm", within.empty() ? "not calibrated" : within);
  if (doubted.empty()) return;
  context.report("not_to_be_trusted", doubted);
  context.warn("not to be trusted here: " + doubted);
}

}  // namespace

NetworkLabels segment_with_network(const Image& ct, const fs::path& model, const NetworkParams& params,
                                   const Context& context) {
  require_valid(ct.frame);
  if (!fs::is_directory(model)) {
    throw Error(
        ExitCode::no_input, model.string() + " is not a folder",
        "give nnU-Net's folder of a trained configuration, with plans.json, dataset.json and fold_0, or one with "
        "network.json and an ONNX file");
  }
  NetworkModel of;
  std::optional<NetworkCalibration> calibration;
  // A damaged one is rejected before the first window.
  const NetworkLogits logits = network_logits(ct, model, of, params, context, [&](const NetworkModel& known) {
    if (const fs::path path = model / "calibration.json"; fs::exists(path))
      calibration = read_network_calibration(read_text(path), known);
  });
  context.progress(0.9, "labels");
  NetworkLabels found;
  found.structures = labels_of_logits(logits, of, ct.frame, context);
  found.uncertainty = no_uncertainty(ct.frame);
  std::array<bool, 256> met{};
  for (const std::uint8_t v : found.structures.span()) met[v] = true;
  std::string missing;
  for (const Structure& s : found.structures.structures) {
    if (!met[s.value]) missing += (missing.empty() ? "" : ", ") + s.name;
  }
  if (!missing.empty()) context.report("not_found", missing);
  if (calibration)
    judge(found, logits, of, *calibration, context);
  else
    context.report("boundary_within_mm", "not calibrated");
  context.progress(1);
  return found;
}

}  // namespace osteo::inline imaging
