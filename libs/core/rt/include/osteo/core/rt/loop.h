// A thread that calls a function at a fixed rate with the least lateness the machine allows.
#pragma once
#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <string>
#include <thread>

#include "osteo/core/rt/detail/histogram.h"

namespace osteo {

struct LoopStats {
  Histogram work;      ///< time spent in the function
  Histogram lateness;  ///< wake-up after the planned time: the machine's share
  std::uint64_t ticks = 0;
  std::uint64_t missed_by_work =
      0;  ///< periods lost because the function itself ran longer than a period (by its thread's CPU time)
  std::uint64_t missed_by_machine =
      0;  ///< periods lost because the wake-up came late, or the thread was taken off its core meanwhile
  bool realtime_granted = false;
  bool memory_locked =
      false;  ///< what is there at the start; what comes later too where no limit (RLIMIT_MEMLOCK) forbids it
  bool idle_states_off = false;  ///< /dev/cpu_dma_latency held at 0 while the loop runs
  std::string realtime_refusal;  ///< empty, or why
};

/// SCHED_FIFO priority 80, memory locked, stack touched beforehand, processor kept from deep sleep, absolute sleeps
/// (clock_nanosleep). When real-time priority is rejected the loop runs all the same with the smallest timer slack, and
/// says so. A late tick does not shift the later ones; periods that passed meanwhile are skipped and counted.
///
/// The servo thread of a rehearsal is one of these, at 1 kHz. Once it ticks, neither the loop nor `tick` may allocate,
/// lock, throw, log or block; the loop itself only sleeps until the next period. The test robust.no-alloc counts
/// allocations and locks of the servo's ticks.
class FixedRateLoop {
 public:
  /// `tick` returns false to end the loop. It must not allocate or lock. What it throws ends the loop; see failure().
  FixedRateLoop(double rate_hz, std::function<bool(std::int64_t lateness_ns)> tick);
  ~FixedRateLoop();
  FixedRateLoop(const FixedRateLoop&) = delete;
  FixedRateLoop& operator=(const FixedRateLoop&) = delete;

  void start();
  void request_stop() noexcept { stop_ = true; }
  void join();
  [[nodiscard]] bool running() const noexcept { return running_; }
  /// Only after join().
  [[nodiscard]] const LoopStats& stats() const { return stats_; }
  /// Only after join(): what ended it, or null.
  [[nodiscard]] std::exception_ptr failure() const { return failure_; }
  /// Whether real-time priority was granted; valid once running() was true.
  [[nodiscard]] bool realtime() const noexcept { return realtime_; }

 private:
  void run();
  void tick_on();
  double rate_hz_;
  std::function<bool(std::int64_t)> tick_;
  std::atomic<bool> stop_{false}, running_{false}, realtime_{false};
  LoopStats stats_;
  std::exception_ptr failure_;
  std::thread thread_;
};

[[nodiscard]] std::int64_t monotonic_ns() noexcept;

}  // namespace osteo
