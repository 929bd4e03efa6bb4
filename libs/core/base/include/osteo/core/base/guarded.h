// Work that may crash, never end or take all memory, in a process of its own.
#pragma once
#include <functional>
#include <string>

#include "osteo/core/base/context.h"

namespace osteo {

struct GuardLimits {
  double seconds = 600;  ///< of wall-clock time; 0: none
  double memory_gb = 8;  ///< beyond what this process has when it begins; 0: none. Not held under address sanitizers
};

/// Forks, does `work` in the child and returns the bytes that it returned. The child is a copy of this process with one
/// thread: `work` may compute and allocate, no more (no threads, no files, no windows); its standard output and error
/// go nowhere. An Error that it throws is thrown here with its code and advice; cancelling the context ends the child.
/// Errors: failed when the child crashes or ends by itself, resources when it runs out of time or memory. `what` begins
/// each message
/// ("TetGen"), `advice` goes with each.
[[nodiscard]] std::string run_guarded(const std::string& what, const std::string& advice, const GuardLimits& limits,
                                      const std::function<std::string()>& work, const Context& context = {});

}  // namespace osteo
