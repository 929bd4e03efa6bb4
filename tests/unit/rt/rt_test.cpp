#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <iterator>
#include <random>
#include <stdexcept>
#include <thread>
#include <vector>

#include "osteo/core/rt/detail/histogram.h"
#include "osteo/core/rt/loop.h"
#include "osteo/core/rt/ring.h"
#include "osteo/core/rt/seqlock.h"

namespace osteo {
namespace {

TEST(Ring, KeepsOrderBetweenTwoThreads) {
  Ring<std::uint64_t> ring(64);
  constexpr std::uint64_t kCount = 300'000;
  std::thread producer([&] {
    for (std::uint64_t i = 0; i < kCount;) {
      std::uint64_t batch[3] = {i, i + 1, i + 2};
      if (ring.push({batch, 3})) {
        i += 3;
      } else {
        std::this_thread::yield();
      }
    }
  });
  std::uint64_t expected = 0;
  std::vector<std::uint64_t> out(10);
  while (expected < kCount) {
    const std::size_t n = ring.pop(out);
    if (n == 0) std::this_thread::yield();
    for (std::size_t i = 0; i < n; ++i) ASSERT_EQ(out[i], expected++);
  }
  producer.join();
}

TEST(Ring, PushIsAllOrNothing) {
  Ring<int> ring(4);
  const int five[5] = {1, 2, 3, 4, 5};
  EXPECT_FALSE(ring.push({five, 5}));
  EXPECT_TRUE(ring.push({five, 4}));
  EXPECT_EQ(ring.room(), 0u);
  EXPECT_FALSE(ring.push(9));
}

TEST(Seqlock, ReaderNeverSeesAHalfWrittenValue) {
  struct Value {
    std::array<std::uint64_t, 9> x;
  };
  Seqlock<Value> lock;
  Value seven;
  seven.x.fill(7);
  lock.store(seven);
  Value read{};
  ASSERT_TRUE(lock.try_load(read));  // nobody writes: it succeeds
  EXPECT_EQ(read.x, seven.x);
  std::atomic<bool> stop{false};
  std::thread writer([&] {
    for (std::uint64_t n = 1; !stop; ++n) {
      Value v;
      v.x.fill(n);
      lock.store(v);
    }
  });
  for (int n = 0; n < 200'000; ++n) {
    Value v;
    if (!lock.try_load(v)) continue;
    for (const auto x : v.x) ASSERT_EQ(x, v.x[0]);
  }
  stop = true;
  writer.join();
}

TEST(Histogram, QuantilesWithinAnEighth) {
  Histogram h;
  std::mt19937 random(1);
  std::vector<std::int64_t> all;
  std::lognormal_distribution<double> d(9, 2);
  for (int i = 0; i < 20000; ++i) {
    all.push_back(static_cast<std::int64_t>(d(random)));
    h.add(all.back());
  }
  std::sort(all.begin(), all.end());
  for (const double q : {0.01, 0.5, 0.99, 0.999}) {
    const double exact = static_cast<double>(all[static_cast<std::size_t>(std::ceil(q * 20000)) - 1]) / 1000;
    EXPECT_GE(h.quantile_us(q), exact * 0.999);
    EXPECT_LE(h.quantile_us(q), exact * 1.13 + 0.001);
  }
  EXPECT_NEAR(h.max_us(), static_cast<double>(all.back()) / 1000, 1e-9);
}

// The largest value that counts the same: buckets of an eighth of an octave, exact below 16 ns.
TEST(Histogram, BucketsEndWhereTheyShould) {
  const auto reported_ns = [](std::int64_t value) {
    Histogram h;
    h.add(value);
    h.add(1'000'000);
    return std::lround(h.quantile_us(0.5) * 1000);
  };
  for (std::int64_t v = 0; v < 16; ++v) EXPECT_EQ(reported_ns(v), v);
  EXPECT_EQ(reported_ns(16), 17);
  EXPECT_EQ(reported_ns(17), 17);
  EXPECT_EQ(reported_ns(18), 19);
  EXPECT_EQ(reported_ns(1000), 1023);
  EXPECT_EQ(reported_ns(1024), 1151);
}

std::int64_t thread_cpu_ns() {
  timespec t{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return t.tv_sec * 1'000'000'000LL + t.tv_nsec;
}

TEST(Loop, CallsAtItsRateAndCountsMissedPeriods) {
  int calls = 0;
  FixedRateLoop loop(1000, [&](std::int64_t) {
    ++calls;
    // By the thread's own clock: work is what counts, however busy the machine.
    const auto until = thread_cpu_ns() + 7'000'000;
    while (calls == 20 && thread_cpu_ns() < until) {
    }
    if (calls == 40) std::this_thread::sleep_for(std::chrono::milliseconds(7));
    return calls < 60;
  });
  const auto begin = monotonic_ns();
  loop.start();
  loop.join();
  EXPECT_EQ(calls, 60);
  EXPECT_EQ(loop.stats().ticks, 60u);
  // Seven milliseconds of work are our own; taken off the core for as long, we are not to blame.
  EXPECT_GE(loop.stats().missed_by_work + loop.stats().missed_by_machine, 12u);
  EXPECT_GE(loop.stats().missed_by_work, 4u);
  EXPECT_GE(loop.stats().missed_by_machine, 5u);
  EXPECT_GE(monotonic_ns() - begin, 60'000'000);
  EXPECT_TRUE(loop.stats().realtime_granted || !loop.stats().realtime_refusal.empty());
  EXPECT_EQ(loop.realtime(), loop.stats().realtime_granted);
}

TEST(Loop, HandsOverWhatItsFunctionThrows) {
  FixedRateLoop loop(1000, [n = 0](std::int64_t) mutable -> bool {
    if (++n == 3) throw std::runtime_error("in the third tick");
    return true;
  });
  loop.start();
  loop.join();
  EXPECT_FALSE(loop.running());
  ASSERT_TRUE(loop.failure());
  EXPECT_THROW(std::rethrow_exception(loop.failure()), std::runtime_error);
}

// The file that keeps cores awake too.
TEST(Loop, LeavesNoFileOpenAndEndsByItself) {
  const auto open_files = [] {
    return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), std::filesystem::directory_iterator());
  };
  const auto files = open_files();
  std::atomic<int> calls{0};
  {
    FixedRateLoop loop(1000, [&](std::int64_t) { return ++calls > 0; });
    loop.start();
    while (calls < 3) std::this_thread::yield();
    // Nobody joins it: a thread that still ran would end the program here.
  }
  EXPECT_EQ(open_files(), files);
}

// Memory that may be locked is limited: the loop must not make others run out of it.
TEST(Loop, LocksNoMoreMemoryThanItMay) {
  const pid_t child = ::fork();
  if (child == 0) {
    if (::geteuid() == 0 && (::setgid(65534) != 0 || ::setuid(65534) != 0)) ::_exit(3);
    rlimit limit{};
    ::getrlimit(RLIMIT_MEMLOCK, &limit);
    limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, 512UL << 20);
    ::setrlimit(RLIMIT_MEMLOCK, &limit);
    bool allocated = false;
    FixedRateLoop loop(1000, [&](std::int64_t) {
      void* const p =
          ::mmap(nullptr, 1UL << 30, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
      allocated = p != MAP_FAILED;
      return false;
    });
    loop.start();
    loop.join();
    ::_exit(allocated ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == 3) GTEST_SKIP() << "may not become another user";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace osteo
