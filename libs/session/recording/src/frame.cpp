#include "frame.h"

#include <zlib.h>
#include <zstd.h>

#include <bit>

#include "osteo/core/base/error.h"

namespace osteo::inline session {

static_assert(std::endian::native == std::endian::little, "session files are little endian");

std::uint32_t checksum(const FrameHead& head, std::span<const std::byte> payload) {
  const auto add = [](uLong crc, const void* bytes, std::size_t n) {
    return ::crc32(crc, static_cast<const Bytef*>(bytes), static_cast<uInt>(n));
  };
  uLong crc = add(0, &head.type, 2 * sizeof head.type);
  crc = add(crc, &head.first_tick, 2 * sizeof head.first_tick);
  return static_cast<std::uint32_t>(add(crc, payload.data(), payload.size()));
}

std::vector<std::byte> compressed(std::span<const std::byte> bytes) {
  constexpr int kLevel = 3;  // higher ones gain 2 % and take ten times as long
  std::vector<std::byte> out(ZSTD_compressBound(bytes.size()));
  const std::size_t n = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), kLevel);
  if (ZSTD_isError(n) != 0)
    throw Error(ExitCode::resources, "the session cannot be compressed", "it takes some memory");
  out.resize(n);
  return out;
}

bool decompress(std::span<const std::byte> from, std::vector<std::byte>& to) {
  const auto size = ZSTD_getFrameContentSize(from.data(), from.size());
  if (size > kLongestFrame) return false;  // also unknown, or none
  to.resize(size);
  return ZSTD_decompress(to.data(), to.size(), from.data(), from.size()) == size;
}

}  // namespace osteo::inline session
