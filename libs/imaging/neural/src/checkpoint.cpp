#include "osteo/imaging/neural/detail/checkpoint.h"

#include <bit>
#include <cstring>
#include <deque>
#include <fstream>
#include <optional>
#include <string_view>
#include <unordered_map>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/neural/detail/half.h"

namespace osteo::inline imaging {
namespace {

constexpr std::uint64_t kMaxPickleBytes = 32 << 20;
constexpr std::size_t kMaxNodes = 1 << 21;
constexpr std::size_t kMaxName = 256;
constexpr std::uint64_t kMaxDirectoryBytes = 16 << 20;

[[noreturn]] void damaged(const std::string& why) {
  throw Error(ExitCode::corrupt, "not a checkpoint of nnU-Net v2: " + why,
              "give the checkpoint as torch.save wrote it, in its zip format");
}

std::vector<std::byte> bytes_of(const ByteSource& source, std::uint64_t offset, std::uint64_t count,
                                std::uint64_t limit, const char* what) {
  if (count > limit) damaged(std::string(what) + " is too large");
  if (offset > source.size || count > source.size - offset) damaged(std::string(what) + " lies beyond the file's end");
  std::vector<std::byte> bytes(count);
  if (count > 0) source.read(offset, bytes);
  return bytes;
}

template <class T>
T little(std::span<const std::byte> bytes, std::size_t at) {
  if (at > bytes.size() || bytes.size() - at < sizeof(T)) damaged("it ends within a number");
  T value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i)
    value = static_cast<T>(value | static_cast<T>(static_cast<T>(bytes[at + i]) << (8 * i)));
  return value;
}

struct ZipEntry {
  std::uint64_t header = 0, size = 0;
};

class Zip {
 public:
  explicit Zip(const ByteSource& source) : source_(source) {
    const std::uint64_t tail = std::min<std::uint64_t>(source.size, 65557);
    const auto end = bytes_of(source, source.size - tail, tail, tail, "its end");
    std::optional<std::size_t> found;
    for (std::size_t at = end.size() < 22 ? 0 : end.size() - 21; at-- > 0 && !found;) {
      if (little<std::uint32_t>(end, at) == 0x06054b50) found = at;
    }
    if (!found) damaged("it is no zip");
    std::uint64_t count = little<std::uint16_t>(end, *found + 10), size = little<std::uint32_t>(end, *found + 12),
                  start = little<std::uint32_t>(end, *found + 16);
    if (*found >= 20 && little<std::uint32_t>(end, *found - 20) == 0x07064b50) {
      const auto wide = bytes_of(source, little<std::uint64_t>(end, *found - 12), 56, 56, "its directory");
      if (little<std::uint32_t>(wide, 0) != 0x06064b50) damaged("its directory is damaged");
      count = little<std::uint64_t>(wide, 32);
      size = little<std::uint64_t>(wide, 40);
      start = little<std::uint64_t>(wide, 48);
    }
    const auto directory = bytes_of(source, start, size, kMaxDirectoryBytes, "its directory");
    std::size_t at = 0;
    for (std::uint64_t n = 0; n < count; ++n) {
      if (little<std::uint32_t>(directory, at) != 0x02014b50) damaged("its directory is damaged");
      const auto method = little<std::uint16_t>(directory, at + 10);
      ZipEntry entry{little<std::uint32_t>(directory, at + 42), little<std::uint32_t>(directory, at + 24)};
      const std::size_t name_size = little<std::uint16_t>(directory, at + 28),
                        extra_size = little<std::uint16_t>(directory, at + 30),
                        comment = little<std::uint16_t>(directory, at + 32);
      const std::size_t next = at + 46 + name_size + extra_size + comment;
      if (next > directory.size()) damaged("its directory is damaged");
      const std::string name(reinterpret_cast<const char*>(directory.data()) + at + 46, name_size);
      wide_sizes(std::span(directory).subspan(at + 46 + name_size, extra_size),
                 little<std::uint32_t>(directory, at + 20), entry);
      if (method != 0) damaged("'" + name.substr(0, 60) + "' is compressed");
      entries_[name] = entry;
      at = next;
    }
  }

  [[nodiscard]] const std::map<std::string, ZipEntry>& entries() const { return entries_; }
  [[nodiscard]] std::uint64_t data_offset(const ZipEntry& entry) const {
    const auto local = bytes_of(source_, entry.header, 30, 30, "a part");
    if (little<std::uint32_t>(local, 0) != 0x04034b50) damaged("a part is damaged");
    return entry.header + 30 + little<std::uint16_t>(local, 26) + little<std::uint16_t>(local, 28);
  }
  [[nodiscard]] std::vector<std::byte> content(const ZipEntry& entry, std::uint64_t limit) const {
    return bytes_of(source_, data_offset(entry), entry.size, limit, "a part");
  }

 private:
  // Sizes above 4 GiB stand in an extra field, in this order, each only where the short one is full.
  static void wide_sizes(std::span<const std::byte> extra, std::uint32_t packed, ZipEntry& entry) {
    for (std::size_t at = 0; at + 4 <= extra.size();) {
      const std::size_t size = little<std::uint16_t>(extra, at + 2);
      if (little<std::uint16_t>(extra, at) == 1) {
        std::size_t from = at + 4;
        for (std::uint64_t* const field : {&entry.size, static_cast<std::uint64_t*>(nullptr), &entry.header}) {
          const bool full = field == nullptr ? packed == 0xffffffff : *field == 0xffffffff;
          if (!full) continue;
          const auto value = little<std::uint64_t>(extra, from);
          if (field != nullptr) *field = value;
          from += 8;
        }
        return;
      }
      at += 4 + size;
    }
  }

  const ByteSource& source_;
  std::map<std::string, ZipEntry> entries_;
};

// What a pickle can hold here. `opaque` stands for everything else: it is carried along and never looked into.
struct Node {
  enum class Kind { opaque, none, flag, whole, text, list, dict, name, storage, tensor, mark } kind{};
  std::int64_t whole = 0;  ///< tensor: its first value
  std::string text;        ///< name: "module.class"
  std::vector<int> items;  ///< list and tuple: parts; dict: key, value, key, ...; storage: class, key;
                           ///< tensor: storage, shape, strides
};

class Pickle {
 public:
  explicit Pickle(std::span<const std::byte> bytes) : bytes_(bytes) {}

  /// The value that is left, and the nodes it stands in.
  int run() {
    for (;;) {
      const auto op = static_cast<unsigned char>(take(1)[0]);
      if (op == '.') return pop();
      step(op);
    }
  }
  [[nodiscard]] const Node& node(int at) const { return nodes_[static_cast<std::size_t>(at)]; }
  /// The value of a text key; nullptr where there is none.
  [[nodiscard]] const Node* find(const Node& dict, std::string_view key) const {
    if (dict.kind != Node::Kind::dict) return nullptr;
    for (std::size_t i = 0; i + 1 < dict.items.size(); i += 2) {
      const Node& k = node(dict.items[i]);
      if (k.kind == Node::Kind::text && k.text == key) return &node(dict.items[i + 1]);
    }
    return nullptr;
  }

 private:
  std::span<const std::byte> take(std::uint64_t count) {
    if (count > bytes_.size() - at_) damaged("its pickle ends early");
    at_ += count;
    return bytes_.subspan(at_ - count, count);
  }
  template <class T>
  T number() {
    return little<T>(take(sizeof(T)), 0);
  }
  std::string text(std::uint64_t count) {
    const auto bytes = take(count);
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  std::string line() {
    std::string s;
    for (;;) {
      const auto c = static_cast<char>(take(1)[0]);
      if (c == '\n') return s;
      s += c;
    }
  }
  int make(Node n) {
    if (nodes_.size() >= kMaxNodes) damaged("its pickle holds too much");
    nodes_.push_back(std::move(n));
    return static_cast<int>(nodes_.size()) - 1;
  }
  void push(Node n) { stack_.push_back(make(std::move(n))); }
  void push_kind(Node::Kind kind) {
    Node n;
    n.kind = kind;
    push(std::move(n));
  }
  void push_whole(std::int64_t v, Node::Kind kind = Node::Kind::whole) {
    Node n;
    n.kind = kind;
    n.whole = v;
    push(std::move(n));
  }
  void push_text(std::string s, Node::Kind kind = Node::Kind::text) {
    Node n;
    n.kind = kind;
    n.text = std::move(s);
    push(std::move(n));
  }
  int pop() {
    if (stack_.empty() || node(stack_.back()).kind == Node::Kind::mark) damaged("its pickle is out of order");
    const int top = stack_.back();
    stack_.pop_back();
    return top;
  }
  Node& top() {
    if (stack_.empty()) damaged("its pickle is out of order");
    return nodes_[static_cast<std::size_t>(stack_.back())];
  }
  std::vector<int> pop_to_mark() {
    std::size_t at = stack_.size();
    while (at > 0 && node(stack_[at - 1]).kind != Node::Kind::mark) --at;
    if (at == 0) damaged("its pickle is out of order");
    std::vector<int> items(stack_.begin() + static_cast<std::ptrdiff_t>(at), stack_.end());
    stack_.resize(at - 1);
    return items;
  }
  void push_list(std::vector<int> items) {
    Node n;
    n.kind = Node::Kind::list;
    n.items = std::move(items);
    push(std::move(n));
  }
  void tuple(int count) {
    std::vector<int> items(static_cast<std::size_t>(count));
    for (int i = count; i-- > 0;) items[static_cast<std::size_t>(i)] = pop();
    push_list(std::move(items));
  }
  void put(std::uint32_t key) {
    if (stack_.empty()) damaged("its pickle is out of order");
    memo_[key] = stack_.back();
  }
  void get(std::uint32_t key) {
    const auto it = memo_.find(key);
    if (it == memo_.end()) damaged("its pickle is out of order");
    if (stack_.size() >= kMaxNodes) damaged("its pickle holds too much");
    stack_.push_back(it->second);
  }
  // Parts of lists and dicts. Each was put on the stack by a step of its own, so that their number is bounded as well.
  void extend(const std::vector<int>& items, Node::Kind kind) {
    Node& to = top();
    if (to.kind == Node::Kind::opaque) return;
    if (to.kind != kind || (kind == Node::Kind::dict && items.size() % 2 != 0)) damaged("its pickle is out of order");
    to.items.insert(to.items.end(), items.begin(), items.end());
  }

  void call() {
    const Node& arguments = node(pop());
    const Node& function = node(pop());
    Node n;
    if (function.kind == Node::Kind::name && arguments.kind == Node::Kind::list) {
      const auto& a = arguments.items;
      if (function.text == "collections.OrderedDict" && a.empty()) {
        n.kind = Node::Kind::dict;
      } else if (function.text == "torch._utils._rebuild_tensor_v2" && a.size() >= 4 &&
                 node(a[0]).kind == Node::Kind::storage && node(a[1]).kind == Node::Kind::whole &&
                 node(a[2]).kind == Node::Kind::list && node(a[3]).kind == Node::Kind::list) {
        n.kind = Node::Kind::tensor;
        n.whole = node(a[1]).whole;
        n.items = {a[0], a[2], a[3]};
      } else if (function.text == "torch._utils._rebuild_parameter" && !a.empty() &&
                 node(a[0]).kind == Node::Kind::tensor) {
        stack_.push_back(a[0]);
        return;
      }
    }
    push(std::move(n));
  }
  void persistent() {
    const Node& id = node(pop());
    Node n;
    if (id.kind == Node::Kind::list && id.items.size() >= 5 && node(id.items[0]).text == "storage" &&
        node(id.items[1]).kind == Node::Kind::name && node(id.items[2]).kind == Node::Kind::text &&
        node(id.items[4]).kind == Node::Kind::whole) {
      n.kind = Node::Kind::storage;
      n.items = {id.items[1], id.items[2]};
    }
    push(std::move(n));
  }
  void long_number(std::uint64_t count) {
    const auto bytes = take(count);
    if (count > 8) return push({});
    std::uint64_t v = 0;
    for (std::size_t i = 0; i < count; ++i) v |= static_cast<std::uint64_t>(bytes[i]) << (8 * i);
    if (count > 0 && count < 8 && (static_cast<unsigned>(bytes[count - 1]) & 0x80U) != 0)
      v |= ~std::uint64_t{0} << (8 * count);
    push_whole(static_cast<std::int64_t>(v));
  }

  void step(unsigned char op) {
    using Kind = Node::Kind;
    switch (op) {
      case 0x80:
        take(1);
        break;  // protocol
      case 0x95:
        take(8);
        break;  // frame
      case '(':
        push_kind(Kind::mark);
        break;
      case '0':
        pop();
        break;
      case '1':
        pop_to_mark();
        break;
      case '2': {
        const int n = pop();
        stack_.push_back(n);
        stack_.push_back(n);
        if (stack_.size() > kMaxNodes) damaged("its pickle holds too much");
        break;
      }
      case 'N':
        push_kind(Kind::none);
        break;
      case 0x88:
        push_whole(1, Kind::flag);
        break;
      case 0x89:
        push_whole(0, Kind::flag);
        break;
      case 'J':
        push_whole(static_cast<std::int32_t>(number<std::uint32_t>()));
        break;
      case 'K':
        push_whole(number<std::uint8_t>());
        break;
      case 'M':
        push_whole(number<std::uint16_t>());
        break;
      case 0x8a:
        long_number(number<std::uint8_t>());
        break;
      case 0x8b:
        long_number(number<std::uint32_t>());
        break;
      case 'G':
        take(8), push({});
        break;
      case 'X':
        push_text(text(number<std::uint32_t>()));
        break;
      case 0x8c:
        push_text(text(number<std::uint8_t>()));
        break;
      case 0x8d:
        push_text(text(number<std::uint64_t>()));
        break;
      case 'T':
        push_text(text(number<std::uint32_t>()));
        break;
      case 'U':
        push_text(text(number<std::uint8_t>()));
        break;
      case 'B':
        take(number<std::uint32_t>()), push({});
        break;
      case 'C':
        take(number<std::uint8_t>()), push({});
        break;
      case 0x8e:
        take(number<std::uint64_t>()), push({});
        break;
      case 'c': {
        const std::string module = line();
        push_text(module + "." + line(), Kind::name);
        break;
      }
      case 0x93: {
        const Node& name = node(pop());
        const Node& module = node(pop());
        if (name.kind != Kind::text || module.kind != Kind::text) damaged("its pickle is out of order");
        push_text(module.text.substr(0, kMaxName) + "." + name.text.substr(0, kMaxName), Kind::name);
        break;
      }
      case '}':
        push_kind(Kind::dict);
        break;
      case ']':
      case ')':
        push_kind(Kind::list);
        break;
      case 0x8f:
        push({});
        break;  // a set
      case 0x90:
        extend(pop_to_mark(), Kind::opaque);
        break;
      case 0x91:
        pop_to_mark(), push({});
        break;
      case 't':
      case 'l':
        push_list(pop_to_mark());
        break;
      case 'd': {
        const auto items = pop_to_mark();
        push_kind(Kind::dict);
        extend(items, Kind::dict);
        break;
      }
      case 0x85:
        tuple(1);
        break;
      case 0x86:
        tuple(2);
        break;
      case 0x87:
        tuple(3);
        break;
      case 'a': {
        const int item = pop();
        extend({item}, Kind::list);
        break;
      }
      case 'e':
        extend(pop_to_mark(), Kind::list);
        break;
      case 's': {
        const int value = pop(), key = pop();
        extend({key, value}, Kind::dict);
        break;
      }
      case 'u':
        extend(pop_to_mark(), Kind::dict);
        break;
      case 'q':
        put(number<std::uint8_t>());
        break;
      case 'r':
        put(number<std::uint32_t>());
        break;
      case 0x94:
        put(static_cast<std::uint32_t>(memo_.size()));
        break;
      case 'h':
        get(number<std::uint8_t>());
        break;
      case 'j':
        get(number<std::uint32_t>());
        break;
      case 'R':
      case 0x81:
        call();
        break;
      case 'b':
        pop(), top();
        break;  // what an object is made to hold: nothing that is a tensor needs it
      case 'Q':
        persistent();
        break;
      default:
        damaged("its pickle has a step that is not known (" + std::to_string(op) + ")");
    }
  }

  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  std::deque<Node> nodes_;  // references stay valid while it grows
  std::vector<int> stack_;
  std::unordered_map<std::uint32_t, int> memo_;
};

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
