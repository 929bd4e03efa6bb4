// Writes the stream to a session file from a thread of its own.
#pragma once
#include <atomic>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>

#include "osteo/base/error.h"
#include "osteo/session/session_file.h"

namespace osteo {

class Recorder {
 public:
  /// `reader` belongs to the recorder from now on. Errors: cannot_write.
  Recorder(StreamReader& reader, const std::filesystem::path& path, const SessionHeader& header);
  ~Recorder();

  void start();
  /// Takes what the stream holds now. Called by the thread, or by hand when it was not started.
  std::size_t drain();
  /// After the servo has stopped: takes the rest and stops the thread; `finish` then closes the file.
  void stop();
  void finish(const SessionEnd& end) { writer_.finish(end); }

  [[nodiscard]] std::uint64_t ticks() const { return ticks_; }
  [[nodiscard]] double removed_mm3() const { return removed_mm3_; }
  [[nodiscard]] std::uint64_t bytes() const { return writer_.bytes(); }
  /// A full disk, say: the rehearsal goes on, recording has ended. Valid after stop().
  [[nodiscard]] const std::optional<Error>& failure() const { return failure_; }

 private:
  StreamReader& reader_;
  SessionWriter writer_;
  std::vector<TickRecord> ticks_buffer_;
  std::vector<VoxelChange> changes_buffer_;
  std::deque<SceneAction> actions_;  // taken from the stream, their ticks not yet
  std::atomic<std::uint64_t> ticks_{0};
  double removed_mm3_ = 0;
  std::atomic<bool> stop_{false};
  std::optional<Error> failure_;
  std::thread thread_;
};

}  // namespace osteo
