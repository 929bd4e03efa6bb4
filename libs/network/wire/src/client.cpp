#include "osteo/network/wire/client.h"

#include <netinet/tcp.h>
#include <poll.h>
#include <pthread.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>

#include "osteo/core/base/error.h"
#include "osteo/core/rt/loop.h"
#include "sockets.h"

namespace osteo::inline network {
namespace {

constexpr int kSliceMs = 10;
constexpr std::size_t kSliceBytes = WireClient::kMaxBytes / (1000 / kSliceMs);

}  // namespace

WireClient::WireClient(const WireAddress& server, std::size_t most_body, Take take, std::function<void()> idle)
    : server_(server), most_body_(most_body), take_(std::move(take)), idle_(std::move(idle)) {
  thread_ = std::thread([this] { run(); });
}

WireClient::~WireClient() {
  stop_ = true;
  thread_.join();
}

WireClient::Counts WireClient::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

std::string WireClient::trouble() const {
  const std::lock_guard lock(mutex_);
  return trouble_;
}

void WireClient::say(const std::string& words) {
  const std::lock_guard lock(mutex_);
  trouble_ = words.empty() ? words : server_.host + ":" + std::to_string(server_.port) + ": " + words;
}

void WireClient::send(std::span<const std::uint8_t> message) {
  const std::lock_guard lock(mutex_);
  if (waiting_.size() + message.size() <= kMaxWaiting) waiting_.insert(waiting_.end(), message.begin(), message.end());
}

void WireClient::send_waiting(int fd) {
  const std::lock_guard lock(mutex_);
  if (waiting_.empty()) return;
  const ssize_t n = ::send(fd, waiting_.data(), waiting_.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  if (n > 0) waiting_.erase(waiting_.begin(), waiting_.begin() + n);
}

int WireClient::connect_now() {
  std::string why = "no address";
  try {
    for (const SocketAddress& a : addresses_of(server_.host, server_.port, false)) {
      const int fd = ::socket(a.family(), SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
      if (fd < 0) continue;
      int error = ::connect(fd, a.get(), a.size) == 0 ? 0 : errno;
      for (int waited = 0; error == EINPROGRESS && waited < 2000 && !stop_; waited += kSliceMs) {
        pollfd p{fd, POLLOUT, 0};
        if (::poll(&p, 1, kSliceMs) <= 0) continue;
        socklen_t size = sizeof error;
        ::getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size);
      }
      if (error == 0) return fd;
      why = error == EINPROGRESS ? "no answer" : std::strerror(error);
      ::close(fd);
    }
  } catch (const Error& e) {
    why = e.what();
  }
  say("not connected: " + why);
  return -1;
}

void WireClient::listen_to(int fd) {
  IgtlParser parser(most_body_);
  {
    const std::lock_guard lock(mutex_);
    waiting_.clear();  // half a message of before
  }
  const Counts before = counts();
  std::array<std::uint8_t, 65536> bytes;
  std::size_t read = 0;
  std::int64_t slice_ns = monotonic_ns();
  bool open = true;
  while (open && !stop_) {
    send_waiting(fd);
    const std::int64_t now = monotonic_ns();
    if (now - slice_ns >= kSliceMs * 1000000) {
      slice_ns = now;
      read = 0;
      if (idle_) idle_();
    }
    if (read >= kSliceBytes) {
      {
        const std::lock_guard lock(mutex_);
        counts_.flooded = true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      continue;
    }
    pollfd p{fd, POLLIN, 0};
    if (::poll(&p, 1, kSliceMs) <= 0) continue;
    const ssize_t n = ::recv(fd, bytes.data(), bytes.size(), 0);
    if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) {
      say("the server has gone; it is looked for again");
      open = false;
    }
    if (n <= 0) continue;
    read += static_cast<std::size_t>(n);
    const bool understood = parser.feed({bytes.data(), static_cast<std::size_t>(n)}, take_);
    const std::lock_guard lock(mutex_);
    counts_.messages = before.messages + parser.messages();
    counts_.damaged = before.damaged + parser.damaged();
    counts_.passed_over = before.passed_over + parser.passed_over();
    counts_.bytes += static_cast<std::uint64_t>(n);
    if (!understood) {
      trouble_ =
          server_.host + ":" + std::to_string(server_.port) + ": what it says is no OpenIGTLink; connected again";
      open = false;
    }
  }
}

void WireClient::run() {
  ::pthread_setname_np(::pthread_self(), "osteo-wire-in");
  while (!stop_) {
    if (const int fd = connect_now(); fd >= 0) {
      {
        const std::lock_guard lock(mutex_);
        ++counts_.connections;
        trouble_.clear();
      }
      connected_ = true;
      listen_to(fd);
      connected_ = false;
      ::close(fd);
    }
    for (int i = 0; i < 50 && !stop_; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      if (idle_) idle_();
    }
  }
}

}  // namespace osteo::inline network
