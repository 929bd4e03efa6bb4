// The packets of pairing: connection 0, kind, protocol, fields of fixed length, then a checksum. Private to
// libs/network/tutor.
#pragma once
#include <algorithm>
#include <cstring>

#include "osteo/network/tutor/pairing.h"

namespace osteo::inline network {

enum class PairingStep : std::uint8_t { ask = 1, challenge, prove, welcome, refused, again, wait };
/// Why: the code was wrong, too many wrong codes, the trainee's place is taken or nobody else can join, another
/// protocol.
enum class PairingRefusal : std::uint8_t { wrong_code = 1, locked, full, protocol };

/// What asks is longer than what it is answered with, so that nobody can have others flooded.
inline constexpr std::size_t kAskBytes = 128;
/// No secret is in it: it tells damage on the way, which must not count as a wrong code, from what was sent so.
inline constexpr std::size_t kChecksumBytes = 8;
[[nodiscard]] std::array<std::uint8_t, kChecksumBytes> packet_checksum(std::span<const std::uint8_t> bytes);

class PairingPacket {
 public:
  explicit PairingPacket(PairingStep step) : bytes(6, 0) {
    bytes[4] = static_cast<std::uint8_t>(step);
    bytes[5] = kTutorProtocol;
  }
  template <class T>
  PairingPacket& add(const T& value) {
    const auto* const from = reinterpret_cast<const std::uint8_t*>(&value);
    bytes.insert(bytes.end(), from, from + sizeof value);
    return *this;
  }
  /// With the checksum; padded with zeros to `least` bytes in all.
  [[nodiscard]] Bytes sealed(std::size_t least = 0) {
    if (bytes.size() + kChecksumBytes < least) bytes.resize(least - kChecksumBytes);
    add(packet_checksum(bytes));
    return std::move(bytes);
  }
  Bytes bytes;
};

/// Fields of a pairing packet in their order; `good` is false where it is too short. Whether it is whole() is another
/// question: one of another protocol may have no checksum.
class PairingFields {
 public:
  explicit PairingFields(std::span<const std::uint8_t> packet) : packet_(packet), left_(packet) {
    good = packet.size() >= 6 && std::all_of(packet.begin(), packet.begin() + 4, [](std::uint8_t b) { return b == 0; });
    if (!good) return;
    step = static_cast<PairingStep>(packet[4]);
    protocol = packet[5];
    left_ = packet.subspan(6);
  }
  template <class T>
  T take() {
    T value{};
    if (left_.size() < sizeof value) {
      good = false;
      return value;
    }
    std::memcpy(&value, left_.data(), sizeof value);
    left_ = left_.subspan(sizeof value);
    return value;
  }
  /// As it was sent. The checksum is no field: once.
  [[nodiscard]] bool whole() {
    if (left_.size() < kChecksumBytes) return false;
    left_ = left_.first(left_.size() - kChecksumBytes);
    const auto sum = packet_checksum(packet_.first(packet_.size() - kChecksumBytes));
    return std::equal(sum.begin(), sum.end(), packet_.end() - kChecksumBytes);
  }
  bool good = false;
  PairingStep step{};
  std::uint8_t protocol = 0;

 private:
  std::span<const std::uint8_t> packet_;
  std::span<const std::uint8_t> left_;
};

}  // namespace osteo::inline network
