// One association, served in a process of its own. Private to libs/hospital/pacs.
#pragma once
#include <atomic>

#include "node.h"
#include "osteo/hospital/pacs/receive.h"

namespace osteo::inline hospital::pacs {

/// What parent and children share: a page of memory.
struct SharedCounts {
  std::atomic<std::uint64_t> stored{0}, again{0}, refused{0}, bytes{0}, refused_associations{0}, timed_out{0};
  /// What the folder held when it was measured, less `bytes` just before: with `bytes` it is what it holds now, never
  /// less but for what others put into it since.
  std::atomic<std::int64_t> folder_before{0};
};
static_assert(
    std::atomic<std::uint64_t>::is_always_lock_free);  // counted in a signal's handler, and by several processes

inline constexpr std::string_view kIncoming = ".incoming";

/// Where an object belongs in the folder: names from hashes, so that no UID can lead out of it.
[[nodiscard]] fs::path place_of(const ObjectHead& head);

/// Serves the connection until its end, then leaves the process. `pipe`: a line for each object that came, its folder
/// relative to `folder`.
[[noreturn]] void serve(int connection, int pipe, const fs::path& folder, const ReceiveOptions& options,
                        SharedCounts& counts);

}  // namespace osteo::inline hospital::pacs
