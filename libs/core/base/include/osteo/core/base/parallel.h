// Parallel loops whose result does not depend on the number of threads: the chunks are fixed by `grain`, not by the
// cores.
#pragma once
#include <cstddef>
#include <functional>

namespace osteo {

/// Runs body(begin, end) over fixed chunks of [0, n) of `grain` items. threads 0 = all cores, 1 = in this thread.
/// The body must write only what belongs to its own chunk. Exceptions reach the caller.
void parallel_for(std::size_t n, std::size_t grain, int threads,
                  const std::function<void(std::size_t, std::size_t)>& body);

}  // namespace osteo
