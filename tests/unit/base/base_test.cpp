#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <thread>

#include "error_of.h"
#include "osteo/core/base/context.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/order.h"
#include "osteo/core/base/parallel.h"
#include "osteo/core/base/param.h"

namespace osteo {
enum class Colour : int { red, green };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(Colour) {
  return {"red", "green"};
}

namespace {

struct Sample {
  struct Params {
    bool on = false;
    int count = 3;
    double half_width = 1.5;
    std::string title = "x";
    std::array<double, 3> at{1, 2, 3};
    Colour colour = Colour::green;
  };
  static void describe(Params& p, auto& visit) {
    visit({"on", "help"}, p.on);
    visit({"count", "help", "", 0, 10}, p.count);
    visit({"half_width", "help", "mm", 0, 5}, p.half_width);
    visit({"title", "help"}, p.title);
    visit({"at", "help", "mm"}, p.at);
    visit({"colour", "help"}, p.colour);
  }
};

using test::error_of;

std::filesystem::path fresh_folder() {
  const auto p = std::filesystem::temp_directory_path() / ("osteo-base-" + std::to_string(::getpid()));
  std::filesystem::remove_all(p);
  std::filesystem::create_directories(p);
  return p;
}

TEST(Param, TextRoundTripsThroughEveryKind) {
  Sample::Params a, b;
  a = {true, 7, 0.1, "two words", {0.1, -2e-5, 3}, Colour::red};
  const auto from = fields_of<Sample>(a), to = fields_of<Sample>(b);
  for (std::size_t i = 0; i < from.size(); ++i) to[i].from_text(from[i].to_text());
  EXPECT_EQ(b.on, a.on);
  EXPECT_EQ(b.count, a.count);
  EXPECT_EQ(b.half_width, a.half_width);
  EXPECT_EQ(b.title, a.title);
  EXPECT_EQ(b.at, a.at);
  EXPECT_EQ(b.colour, a.colour);
  EXPECT_EQ(from[2].flag(), "--half-width");
}

TEST(Param, ErrorsNameFlagRangeAndChoices) {
  Sample::Params p;
  const auto f = fields_of<Sample>(p);
  EXPECT_EQ(error_of([&] { f[2].from_text("9"); }), "--half-width is 9 but must be between 0 mm and 5 mm");
  EXPECT_EQ(error_of([&] { f[1].from_text("2.5"); }), "--count: '2.5' is not a whole number");
  EXPECT_EQ(error_of([&] { f[5].from_text("blue"); }), "--colour: 'blue' is not one of red, green");
  EXPECT_EQ(error_of([&] { f[4].from_text("1,2"); }), "--at: '1,2' is not three numbers like 1,2,3");
  EXPECT_NE(error_of([&] { f[2].from_text("nan"); }), "");
  EXPECT_NE(error_of([&] { f[2].from_text("1e999"); }), "");
  EXPECT_EQ(p.half_width, 1.5);  // a rejected value changes nothing
}

TEST(Param, NearestName) {
  const std::vector<std::string> known{"threshold", "resample", "surface"};
  EXPECT_EQ(nearest_name("treshold", known), "threshold");
  EXPECT_EQ(nearest_name("surfaces", known), "surface");
  EXPECT_EQ(nearest_name("banana", known), "");
}

TEST(Param, TrimmedIsAPartOfTheSameText) {
  const std::string_view text = " \t a b\t ";
  EXPECT_EQ(trimmed(text), "a b");
  EXPECT_EQ(trimmed(text).data(), text.data() + 3);
  EXPECT_EQ(trimmed("\ta ", " "), "\ta");
  EXPECT_EQ(trimmed(" \t "), "");
  EXPECT_EQ(trimmed(""), "");
}

TEST(Order, PlacesAreThoseOfTheSortedList) {
  EXPECT_EQ(upper_median(std::vector<double>{}), 0);
  EXPECT_EQ(value_at_share(std::vector<float>{}, 0.5), 0);
  for (int n = 1; n < 12; ++n) {
    std::vector<int> values, sorted;
    for (int i = 0; i < n; ++i) values.push_back(i * 7 % 12);
    sorted = values;
    std::sort(sorted.begin(), sorted.end());
    EXPECT_EQ(upper_median(values), sorted[static_cast<std::size_t>(n) / 2]);
    for (const double share : {0.0, 0.25, 0.5, 0.95, 1.0})
      EXPECT_EQ(value_at_share(values, share), sorted[static_cast<std::size_t>(share * (n - 1))]) << share;
  }
}

// As of `osteo run <(...)`: no size, and longer than what a pipe holds at once.
TEST(Files, APipeIsReadUntilItEnds) {
  const TemporaryFolder folder;
  const auto pipe = folder.path() / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const std::string text(300000, 'x');
  std::thread writer([&] { std::ofstream(pipe, std::ios::binary) << text; });
  const std::string read = read_text(pipe);
  writer.join();
  EXPECT_EQ(read, text);
}

TEST(Files, AtomicWriteLeavesOldFileOnFailure) {
  const auto folder = fresh_folder();
  const auto path = folder / "a.txt";
  write_file(path, "old");
  EXPECT_THROW(write_atomically(path,
                                [](const auto& t) {
                                  std::ofstream(t) << "half";
                                  throw Error(ExitCode::failed, "stop");
                                }),
               Error);
  EXPECT_EQ(read_text(path), "old");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1);
}

TEST(Files, HashTellsContentNotNames) {
  const auto a = fresh_folder() / "a";
  std::filesystem::create_directories(a);
  write_file(a / "PATIENT^NAME.dcm", "x");
  write_file(a / "2.dcm", "y");
  const std::string before = hash_path(a);
  std::filesystem::rename(a / "PATIENT^NAME.dcm", a / "1.dcm");
  EXPECT_EQ(hash_path(a), before);
  write_file(a / "2.dcm", "z");
  EXPECT_NE(hash_path(a), before);
}

TEST(Parallel, ChunksCoverEachItemOnceForAnyThreadCount) {
  for (const int threads : {1, 2, 0}) {
    std::vector<std::atomic<int>> seen(1001);
    parallel_for(seen.size(), 10, threads, [&](std::size_t b, std::size_t e) {
      for (; b < e; ++b) ++seen[b];
    });
    for (const auto& s : seen) EXPECT_EQ(s, 1);
  }
}

TEST(Parallel, ExceptionReachesTheCaller) {
  EXPECT_THROW(parallel_for(100, 1, 2,
                            [](std::size_t b, std::size_t) {
                              if (b == 50) throw Error(ExitCode::failed, "x");
                            }),
               Error);
}

TEST(Context, SubrangesNestAndCancelThrows) {
  Context c;
  std::vector<double> seen;
  c.on_progress([&](double f, std::string_view) { seen.push_back(f); });
  c.sub(0.5, 1).sub(0, 0.5).progress(1);
  EXPECT_EQ(seen, std::vector<double>{0.75});
  std::atomic<bool> cancel{true};
  c.set_cancel_flag(&cancel);
  EXPECT_THROW(c.progress(0.1), Error);
}

}  // namespace
}  // namespace osteo
