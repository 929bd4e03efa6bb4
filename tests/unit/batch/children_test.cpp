#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <iostream>
#include <new>
#include <set>
#include <thread>
#include <vector>

#include "osteo/hospital/batch/children.h"

namespace osteo {
namespace {

// Tests are slow on a busy machine, hangs last for ever.
constexpr double kLong = 120;

ChildEnd end_of(const std::function<int()>& work, const ChildLimits& limits = {}) {
  Children children;
  children.start(7, work, limits);
  const auto end = children.wait(kLong);
  EXPECT_TRUE(end.has_value());
  return end.value_or(ChildEnd{});
}

// Memory that is in use, not only asked for.
void use_memory(std::size_t bytes) {
  std::vector<char> block(bytes);
  for (std::size_t i = 0; i < bytes; i += 4096) block[i] = static_cast<char>(i >> 12);
  volatile char keep = block[bytes / 2];
  static_cast<void>(keep);
}

[[noreturn]] void sleep_for_ever() {
  for (;;) std::this_thread::sleep_for(std::chrono::seconds(1));
}

TEST(Children, TellWhatTheySaidAndHowTheyEnded) {
  const ChildEnd end = end_of([] {
    std::cout << "data";
    std::cerr << "words\n";
    return 4;
  });
  EXPECT_EQ(end.id, 7U);
  EXPECT_EQ(end.exit_code, 4);
  EXPECT_EQ(end.signal, 0);
  EXPECT_EQ(end.out, "data");
  EXPECT_EQ(end.err, "words\n");
  EXPECT_GT(end.peak_mb, 1);
}

TEST(Children, KeepTheBeginningOfOutputAndTheEndOfErrors) {
  const ChildEnd end = end_of([] {
    for (int i = 0; i < 6000; ++i) std::cout << std::string(1000, i == 0 ? 'a' : 'b');
    for (int i = 0; i < 1000; ++i) std::cerr << std::string(999, i == 999 ? 'z' : 'y') << '\n';
    return 0;
  });
  EXPECT_EQ(end.exit_code, 0);
  EXPECT_EQ(end.out.size(), 4'000'000U);
  EXPECT_EQ(end.out.front(), 'a');
  EXPECT_EQ(end.err.size(), 64'000U);
  EXPECT_EQ(end.err[end.err.size() - 2], 'z');
}

TEST(Children, AreEndedForTheirTime) {
  const auto start = std::chrono::steady_clock::now();
  const ChildEnd end = end_of(
      []() -> int {
        ::signal(SIGTERM, SIG_DFL);
        sleep_for_ever();
      },
      {0, 0.2});
  EXPECT_TRUE(end.over_time);
  EXPECT_EQ(end.signal, SIGTERM);
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), kLong);
}

TEST(Children, CannotHaveMoreMemoryThanTheirBound) {
  // The whole of it at once is rejected; in a sanitizer's process, where only what is in use is bounded, it is ended
  // instead.
  const ChildEnd end = end_of(
      [] {
        try {
          for (int i = 0; i < 40; ++i) {
            static std::vector<std::vector<char>> held;
            held.emplace_back(50'000'000, 'x');
            std::this_thread::sleep_for(std::chrono::milliseconds(50));
          }
        } catch (const std::bad_alloc&) {
          return 9;
        }
        return 0;
      },
      {400, 0});
  EXPECT_TRUE(end.exit_code == 9 || end.over_memory) << end.exit_code;
  EXPECT_LT(end.peak_mb, 800);
  EXPECT_EQ(end_of(
                [] {
                  use_memory(50'000'000);
                  return 0;
                },
                {400, 0})
                .exit_code,
            0);
}

TEST(Children, OneThatCrashesTakesNoOther) {
  Children children;
  children.start(1,
                 []() -> int {
                   ::raise(SIGKILL);
                   return 0;
                 },
                 {});
  children.start(2, [] { return 0; }, {});
  children.start(3, []() -> int { throw std::runtime_error("out of hand"); }, {});
  std::set<std::size_t> seen;
  for (int i = 0; i < 3; ++i) {
    const auto end = children.wait(kLong);
    ASSERT_TRUE(end.has_value());
    seen.insert(end->id);
    EXPECT_EQ(end->signal, end->id == 1 ? SIGKILL : 0);
    EXPECT_EQ(end->err, end->id == 3 ? "out of hand\n" : "");
  }
  EXPECT_EQ(seen.size(), 3U);
  EXPECT_EQ(children.running(), 0U);
  EXPECT_FALSE(children.wait(0.01).has_value());
}

TEST(Children, StopAsksEachToEnd) {
  Children children;
  for (std::size_t i = 0; i < 3; ++i) {
    children.start(i,
                   []() -> int {
                     static volatile std::sig_atomic_t asked = 0;
                     ::signal(SIGTERM, [](int) { asked = 1; });
                     std::cout << "ready" << std::flush;
                     while (asked == 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
                     return 130;
                   },
                   {});
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  children.stop();
  for (int i = 0; i < 3; ++i) {
    const auto end = children.wait(kLong);
    ASSERT_TRUE(end.has_value());
    EXPECT_TRUE(end->exit_code == 130 || end->signal == SIGTERM);
  }
}

TEST(Children, AreGoneWithTheirOwner) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  {
    Children children;
    children.start(1,
                   [&]() -> int {
                     ::close(ends[0]);
                     sleep_for_ever();
                   },
                   {});
    ::close(ends[1]);
  }
  char c = 0;
  EXPECT_EQ(::read(ends[0], &c, 1), 0);  // nobody holds the other end any more
  ::close(ends[0]);
}

}  // namespace
}  // namespace osteo
