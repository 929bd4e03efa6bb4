// What two machines tell each other in live tutoring, as bytes. Pure: no socket, no clock, no key.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "osteo/simulation/bone/action.h"
#include "osteo/simulation/haptics/stream.h"

namespace osteo::inline network {

/// Raised when a packet means something else: others are not understood, and say so.
inline constexpr std::uint8_t kTutorProtocol = 6;
/// With what encryption adds it stays under the usual 1280 bytes of a path.
inline constexpr std::size_t kMaxPacketBytes = 1200;
using Bytes = std::vector<std::uint8_t>;

/// Where a packet comes from or goes to. IPv4 as IPv6 has it (mapped, RFC 4291).
struct UdpPeer {
  std::array<std::uint8_t, 16> address{};
  std::uint32_t scope = 0;  ///< of an address that is one on each link
  std::uint16_t port = 0;
  friend bool operator==(const UdpPeer&, const UdpPeer&) = default;
};

/// When it was sent by the sender's clock, and what was last heard: enough for both to know delay and offset (NTP's
/// four times).
struct WireTimes {
  std::int64_t sent_us = 0;
  std::int64_t echo_us = 0;  ///< `sent_us` of the last packet heard; 0: none yet
  std::int64_t held_us = 0;  ///< since that was heard
};

/// Bone of a copy up to a tick, as one number: over all changes of all ticks before.
struct BoneMark {
  std::uint64_t tick = 0, hash = 0;
  friend bool operator==(const BoneMark&, const BoneMark&) = default;
};

/// From who joined: the newest samples of the hand (none from a watcher), and how far its copy is.
struct HandPacket {
  static constexpr std::size_t kMax = 16;
  WireTimes times;
  std::uint64_t next_tick = 0;   ///< of the log: the first that it lacks
  std::uint32_t blob_bytes = 0;  ///< of the settings: so many it has
  bool ready = false;            ///< its copy is made: a session that waits for it may begin
  BoneMark mark;
  std::uint64_t newest = 0;  ///< number of samples.back(), by the sender's own ticks
  std::vector<DeviceSample> samples;
};

/// How far a session is: it runs; its last tick was `now_tick` less one; its host could not follow it and can say no
/// more of it.
enum class LogState : std::uint8_t { runs, over, lost };

/// From who runs the session: ticks as they were, with what was done at their beginnings.
struct LogPacket {
  static constexpr std::size_t kMaxTicks = 12, kMaxActions = 3;
  WireTimes times;
  std::uint64_t session = 0;  ///< another number, another session
  std::uint64_t first_tick = 0;
  std::uint64_t now_tick = 0;  ///< that the session has come to
  LogState state = LogState::runs;
  BoneMark mark;
  std::uint8_t hands = 2;
  std::vector<DeviceSample> samples;  ///< of each tick all hands
  std::vector<SceneAction> actions;   ///< of these ticks; with the last of a session that is over those behind it too
};

/// A piece of what a copy has to know before the first tick.
struct BlobPacket {
  static constexpr std::size_t kMax = 1000;
  static constexpr std::uint32_t kMaxTotal = 1U << 24;
  WireTimes times;
  std::uint64_t session = 0;
  std::uint32_t total = 0, offset = 0;
  Bytes bytes;
};

[[nodiscard]] Bytes encode(const HandPacket& p);
[[nodiscard]] Bytes encode(const LogPacket& p);
[[nodiscard]] Bytes encode(const BlobPacket& p);
/// Nothing for what is too short, too long, of another kind, or says of itself what is not so. Poses may be anything:
/// the servo's checks are for those.
[[nodiscard]] std::optional<HandPacket> decode_hand(std::span<const std::uint8_t> bytes);
[[nodiscard]] std::optional<LogPacket> decode_log(std::span<const std::uint8_t> bytes);
[[nodiscard]] std::optional<BlobPacket> decode_blob(std::span<const std::uint8_t> bytes);

}  // namespace osteo::inline network
