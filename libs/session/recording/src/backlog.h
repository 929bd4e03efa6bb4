// Between who makes bytes and a disk that may stall.
#pragma once
#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "osteo/core/base/error.h"
#include "osteo/session/recording/session_file.h"

namespace osteo::inline session {

/// Until start() it passes on what it is given. Then write() never waits: a thread writes, in order, and syncs each
/// second. What that throws is handed to the next write() or sync(), and nothing is written any more.
class Backlog final : public SessionSink {
 public:
  explicit Backlog(std::unique_ptr<SessionSink> disk) : disk_(std::move(disk)) {}
  ~Backlog() override;
  void start();
  void write(std::span<const std::byte> bytes) override;
  /// Waits until the disk has all.
  void sync() override;

  [[nodiscard]] std::size_t waiting_bytes() const;
  /// Age of the oldest bytes that are not written.
  [[nodiscard]] double behind_s() const;
  [[nodiscard]] std::optional<Error> failure() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Block {
    std::vector<std::byte> bytes;
    Clock::time_point since;
  };
  void run();
  std::unique_ptr<SessionSink> disk_;
  mutable std::mutex mutex_;
  std::condition_variable wake_, done_;
  std::deque<Block> blocks_;  // the first is being written
  std::size_t waiting_ = 0;
  bool stop_ = false, sync_ = false;
  std::optional<Error> failure_;
  std::thread thread_;
};

}  // namespace osteo::inline session
