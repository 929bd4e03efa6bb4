#include "checkpoint_zip.h"

#include <algorithm>
#include <optional>

#include "osteo/core/base/error.h"

namespace osteo::inline imaging::checkpoint_file {
namespace {

constexpr std::uint64_t kMaxDirectoryBytes = 16 << 20;

// Sizes above 4 GiB stand in an extra field, in this order, each only where the short one is full.
void wide_sizes(std::span<const std::byte> extra, std::uint32_t packed, ZipEntry& entry) {
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

}  // namespace

void damaged(const std::string& why) {
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

Zip::Zip(const ByteSource& source) : source_(source) {
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
    wide_sizes(std::span(directory).subspan(at + 46 + name_size, extra_size), little<std::uint32_t>(directory, at + 20),
               entry);
    if (method != 0) damaged("'" + name.substr(0, 60) + "' is compressed");
    entries_[name] = entry;
    at = next;
  }
}

std::uint64_t Zip::data_offset(const ZipEntry& entry) const {
  const auto local = bytes_of(source_, entry.header, 30, 30, "a part");
  if (little<std::uint32_t>(local, 0) != 0x04034b50) damaged("a part is damaged");
  return entry.header + 30 + little<std::uint16_t>(local, 26) + little<std::uint16_t>(local, 28);
}

std::vector<std::byte> Zip::content(const ZipEntry& entry, std::uint64_t limit) const {
  return bytes_of(source_, data_offset(entry), entry.size, limit, "a part");
}

}  // namespace osteo::inline imaging::checkpoint_file
