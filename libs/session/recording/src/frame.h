// Frames of a session file.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace osteo::inline session {

constexpr std::uint32_t kMagic = 0x3246534f;     // "OSF2"
constexpr std::uint32_t kOldMagic = 0x3146534f;  // "OSF1"
enum FrameType : std::uint32_t {
  kHeaderFrame = 1,
  kRecordsFrame = 2,
  kGapFrame = 3,
  kCheckpointFrame = 4,
  kEndFrame = 5
};
constexpr std::uint32_t kLongestFrame = 64U << 20;  // also when it is no longer compressed

struct FrameHead {
  std::uint32_t magic = kMagic, type = 0, bytes = 0, crc = 0;
  std::uint64_t first_tick = 0, end_tick = 0;
};
static_assert(sizeof(FrameHead) == 32);

/// What stands in the head: over type, length, both ticks and the payload.
[[nodiscard]] std::uint32_t checksum(const FrameHead& head, std::span<const std::byte> payload);

/// One zstd frame that tells its size.
[[nodiscard]] std::vector<std::byte> compressed(std::span<const std::byte> bytes);
/// False where it is none, or of more than kLongestFrame.
[[nodiscard]] bool decompress(std::span<const std::byte> from, std::vector<std::byte>& to);

}  // namespace osteo::inline session
