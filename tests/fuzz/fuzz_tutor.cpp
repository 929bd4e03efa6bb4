// Live tutoring: packets from anyone at the host and at who has joined, and the decoders behind the seal.
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>

#include "osteo/network/tutor/live.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace osteo;
  const std::span<const std::uint8_t> all(data, size);
  if (const auto p = decode_hand(all)) static_cast<void>(encode(*p));
  if (const auto p = decode_log(all)) static_cast<void>(encode(*p));
  if (const auto p = decode_blob(all)) static_cast<void>(encode(*p));
  // A host and a guest cost more than a packet: for one first byte in eight. Packets come one after another, each
  // behind its length.
  if (size == 0 || data[0] % 8 != 0) return 0;
  static const auto far = std::make_shared<FarDevice>();
  LiveHost host("K7MX2QPA", Bytes(2500, 7), 2, far);
  LiveGuest guest("K7MX2QPA", JoinRole::trainee, far);
  std::int64_t now_us = 0;
  for (std::size_t at = 1; at + 1 < size;) {
    const std::size_t length = std::min<std::size_t>(data[at] * 6U, size - at - 1);
    const auto packet = all.subspan(at + 1, length);
    UdpPeer from;
    from.port = data[at] % 4;
    host.receive(from, packet, now_us);
    guest.receive(packet, now_us);
    at += 1 + length;
    now_us += 100'000;
  }
  for (const OutgoingPacket& o : host.poll(now_us)) guest.receive(o.bytes, now_us);
  for (const Bytes& b : guest.poll(now_us)) host.receive({}, b, now_us);
  return 0;
}
