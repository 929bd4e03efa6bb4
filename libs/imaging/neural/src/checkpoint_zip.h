// The zip that torch.save writes: parts as they lie in the file, none compressed. What does not fit is told, nothing is
// read beyond the file's end.
#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "osteo/imaging/neural/detail/checkpoint.h"

namespace osteo::inline imaging::checkpoint_file {

/// Throws Error(corrupt).
[[noreturn]] void damaged(const std::string& why);

/// `what` as the error calls it.
[[nodiscard]] std::vector<std::byte> bytes_of(const ByteSource& source, std::uint64_t offset, std::uint64_t count,
                                              std::uint64_t limit, const char* what);

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
  /// Reads the directory. `source` must outlive it.
  explicit Zip(const ByteSource& source);
  [[nodiscard]] const std::map<std::string, ZipEntry>& entries() const { return entries_; }
  [[nodiscard]] std::uint64_t data_offset(const ZipEntry& entry) const;
  [[nodiscard]] std::vector<std::byte> content(const ZipEntry& entry, std::uint64_t limit) const;

 private:
  const ByteSource& source_;
  std::map<std::string, ZipEntry> entries_;
};

}  // namespace osteo::inline imaging::checkpoint_file
