#include "onnx_file.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <fstream>
#include <string_view>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/neural/detail/half.h"

namespace osteo::inline imaging {
namespace {

[[noreturn]] void reject_file(const std::string& why) {
  throw Error(ExitCode::corrupt, "the ONNX file: " + why,
              "docs/how-to/segment-network.md says which networks can be run");
}

using Bytes = std::span<const std::byte>;

// The fields of one message.
class Message {
 public:
  explicit Message(Bytes bytes) : left_(bytes) {}

  // False at the end. A field is a number or bytes.
  bool next() {
    if (left_.empty()) return false;
    const std::uint64_t key = varint();
    field = static_cast<int>(std::min<std::uint64_t>(key >> 3, 1U << 30));
    bytes = {};
    number = 0;
    is_bytes = false;
    switch (key & 7U) {
      case 0:
        number = varint();
        break;
      case 1:
        number = fixed(8);
        break;
      case 5:
        number = fixed(4);
        break;
      case 2: {
        const std::uint64_t size = varint();
        if (size > left_.size()) reject_file("it ends in the middle");
        bytes = left_.first(static_cast<std::size_t>(size));
        left_ = left_.subspan(static_cast<std::size_t>(size));
        is_bytes = true;
        break;
      }
      default:
        reject_file("it is damaged, or no ONNX file");
    }
    return true;
  }
  [[nodiscard]] std::string text() const { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }
  [[nodiscard]] std::int64_t whole() const { return static_cast<std::int64_t>(number); }
  [[nodiscard]] float real() const { return std::bit_cast<float>(static_cast<std::uint32_t>(number)); }

  // Numbers of a list, packed or one a field.
  void add_to(std::vector<std::int64_t>& list) const {
    if (!is_bytes) {
      list.push_back(whole());
      return;
    }
    Message packed(bytes);
    while (!packed.left_.empty()) list.push_back(static_cast<std::int64_t>(packed.varint()));
  }
  void add_to(std::vector<float>& list) const {
    if (!is_bytes) {
      list.push_back(real());
      return;
    }
    if (bytes.size() % 4 != 0) reject_file("it is damaged");
    const std::size_t before = list.size();
    list.resize(before + bytes.size() / 4);
    std::memcpy(list.data() + before, bytes.data(), bytes.size());
  }

  int field = 0;
  std::uint64_t number = 0;
  Bytes bytes;
  bool is_bytes = false;

 private:
  std::uint64_t varint() {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      if (left_.empty()) reject_file("it ends in the middle");
      const auto b = static_cast<std::uint64_t>(left_[0]);
      left_ = left_.subspan(1);
      value |= (b & 0x7fU) << shift;
      if (b < 0x80U) return value;
    }
    reject_file("it is damaged");
  }
  std::uint64_t fixed(std::size_t size) {
    if (left_.size() < size) reject_file("it ends in the middle");
    std::uint64_t value = 0;
    std::memcpy(&value, left_.data(), size);  // little-endian, as all machines that this is built for
    left_ = left_.subspan(size);
    return value;
  }
  Bytes left_;
};

// A stretch of a file beside: ONNX keeps large weights there.
std::vector<std::byte> outside(const std::filesystem::path& beside, const std::map<std::string, std::string>& where) {
  const auto of = [&](const char* key) {
    const auto it = where.find(key);
    return it == where.end() ? std::string() : it->second;
  };
  const auto number = [&](const char* key) -> std::uint64_t {
    const std::string text = of(key);
    if (text.empty()) return 0;
    if (text.size() > 18 || text.find_first_not_of("0123456789") != std::string::npos) reject_file("it is damaged");
    return std::stoull(text);
  };
  const std::string name = of("location");
  if (name.empty() || name == "." || name == ".." || name.find_first_of("/\\") != std::string::npos)
    reject_file("its weights lie in '" + name + "', which is no file beside it");
  std::error_code failed;
  const std::uint64_t size = std::filesystem::file_size(beside / name, failed), first = number("offset");
  if (failed) reject_file("its weights are missing: " + (beside / name).string());
  const std::uint64_t length = of("length").empty() ? size - std::min(size, first) : number("length");
  if (first > size || length > size - first) reject_file("its weights lie beyond the end of '" + name + "'");
  std::vector<std::byte> bytes(static_cast<std::size_t>(length));
  std::ifstream in(beside / name, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(first));
  if (!in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(length)))
    reject_file("'" + name + "' cannot be read");
  return bytes;
}

std::pair<std::string, NetworkTensor> tensor_of(Bytes message, const std::filesystem::path& beside) {
  std::string name;
  NetworkTensor t;
  std::int64_t kind = 0;
  Bytes raw;
  std::vector<std::byte> kept;
  bool is_outside = false;
  std::map<std::string, std::string> where;
  std::vector<std::int64_t> wholes;
  for (Message m(message); m.next();) {
    switch (m.field) {
      case 1:
        m.add_to(t.shape);
        break;
      case 2:
        kind = m.whole();
        break;
      case 4:
        m.add_to(t.values);
        break;
      case 5:
      case 7:
        m.add_to(wholes);
        break;
      case 8:
        name = m.text();
        break;
      case 9:
        raw = m.bytes;
        break;
      case 13: {
        std::string key, value;
        for (Message pair(m.bytes); pair.next();) (pair.field == 1 ? key : value) = pair.text();
        where[key] = value;
        break;
      }
      case 14:
        is_outside = m.number == 1;
        break;
      default:
        break;
    }
  }
  constexpr std::int64_t kFloat = 1, kInt32 = 6, kInt64 = 7, kHalf = 10, kDouble = 11;
  if (is_outside) {
    kept = outside(beside, where);
    raw = kept;
  }
  const std::size_t wide = kind == kFloat || kind == kInt32    ? 4
                           : kind == kHalf                     ? 2
                           : kind == kInt64 || kind == kDouble ? 8
                                                               : 0;
  if (wide == 0) return {name, {}};  // texts and the like: missed only where it is wanted
  std::uint64_t count = 1;
  for (const std::int64_t n : t.shape) {
    if (n < 0 || n > (std::int64_t{1} << 32) || (count *= static_cast<std::uint64_t>(n)) > (std::uint64_t{1} << 34))
      reject_file("'" + name + "' has no shape");
  }
  if (!raw.empty()) {
    if (raw.size() != count * wide) reject_file("'" + name + "' has not as many numbers as its shape");
    t.values.resize(static_cast<std::size_t>(count));
    for (std::size_t n = 0; n < t.values.size(); ++n) {
      const std::byte* const from = raw.data() + n * wide;
      const auto as = [&]<class T>(T v) {
        std::memcpy(&v, from, sizeof(v));
        return v;
      };
      t.values[n] = kind == kFloat    ? as(float{})
                    : kind == kHalf   ? float_from_half(as(std::uint16_t{}))
                    : kind == kDouble ? static_cast<float>(as(double{}))
                    : kind == kInt32  ? static_cast<float>(as(std::int32_t{}))
                                      : static_cast<float>(as(std::int64_t{}));
    }
  } else if (kind == kHalf) {
    for (const std::int64_t n : wholes) t.values.push_back(float_from_half(static_cast<std::uint16_t>(n)));
  } else if (kind == kInt32 || kind == kInt64) {
    for (const std::int64_t n : wholes) t.values.push_back(static_cast<float>(n));
  }
  if (t.values.size() != count) reject_file("'" + name + "' has not as many numbers as its shape");
  return {name, std::move(t)};
}

OnnxNode node_of(Bytes message, const std::filesystem::path& beside) {
  OnnxNode node;
  for (Message m(message); m.next();) {
    switch (m.field) {
      case 1:
        node.inputs.push_back(m.text());
        break;
      case 2:
        node.outputs.push_back(m.text());
        break;
      case 3:
        node.name = m.text();
        break;
      case 4:
        node.kind = m.text();
        break;
      case 5: {
        std::string name;
        OnnxAttribute a;
        for (Message f(m.bytes); f.next();) {
          switch (f.field) {
            case 1:
              name = f.text();
              break;
            case 2:
              a.number = static_cast<double>(f.real());
              break;
            case 3:
              a.number = static_cast<double>(f.whole());
              break;
            case 4:
              a.text = f.text();
              break;
            case 5:
              a.tensor = tensor_of(f.bytes, beside).second;
              break;
            case 8:
              f.add_to(a.numbers);
              break;
            default:
              break;
          }
        }
        node.attributes[name] = std::move(a);
        break;
      }
      default:
        break;
    }
  }
  return node;
}

std::string name_of_value(Bytes message) {
  std::string name;
  for (Message m(message); m.next();)
    if (m.field == 1) name = m.text();
  return name;
}

}  // namespace

OnnxGraph read_onnx_graph(Bytes file, const std::filesystem::path& beside) {
  OnnxGraph graph;
  Bytes body;
  for (Message m(file); m.next();)
    if (m.field == 7 && m.is_bytes) body = m.bytes;
  if (body.empty()) reject_file("it holds no graph");
  for (Message m(body); m.next();) {
    switch (m.field) {
      case 1:
        graph.nodes.push_back(node_of(m.bytes, beside));
        break;
      case 5:
        graph.tensors.insert(tensor_of(m.bytes, beside));
        break;
      case 11:
        graph.inputs.push_back(name_of_value(m.bytes));
        break;
      case 12:
        graph.outputs.push_back(name_of_value(m.bytes));
        break;
      case 15:
        reject_file("sparse weights are not supported");
      default:
        break;
    }
  }
  std::erase_if(graph.inputs, [&](const std::string& name) { return graph.tensors.contains(name); });
  return graph;
}

}  // namespace osteo::inline imaging
