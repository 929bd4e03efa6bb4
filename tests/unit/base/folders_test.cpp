// What happens to folders that are there already: nothing is lost, and either the old or the new one is whole.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <random>
#include <thread>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/shell.h"

namespace osteo {
namespace {

const auto kAny = [](const fs::path&) {};

void put(const fs::path& path, const std::string& text) {
  std::ofstream(path) << text;
}

std::string message_of(const std::function<void()>& f, ExitCode code) {
  try {
    f();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), code) << e.what();
    return e.what();
  }
  ADD_FAILURE() << "nothing was refused";
  return {};
}

std::size_t entries(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), {}));
}

// What a program proposes to type is one word for the shell, whatever the folder is called.
TEST(ShellPath, IsOneWordForAShell) {
  EXPECT_EQ(shell_path("out/case-1.b"), "out/case-1.b");
  EXPECT_EQ(shell_path("Fälle/Größe"), "Fälle/Größe");
  for (const std::string name : {"Fall 1", "Kopf (2)", "it's", "a;b", "$HOME", "~", "a*", "#1", "-x y", "a\nb"}) {
    const fs::path heard = fs::temp_directory_path() / ("shell-" + std::to_string(getpid()));
    const std::string line = "printf %s " + shell_path(name) + " > " + shell_path(heard);
    ASSERT_EQ(std::system(line.c_str()), 0) << line;
    EXPECT_EQ(read_text(heard), name) << line;
    fs::remove(heard);
  }
}

TEST(Folders, ReplacedWholeOrNotAtAll) {
  const TemporaryFolder at;
  const fs::path folder = at.path() / "d";
  write_folder_atomically(folder, {}, [](const auto& t) { put(t / "one", "1"); });
  EXPECT_THROW(write_folder_atomically(folder, {}, [](const auto&) {}), Error);
  EXPECT_THROW(write_folder_atomically(folder, kAny,
                                       [](const auto& t) {
                                         put(t / "two", "2");
                                         throw Error(ExitCode::failed, "stop");
                                       }),
               Error);
  EXPECT_TRUE(fs::exists(folder / "one"));
  write_folder_atomically(folder, kAny, [](const auto& t) { put(t / "two", "2"); });
  EXPECT_FALSE(fs::exists(folder / "one"));
  EXPECT_TRUE(fs::exists(folder / "two"));
  EXPECT_EQ(entries(at.path()), 1U);  // nothing beside it is left
}

TEST(Folders, AreAskedBeforeTheWorkAndJustBeforeTheExchange) {
  const TemporaryFolder at;
  const fs::path folder = at.path() / "d";
  fs::create_directory(folder);
  put(folder / "theirs", "x");
  bool worked = false;
  EXPECT_THROW(write_folder_atomically(
                   folder, [](const fs::path&) { throw Error(ExitCode::cannot_write, "no"); },
                   [&](const auto&) { worked = true; }),
               Error);
  EXPECT_FALSE(worked);
  // A file that comes while the work is done is seen too.
  const auto only_ours = [](const fs::path& old) {
    for (const auto& e : fs::directory_iterator(old)) {
      if (e.path().filename() != "theirs") throw Error(ExitCode::cannot_write, "no");
    }
  };
  EXPECT_THROW(write_folder_atomically(folder, only_ours, [&](const auto&) { put(folder / "late", "y"); }), Error);
  EXPECT_EQ(read_text(folder / "late"), "y");
  EXPECT_EQ(read_text(folder / "theirs"), "x");
}

TEST(Folders, CurrentFolderRootAndFilesAreNotReplaced) {
  const TemporaryFolder at;
  const fs::path before = fs::current_path(), inner = at.path() / "inner";
  fs::create_directory(inner);
  fs::current_path(inner);
  const auto fill = [](const auto& t) { put(t / "x", "x"); };
  for (const char* path : {".", "..", "./", "../inner", "/", "../inner/."}) {
    EXPECT_NE(message_of([&] { write_folder_atomically(path, kAny, fill); }, ExitCode::cannot_write)
                  .find("the folder you are in"),
              std::string::npos)
        << path;
  }
  fs::current_path(before);
  put(at.path() / "file", "mine");
  EXPECT_NE(message_of([&] { write_folder_atomically(at.path() / "file", kAny, fill); }, ExitCode::cannot_write)
                .find("is a file, not a folder"),
            std::string::npos);
  EXPECT_EQ(read_text(at.path() / "file"), "mine");
  EXPECT_NE(message_of([&] { write_atomically(inner, [](const auto&) {}); }, ExitCode::cannot_write)
                .find("is a folder, not a file"),
            std::string::npos);
  ASSERT_EQ(::mkfifo((at.path() / "pipe").c_str(), 0600), 0);
  EXPECT_NE(message_of([&] { write_file(at.path() / "pipe", "x"); }, ExitCode::cannot_write).find("device or pipe"),
            std::string::npos);
}

TEST(Folders, LinkStaysAndWhatItLeadsToIsReplaced) {
  const TemporaryFolder at;
  const fs::path real = at.path() / "real", link = at.path() / "link", lost = at.path() / "lost";
  fs::create_directory(real);
  put(real / "old", "1");
  fs::create_directory_symlink(real, link);
  fs::create_directory_symlink(at.path() / "nowhere", lost);
  write_folder_atomically(link / "", kAny, [](const auto& t) { put(t / "new", "2"); });
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_TRUE(fs::exists(real / "new"));
  EXPECT_FALSE(fs::exists(real / "old"));
  EXPECT_NE(message_of([&] { write_folder_atomically(lost, kAny, [](const auto&) {}); }, ExitCode::cannot_write)
                .find("leads nowhere"),
            std::string::npos);
  EXPECT_TRUE(output_exists(lost));
}

// A child replaces a folder again and again and is killed at some moment: what is there is one generation, whole.
TEST(Folders, KilledAtAnyMomentOneOfThemIsWhole) {
  const TemporaryFolder at;
  const fs::path folder = at.path() / "d";
  constexpr int kFiles = 5;
  const auto generation = [&](int g) {
    return [g](const fs::path& t) {
      for (int n = 0; n < kFiles; ++n) put(t / std::to_string(n), std::to_string(g));
    };
  };
  write_folder_atomically(folder, {}, generation(0));
  std::mt19937 random(7);
  for (int kill = 0; kill < 60; ++kill) {
    int begun[2];
    ASSERT_EQ(::pipe(begun), 0);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      [[maybe_unused]] const auto n = ::write(begun[1], "x", 1);
      for (int g = 1;; ++g) write_folder_atomically(folder, kAny, generation(g));
    }
    char byte = 0;
    ASSERT_EQ(::read(begun[0], &byte, 1), 1);
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 20000));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    ::close(begun[0]);
    ::close(begun[1]);
    ASSERT_TRUE(fs::is_directory(folder)) << "after kill " << kill;
    ASSERT_EQ(entries(folder), static_cast<std::size_t>(kFiles)) << "after kill " << kill;
    const std::string first = read_text(folder / "0");
    for (int n = 1; n < kFiles; ++n) ASSERT_EQ(read_text(folder / std::to_string(n)), first) << "after kill " << kill;
  }
}

// The name is there at every moment, as somebody sees who looks all the time.
TEST(Folders, ExchangeLeavesNoGap) {
  const TemporaryFolder at;
  const fs::path folder = at.path() / "d";
  const auto fill = [](const fs::path& t) { put(t / "x", "x"); };
  write_folder_atomically(folder, {}, fill);
  std::atomic<bool> done{false};
  std::atomic<long> looks{0}, gaps{0};
  std::thread watcher([&] {
    while (!done) {
      gaps += ::access(folder.c_str(), F_OK) == 0 ? 0 : 1;
      ++looks;
    }
  });
  while (looks == 0) std::this_thread::yield();
  for (int n = 0; n < 300; ++n) write_folder_atomically(folder, kAny, fill);
  done = true;
  watcher.join();
  EXPECT_EQ(gaps, 0) << "of " << looks << " looks";
}

TEST(Folders, HashFilesNamesEachAndTellsLinks) {
  const TemporaryFolder at;
  fs::create_directories(at.path() / "sub");
  put(at.path() / "a", "1");
  put(at.path() / "sub/b", "2");
  fs::create_symlink(at.path() / "a", at.path() / "l");
  const auto files = hash_files(at.path());
  EXPECT_EQ(files.size(), 3U);
  EXPECT_EQ(files.at("a"), hash_text("1"));
  EXPECT_EQ(files.at("sub/b"), hash_text("2"));
  EXPECT_TRUE(files.at("l").empty());
}

// As somebody without rights: in a child, since a process cannot take them back safely beside threads.
TEST(Folders, WhereOneMayNotGoIsCannotWrite) {
  const TemporaryFolder at;
  fs::create_directory(at.path() / "locked");
  fs::permissions(at.path(), fs::perms::all);
  fs::permissions(at.path() / "locked", fs::perms::none);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    if (::geteuid() == 0 && ::setresuid(65534, 65534, 65534) != 0) ::_exit(99);
    int reported = 0;
    const auto code_of = [&](const std::function<void()>& f) {
      try {
        f();
      } catch (const Error& e) {
        reported += e.code() == ExitCode::cannot_write ? 1 : 0;
      } catch (const fs::filesystem_error& e) {
        reported += error_of(e).code() == ExitCode::cannot_write ? 100 : 0;
      }
    };
    code_of([&] { (void)output_exists(at.path() / "locked/x"); });
    code_of([&] { make_output_folder(at.path() / "locked/x"); });
    code_of([&] { write_file(at.path() / "locked/x", ""); });
    code_of([&] { write_folder_atomically(at.path() / "locked/x", kAny, [](const auto&) {}); });
    code_of([&] { (void)fs::exists(at.path() / "locked/x"); });
    ::_exit(reported);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  fs::permissions(at.path() / "locked", fs::perms::all);
  EXPECT_EQ(WEXITSTATUS(status), 104);
}

}  // namespace
}  // namespace osteo
