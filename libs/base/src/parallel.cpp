#include "osteo/base/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>

namespace osteo {

void parallel_for(std::size_t n, std::size_t grain, int threads, const std::function<void(std::size_t, std::size_t)>& body) {
  grain = std::max<std::size_t>(grain, 1);
  const std::size_t chunks = (n + grain - 1) / grain;
  const auto run = [&](std::size_t c) { body(c * grain, std::min(n, (c + 1) * grain)); };
  if (threads == 1 || chunks <= 1) {
    for (std::size_t c = 0; c < chunks; ++c) run(c);
    return;
  }
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  arena.execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, chunks, 1),
        [&](const auto& range) {
          for (std::size_t c = range.begin(); c != range.end(); ++c) run(c);
        },
        tbb::simple_partitioner());
  });
}

}  // namespace osteo
