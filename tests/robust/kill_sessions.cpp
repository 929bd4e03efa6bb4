// Kills a recording program again and again in the middle of its writing, and looks for every record that it had been
// told was written; in turns by the writer alone and by the recorder with its threads. usage: kill_sessions KILLS
// FOLDER
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>
#include <csignal>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <thread>

#include "osteo/core/base/error.h"
#include "osteo/session/recording/recorder.h"
#include "osteo/session/recording/session_reader.h"

namespace {

std::vector<osteo::TickRecord> some_ticks(std::uint64_t first, std::size_t n) {
  std::vector<osteo::TickRecord> t(n);
  for (std::size_t i = 0; i < n; ++i) {
    t[i].tick = first + i;
    t[i].removed_mm3 = static_cast<float>((first + i) % 1000);
  }
  return t;
}

[[noreturn]] void record_by_threads(const std::filesystem::path& path, std::atomic<std::uint64_t>* written) {
  osteo::SessionHeader header;
  header.program_version = "test";
  osteo::StreamReader reader(1 << 12, 1 << 16);
  osteo::Recorder recorder(reader, path, header);
  recorder.start();
  std::mt19937 random(static_cast<unsigned>(::getpid()));
  for (std::uint64_t tick = 0;;) {
    const std::size_t n = 1 + random() % 400;
    for (osteo::TickRecord& t : some_ticks(tick, n)) {
      t.voxels_changed = static_cast<std::uint32_t>(random() % 8);
      std::vector<osteo::VoxelChange> changes(t.voxels_changed,
                                              {static_cast<osteo::VoxelKey>(random() % 100000), 0.5F});
      while (reader.ticks.room() < 1 || !reader.changes.push(changes)) std::this_thread::yield();
      reader.ticks.push(t);
    }
    tick += n;
    // The system has what is in a frame once nothing waits; the last tenth of a second is not in one yet.
    osteo::Recorder::Status status;
    do {
      status = recorder.status();
      std::this_thread::yield();
    } while (status.waiting_bytes > 0 || status.ticks + 100 < tick);
    written->store(status.ticks, std::memory_order_release);
  }
}

[[noreturn]] void record(const std::filesystem::path& path, std::atomic<std::uint64_t>* written) {
  osteo::SessionHeader header;
  header.program_version = "test";
  osteo::SessionWriter writer(path, header);
  std::mt19937 random(static_cast<unsigned>(::getpid()));
  for (std::uint64_t tick = 0;;) {
    const std::size_t n = 1 + random() % 40;
    std::vector<osteo::VoxelChange> changes(random() % 200);
    for (auto& c : changes) c = {static_cast<osteo::VoxelKey>(random() % 100000), 0.5F};
    writer.append({{}, some_ticks(tick, n), changes, {}});
    tick += n;
    written->store(tick, std::memory_order_release);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int kills = argc > 1 ? std::atoi(argv[1]) : 100;
  const std::filesystem::path folder = argc > 2 ? argv[2] : "kill-sessions";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  auto* const written = new (::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0))
      std::atomic<std::uint64_t>(0);
  {
    const osteo::SessionWriter once(folder / "once.oss", {});
  }  // makes the plates that a header tells of, so that children need not
  std::mt19937 random(11);
  std::uint64_t acknowledged = 0, recovered = 0;
  int torn = 0;
  const auto path = folder / "stream.oss";
  for (int k = 0; k < kills; ++k) {
    std::filesystem::remove(path);
    written->store(0);
    const pid_t child = ::fork();
    if (child == 0 && k % 2 == 1) record_by_threads(path, written);
    if (child == 0) record(path, written);
    ::usleep(1500 + static_cast<unsigned>(random()) % 15000);
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    const std::uint64_t reported = written->load();
    if (reported == 0) continue;
    const osteo::Session session = osteo::read_session(path);
    if (session.ticks.size() < reported || session.end) {
      std::printf("kill %d: %llu records were acknowledged, %zu are there\n", k,
                  static_cast<unsigned long long>(reported), session.ticks.size());
      return 1;
    }
    for (std::size_t t = 0; t < session.ticks.size(); ++t) {
      if (session.ticks[t].tick != t || session.ticks[t].removed_mm3 != static_cast<float>(t % 1000)) {
        std::printf("kill %d: record %zu is wrong\n", k, t);
        return 1;
      }
    }
    acknowledged += reported;
    recovered += session.ticks.size();
    // A frame cut in the middle leaves bytes behind the last whole one.
    torn += session.torn_bytes > 0 ? 1 : 0;
  }
  std::printf("%d kills: %llu records acknowledged, %llu recovered, %d torn tails left out\n", kills,
              static_cast<unsigned long long>(acknowledged), static_cast<unsigned long long>(recovered), torn);
  return acknowledged > 0 ? 0 : 1;
}
