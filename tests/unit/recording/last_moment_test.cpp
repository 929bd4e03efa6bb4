// The end of a recording and of an export, on disks that have their own time or no room.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <string>

#include "osteo/core/base/error.h"
#include "osteo/session/recording/export.h"
#include "osteo/session/recording/recorder.h"
#include "osteo/session/recording/session_reader.h"
#include "scratch.h"

namespace osteo {
namespace {

SessionHeader header() {
  SessionHeader h;
  h.program_version = "test";
  h.bone_hash = "abc";
  return h;
}

class Listening final : public SessionSink {
 public:
  explicit Listening(std::string& heard) : heard_(heard) {}
  void write(std::span<const std::byte>) override { heard_ += 'w'; }
  void sync() override { heard_ += 's'; }

 private:
  std::string& heard_;
};

TEST(Recorder, EndsWithASyncOfAllThatWasWritten) {
  std::string heard;
  {
    StreamReader reader(1 << 10, 1 << 10);
    Recorder recorder(reader, std::make_unique<Listening>(heard), header());
    recorder.start();
    for (std::uint64_t n = 0; n < 5; ++n) {
      TickRecord t;
      t.tick = n;
      reader.ticks.push(t);
    }
    recorder.finish({5, "abc", "", 0, "", 0, 0});
  }
  ASSERT_GE(heard.size(), 3u);
  EXPECT_EQ(heard.back(), 's') << heard;
}

// A file that is deleted while it is written takes all of it, and nobody finds it again: the recording has failed. One
// that is moved is whole where it is.
TEST(Recorder, AFileThatIsDeletedMeanwhileIsToldAndAMovedOneIsWhole) {
  for (const bool deleted : {true, false}) {
    const test::ScratchFolder at;
    std::filesystem::create_directory(at / "session");
    StreamReader reader(1 << 10, 1 << 10);
    Recorder recorder(reader, at / "session" / "stream.oss", header());
    recorder.start();
    if (deleted) {
      std::filesystem::remove_all(at / "session");
    } else {
      std::filesystem::rename(at / "session", at / "elsewhere");
    }
    TickRecord t;
    reader.ticks.push(t);
    recorder.finish({1, "abc", "", 0, "", 0, 0});
    const auto failure = recorder.status().failure;
    ASSERT_EQ(failure.has_value(), deleted);
    if (deleted) {
      EXPECT_NE(std::string(failure->what()).find("was deleted while it was recorded"), std::string::npos);
    } else {
      EXPECT_EQ(SessionReader(at / "elsewhere" / "stream.oss").outline().tick_records, 1U);
    }
  }
}

// What was buffered goes to the disk last: that it does not fit is told then.
TEST(Export, ADiskWithoutRoomIsToldByEveryFormat) {
  const test::ScratchFolder recorded;
  {
    SessionWriter writer(recorded / "stream.oss", header());
    SessionBatch batch;
    for (std::uint64_t n = 0; n < 300; ++n) {
      TickRecord t;
      t.tick = n;
      batch.ticks.push_back(t);
    }
    writer.append(batch);
    writer.finish({300, "abc", "", 0, "", 0, 0});
  }
  const SessionReader session(recorded / "stream.oss");
  for (const char* const name : {"out.csv", "out.h5", "out.mcap"}) {
    const test::ScratchFolder folder;
    const pid_t child = ::fork();
    if (child == 0) {
      ::signal(SIGXFSZ, SIG_IGN);
      const rlimit limit{4096, 4096};
      ::setrlimit(RLIMIT_FSIZE, &limit);
      int code = 0;
      try {
        export_session(session, folder / name, Context{});
      } catch (const Error& e) {
        code = static_cast<int>(e.code());
      } catch (...) {
        code = 99;
      }
      ::_exit(code);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFEXITED(status)) << name;
    EXPECT_EQ(WEXITSTATUS(status), static_cast<int>(ExitCode::cannot_write)) << name;
    EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << name;
  }
}

}  // namespace
}  // namespace osteo
