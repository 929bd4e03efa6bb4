#include "osteo/simulation/haptics/stream.h"

#include <algorithm>
#include <thread>

#include "osteo/core/base/error.h"

namespace osteo::inline simulation {

StreamReader& Stream::add_reader(std::size_t tick_capacity, std::size_t change_capacity) {
  auto made = std::make_unique<StreamReader>(tick_capacity, change_capacity);
  const std::lock_guard lock(mutex_);
  const auto slot = std::find_if(slots_.begin(), slots_.end(),
                                 [](const auto& s) { return s.load(std::memory_order_relaxed) == nullptr; });
  if (slot == slots_.end())
    throw Error(ExitCode::resources, "the stream has " + std::to_string(kMaxReaders) + " readers already",
                "let one of them leave");
  readers_.push_back(std::move(made));
  slot->store(readers_.back().get(), std::memory_order_seq_cst);
  return *readers_.back();
}

void Stream::remove_reader(StreamReader& reader) {
  const std::lock_guard lock(mutex_);
  for (auto& slot : slots_) {
    if (slot.load(std::memory_order_relaxed) == &reader) slot.store(nullptr, std::memory_order_seq_cst);
  }
  const std::uint64_t n = publishes_.load(std::memory_order_seq_cst);
  while ((n & 1) != 0 && publishes_.load(std::memory_order_acquire) == n) std::this_thread::yield();
  std::erase_if(readers_, [&](const auto& r) { return r.get() == &reader; });
}

}  // namespace osteo::inline simulation
