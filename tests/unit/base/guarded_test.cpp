#include "osteo/core/base/guarded.h"

#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include "osteo/core/base/error.h"

namespace osteo {
namespace {

Error error_of(const std::function<std::string()>& work, const GuardLimits& limits = {}, const Context& context = {}) {
  try {
    static_cast<void>(run_guarded("It", "do otherwise", limits, work, context));
  } catch (const Error& e) {
    return e;
  }
  return {ExitCode::ok, "no error"};
}

TEST(Guarded, BringsBackWhatWasMade) {
  std::string large(3'000'000, 'x');
  large[17] = '\0';
  EXPECT_EQ(run_guarded("It", "", {}, [&] { return large; }), large);
  EXPECT_EQ(run_guarded("It", "", {}, [] { return std::string(); }), "");
}

TEST(Guarded, SaysWhyThereIsNone) {
  EXPECT_NE(std::string(error_of([]() -> std::string {
                          std::raise(SIGSEGV);
                          return {};
                        }).what())
                .find("It crashed: it reached into memory"),
            std::string::npos);
  const Error own = error_of([]() -> std::string { throw Error(ExitCode::corrupt, "its own words", "its advice"); });
  EXPECT_EQ(own.code(), ExitCode::corrupt);
  EXPECT_EQ(std::string(own.what()), "its own words");
  EXPECT_EQ(own.advice(), "its advice");
  const Error ended = error_of([]() -> std::string { std::exit(0); });
  EXPECT_EQ(ended.code(), ExitCode::failed);
  EXPECT_NE(std::string(ended.what()).find("ended without a result"), std::string::npos);
  EXPECT_EQ(ended.advice(), "do otherwise");
  EXPECT_NE(std::string(error_of([]() -> std::string { throw 7; }).what()).find("It failed"), std::string::npos);
}

TEST(Guarded, StopsWhatNeverEnds) {
  const auto never = []() -> std::string {
    for (;;) std::this_thread::yield();
  };
  const Error late = error_of(never, {0.3, 0});
  EXPECT_EQ(late.code(), ExitCode::resources);
  EXPECT_NE(std::string(late.what()).find("0.3 s"), std::string::npos);
  std::atomic<bool> flag = true;
  Context context;
  context.set_cancel_flag(&flag);
  EXPECT_EQ(error_of(never, {}, context).code(), ExitCode::cancelled);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST(Guarded, StopsWhatTakesAllMemory) {
  const Error e = error_of(
      []() -> std::string {
        std::string all;
        for (;;) all.append(100'000'000, 'x');
      },
      {60, 0.5});
  EXPECT_EQ(e.code(), ExitCode::resources);
  EXPECT_NE(std::string(e.what()).find("ran out of memory, of which it has 0.5 GB"), std::string::npos) << e.what();
}
#endif

}  // namespace
}  // namespace osteo
