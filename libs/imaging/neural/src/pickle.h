// A pickle of Python as torch.save writes it, read without running anything: what it would call is looked up by name,
// and of that only what makes a tensor is understood.
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace osteo::inline imaging::checkpoint_file {

/// What a pickle can hold here. `opaque` stands for everything else: it is carried along and never looked into.
struct PickleNode {
  enum class Kind { opaque, none, flag, whole, text, list, dict, name, storage, tensor, mark } kind{};
  std::int64_t whole = 0;  ///< tensor: its first value
  std::string text;        ///< name: "module.class"
  std::vector<int> items;  ///< list and tuple: parts; dict: key, value, key, ...; storage: class, key;
                           ///< tensor: storage, shape, strides
};

class Pickle {
 public:
  using Node = PickleNode;
  explicit Pickle(std::span<const std::byte> bytes) : bytes_(bytes) {}

  /// The value that is left; node() and find() look into it.
  [[nodiscard]] int run();
  [[nodiscard]] const Node& node(int at) const { return nodes_[static_cast<std::size_t>(at)]; }
  /// The value of a text key; nullptr where there is none.
  [[nodiscard]] const Node* find(const Node& dict, std::string_view key) const;

 private:
  std::span<const std::byte> take(std::uint64_t count);
  template <class T>
  T number();
  std::string text(std::uint64_t count);
  std::string line();
  int make(Node n);
  void push(Node n);
  void push_kind(Node::Kind kind);
  void push_whole(std::int64_t v, Node::Kind kind = Node::Kind::whole);
  void push_text(std::string s, Node::Kind kind = Node::Kind::text);
  int pop();
  Node& top();
  std::vector<int> pop_to_mark();
  void push_list(std::vector<int> items);
  void tuple(int count);
  void put(std::uint32_t key);
  void get(std::uint32_t key);
  // Parts of lists and dicts. Each was put on the stack by a step of its own, so that their number is bounded as well.
  void extend(const std::vector<int>& items, Node::Kind kind);
  void call();
  void persistent();
  void long_number(std::uint64_t count);
  void step(unsigned char op);

  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  std::deque<Node> nodes_;  // references stay valid while it grows
  std::vector<int> stack_;
  std::unordered_map<std::uint32_t, int> memo_;
};

}  // namespace osteo::inline imaging::checkpoint_file
