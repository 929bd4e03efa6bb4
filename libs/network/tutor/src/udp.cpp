#include "osteo/network/tutor/udp.h"

#include <arpa/inet.h>
#include <net/if.h>
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "osteo/core/base/error.h"

namespace osteo::inline network {
namespace {

constexpr std::array<std::uint8_t, 12> kMapped{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};

bool is_mapped(const UdpPeer& p) {
  return std::equal(kMapped.begin(), kMapped.end(), p.address.begin());
}

struct Address {
  sockaddr_storage storage{};
  socklen_t length = sizeof(sockaddr_storage);
  sockaddr* any() { return reinterpret_cast<sockaddr*>(&storage); }
};

UdpPeer peer_of(const sockaddr_storage& a) {
  UdpPeer p;
  if (a.ss_family == AF_INET) {
    sockaddr_in v4{};
    std::memcpy(&v4, &a, sizeof v4);
    std::copy(kMapped.begin(), kMapped.end(), p.address.begin());
    std::memcpy(p.address.data() + kMapped.size(), &v4.sin_addr, 4);
    p.port = ntohs(v4.sin_port);
  } else {
    sockaddr_in6 v6{};
    std::memcpy(&v6, &a, sizeof v6);
    std::memcpy(p.address.data(), &v6.sin6_addr, 16);
    p.scope = v6.sin6_scope_id;
    p.port = ntohs(v6.sin6_port);
  }
  return p;
}

// For a socket of this family: one of IPv6 takes both.
Address address_of(const UdpPeer& p, int family) {
  Address a;
  if (family == AF_INET) {
    sockaddr_in v4{};
    v4.sin_family = AF_INET;
    std::memcpy(&v4.sin_addr, p.address.data() + kMapped.size(), 4);
    v4.sin_port = htons(p.port);
    std::memcpy(&a.storage, &v4, sizeof v4);
    a.length = sizeof v4;
  } else {
    sockaddr_in6 v6{};
    v6.sin6_family = AF_INET6;
    std::memcpy(&v6.sin6_addr, p.address.data(), 16);
    v6.sin6_scope_id = p.scope;
    v6.sin6_port = htons(p.port);
    std::memcpy(&a.storage, &v6, sizeof v6);
    a.length = sizeof v6;
  }
  return a;
}

Address resolve(const std::string& name, const std::string& port) {
  addrinfo hints{}, *found = nullptr;
  hints.ai_socktype = SOCK_DGRAM;
  if (const int why = ::getaddrinfo(name.c_str(), port.c_str(), &hints, &found); why != 0 || found == nullptr)
    throw Error(ExitCode::usage, "there is no address '" + name + "': " + ::gai_strerror(why),
                "give HOST:PORT, as 192.0.2.7:18950 or [2001:db8::7]:18950");
  Address a;
  std::memcpy(&a.storage, found->ai_addr, found->ai_addrlen);
  a.length = found->ai_addrlen;
  ::freeaddrinfo(found);
  return a;
}

// A brace around an address of IPv6 keeps its colons from that of the port.
std::string bare(const std::string& host) {
  return host.size() > 2 && host.front() == '[' && host.back() == ']' ? host.substr(1, host.size() - 2) : host;
}

}  // namespace

UdpPeer udp_peer(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  const std::string host = text.substr(0, std::min(colon, text.size())),
                    port = colon == std::string::npos ? "" : text.substr(colon + 1);
  const bool two = host.find(':') != std::string::npos && (host.front() != '[' || host.back() != ']');
  if (two || host.empty() || port.empty() || port.size() > 5 ||
      port.find_first_not_of("0123456789") != std::string::npos || std::stoi(port) > 65535 || std::stoi(port) == 0)
    throw Error(ExitCode::usage, "'" + text + "' is no HOST:PORT",
                "as the host shows it: 192.0.2.7:18950, or [2001:db8::7]:18950");
  return peer_of(resolve(bare(host), port).storage);
}

std::string udp_name(const UdpPeer& peer) {
  char text[INET6_ADDRSTRLEN] = {};
  if (is_mapped(peer)) {
    ::inet_ntop(AF_INET, peer.address.data() + kMapped.size(), text, sizeof text);
    return std::string(text) + ":" + std::to_string(peer.port);
  }
  ::inet_ntop(AF_INET6, peer.address.data(), text, sizeof text);
  char link[IF_NAMESIZE] = {};
  const bool scoped = peer.scope != 0 && ::if_indextoname(peer.scope, link) != nullptr;
  return "[" + std::string(text) + (scoped ? "%" + std::string(link) : "") + "]:" + std::to_string(peer.port);
}

UdpSocket::UdpSocket(const std::string& address, int port) {
  Address a;
  if (!address.empty()) {
    a = resolve(bare(address), std::to_string(port));
  } else {
    a = address_of({{}, 0, static_cast<std::uint16_t>(port)}, AF_INET6);
  }
  family_ = a.storage.ss_family;
  fd_ = ::socket(family_, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd_ < 0 && address.empty()) {  // a machine without IPv6
    a = resolve("0.0.0.0", std::to_string(port));
    family_ = AF_INET;
    fd_ = ::socket(family_, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  }
  if (fd_ < 0) throw Error(ExitCode::failed, std::string("no socket: ") + std::strerror(errno));
  if (family_ == AF_INET6) {
    const int only = 0;
    static_cast<void>(::setsockopt(fd_, IPPROTO_IPV6, IPV6_V6ONLY, &only, sizeof only));
  }
  if (::bind(fd_, a.any(), a.length) != 0) {
    const int why = errno;
    ::close(fd_);
    throw Error(
        why == EADDRNOTAVAIL ? ExitCode::usage : ExitCode::failed,
        "cannot listen on " + udp_name(peer_of(a.storage)) + ": " + std::strerror(why),
        why == EADDRINUSE ? "another program has this port; give another --port" : "give an address of this machine");
  }
}

UdpSocket::~UdpSocket() {
  ::close(fd_);
}

int UdpSocket::port() const {
  Address a;
  ::getsockname(fd_, a.any(), &a.length);
  return peer_of(a.storage).port;
}

bool UdpSocket::send(const UdpPeer& to, std::span<const std::uint8_t> bytes) noexcept {
  if (family_ == AF_INET && !is_mapped(to)) return false;
  Address a = address_of(to, family_);
  return ::sendto(fd_, bytes.data(), bytes.size(), 0, a.any(), a.length) >= 0;
}

std::optional<std::span<const std::uint8_t>> UdpSocket::receive(UdpPeer& from) noexcept {
  Address a;
  const ssize_t n = ::recvfrom(fd_, buffer_.data(), buffer_.size(), 0, a.any(), &a.length);
  if (n < 0) return std::nullopt;
  from = peer_of(a.storage);
  return std::span<const std::uint8_t>(buffer_.data(), static_cast<std::size_t>(n));
}

void UdpSocket::wait_ms(int most) noexcept {
  pollfd p{fd_, POLLIN, 0};
  static_cast<void>(::poll(&p, 1, most));
}

}  // namespace osteo::inline network
