// A connection to an OpenIGTLink server that is looked for until it is there.
#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "osteo/network/wire/server.h"

namespace osteo::inline network {

/// In a thread of its own: connects, and again twice a second where there is no server or it went; cuts what comes into
/// messages. Reads no faster than kMaxBytes a second, so that a server that floods fills its own queue. Sends what it
/// is told to, at most kMaxWaiting bytes at a time. Memory: most_body and kMaxWaiting.
class WireClient {
 public:
  static constexpr std::size_t kMaxBytes = 32 << 20, kMaxWaiting = 64 << 10;
  using Take = std::function<void(const IgtlMessage&)>;

  /// `take` is called in its thread, `idle` there too, about every 10 ms. A name is looked up at each attempt.
  WireClient(const WireAddress& server, std::size_t most_body, Take take, std::function<void()> idle = {});
  ~WireClient();
  WireClient(const WireClient&) = delete;
  WireClient& operator=(const WireClient&) = delete;

  /// From any thread: to the server, when there is room, within about 10 ms. What does not fit, or is left when the
  /// connection goes, is dropped.
  void send(std::span<const std::uint8_t> message);
  [[nodiscard]] bool connected() const { return connected_; }
  struct Counts {
    std::uint64_t connections = 0, messages = 0, damaged = 0, passed_over = 0, bytes = 0;
    bool flooded = false;  ///< it came faster than it is read
  };
  [[nodiscard]] Counts counts() const;
  /// In words, for people; empty: all well.
  [[nodiscard]] std::string trouble() const;

 private:
  void run();
  [[nodiscard]] int connect_now();
  void listen_to(int fd);
  void send_waiting(int fd);
  void say(const std::string& words);

  WireAddress server_;
  std::size_t most_body_;
  Take take_;
  std::function<void()> idle_;
  mutable std::mutex mutex_;
  std::string trouble_;
  Counts counts_;
  std::vector<std::uint8_t> waiting_;
  std::atomic<bool> connected_{false}, stop_{false};
  std::thread thread_;  // last: it uses all the others
};

}  // namespace osteo::inline network
