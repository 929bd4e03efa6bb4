// What changed between two states of an array of words: enough to go either way. Private to libs/imaging/edit.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace osteo::inline imaging {

/// Applied twice it is undone: runs of words, each to be combined by exclusive or, packed by zstd where that is
/// shorter.
class WordChanges {
 public:
  WordChanges() = default;
  /// O(words), in memory of what differs.
  WordChanges(std::span<const std::uint64_t> before, std::span<const std::uint64_t> after);
  /// Number of a word, ascending, each once, and its exclusive or.
  explicit WordChanges(std::span<const std::pair<std::uint32_t, std::uint64_t>> changes);

  void apply(std::span<std::uint64_t> words) const;
  [[nodiscard]] bool empty() const { return raw_bytes_ == 0; }
  [[nodiscard]] std::size_t memory_bytes() const { return packed_.capacity() + sizeof *this; }

 private:
  void pack(std::vector<std::byte> raw);
  std::vector<std::byte> packed_;
  std::size_t raw_bytes_ = 0;  // as long as packed_: not packed
};

}  // namespace osteo::inline imaging
