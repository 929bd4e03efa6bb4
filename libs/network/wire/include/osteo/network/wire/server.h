// A TCP server that tells many clients the same, and waits for none of them.
#pragma once
#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "osteo/network/wire/igtl.h"

namespace osteo::inline network {

/// Where to listen or connect: "18944", "192.0.2.7:18944", "[::1]:18944". Error(usage) says what is expected.
struct WireAddress {
  std::string host = "127.0.0.1";
  int port = 0;
};
[[nodiscard]] WireAddress wire_address(const std::string& text);

/// What it did so far.
struct WireCounts {
  std::size_t clients = 0;        ///< there now
  std::uint64_t accepted = 0;     ///< came
  std::uint64_t turned_away = 0;  ///< since kMaxClients were there
  std::uint64_t messages = 0;     ///< sent whole, to all of them together
  std::uint64_t dropped = 0;      ///< since a client did not keep up, counted for each
  std::uint64_t bytes = 0;        ///< sent
  std::uint64_t heard = 0;        ///< bytes of clients, most of which mean nothing here
};

/// In a thread of its own. A client has a queue of its own: what does not fit is dropped, as whole messages, for this
/// client alone, and counted; when there is room again `notice` tells it how many. A client that takes nothing for
/// kMaxSilentS with a full queue is cut off. Whatever clients send is read no faster than kMaxHeard a second and
/// forgotten, but for what answer() is for. Memory: kMaxClients times kMaxQueued at most.
class WireServer {
 public:
  static constexpr std::size_t kMaxClients = 8, kMaxQueued = 4 << 20, kMaxHeard = 256 << 10;
  static constexpr double kMaxSilentS = 10;
  using Notice = std::function<WireBytes(std::uint64_t dropped)>;
  static constexpr std::size_t kMaxAsked = 1024;  ///< bytes of a message that is heard
  /// In the server's thread: what a client has said, and what it alone is answered; that it has gone.
  struct Answer {
    std::function<std::vector<WireBytes>(std::uint64_t client, const IgtlMessage& message)> hear;
    std::function<void(std::uint64_t client)> gone;
  };

  /// Port 0: any that is free. Errors: usage, no such address on this machine; failed, the port is taken.
  WireServer(const WireAddress& address, Notice notice, double most_silent_s = kMaxSilentS);
  ~WireServer();
  WireServer(const WireServer&) = delete;
  WireServer& operator=(const WireServer&) = delete;

  /// From any thread; waits for no network. To all clients that are there.
  void send(WireBytes message);
  /// What each client is told first; those who are there already, now.
  void greet(std::vector<WireBytes> messages);
  /// From now on messages of clients are heard; what is no OpenIGTLink, or longer than kMaxAsked, is not.
  void answer(Answer answer);
  /// Until so many clients are there, at most so long, or `stop` says so. False: they are not.
  bool wait_for_clients(std::size_t clients, double most_s, const std::function<bool()>& stop = {}) const;
  /// Until all that was sent is on its way, at most so long.
  bool flush(double most_s) const;

  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] WireCounts counts() const;

 private:
  using Shared = std::shared_ptr<const WireBytes>;
  struct Client {
    int fd = -1;
    std::uint64_t number = 0;
    IgtlParser parser{kMaxAsked};
    bool understood = true;
    std::deque<Shared> queue;
    std::size_t queued = 0;     // bytes
    std::size_t begun = 0;      // of the first, sent
    std::uint64_t dropped = 0;  // since it was last told
    double took_s = 0, second_s = 0;
    std::size_t heard = 0;  // in this second
    bool gone = false;
  };
  void run();
  void accept_one();
  void read_from(Client& client, double now_s);
  void write_to(Client& client, double now_s);
  void queue(Client& client, const Shared& message);

  Notice notice_;
  double most_silent_s_;
  int listen_ = -1, wake_ = -1, port_ = 0;
  mutable std::mutex mutex_;
  std::vector<std::unique_ptr<Client>> clients_;
  std::vector<Shared> greeting_;
  std::shared_ptr<const Answer> answer_;
  WireCounts counts_;
  std::atomic<bool> stop_{false};
  std::thread thread_;  // last: it uses all the others
};

}  // namespace osteo::inline network
