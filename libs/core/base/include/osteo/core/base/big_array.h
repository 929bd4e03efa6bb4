// Vectors for large results that are written once, front to back.
#pragma once
#include <sys/mman.h>

#include <algorithm>
#include <cstdlib>
#include <new>
#include <utility>
#include <vector>

namespace osteo {

/// Leaves new elements as they are in memory (resize costs nothing before the first write) and asks for 2 MB pages,
/// which makes first writes several times cheaper. For types without constructors only.
template <class T>
struct BigAllocator {
  using value_type = T;
  BigAllocator() = default;
  template <class U>
  explicit BigAllocator(const BigAllocator<U>&) {}
  template <class U>
  struct rebind {
    using other = BigAllocator<U>;
  };

  T* allocate(std::size_t n) {
    constexpr std::size_t kPage = std::size_t{1} << 21;
    const std::size_t bytes = n * sizeof(T);
    const bool large = bytes >= kPage;
    const std::size_t alignment = large ? kPage : std::max<std::size_t>(64, alignof(T));
    void* const p = std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
    if (p == nullptr) throw std::bad_alloc();
    if (large) ::madvise(p, (bytes + kPage - 1) / kPage * kPage, MADV_HUGEPAGE);  // advice: refusal costs only time
    return static_cast<T*>(p);
  }
  void deallocate(T* p, std::size_t) { std::free(p); }
  template <class U>
  void construct(U*) {}  // left as it is
  template <class U, class... Args>
  void construct(U* p, Args&&... args) {
    ::new (static_cast<void*>(p)) U(std::forward<Args>(args)...);
  }
  friend bool operator==(const BigAllocator&, const BigAllocator&) { return true; }
};

template <class T>
using BigArray = std::vector<T, BigAllocator<T>>;

}  // namespace osteo
