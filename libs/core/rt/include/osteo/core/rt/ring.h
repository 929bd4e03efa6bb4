// A bounded queue from one thread to one other. No allocation, no lock, no wait.
#pragma once
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <memory>
#include <span>
#include <type_traits>

namespace osteo {

template <class T>
class Ring {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  /// Room for at least `capacity` items.
  explicit Ring(std::size_t capacity) {
    std::size_t size = 2;
    while (size < capacity) size *= 2;
    mask_ = size - 1;
    items_ = std::make_unique<T[]>(size);  // zeroed: its pages exist before the first tick
  }

  /// Producer: all or nothing; false when there is no room.
  bool push(std::span<const T> items) noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (room() < items.size()) return false;
    for (std::size_t i = 0; i < items.size(); ++i) items_[(tail + i) & mask_] = items[i];
    tail_.store(tail + items.size(), std::memory_order_release);
    return true;
  }
  bool push(const T& item) noexcept { return push(std::span<const T>(&item, 1)); }

  /// Producer: items that push() has room for now; only grows until the next push().
  [[nodiscard]] std::size_t room() const noexcept {
    return mask_ + 1 - (tail_.load(std::memory_order_relaxed) - head_.load(std::memory_order_acquire));
  }

  /// Consumer: takes up to out.size() items, returns how many.
  std::size_t pop(std::span<T> out) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    const std::size_t n = std::min(out.size(), tail_.load(std::memory_order_acquire) - head);
    for (std::size_t i = 0; i < n; ++i) out[i] = items_[(head + i) & mask_];
    head_.store(head + n, std::memory_order_release);
    return n;
  }

 private:
  std::unique_ptr<T[]> items_;
  std::size_t mask_ = 0;
  alignas(64) std::atomic<std::size_t> head_{0};
  alignas(64) std::atomic<std::size_t> tail_{0};
};

}  // namespace osteo
