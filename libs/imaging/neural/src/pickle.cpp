#include "pickle.h"

#include <utility>

#include "checkpoint_zip.h"

namespace osteo::inline imaging::checkpoint_file {
namespace {

constexpr std::size_t kMaxNodes = 1 << 21;
constexpr std::size_t kMaxName = 256;

}  // namespace

int Pickle::run() {
  for (;;) {
    const auto op = static_cast<unsigned char>(take(1)[0]);
    if (op == '.') return pop();
    step(op);
  }
}

const PickleNode* Pickle::find(const PickleNode& dict, std::string_view key) const {
  if (dict.kind != Node::Kind::dict) return nullptr;
  for (std::size_t i = 0; i + 1 < dict.items.size(); i += 2) {
    const Node& k = node(dict.items[i]);
    if (k.kind == Node::Kind::text && k.text == key) return &node(dict.items[i + 1]);
  }
  return nullptr;
}

std::span<const std::byte> Pickle::take(std::uint64_t count) {
  if (count > bytes_.size() - at_) damaged("its pickle ends early");
  at_ += count;
  return bytes_.subspan(at_ - count, count);
}

template <class T>
T Pickle::number() {
  return little<T>(take(sizeof(T)), 0);
}

std::string Pickle::text(std::uint64_t count) {
  const auto bytes = take(count);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string Pickle::line() {
  std::string s;
  for (;;) {
    const auto c = static_cast<char>(take(1)[0]);
    if (c == '\n') return s;
    s += c;
  }
}

int Pickle::make(Node n) {
  if (nodes_.size() >= kMaxNodes) damaged("its pickle holds too much");
  nodes_.push_back(std::move(n));
  return static_cast<int>(nodes_.size()) - 1;
}

void Pickle::push(Node n) {
  stack_.push_back(make(std::move(n)));
}

void Pickle::push_kind(Node::Kind kind) {
  Node n;
  n.kind = kind;
  push(std::move(n));
}

void Pickle::push_whole(std::int64_t v, Node::Kind kind) {
  Node n;
  n.kind = kind;
  n.whole = v;
  push(std::move(n));
}

void Pickle::push_text(std::string s, Node::Kind kind) {
  Node n;
  n.kind = kind;
  n.text = std::move(s);
  push(std::move(n));
}

int Pickle::pop() {
  if (stack_.empty() || node(stack_.back()).kind == Node::Kind::mark) damaged("its pickle is out of order");
  const int top = stack_.back();
  stack_.pop_back();
  return top;
}

PickleNode& Pickle::top() {
  if (stack_.empty()) damaged("its pickle is out of order");
  return nodes_[static_cast<std::size_t>(stack_.back())];
}

std::vector<int> Pickle::pop_to_mark() {
  std::size_t at = stack_.size();
  while (at > 0 && node(stack_[at - 1]).kind != Node::Kind::mark) --at;
  if (at == 0) damaged("its pickle is out of order");
  std::vector<int> items(stack_.begin() + static_cast<std::ptrdiff_t>(at), stack_.end());
  stack_.resize(at - 1);
  return items;
}

void Pickle::push_list(std::vector<int> items) {
  Node n;
  n.kind = Node::Kind::list;
  n.items = std::move(items);
  push(std::move(n));
}

void Pickle::tuple(int count) {
  std::vector<int> items(static_cast<std::size_t>(count));
  for (int i = count; i-- > 0;) items[static_cast<std::size_t>(i)] = pop();
  push_list(std::move(items));
}

void Pickle::put(std::uint32_t key) {
  if (stack_.empty()) damaged("its pickle is out of order");
  memo_[key] = stack_.back();
}

void Pickle::get(std::uint32_t key) {
  const auto it = memo_.find(key);
  if (it == memo_.end()) damaged("its pickle is out of order");
  if (stack_.size() >= kMaxNodes) damaged("its pickle holds too much");
  stack_.push_back(it->second);
}

void Pickle::extend(const std::vector<int>& items, Node::Kind kind) {
  Node& to = top();
  if (to.kind == Node::Kind::opaque) return;
  if (to.kind != kind || (kind == Node::Kind::dict && items.size() % 2 != 0)) damaged("its pickle is out of order");
  to.items.insert(to.items.end(), items.begin(), items.end());
}

void Pickle::call() {
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

void Pickle::persistent() {
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

void Pickle::long_number(std::uint64_t count) {
  const auto bytes = take(count);
  if (count > 8) return push({});
  std::uint64_t v = 0;
  for (std::size_t i = 0; i < count; ++i) v |= static_cast<std::uint64_t>(bytes[i]) << (8 * i);
  if (count > 0 && count < 8 && (static_cast<unsigned>(bytes[count - 1]) & 0x80U) != 0)
    v |= ~std::uint64_t{0} << (8 * count);
  push_whole(static_cast<std::int64_t>(v));
}

void Pickle::step(unsigned char op) {
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

}  // namespace osteo::inline imaging::checkpoint_file
