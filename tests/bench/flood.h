// Who floods a port of this machine, and what the process has grown by. For benchmarks.
#pragma once
#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <thread>
#include <vector>

namespace osteo::bench {

using Bytes = std::vector<std::uint8_t>;

inline double resident_mb() {
  std::ifstream in("/proc/self/statm");
  double pages = 0, resident = 0;
  in >> pages >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

// Packets as fast as asked to a port of this machine: of random bytes, forged pairings, real ones once more, of another
// key.
class Flood {
 public:
  Flood(int port, double packets_a_s, const std::vector<Bytes>& kinds) {
    thread_ = std::thread([this, port, packets_a_s, kinds] {
      const int fd = ::socket(AF_INET, SOCK_DGRAM, 0);
      sockaddr_in to{};
      to.sin_family = AF_INET;
      to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      to.sin_port = htons(static_cast<std::uint16_t>(port));
      const auto begin = std::chrono::steady_clock::now();
      while (!stop_) {
        const double due =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() * packets_a_s;
        if (static_cast<double>(sent_) >= due) {
          std::this_thread::sleep_for(std::chrono::microseconds(200));
          continue;
        }
        for (int i = 0; i < 20; ++i) {
          const Bytes& b = kinds[sent_++ % kinds.size()];
          static_cast<void>(
              ::sendto(fd, b.data(), b.size(), MSG_DONTWAIT, reinterpret_cast<const sockaddr*>(&to), sizeof to));
        }
      }
      ::close(fd);
    });
  }
  ~Flood() { stop(); }
  void stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] std::uint64_t sent() const { return sent_; }

 private:
  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> sent_{0};
  std::thread thread_;
};

// Connections to a port of TCP that say as much as is asked, as far as it is taken, and others that come all the time.
class Crowd {
 public:
  Crowd(int port, int connections, double messages_a_s, const std::vector<Bytes>& kinds) {
    thread_ = std::thread([this, port, connections, messages_a_s, kinds] {
      sockaddr_in to{};
      to.sin_family = AF_INET;
      to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      to.sin_port = htons(static_cast<std::uint16_t>(port));
      const auto connected = [&] {
        const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
        if (::connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) return ::close(fd), -1;
        ::fcntl(fd, F_SETFL, O_NONBLOCK);
        return fd;
      };
      std::vector<int> all;
      for (int i = 0; i < connections; ++i) all.push_back(connected());
      std::vector<std::uint8_t> ignored(1 << 16);
      const auto begin = std::chrono::steady_clock::now();
      while (!stop_) {
        const double due =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() * messages_a_s;
        if (static_cast<double>(sent_) >= due) {
          std::this_thread::sleep_for(std::chrono::microseconds(200));
          continue;
        }
        for (int i = 0; i < 20; ++i) {
          int& fd = all[sent_ % all.size()];
          const Bytes& b = kinds[sent_++ % kinds.size()];
          const ssize_t n = fd < 0 ? -1 : ::send(fd, b.data(), b.size(), MSG_NOSIGNAL);
          if (n > 0) taken_ += static_cast<std::uint64_t>(n);
          static_cast<void>(::recv(fd, ignored.data(), ignored.size(), 0));
        }
        if (sent_ % 2000 == 0) {
          if (const int more = connected(); more >= 0) ::close(more);  // one too many
        }
      }
      for (const int fd : all) {
        if (fd >= 0) ::close(fd);
      }
    });
  }
  ~Crowd() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] std::uint64_t sent() const { return sent_; }
  [[nodiscard]] std::uint64_t taken() const { return taken_; }  // bytes

 private:
  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> sent_{0}, taken_{0};
  std::thread thread_;
};

}  // namespace osteo::bench
