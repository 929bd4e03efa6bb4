#include "osteo/core/base/parallel.h"

#ifdef __SANITIZE_THREAD__
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>
#else
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#endif

#include <algorithm>

namespace osteo {

void parallel_for(std::size_t n, std::size_t grain, int threads,
                  const std::function<void(std::size_t, std::size_t)>& body) {
  grain = std::max<std::size_t>(grain, 1);
  const std::size_t chunks = (n + grain - 1) / grain;
  const auto run = [&](std::size_t c) { body(c * grain, std::min(n, (c + 1) * grain)); };
  if (threads == 1 || chunks <= 1) {
    for (std::size_t c = 0; c < chunks; ++c) run(c);
    return;
  }
#ifdef __SANITIZE_THREAD__
  // oneTBB is not built for the thread sanitizer, which does not see that its tasks end before their caller goes on.
  // Plain threads it sees.
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex mutex;
  const auto work = [&] {
    try {
      for (std::size_t c; (c = next++) < chunks;) run(c);
    } catch (...) {
      next = chunks;
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
    }
  };
  std::vector<std::thread> others(std::min<std::size_t>(threads > 0 ? static_cast<std::size_t>(threads) : 4, chunks) -
                                  1);
  for (auto& t : others) t = std::thread(work);
  work();
  for (auto& t : others) t.join();
  if (failure) std::rethrow_exception(failure);
#else
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  arena.execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, chunks, 1),
        [&](const auto& range) {
          for (std::size_t c = range.begin(); c != range.end(); ++c) run(c);
        },
        tbb::simple_partitioner());
  });
#endif
}

}  // namespace osteo
