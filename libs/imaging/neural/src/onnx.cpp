#include "osteo/imaging/neural/detail/onnx.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "network_steps.h"
#include "onnx_file.h"
#include "osteo/core/base/error.h"

namespace osteo::inline imaging {
namespace {

constexpr const char* kOnnxAdvice = "docs/how-to/segment-network.md says which networks can be run";

// Follows the graph node by node. A norm, a sum and a bend are done in place of what made their input, where nobody
// else takes that; else a copy is made first.
class OnnxSteps {
 public:
  OnnxSteps(const OnnxGraph& graph, std::size_t axes) : graph_(graph), axes_(axes) {
    for (const OnnxNode& n : graph.nodes)
      for (const std::string& in : n.inputs) ++uses_[in];
    for (const std::string& out : graph.outputs) ++uses_[out];
    if (graph.inputs.size() != 1) reject("the graph has " + std::to_string(graph.inputs.size()) + " inputs, not one");
    if (graph.outputs.size() != 1)
      reject("the graph has " + std::to_string(graph.outputs.size()) +
             " outputs, not one: export it without deep supervision");
    values_[graph.inputs[0]] = {{0}};
    channels_ = {1};
    scale_ = {{1, 1, 1}};
    open_ = {false};
    for (const auto& [name, tensor] : graph.tensors) made_.weight_bytes += tensor.values.size() * sizeof(float);
  }

  NetworkSteps follow(int classes, const Axes& patch) {
    for (const OnnxNode& n : graph_.nodes) {
      node_ = &n;
      if (n.outputs.empty()) reject("it gives nothing");
      take_node();
    }
    node_ = nullptr;
    const std::vector<int>& out = value(graph_.outputs[0]);
    if (out.size() != 1 || out[0] == 0) reject("no convolution makes what the graph gives");
    made_.result = out[0];
    const auto at = static_cast<std::size_t>(out[0]);
    if (channels_[at] != classes)
      reject("it gives " + std::to_string(channels_[at]) + " classes, and network.json names " +
             std::to_string(classes));
    if (scale_[at] != Axes{1, 1, 1}) reject("it gives a coarser grid than it takes");
    Axes most{1, 1, 1};
    for (const Axes& s : scale_)
      for (std::size_t a = 0; a < 3; ++a) most[a] = std::max(most[a], s[a]);
    for (std::size_t a = 0; a < 3; ++a)
      if (patch[a] % most[a] != 0) reject("'patch_size' is not a multiple of its strides");
    return std::move(made_);
  }

 private:
  [[noreturn]] void reject(const std::string& why) const {
    throw Error(ExitCode::corrupt,
                node_ == nullptr ? "the ONNX graph: " + why
                                 : "the ONNX graph, " + node_->kind + " '" + node_->name + "': " + why,
                kOnnxAdvice);
  }

  void take_node() {
    const std::string& kind = node_->kind;
    if (kind == "Conv" || kind == "ConvTranspose") return convolution(kind == "ConvTranspose");
    if (kind == "InstanceNormalization" || kind == "BatchNormalization") return norm(kind == "BatchNormalization");
    if (kind == "LeakyRelu" || kind == "Relu") return bend(kind == "Relu" ? 0 : number("alpha", 0.01));
    if (kind == "Add") return sum();
    if (kind == "Concat") return join();
    if (kind == "AveragePool") return pool();
    if (kind == "Identity" || kind == "Dropout") {
      values_[node_->outputs[0]] = value(input(0));
      seal(value(input(0)));
      return;
    }
    if (kind == "Constant") {
      const auto it = node_->attributes.find("value");
      if (it != node_->attributes.end()) constants_[node_->outputs[0]] = it->second.tensor;
      return;
    }
    reject("this operation is not supported" + std::string(kind == "Softmax" || kind == "Sigmoid" || kind == "ArgMax"
                                                               ? ": the last layer must give logits"
                                                               : ""));
  }

  const std::string& input(std::size_t n) const {
    if (n >= node_->inputs.size() || node_->inputs[n].empty()) reject("an input is missing");
    return node_->inputs[n];
  }
  const std::vector<int>& value(const std::string& name) const {
    const auto it = values_.find(name);
    if (it == values_.end()) reject("'" + name + "' is not made before it is taken");
    return it->second;
  }
  int one(std::size_t n) const {
    const std::vector<int>& v = value(input(n));
    if (v.size() != 1) reject("values that are joined can be taken by a convolution alone");
    if (v[0] == 0) reject("it takes the image itself, which a convolution alone can");
    return v[0];
  }
  const NetworkTensor& tensor(std::size_t n) const {
    for (const auto* const kept : {&graph_.tensors, &constants_}) {
      const auto it = kept->find(input(n));
      if (it != kept->end()) return it->second;
    }
    reject("'" + input(n) + "' is no weight of the file");
  }
  double number(const std::string& name, double otherwise) const {
    const auto it = node_->attributes.find(name);
    return it == node_->attributes.end() ? otherwise : it->second.number;
  }
  // One an axis; a flat network's first is `otherwise`.
  Axes list(const std::string& name, int otherwise, int most) const {
    Axes v{otherwise, otherwise, otherwise};
    const auto it = node_->attributes.find(name);
    if (it == node_->attributes.end() || it->second.numbers.empty()) return v;
    const auto& numbers = it->second.numbers;
    if (numbers.size() != axes_) reject("'" + name + "' has not a number for each axis");
    for (std::size_t a = 0; a < axes_; ++a) {
      if (numbers[a] < 0 || numbers[a] > most) reject("'" + name + "' is out of range");
      v[a + 3 - axes_] = static_cast<int>(numbers[a]);
    }
    return v;
  }
  void require(bool is, const std::string& what) const {
    if (!is) reject(what + " is not supported");
  }
  // Padding before and after each axis.
  void require_pads(const Axes& wanted) const {
    const auto it = node_->attributes.find("pads");
    std::vector<std::int64_t> pads(2 * axes_, 0);
    if (it != node_->attributes.end() && !it->second.numbers.empty()) pads = it->second.numbers;
    const auto automatic = node_->attributes.find("auto_pad");
    require(
        automatic == node_->attributes.end() || automatic->second.text == "NOTSET" || automatic->second.text.empty(),
        "automatic padding");
    require(pads.size() == 2 * axes_, "such a padding");
    for (std::size_t a = 0; a < axes_; ++a)
      require(pads[a] == wanted[a + 3 - axes_] && pads[a + axes_] == pads[a], "such a padding");
  }

  int put(Step s, int channels, const Axes& scale, bool open) {
    made_.steps.push_back(std::move(s));
    channels_.push_back(channels);
    scale_.push_back(scale);
    open_.push_back(open);
    return static_cast<int>(made_.steps.size());
  }
  void give(int v) { values_[node_->outputs[0]] = {v}; }
  void seal(const std::vector<int>& values) {
    for (const int v : values) open_[static_cast<std::size_t>(v)] = false;
  }
  Step& step(int v) { return made_.steps[static_cast<std::size_t>(v) - 1]; }

  // A value that may be changed in place: that of input n, where nobody else takes it and `fits`, or a copy.
  template <class Fits>
  int own(std::size_t n, const Fits& fits) {
    const int v = one(n);
    if (open_[static_cast<std::size_t>(v)] && uses_.at(input(n)) == 1 && fits(step(v))) return v;
    Step copy;
    copy.kind = Step::Kind::pool;
    copy.in = {v};
    return put(std::move(copy), channels_[static_cast<std::size_t>(v)], scale_[static_cast<std::size_t>(v)], true);
  }

  void convolution(bool transposed) {
    const std::vector<int> in = value(input(0));
    const NetworkTensor& w = tensor(1);
    if (w.shape.size() != axes_ + 2) reject("its weights have not " + std::to_string(axes_) + " axes");
    Axes kernel{1, 1, 1};
    for (std::size_t a = 0; a < axes_; ++a) {
      if (w.shape[a + 2] < 1 || w.shape[a + 2] > 8) reject("a kernel of that size is not supported");
      kernel[a + 3 - axes_] = static_cast<int>(w.shape[a + 2]);
    }
    const std::int64_t from = w.shape[transposed ? 0 : 1], to = w.shape[transposed ? 1 : 0];
    if (from < 1 || from > 65536 || to < 1 || to > 65536) reject("its weights have no channels");
    const Axes stride = list("strides", 1, 8);
    require(*std::min_element(stride.begin(), stride.end()) > 0, "a stride of 0");
    require(number("group", 1) == 1, "a convolution in groups");
    require(list("dilations", 1, 64) == Axes{1, 1, 1}, "a dilated convolution");
    if (transposed) {
      require(kernel == stride, "a transposed convolution whose kernel is not as wide as its stride");
      require(list("output_padding", 0, 8) == Axes{0, 0, 0}, "an output's padding");
      require_pads({0, 0, 0});
      require(in.size() == 1, "a transposed convolution of joined values");
    } else {
      for (const int k : kernel) require(k % 2 == 1, "a kernel of even size");
      require_pads({kernel[0] / 2, kernel[1] / 2, kernel[2] / 2});
    }
    std::vector<int> channels;
    int all = 0;
    for (const int v : in) {
      channels.push_back(channels_[static_cast<std::size_t>(v)]);
      all += channels.back();
      if (scale_[static_cast<std::size_t>(v)] != scale_[static_cast<std::size_t>(in[0])])
        reject("it takes values of different grids");
      if (v == 0 && in.size() > 1) reject("it takes the image joined to others");
    }
    if (transposed && in[0] == 0) reject("it takes the image itself");
    if (all != from)
      reject("its weights are for " + std::to_string(from) + " channels, and " + std::to_string(all) + " come in");
    std::span<const float> bias;
    if (node_->inputs.size() > 2 && !node_->inputs[2].empty()) {
      bias = tensor(2).values;
      if (bias.size() != static_cast<std::size_t>(to)) reject("its bias is not of its channels");
    }
    Axes scale = scale_[static_cast<std::size_t>(in[0])];
    for (std::size_t a = 0; a < 3; ++a) {
      if (transposed && scale[a] % stride[a] != 0) reject("it gives a finer grid than the image's");
      scale[a] = transposed ? scale[a] / stride[a] : scale[a] * stride[a];
      if (scale[a] > 4096) reject("its strides are too large");
    }
    Step s;
    s.kind = transposed ? Step::Kind::transposed : Step::Kind::convolution;
    s.in = in;
    s.convolution = packed_convolution(w.values, bias, channels, static_cast<int>(to), kernel, stride, transposed,
                                       in[0] == 0 ? 1 : kChannels);
    seal(in);
    give(put(std::move(s), static_cast<int>(to), scale, true));
  }

  void norm(bool of_batches) {
    const int v = own(0, [](const Step& s) { return s.norm.kind == Norm::Kind::none && s.add < 0 && s.slope == 1; });
    const auto channels = static_cast<std::size_t>(channels_[static_cast<std::size_t>(v)]);
    Norm n;
    n.kind = of_batches ? Norm::Kind::batch : Norm::Kind::instance;
    n.eps = number("epsilon", 1e-5);
    if (!(n.eps >= 0 && n.eps <= 1)) reject("'epsilon' is out of range");
    std::size_t at = 1;
    for (auto* const to : {&n.weight, &n.bias, &n.mean, &n.variance}) {
      if (!of_batches && at > 2) break;
      *to = tensor(at++).values;
      if (to->size() != channels) reject("its weights are not of the channels that come in");
      to->resize(static_cast<std::size_t>(blocks_of(static_cast<int>(channels)) * kChannels), 0.0F);
    }
    require(number("training_mode", 0) == 0, "a norm that trains");
    step(v).norm = std::move(n);
    give(v);
  }

  void bend(double slope) {
    if (!(std::abs(slope) <= 1)) reject("its slope is out of range");
    const int v = own(0, [](const Step& s) { return s.slope == 1; });
    step(v).slope = static_cast<float>(slope);
    seal({v});
    give(v);
  }

  void sum() {
    const int a = one(0), b = one(1);
    if (channels_[static_cast<std::size_t>(a)] != channels_[static_cast<std::size_t>(b)] ||
        scale_[static_cast<std::size_t>(a)] != scale_[static_cast<std::size_t>(b)])
      reject("it adds values of different sizes");
    // The later of both is changed: the other is there by then.
    const std::size_t later = b > a ? 1 : 0;
    const int v = own(later, [](const Step& s) { return s.add < 0 && s.slope == 1; });
    step(v).add = later == 1 ? a : b;
    seal({a, b});
    open_[static_cast<std::size_t>(v)] = true;
    give(v);
  }

  void join() {
    require(number("axis", -1) == 1, "a join along another axis than the channels'");
    std::vector<int> all;
    for (std::size_t n = 0; n < node_->inputs.size(); ++n) {
      const std::vector<int>& v = value(input(n));
      all.insert(all.end(), v.begin(), v.end());
    }
    if (all.empty() || all.size() > 64) reject("it joins no values, or too many");
    seal(all);
    values_[node_->outputs[0]] = all;
  }

  void pool() {
    const Axes kernel = list("kernel_shape", 1, 8);
    require(kernel == list("strides", 1, 8) && *std::min_element(kernel.begin(), kernel.end()) > 0,
            "a mean over another part than a stride");
    require(number("ceil_mode", 0) == 0, "rounding up");
    require_pads({0, 0, 0});
    const int v = one(0);
    Axes scale = scale_[static_cast<std::size_t>(v)];
    for (std::size_t a = 0; a < 3; ++a)
      if ((scale[a] *= kernel[a]) > 4096) reject("its strides are too large");
    Step s;
    s.kind = Step::Kind::pool;
    s.in = {v};
    s.stride = kernel;
    seal({v});
    give(put(std::move(s), channels_[static_cast<std::size_t>(v)], scale, true));
  }

  const OnnxGraph& graph_;
  std::size_t axes_;
  const OnnxNode* node_ = nullptr;
  NetworkSteps made_;
  std::map<std::string, int> uses_;
  std::map<std::string, std::vector<int>> values_;  // several where they are joined
  std::map<std::string, NetworkTensor> constants_;
  std::vector<int> channels_;  // of each value
  std::vector<Axes> scale_;    // voxels of the image in one of its own
  std::vector<bool> open_;     // whether it may still be changed in place
};

}  // namespace

NetworkSteps read_onnx(std::span<const std::byte> file, const std::filesystem::path& beside, int classes,
                       const Axes& patch) {
  const OnnxGraph graph = read_onnx_graph(file, beside);
  std::size_t axes = 0;
  for (const OnnxNode& n : graph.nodes) {
    if (n.kind != "Conv" || n.inputs.size() < 2) continue;
    const auto w = graph.tensors.find(n.inputs[1]);
    if (w != graph.tensors.end()) axes = std::max<std::size_t>(w->second.shape.size(), 2) - 2;
    break;
  }
  if (axes != 2 && axes != 3)
    throw Error(ExitCode::corrupt, "the ONNX graph has no convolution of 2 or 3 axes", kOnnxAdvice);
  if (axes == 2 && patch[0] != 1)
    throw Error(ExitCode::corrupt, "the ONNX graph works on slices, and 'patch_size' has three numbers", kOnnxAdvice);
  return OnnxSteps(graph, axes).follow(classes, patch);
}

}  // namespace osteo::inline imaging
