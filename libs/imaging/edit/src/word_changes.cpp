#include "word_changes.h"

#include <zstd.h>

#include <cstring>

#include "osteo/core/base/error.h"

namespace osteo::inline imaging {
namespace {

// Raw form: run after run of { first word, number of words, the words }.
struct Head {
  std::uint32_t first, count;
};

class Writer {
 public:
  void add(std::uint32_t word, std::uint64_t bits) {
    if (head_at_ == kNone || word != next_) {
      head_at_ = raw.size();
      put(Head{word, 0});
    }
    Head h{};
    std::memcpy(&h, raw.data() + head_at_, sizeof h);
    ++h.count;
    std::memcpy(raw.data() + head_at_, &h, sizeof h);
    put(bits);
    next_ = word + 1;
  }
  std::vector<std::byte> raw;

 private:
  static constexpr std::size_t kNone = ~std::size_t{0};
  template <class T>
  void put(const T& value) {
    const auto* const bytes = reinterpret_cast<const std::byte*>(&value);
    raw.insert(raw.end(), bytes, bytes + sizeof value);
  }
  std::size_t head_at_ = kNone;
  std::uint32_t next_ = 0;
};

}  // namespace

WordChanges::WordChanges(std::span<const std::uint64_t> before, std::span<const std::uint64_t> after) {
  Writer w;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (before[i] != after[i]) w.add(static_cast<std::uint32_t>(i), before[i] ^ after[i]);
  }
  pack(std::move(w.raw));
}

WordChanges::WordChanges(std::span<const std::pair<std::uint32_t, std::uint64_t>> changes) {
  Writer w;
  for (const auto& [word, bits] : changes) {
    if (bits != 0) w.add(word, bits);
  }
  pack(std::move(w.raw));
}

void WordChanges::pack(std::vector<std::byte> raw) {
  raw_bytes_ = raw.size();
  if (raw.size() > 512) {
    std::vector<std::byte> out(ZSTD_compressBound(raw.size()));
    const std::size_t n = ZSTD_compress(out.data(), out.size(), raw.data(), raw.size(), 1);
    if (ZSTD_isError(n) == 0 && n < raw.size()) {
      packed_.assign(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(n));
      return;
    }
  }
  raw.shrink_to_fit();
  packed_ = std::move(raw);
}

void WordChanges::apply(std::span<std::uint64_t> words) const {
  std::vector<std::byte> unpacked;
  const std::byte* at = packed_.data();
  if (packed_.size() != raw_bytes_) {
    unpacked.resize(raw_bytes_);
    const std::size_t n = ZSTD_decompress(unpacked.data(), unpacked.size(), packed_.data(), packed_.size());
    if (ZSTD_isError(n) != 0 || n != raw_bytes_)
      throw Error(ExitCode::failed, "the history of edits is damaged in memory");
    at = unpacked.data();
  }
  for (const std::byte* const end = at + raw_bytes_; at < end;) {
    Head h{};
    std::memcpy(&h, at, sizeof h);
    at += sizeof h;
    for (std::uint32_t i = 0; i < h.count; ++i, at += sizeof(std::uint64_t)) {
      std::uint64_t bits = 0;
      std::memcpy(&bits, at, sizeof bits);
      words[h.first + i] ^= bits;
    }
  }
}

}  // namespace osteo::inline imaging
