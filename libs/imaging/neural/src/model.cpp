#include "osteo/imaging/neural/detail/model.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "osteo/core/base/error.h"
#include "osteo/core/base/json_document.h"
#include "osteo/imaging/neural/detail/onnx.h"

namespace osteo::inline imaging {
namespace {

constexpr const char* kAdvice = "docs/how-to/segment-network.md says which networks can be run";

[[noreturn]] void refuse(const std::string& why) {
  throw Error(ExitCode::corrupt, why, kAdvice);
}

const Json& member(const Json& object, std::string_view key) {
  const Json* const found = object.find(key);
  if (found == nullptr) refuse("'" + std::string(key) + "' is missing");
  return *found;
}

double number(const Json& value, std::string_view what, double low, double high) {
  const auto n = value.number();
  if (!n || !(*n >= low && *n <= high))
    refuse("'" + std::string(what) + "' is not a number from " + std::to_string(low) + " to " + std::to_string(high));
  return *n;
}

int whole(const Json& value, std::string_view what, int low, int high) {
  const double n = number(value, what, low, high);
  if (n != std::floor(n)) refuse("'" + std::string(what) + "' is not whole");
  return static_cast<int>(n);
}

std::string word(const Json& value, std::string_view what) {
  if (value.text() == nullptr) refuse("'" + std::string(what) + "' is not a text");
  return *value.text();
}

// One number for each of `count`, or one for all.
std::vector<int> wholes(const Json& value, std::string_view what, std::size_t count, int low, int high) {
  std::vector<int> v;
  if (value.number()) return std::vector<int>(count, whole(value, what, low, high));
  for (const Json& item : value.items()) v.push_back(whole(item, what, low, high));
  if (v.size() != count) refuse("'" + std::string(what) + "' has not " + std::to_string(count) + " numbers");
  return v;
}

Axes axes(const Json& value, std::string_view what, bool flat, int low, int high) {
  const auto v = wholes(value, what, flat ? 2 : 3, low, high);
  return flat ? Axes{1, v[0], v[1]} : Axes{v[0], v[1], v[2]};
}

bool ends_with(const Json* value, std::string_view end) {
  return value != nullptr && value->text() != nullptr && value->text()->ends_with(end);
}

Json configuration_of(const Json& plans, const std::string& name, int depth = 0) {
  const Json* const found = member(plans, "configurations").find(name);
  if (found == nullptr) refuse("there is no configuration '" + name + "'");
  const Json* const parent = found->find("inherits_from");
  if (parent == nullptr) return *found;
  if (depth > 16) refuse("configurations inherit from each other in a circle");
  Json whole_one = configuration_of(plans, word(*parent, "inherits_from"), depth + 1);
  for (const auto& m : found->members()) whole_one[m.key] = m.value;
  return whole_one;
}

void require_absent(const Json& object, std::string_view key) {
  const Json* const value = object.find(key);
  if (value != nullptr && !value->is_null() && !(value->flag() != nullptr && !*value->flag()))
    refuse("'" + std::string(key) + "' is not supported");
}

UnetPlan unet_of(const Json& configuration, bool flat) {
  UnetPlan plan;
  plan.flat = flat;
  std::string name;
  Json old;
  const Json* arguments = nullptr;
  if (const Json* const architecture = configuration.find("architecture")) {
    name = word(member(*architecture, "network_class_name"), "network_class_name");
    arguments = &member(*architecture, "arch_kwargs");
  } else {  // plans of before 2.5
    name = word(member(configuration, "UNet_class_name"), "UNet_class_name");
    const Json& blocks = member(configuration, "n_conv_per_stage_encoder");
    const int base = whole(member(configuration, "UNet_base_num_features"), "UNet_base_num_features", 1, 4096),
              most = whole(member(configuration, "unet_max_num_features"), "unet_max_num_features", 1, 4096);
    old["n_stages"] = blocks.items().size();
    old["features_per_stage"] = Json::list();
    for (std::size_t s = 0; s < blocks.items().size() && s < 16; ++s)
      old["features_per_stage"].push_back(std::min<std::int64_t>(most, static_cast<std::int64_t>(base) << s));
    old["kernel_sizes"] = member(configuration, "conv_kernel_sizes");
    old["strides"] = member(configuration, "pool_op_kernel_sizes");
    old[name == "PlainConvUNet" ? "n_conv_per_stage" : "n_blocks_per_stage"] = blocks;
    old["n_conv_per_stage_decoder"] = member(configuration, "n_conv_per_stage_decoder");
    old["conv_bias"] = true;
    old["norm_op"] = flat ? "InstanceNorm2d" : "InstanceNorm3d";
    old["nonlin"] = "LeakyReLU";
    arguments = &old;
  }
  const std::string kind = name.substr(name.rfind('.') + 1);
  if (kind != "PlainConvUNet" && kind != "ResidualEncoderUNet") refuse("the network '" + name + "' is not supported");
  plan.residual = kind == "ResidualEncoderUNet";
  const Json& a = *arguments;

  const Json* const norm = a.find("norm_op");
  plan.batch_norm = ends_with(norm, flat ? "BatchNorm2d" : "BatchNorm3d");
  if (!plan.batch_norm && !ends_with(norm, flat ? "InstanceNorm2d" : "InstanceNorm3d"))
    refuse("'norm_op' is neither the instance nor the batch norm of its dimension");
  if (const Json* const how = a.find("norm_op_kwargs"); how != nullptr && !how->is_null()) {
    if (const Json* const eps = how->find("eps")) plan.eps = number(*eps, "eps", 0, 1);
    const Json* const affine = how->find("affine");
    if (!plan.batch_norm && (affine == nullptr || affine->flag() == nullptr || !*affine->flag()))
      refuse("an instance norm without weights is not supported");
    if (affine != nullptr && affine->flag() != nullptr && !*affine->flag())
      refuse("a norm without weights is not supported");
    require_absent(*how, plan.batch_norm ? "no_such" : "track_running_stats");
  }
  const Json* const bend = a.find("nonlin");
  if (ends_with(bend, "LeakyReLU")) {
    if (const Json* const how = a.find("nonlin_kwargs"); how != nullptr) {
      if (const Json* const slope = how->find("negative_slope")) plan.slope = number(*slope, "negative_slope", -1, 1);
    }
  } else if (ends_with(bend, ".ReLU")) {
    plan.slope = 0;
  } else {
    refuse("'nonlin' is neither LeakyReLU nor ReLU");
  }
  for (const char* const key : {"nonlin_first", "squeeze_excitation", "bottleneck_channels", "stem_channels"})
    require_absent(a, key);
  if (const Json* const block = a.find("block");
      block != nullptr && !block->is_null() && !ends_with(block, "BasicBlockD"))
    refuse("its 'block' is not supported");
  const Json* const bias = a.find("conv_bias");
  plan.conv_bias = bias != nullptr && bias->flag() != nullptr && *bias->flag();

  const auto count = static_cast<std::size_t>(whole(member(a, "n_stages"), "n_stages", 2, 12));
  const auto features = wholes(member(a, "features_per_stage"), "features_per_stage", count, 1, 4096);
  const char* const per_stage = plan.residual ? "n_blocks_per_stage" : "n_conv_per_stage";
  const auto blocks = wholes(member(a, per_stage), per_stage, count, 1, 64);
  const auto decoder = wholes(member(a, "n_conv_per_stage_decoder"), "n_conv_per_stage_decoder", count - 1, 1, 64);
  const auto& kernels = member(a, "kernel_sizes").items();
  const auto& strides = member(a, "strides").items();
  if (kernels.size() != count || strides.size() != count) refuse("kernels or strides are not one a stage");
  for (std::size_t s = 0; s < count; ++s) {
    UnetStage stage;
    stage.kernel = axes(kernels[s], "kernel_sizes", flat, 1, 7);
    if (std::any_of(stage.kernel.begin(), stage.kernel.end(), [](int k) { return k % 2 == 0; }))
      refuse("a kernel of even size is not supported");
    stage.stride = axes(strides[s], "strides", flat, 1, 8);
    stage.features = features[s];
    stage.encoder_blocks = blocks[s];
    stage.decoder_convolutions = s + 1 < count ? decoder[count - 2 - s] : 0;
    plan.stages.push_back(stage);
  }
  if (plan.stages[0].stride != Axes{1, 1, 1}) refuse("a first stage with a stride is not supported");
  return plan;
}

// How data or logits are resampled, as far as it is what is done here.
void require_resampling(const Json& configuration, const std::string& what, int order) {
  const Json* const name = configuration.find("resampling_fn_" + what);
  if (name != nullptr && (name->text() == nullptr || *name->text() != "resample_data_or_seg_to_shape"))
    refuse("the resampling of " + what + " is not supported");
  const Json* const how = configuration.find("resampling_fn_" + what + "_kwargs");
  if (how == nullptr) return;
  if (const Json* const o = how->find("order"); o != nullptr && o->number() != order)
    refuse("resampling " + what + " of this order is not supported");
  if (const Json* const o = how->find("order_z"); o != nullptr && o->number() != 0.0)
    refuse("resampling " + what + " of this order along the slices is not supported");
  if (const Json* const o = how->find("force_separate_z"); o != nullptr && !o->is_null())
    refuse("'force_separate_z' is not supported");
}

void read_labels(const Json& dataset, NetworkModel& model) {
  const auto& labels = member(dataset, "labels").members();
  std::vector<std::pair<std::string, std::vector<int>>> all;
  std::set<int> foreground;
  for (const auto& m : labels) {
    if (m.key == "ignore") continue;
    std::vector<int> values;
    if (m.value.number()) {
      values.push_back(whole(m.value, "labels", 0, 255));
    } else {
      for (const Json& v : m.value.items()) values.push_back(whole(v, "labels", 0, 255));
      if (values.empty()) refuse("the label '" + m.key + "' has no value");
    }
    model.regions |= values.size() > 1;
    foreground.insert(values.begin(), values.end());
    all.emplace_back(m.key, std::move(values));
  }
  if (model.regions) {
    std::vector<std::string> names;
    for (const auto& [name, values] : all) {
      if (std::any_of(values.begin(), values.end(), [](int v) { return v != 0; })) names.push_back(name);
    }
    model.values = wholes(member(dataset, "regions_class_order"), "regions_class_order", names.size(), 1, 255);
    for (std::size_t n = 0; n < names.size(); ++n) model.names.emplace_back(model.values[n], names[n]);
  } else {
    model.values.resize(all.size());
    std::vector<bool> met(all.size(), false);
    for (const auto& [name, values] : all) {
      const auto v = static_cast<std::size_t>(values[0]);
      if (v >= all.size() || met[v]) refuse("its labels are not 0, 1, 2, ...");
      met[v] = true;
      model.values[v] = values[0];
      if (v > 0) model.names.emplace_back(values[0], name);
    }
  }
  std::sort(model.names.begin(), model.names.end());
  if (model.values.empty()) refuse("it has no labels");
  model.unet.classes = static_cast<int>(model.values.size());
  if (model.previous_stage.empty()) return;
  foreground.erase(0);
  model.previous_labels.assign(foreground.begin(), foreground.end());
  model.unet.channels += static_cast<int>(foreground.size());
}

Json parsed(std::string_view text) {
  auto json = Json::parse(text);
  if (!json) refuse("it is not JSON");
  return std::move(*json);
}

}  // namespace

OnnxModel read_onnx_model(std::string_view network_json) {
  OnnxModel model;
  NetworkModel& n = model.network;
  try {
    const Json json = parsed(network_json);
    number(member(json, "osteotome_network"), "osteotome_network", 1, 1);
    constexpr std::array<std::string_view, 8> kKnown{
        "osteotome_network", "onnx",   "patch_size",  "spacing_mm",
        "normalisation",     "labels", "mirror_axes", "regions_class_order"};
    for (const auto& m : json.members())
      if (std::find(kKnown.begin(), kKnown.end(), m.key) == kKnown.end())
        refuse("the key '" + m.key + "' is not known");
    model.file = word(member(json, "onnx"), "onnx");
    if (model.file.empty() || model.file == "." || model.file == ".." ||
        model.file.find_first_of("/\\") != std::string::npos)
      refuse("'onnx' is no name of a file beside it");
    const Json& patch = member(json, "patch_size");
    n.unet.flat = patch.items().size() == 2;
    n.patch = axes(patch, "patch_size", n.unet.flat, 1, 1024);
    for (const Json& v : member(json, "spacing_mm").items()) n.spacing_mm.push_back(number(v, "spacing_mm", 1e-3, 100));
    if (n.spacing_mm.size() != (n.unet.flat ? 2U : 3U))
      refuse("'spacing_mm' has not a number for each axis of a window");
    const Json& how = member(json, "normalisation");
    if (const std::string* const name = how.text()) {
      if (*name == "z_score")
        n.normalisation = Normalisation::z_score;
      else if (*name == "0_to_1")
        n.normalisation = Normalisation::rescale_to_01;
      else if (*name == "none")
        n.normalisation = Normalisation::none;
      else
        refuse("'normalisation' is none of z_score, 0_to_1, none and an object with lower, upper, mean and std");
    } else {
      n.lower = number(member(how, "lower"), "lower", -1e6, 1e6);
      n.upper = number(member(how, "upper"), "upper", n.lower, 1e6);
      n.mean = number(member(how, "mean"), "mean", -1e6, 1e6);
      n.deviation = number(member(how, "std"), "std", 1e-8, 1e6);
    }
    read_labels(json, n);
    if (const Json* const mirrored = json.find("mirror_axes")) {
      for (const Json& v : mirrored->items())
        model.mirror_axes.push_back(whole(v, "mirror_axes", 0, n.unet.flat ? 1 : 2));
    }
  } catch (const Error& error) {
    throw error.in("network.json");
  }
  return model;
}

NetworkModel read_network_model(std::string_view plans_text, std::string_view dataset_text,
                                const std::string& configuration_name) {
  NetworkModel model;
  try {
    const Json plans = parsed(plans_text);
    const Json c = configuration_of(plans, configuration_name);
    if (const Json* const before = c.find("previous_stage"); before != nullptr && !before->is_null()) {
      model.previous_stage = word(*before, "previous_stage");
      if (model.previous_stage.empty() || model.previous_stage.find('/') != std::string::npos)
        refuse("'previous_stage' is no configuration's name");
    }
    if (const Json* const reader = plans.find("image_reader_writer"); ends_with(reader, "WithReorient"))
      refuse("images that the reader '" + *reader->text() + "' turns are not supported");
    const auto& patch = member(c, "patch_size");
    const bool flat = patch.items().size() == 2;
    model.unet = unet_of(c, flat);
    model.patch = axes(patch, "patch_size", flat, 1, 1024);
    for (std::size_t a = 0; a < 3; ++a) {
      int product = 1;
      for (const UnetStage& s : model.unet.stages) product *= s.stride[a];
      if (model.patch[a] % product != 0) refuse("'patch_size' is not a multiple of its strides");
    }
    for (const Json& v : member(c, "spacing").items()) model.spacing_mm.push_back(number(v, "spacing", 1e-3, 100));
    if (model.spacing_mm.size() != (flat ? 2U : 3U)) refuse("'spacing' has not a number for each axis");
    const auto order = wholes(member(plans, "transpose_forward"), "transpose_forward", 3, 0, 2);
    std::copy(order.begin(), order.end(), model.transpose.begin());
    auto sorted = model.transpose;
    std::sort(sorted.begin(), sorted.end());
    if (sorted != std::array{0, 1, 2}) refuse("'transpose_forward' is damaged");

    const auto& schemes = member(c, "normalization_schemes").items();
    if (schemes.size() != 1) refuse("a network of several images is not supported");
    const std::string scheme = word(schemes[0], "normalization_schemes");
    const bool masked = [&] {
      const Json* const use = c.find("use_mask_for_norm");
      return use != nullptr && use->items().size() == 1 && use->items()[0].flag() != nullptr && *use->items()[0].flag();
    }();
    if (scheme == "CTNormalization") {
      const Json& p = member(member(plans, "foreground_intensity_properties_per_channel"), "0");
      model.mean = number(member(p, "mean"), "mean", -1e6, 1e6);
      model.deviation = std::max(number(member(p, "std"), "std", 0, 1e6), 1e-8);
      model.lower = number(member(p, "percentile_00_5"), "percentile_00_5", -1e6, 1e6);
      model.upper = number(member(p, "percentile_99_5"), "percentile_99_5", -1e6, 1e6);
    } else if (scheme == "ZScoreNormalization" && !masked) {
      model.normalisation = Normalisation::z_score;
    } else if (scheme == "RescaleTo01Normalization") {
      model.normalisation = Normalisation::rescale_to_01;
    } else if (scheme == "NoNormalization") {
      model.normalisation = Normalisation::none;
    } else {
      refuse("the normalisation '" + scheme + "'" + (masked ? " within a mask" : "") + " is not supported");
    }
    require_resampling(c, "data", 3);
    require_resampling(c, "probabilities", 1);
  } catch (const Error& error) {
    throw error.in("plans.json");
  }
  try {
    const Json dataset = parsed(dataset_text);
    read_labels(dataset, model);
    const Json* channels = dataset.find("channel_names");
    if (channels == nullptr) channels = dataset.find("modality");
    if (channels == nullptr || channels->members().size() != 1) refuse("a network of several images is not supported");
  } catch (const Error& error) {
    throw error.in("dataset.json");
  }
  return model;
}

}  // namespace osteo::inline imaging
