#include "osteo/core/rt/loop.h"

#include <fcntl.h>
#include <linux/capability.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <string>

namespace osteo {

std::int64_t monotonic_ns() noexcept {
  timespec t{};
  ::clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * 1'000'000'000LL + t.tv_nsec;
}

namespace {

std::int64_t thread_cpu_ns() noexcept {
  timespec t{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return t.tv_sec * 1'000'000'000LL + t.tv_nsec;
}

// So that no tick meets a page of the stack for the first time.
[[gnu::noinline]] void touch_stack() noexcept {
  volatile char page[256 * 1024];
  for (std::size_t i = 0; i < sizeof page; i += 4096) page[i] = 0;
}

// Where the system limits what may be locked, locking all that is to come would make later allocations of the whole
// program fail: there only what there is now is locked.
bool lock_memory() noexcept {
  rlimit limit{};
  bool unlimited = ::getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY;
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, 2> may{};
  if (::syscall(SYS_capget, &header, may.data()) == 0)
    unlimited = unlimited || (may[0].effective >> CAP_IPC_LOCK & 1U) != 0;
  return ::mlockall(unlimited ? MCL_CURRENT | MCL_FUTURE : MCL_CURRENT) == 0;
}

}  // namespace

FixedRateLoop::FixedRateLoop(double rate_hz, std::function<bool(std::int64_t)> tick)
    : rate_hz_(rate_hz), tick_(std::move(tick)) {}

FixedRateLoop::~FixedRateLoop() {
  request_stop();
  join();
}

void FixedRateLoop::start() {
  running_ = true;
  thread_ = std::thread([this] { run(); });
}

void FixedRateLoop::join() {
  if (thread_.joinable()) thread_.join();
}

void FixedRateLoop::run() {
  try {
    tick_on();
  } catch (...) {
    failure_ = std::current_exception();
  }
  running_ = false;
}

void FixedRateLoop::tick_on() {
  ::pthread_setname_np(::pthread_self(), "osteo-servo");
  sched_param priority{};
  priority.sched_priority = 80;
  if (const int rc = ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &priority); rc == 0) {
    stats_.realtime_granted = true;
  } else {
    stats_.realtime_refusal = std::strerror(rc);
    ::prctl(PR_SET_TIMERSLACK, 1);
  }
  realtime_ = stats_.realtime_granted;
  stats_.memory_locked = lock_memory();
  touch_stack();
  // As long as this file is open with a 0 in it, cores do not fall into sleep that takes long to wake from.
  struct Undo {
    int latency_fd;
    bool locked;
    ~Undo() {
      if (latency_fd >= 0) ::close(latency_fd);
      if (locked) ::munlockall();
    }
  };
  const int latency_fd = ::open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
  const std::int32_t none = 0;
  stats_.idle_states_off = latency_fd >= 0 && ::write(latency_fd, &none, sizeof none) == sizeof none;
  const Undo undo{latency_fd, stats_.memory_locked};

  const auto period = static_cast<std::int64_t>(1e9 / rate_hz_);
  std::int64_t due = monotonic_ns() + period;
  while (!stop_.load(std::memory_order_relaxed)) {
    const timespec at{due / 1'000'000'000LL, due % 1'000'000'000LL};
    while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr) == EINTR) {
    }
    const std::int64_t woke = monotonic_ns(), cpu_before = thread_cpu_ns();
    const bool more = tick_(woke - due);
    const std::int64_t done = monotonic_ns();
    stats_.work.add(done - woke);
    stats_.lateness.add(woke - due);
    ++stats_.ticks;
    if (!more) break;
    due += period;
    if (done >= due) {
      // Blame: was it the work itself that did not fit, or did something else take the time?
      const auto lost = static_cast<std::uint64_t>((done - due) / period + 1);
      (thread_cpu_ns() - cpu_before >= period ? stats_.missed_by_work : stats_.missed_by_machine) += lost;
      due += static_cast<std::int64_t>(lost) * period;
    }
  }
}

}  // namespace osteo
