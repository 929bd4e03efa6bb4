// UDP over IPv4 and IPv6, without waiting for anyone.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "osteo/network/tutor/wire.h"

namespace osteo::inline network {

/// "192.0.2.7:18950", "[2001:db8::7]:18950", or a name before the colon. Error(usage) where there is no such address,
/// with what is expected.
[[nodiscard]] UdpPeer udp_peer(const std::string& host_and_port);
[[nodiscard]] std::string udp_name(const UdpPeer& peer);

/// Owned by one thread.
class UdpSocket {
 public:
  /// Listens there; port 0: any that is free. "": at any address, of IPv6 where the machine has it, and of IPv4.
  /// Errors: usage, no such address on this machine; failed, the port is taken.
  UdpSocket(const std::string& address, int port);
  ~UdpSocket();
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;
  [[nodiscard]] int port() const;
  /// What cannot be sent is lost, as on the way; false: it was lost here.
  bool send(const UdpPeer& to, std::span<const std::uint8_t> bytes) noexcept;
  /// The next packet, where one is here; longer ones than kMaxPacketBytes and 64 are cut, which whoever opens them
  /// finds.
  [[nodiscard]] std::optional<std::span<const std::uint8_t>> receive(UdpPeer& from) noexcept;
  /// Until a packet is here, at most so long.
  void wait_ms(int most) noexcept;

 private:
  int fd_ = -1, family_ = 0;
  std::array<std::uint8_t, kMaxPacketBytes + 64> buffer_{};
};

}  // namespace osteo::inline network
