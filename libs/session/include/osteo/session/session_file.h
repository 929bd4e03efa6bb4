// The file of a rehearsal: the stream of the servo, in frames with a checksum each, only ever appended to. Whatever was
// written before a crash can be read. Format: docs/session-format.md.
#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "osteo/haptics/renderer.h"
#include "osteo/haptics/stream.h"

namespace osteo {

/// What a replay needs to know before the first tick.
struct SessionHeader {
  std::string program_version;
  std::string bone_hash;  ///< World::hash() before the first tick
  double rate_hz = 1000;
  int burr_library = kBurrLibraryVersion;
  HapticSetup haptics;
  bool dust = false;  ///< the scene has bone dust
};

/// How it ended.
struct SessionEnd {
  std::uint64_t ticks = 0;
  std::string bone_hash;
  std::string surface_hash;
  double removed_mm3 = 0;
  std::string dust_hash;  ///< empty where the scene has none
};

class SessionWriter {
 public:
  /// Creates the file. Errors: cannot_write, also when it exists.
  SessionWriter(const std::filesystem::path& path, const SessionHeader& header);
  ~SessionWriter();
  SessionWriter(const SessionWriter&) = delete;
  SessionWriter& operator=(const SessionWriter&) = delete;

  /// At the beginning of a tick: after the ticks and changes before it, before those of it.
  void append(const SceneAction& action);
  /// Ticks in order; changes of the same ticks, any number a voxel, the last one counts.
  void append(std::span<const TickRecord> ticks, std::span<const VoxelChange> changes);
  /// To the disk, not only to the system.
  void sync();
  void finish(const SessionEnd& end);
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  void frame(std::uint32_t type, std::span<const std::byte> payload);
  int fd_ = -1;
  std::filesystem::path path_;
  std::uint64_t bytes_ = 0;
  std::vector<VoxelChange> coalesced_;
};

/// Something done to the scene, and how many of the changes came before it.
struct RecordedAction {
  SceneAction action;
  std::size_t changes_before = 0;
};

struct Session {
  SessionHeader header;
  std::vector<TickRecord> ticks;
  std::vector<VoxelChange>
      changes;  ///< in the order written; applied in this order, with the actions between them, they give the scene at the end
  std::vector<RecordedAction> actions;
  std::uint64_t torn_bytes = 0;   ///< behind the last whole frame, left out
  std::optional<SessionEnd> end;  ///< absent when the program was stopped before it could close the file
};

/// Reads all whole frames. Errors: no_input, cannot_read; corrupt when the header is damaged or a frame in the middle is.
/// A cut or damaged last frame is left out without error: `end` is then absent.
[[nodiscard]] Session read_session(const std::filesystem::path& path);

}  // namespace osteo
