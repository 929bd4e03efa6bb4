#include "osteo/network/wire/server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>

#include "osteo/core/base/error.h"
#include "osteo/core/rt/loop.h"
#include "sockets.h"

namespace osteo::inline network {
namespace {

double now_seconds() {
  return static_cast<double>(monotonic_ns()) / 1e9;
}

}  // namespace

WireServer::WireServer(const WireAddress& address, Notice notice, double most_silent_s)
    : notice_(std::move(notice)), most_silent_s_(most_silent_s) {
  const std::string name = address.host + ":" + std::to_string(address.port);
  int why = 0;
  for (const SocketAddress& a : addresses_of(address.host, address.port, true)) {
    listen_ = ::socket(a.family(), SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    const int yes = 1;
    ::setsockopt(listen_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    if (listen_ >= 0 && ::bind(listen_, a.get(), a.size) == 0 && ::listen(listen_, 16) == 0) break;
    why = errno;
    if (listen_ >= 0) ::close(listen_);
    listen_ = -1;
  }
  if (listen_ < 0)
    throw Error(why == EADDRNOTAVAIL ? ExitCode::usage : ExitCode::failed,
                "cannot listen on " + name + ": " + std::strerror(why),
                why == EADDRINUSE ? "another program has this port; name another" : "give an address of this machine");
  SocketAddress own;
  own.size = sizeof own.storage;
  ::getsockname(listen_, own.get(), &own.size);
  port_ = own.port();
  wake_ = ::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  thread_ = std::thread([this] { run(); });
}

WireServer::~WireServer() {
  stop_ = true;
  static_cast<void>(::eventfd_write(wake_, 1));
  thread_.join();
  for (const auto& c : clients_) ::close(c->fd);
  ::close(listen_);
  ::close(wake_);
}

void WireServer::queue(Client& client, const Shared& message) {
  // What is told of drops comes behind what the client still gets of before.
  if (client.dropped > 0 && client.queued + message->size() <= kMaxQueued / 2 && notice_) {
    const auto notice = std::make_shared<const WireBytes>(notice_(client.dropped));
    client.dropped = 0;
    client.queued += notice->size();
    client.queue.push_back(notice);
  }
  if (client.dropped > 0 || client.queued + message->size() > kMaxQueued) {
    ++client.dropped;
    ++counts_.dropped;
    return;
  }
  client.queued += message->size();
  client.queue.push_back(message);
}

void WireServer::send(WireBytes message) {
  const auto shared = std::make_shared<const WireBytes>(std::move(message));
  {
    const std::lock_guard lock(mutex_);
    if (clients_.empty()) return;
    for (const auto& c : clients_) queue(*c, shared);
  }
  static_cast<void>(::eventfd_write(wake_, 1));
}

void WireServer::greet(std::vector<WireBytes> messages) {
  std::vector<Shared> all;
  for (WireBytes& m : messages) all.push_back(std::make_shared<const WireBytes>(std::move(m)));
  {
    const std::lock_guard lock(mutex_);
    greeting_ = std::move(all);
    for (const auto& c : clients_) {
      for (const Shared& m : greeting_) queue(*c, m);
    }
  }
  static_cast<void>(::eventfd_write(wake_, 1));
}

void WireServer::answer(Answer answer) {
  const std::lock_guard lock(mutex_);
  answer_ = std::make_shared<const Answer>(std::move(answer));
}

bool WireServer::wait_for_clients(std::size_t clients, double most_s, const std::function<bool()>& stop) const {
  const double until = now_seconds() + most_s;
  while (counts().clients < clients) {
    if (now_seconds() > until || (stop && stop())) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return true;
}

bool WireServer::flush(double most_s) const {
  const double until = now_seconds() + most_s;
  while (true) {
    {
      const std::lock_guard lock(mutex_);
      if (std::all_of(clients_.begin(), clients_.end(), [](const auto& c) { return c->queue.empty(); })) return true;
    }
    if (now_seconds() > until) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

WireCounts WireServer::counts() const {
  const std::lock_guard lock(mutex_);
  WireCounts c = counts_;
  c.clients = clients_.size();
  return c;
}

void WireServer::accept_one() {
  const int fd = ::accept4(listen_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (fd < 0) return;
  const std::lock_guard lock(mutex_);
  if (clients_.size() >= kMaxClients) {
    ++counts_.turned_away;
    ::close(fd);
    return;
  }
  const int yes = 1;
  ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  ++counts_.accepted;
  clients_.push_back(std::make_unique<Client>());
  Client& c = *clients_.back();
  c.fd = fd;
  c.number = counts_.accepted;
  c.took_s = now_seconds();
  for (const Shared& m : greeting_) queue(c, m);
}

void WireServer::read_from(Client& client, double now_s) {
  std::array<std::uint8_t, 16384> bytes;
  if (now_s - client.second_s >= 1) {
    client.second_s = now_s;
    client.heard = 0;
  }
  const ssize_t n = ::recv(client.fd, bytes.data(), bytes.size(), 0);
  if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) client.gone = true;
  if (n <= 0) return;
  client.heard += static_cast<std::size_t>(n);
  std::shared_ptr<const Answer> answer;
  {
    const std::lock_guard lock(mutex_);
    counts_.heard += static_cast<std::uint64_t>(n);
    answer = answer_;
  }
  if (!answer || !client.understood) return;
  client.understood = client.parser.feed({bytes.data(), static_cast<std::size_t>(n)}, [&](const IgtlMessage& m) {
    for (WireBytes& b : answer->hear(client.number, m)) {
      const auto message = std::make_shared<const WireBytes>(std::move(b));
      const std::lock_guard lock(mutex_);
      queue(client, message);
    }
  });
}

void WireServer::write_to(Client& client, double now_s) {
  // The lock is for the queue; nobody waits for it while the network is asked.
  for (int messages = 0; messages < 64; ++messages) {
    Shared first;
    {
      const std::lock_guard lock(mutex_);
      if (client.queue.empty()) {
        client.took_s = now_s;
        return;
      }
      first = client.queue.front();
    }
    const ssize_t n = ::send(client.fd, first->data() + client.begun, first->size() - client.begun, MSG_NOSIGNAL);
    if (n < 0) {
      if (errno != EAGAIN && errno != EINTR) client.gone = true;
      return;
    }
    client.took_s = now_s;
    client.begun += static_cast<std::size_t>(n);
    const std::lock_guard lock(mutex_);
    counts_.bytes += static_cast<std::uint64_t>(n);
    if (client.begun < first->size()) return;
    client.begun = 0;
    client.queued -= first->size();
    client.queue.pop_front();
    ++counts_.messages;
  }
}

void WireServer::run() {
  ::pthread_setname_np(::pthread_self(), "osteo-wire");
  std::vector<pollfd> polled;
  while (!stop_) {
    polled.assign({{listen_, POLLIN, 0}, {wake_, POLLIN, 0}});
    const double before_s = now_seconds();
    {
      const std::lock_guard lock(mutex_);
      for (const auto& c : clients_) {
        // Who talks too much is not listened to until the next second.
        const bool listens = c->heard < kMaxHeard || before_s - c->second_s >= 1;
        polled.push_back({c->fd, static_cast<short>((listens ? POLLIN : 0) | (c->queue.empty() ? 0 : POLLOUT)), 0});
      }
    }
    static_cast<void>(::poll(polled.data(), polled.size(), 200));
    const double now_s = now_seconds();
    eventfd_t woken = 0;
    if ((polled[1].revents & POLLIN) != 0) static_cast<void>(::eventfd_read(wake_, &woken));
    // Only this thread makes and ends clients.
    const std::size_t known = polled.size() - 2;
    for (std::size_t i = 0; i < known; ++i) {
      Client& c = *clients_[i];
      const auto what = polled[i + 2].revents;
      if ((what & (POLLIN | POLLHUP | POLLERR)) != 0) read_from(c, now_s);
      write_to(c, now_s);
      if (now_s - c.took_s > most_silent_s_) c.gone = true;
    }
    if ((polled[0].revents & POLLIN) != 0) accept_one();
    const std::lock_guard lock(mutex_);
    std::erase_if(clients_, [this](const auto& c) {
      if (c->gone && answer_) answer_->gone(c->number);
      if (c->gone) ::close(c->fd);
      return c->gone;
    });
  }
}

}  // namespace osteo::inline network
