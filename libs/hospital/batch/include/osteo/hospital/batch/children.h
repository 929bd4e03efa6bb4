// Pieces of work that each run in a process of their own, with bounds on memory and time, so that none can take another
// with it.
#pragma once
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace osteo::inline hospital {

/// 0: no bound.
struct ChildLimits {
  double memory_mb = 0;  ///< 10^6 bytes: of memory asked for (RLIMIT_DATA) and of memory of its own that is in use,
                         ///< looked at 10 times a second
  double seconds = 0;    ///< in real time
};

struct ChildEnd {
  std::size_t id = 0;
  int exit_code = 0;         ///< -1: ended by `signal`
  int signal = 0;            ///< 0: it ended by itself
  bool over_time = false;    ///< it was ended for its time ...
  bool over_memory = false;  ///< ... or its memory
  double seconds = 0;
  double peak_mb = 0;    ///< resident, at its highest
  std::string out, err;  ///< what it wrote: the first 4 MB to standard output, the last 64 kB to standard error
};

/// Forks this process: the work runs in a copy of it, which costs milliseconds where starting the program again costs a
/// quarter of a second. So the caller may have no other threads (nor have used TBB). A child is asked to end (SIGTERM)
/// by the kernel when its parent is gone.
class Children {
 public:
  Children();
  ~Children();  ///< kills what still runs
  Children(const Children&) = delete;
  Children& operator=(const Children&) = delete;

  /// `work` gives the exit code. Its standard output and error are collected, its input is empty. Error(resources) when
  /// no process can be started.
  void start(std::size_t id, const std::function<int()>& work, const ChildLimits& limits);
  /// The next one that has ended; none when none did within this time, or a signal came.
  [[nodiscard]] std::optional<ChildEnd> wait(double at_most_s);
  /// Asks all to end (SIGTERM); who has not within 10 s is killed.
  void stop();
  [[nodiscard]] std::size_t running() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteo::inline hospital
