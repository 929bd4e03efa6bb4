#include "sockets.h"

#include <netdb.h>

#include <cstring>

#include "osteo/core/base/error.h"
#include "osteo/network/wire/server.h"

namespace osteo::inline network {

WireAddress wire_address(const std::string& text) {
  const auto refuse = [&]() -> WireAddress {
    throw Error(ExitCode::usage, "'" + text + "' is no PORT or HOST:PORT", "as 18944, 192.0.2.7:18944 or [::1]:18944");
  };
  WireAddress a;
  const std::size_t colon = text.rfind(':');
  const std::string port = colon == std::string::npos ? text : text.substr(colon + 1);
  if (colon != std::string::npos) a.host = text.substr(0, colon);
  if (a.host.size() > 2 && a.host.front() == '[' && a.host.back() == ']') a.host = a.host.substr(1, a.host.size() - 2);
  if (a.host.empty() || port.empty() || port.size() > 5 || port.find_first_not_of("0123456789") != std::string::npos)
    return refuse();
  a.port = std::stoi(port);
  return a.port > 65535 ? refuse() : a;
}

std::vector<SocketAddress> addresses_of(const std::string& host, int port, bool to_listen) {
  addrinfo hints{}, *found = nullptr;
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = to_listen ? AI_PASSIVE : 0;
  if (const int why = ::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found);
      why != 0 || found == nullptr)
    throw Error(ExitCode::usage, "there is no address '" + host + "': " + ::gai_strerror(why),
                "give HOST:PORT, as 192.0.2.7:18944");
  std::vector<SocketAddress> all;
  for (const addrinfo* a = found; a != nullptr; a = a->ai_next) {
    SocketAddress one;
    std::memcpy(&one.storage, a->ai_addr, a->ai_addrlen);
    one.size = a->ai_addrlen;
    all.push_back(one);
  }
  ::freeaddrinfo(found);
  return all;
}

}  // namespace osteo::inline network
