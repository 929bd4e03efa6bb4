// A disk that stalls when a test says so.
#pragma once
#include <condition_variable>
#include <filesystem>
#include <memory>
#include <mutex>
#include <span>

#include "osteo/session/recording/session_file.h"

namespace osteo::test {

// A disk that takes nothing while it stalls.
struct Disk {
  std::mutex mutex;
  std::condition_variable wake;
  bool stalls = false;
  void stall(bool on) {
    const std::lock_guard lock(mutex);
    stalls = on;
    wake.notify_all();
  }
};
class StallingSink final : public SessionSink {
 public:
  StallingSink(Disk& disk, const std::filesystem::path& path) : disk_(disk), file_(session_file(path)) {}
  void write(std::span<const std::byte> bytes) override {
    wait();
    file_->write(bytes);
  }
  void sync() override {
    wait();
    file_->sync();
  }

 private:
  void wait() {
    std::unique_lock lock(disk_.mutex);
    disk_.wake.wait(lock, [&] { return !disk_.stalls; });
  }
  Disk& disk_;
  std::unique_ptr<SessionSink> file_;
};

}  // namespace osteo::test
