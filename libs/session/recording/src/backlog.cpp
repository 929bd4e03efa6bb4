#include "backlog.h"

#include <pthread.h>

#include <exception>

namespace osteo::inline session {

Backlog::~Backlog() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void Backlog::start() {
  thread_ = std::thread([this] { run(); });
}

void Backlog::write(std::span<const std::byte> bytes) {
  if (!thread_.joinable()) {
    disk_->write(bytes);
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    if (failure_) throw Error(*failure_);
    blocks_.push_back({{bytes.begin(), bytes.end()}, Clock::now()});
    waiting_ += bytes.size();
  }
  wake_.notify_one();
}

void Backlog::sync() {
  if (!thread_.joinable()) {
    disk_->sync();
    return;
  }
  std::unique_lock lock(mutex_);
  sync_ = true;
  wake_.notify_one();
  done_.wait(lock, [&] { return (!sync_ && blocks_.empty()) || failure_; });
  if (failure_) throw Error(*failure_);
}

void Backlog::run() {
  ::pthread_setname_np(::pthread_self(), "osteo-disk");
  constexpr auto kSyncEvery = std::chrono::seconds(1);
  auto synced = Clock::now();
  bool written = false;
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait_for(lock, kSyncEvery, [&] { return stop_ || sync_ || !blocks_.empty(); });
    const bool asked = sync_;
    try {
      while (!blocks_.empty()) {
        const Block& block = blocks_.front();  // stays where it is while others are put behind it
        lock.unlock();
        disk_->write(block.bytes);
        written = true;
        if (Clock::now() - synced > kSyncEvery) {
          disk_->sync();
          synced = Clock::now();
          written = false;
        }
        lock.lock();
        waiting_ -= block.bytes.size();
        blocks_.pop_front();
      }
      if (asked || (written && Clock::now() - synced > kSyncEvery)) {
        lock.unlock();
        disk_->sync();
        synced = Clock::now();
        written = false;
        lock.lock();
        if (asked) sync_ = false;
      }
    } catch (...) {
      if (!lock.owns_lock()) lock.lock();
      try {
        throw;
      } catch (const Error& e) {
        failure_ = e;
      } catch (const std::exception& e) {
        failure_ = Error(ExitCode::cannot_write, std::string("the session cannot be written: ") + e.what());
      } catch (...) {
        failure_ = Error(ExitCode::cannot_write, "the session cannot be written");
      }
      blocks_.clear();
      waiting_ = 0;
    }
    if (blocks_.empty()) done_.notify_all();
    if (failure_ || (stop_ && blocks_.empty())) return;
  }
}

std::size_t Backlog::waiting_bytes() const {
  const std::lock_guard lock(mutex_);
  return waiting_;
}

double Backlog::behind_s() const {
  const std::lock_guard lock(mutex_);
  return blocks_.empty() ? 0 : std::chrono::duration<double>(Clock::now() - blocks_.front().since).count();
}

std::optional<Error> Backlog::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

}  // namespace osteo::inline session
