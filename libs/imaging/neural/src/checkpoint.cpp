#include "osteo/imaging/neural/detail/checkpoint.h"

#include <bit>
#include <fstream>
#include <string_view>

#include "checkpoint_zip.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/neural/detail/half.h"
#include "pickle.h"

namespace osteo::inline imaging {
namespace {

using checkpoint_file::bytes_of, checkpoint_file::damaged, checkpoint_file::little, checkpoint_file::Pickle;
using checkpoint_file::Zip, checkpoint_file::ZipEntry;
using Node = checkpoint_file::PickleNode;

constexpr std::uint64_t kMaxPickleBytes = 32 << 20;

// Bytes a value; 0: not floating point.
int width_of(std::string_view storage) {
  if (storage == "torch.FloatStorage") return 4;
  if (storage == "torch.HalfStorage" || storage == "torch.BFloat16Storage") return 2;
  return storage == "torch.DoubleStorage" ? 8 : 0;
}

float value_at(std::span<const std::byte> bytes, std::size_t index, std::string_view storage) {
  const std::size_t at = index * static_cast<std::size_t>(width_of(storage));
  if (storage == "torch.FloatStorage") return std::bit_cast<float>(little<std::uint32_t>(bytes, at));
  if (storage == "torch.HalfStorage") return float_from_half(little<std::uint16_t>(bytes, at));
  if (storage == "torch.BFloat16Storage")
    return std::bit_cast<float>(static_cast<std::uint32_t>(little<std::uint16_t>(bytes, at)) << 16);
  return static_cast<float>(std::bit_cast<double>(little<std::uint64_t>(bytes, at)));
}

std::vector<std::int64_t> wholes(const Pickle& pickle, const Node& list) {
  std::vector<std::int64_t> v;
  for (const int i : list.items) {
    const Node& n = pickle.node(i);
    if (n.kind != Node::Kind::whole || n.whole < 0) damaged("a tensor's shape is damaged");
    v.push_back(n.whole);
  }
  return v;
}

class TensorReader {
 public:
  TensorReader(const ByteSource& source, const Zip& zip, std::string folder)
      : source_(source), zip_(zip), folder_(std::move(folder)) {}

  NetworkTensor read(const Pickle& pickle, const Node& tensor, const std::string& name) {
    const Node& storage = pickle.node(tensor.items[0]);
    const std::string& kind = pickle.node(storage.items[0]).text;
    const auto width = static_cast<std::uint64_t>(width_of(kind));
    const auto entry = zip_.entries().find(folder_ + "data/" + pickle.node(storage.items[1]).text);
    if (entry == zip_.entries().end()) damaged("the values of '" + name + "' are missing");
    const std::uint64_t held = entry->second.size / width;
    NetworkTensor out;
    out.shape = wholes(pickle, pickle.node(tensor.items[1]));
    const auto strides = wholes(pickle, pickle.node(tensor.items[2]));
    if (out.shape.size() > 5 || strides.size() != out.shape.size()) damaged("the shape of '" + name + "' is damaged");
    // With sizes and strides below the file's number of values no product below overflows.
    std::uint64_t count = 1, last = static_cast<std::uint64_t>(tensor.whole);
    if (tensor.whole < 0 || last >= held) damaged("'" + name + "' lies beyond its values");
    for (std::size_t d = 0; d < out.shape.size(); ++d) {
      const auto size = static_cast<std::uint64_t>(out.shape[d]), stride = static_cast<std::uint64_t>(strides[d]);
      if (size == 0 || size > held || stride > held) damaged("the shape of '" + name + "' is damaged");
      if (count > source_.size / size) damaged("'" + name + "' is larger than the file");
      count *= size;
      if (size > 1 && stride > (held - 1 - last) / (size - 1)) damaged("'" + name + "' lies beyond its values");
      last += (size - 1) * stride;
    }
    if (count > (source_.size - values_) / width) damaged("its weights are larger than the file");
    values_ += count * width;
    const auto bytes =
        bytes_of(source_, zip_.data_offset(entry->second) + static_cast<std::uint64_t>(tensor.whole) * width,
                 (last - static_cast<std::uint64_t>(tensor.whole) + 1) * width, source_.size, "a tensor");
    out.values.resize(count);
    std::vector<std::int64_t> index(out.shape.size(), 0);
    for (std::uint64_t n = 0; n < count; ++n) {
      std::size_t at = 0;
      for (std::size_t d = 0; d < index.size(); ++d) at += static_cast<std::size_t>(index[d] * strides[d]);
      out.values[n] = value_at(bytes, at, kind);
      for (std::size_t d = index.size(); d-- > 0 && ++index[d] == out.shape[d];) index[d] = 0;
    }
    return out;
  }

 private:
  const ByteSource& source_;
  const Zip& zip_;
  std::string folder_;
  std::uint64_t values_ = 0;
};

// The decoder holds the encoder, and each block its parts once more in order: the same tensors under other names.
bool listed_twice(std::string_view key) {
  return key.find("all_modules") != std::string_view::npos || key.starts_with("decoder.encoder.");
}

}  // namespace

Checkpoint read_checkpoint(const ByteSource& source) {
  const Zip zip(source);
  std::string folder;
  const ZipEntry* pickled = nullptr;
  for (const auto& [name, entry] : zip.entries()) {
    if (!name.ends_with("/data.pkl")) continue;
    folder = name.substr(0, name.size() - 8);
    pickled = &entry;
  }
  if (pickled == nullptr) damaged("it has no data.pkl");
  if (const auto order = zip.entries().find(folder + "byteorder"); order != zip.entries().end()) {
    const auto bytes = zip.content(order->second, 64);
    if (std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()) != "little")
      damaged("its bytes are in another order");
  }
  const auto bytes = zip.content(*pickled, kMaxPickleBytes);
  Pickle pickle(bytes);
  const Node& root = pickle.node(pickle.run());
  const Node* const weights = pickle.find(root, "network_weights");
  if (weights == nullptr || weights->kind != Node::Kind::dict) damaged("it has no network_weights");

  Checkpoint out;
  TensorReader reader(source, zip, folder);
  for (std::size_t i = 0; i + 1 < weights->items.size(); i += 2) {
    const Node& key = pickle.node(weights->items[i]);
    const Node& value = pickle.node(weights->items[i + 1]);
    if (key.kind != Node::Kind::text) damaged("a weight has no name");
    std::string name = key.text;
    for (const std::string_view prefix : {"module.", "_orig_mod."}) {  // several processors; compiled
      if (name.starts_with(prefix)) name.erase(0, prefix.size());
    }
    if (listed_twice(name)) continue;
    if (value.kind != Node::Kind::tensor) damaged("the weight '" + name.substr(0, 80) + "' is no tensor");
    if (width_of(pickle.node(pickle.node(value.items[0]).items[0]).text) == 0) continue;  // counters
    out.weights[name] = reader.read(pickle, value, name.substr(0, 80));
  }
  if (const Node* const args = pickle.find(root, "init_args")) {
    if (const Node* const c = pickle.find(*args, "configuration"); c != nullptr && c->kind == Node::Kind::text)
      out.configuration = c->text;
  }
  if (const Node* const axes = pickle.find(root, "inference_allowed_mirroring_axes");
      axes != nullptr && axes->kind == Node::Kind::list) {
    for (const std::int64_t a : wholes(pickle, *axes)) {
      if (a > 2) damaged("its mirroring axes are damaged");
      out.mirror_axes.push_back(static_cast<int>(a));
    }
    if (out.mirror_axes.size() > 3) damaged("its mirroring axes are damaged");
  }
  return out;
}

Checkpoint read_checkpoint(const std::filesystem::path& path) {
  require_readable(path);
  std::ifstream file(path, std::ios::binary);
  ByteSource source;
  source.size = std::filesystem::file_size(path);
  source.read = [&](std::uint64_t offset, std::span<std::byte> to) {
    file.clear();
    file.seekg(static_cast<std::streamoff>(offset));
    file.read(reinterpret_cast<char*>(to.data()), static_cast<std::streamsize>(to.size()));
    if (!file) throw Error(ExitCode::cannot_read, "cannot be read");
  };
  try {
    return read_checkpoint(source);
  } catch (const Error& error) {
    throw error.in(path.string());
  }
}

}  // namespace osteo::inline imaging
