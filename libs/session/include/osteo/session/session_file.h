// The file of a rehearsal: the stream of the servo, in frames with a checksum each, only ever appended to. Whatever was
// written before a crash can be read. Format: docs/session-format.md.
#pragma once
#include <filesystem>
#include <memory>
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
  /// Read from a file: names of the settings under the numbers that its `setting` actions carry (the keys of haptics.params, in order);
  /// read_session() gives the actions the numbers of this build. Not needed to write one.
  std::vector<std::string> setting_names;
};

/// How it ended.
struct SessionEnd {
  std::uint64_t ticks = 0;
  std::string bone_hash;
  std::string surface_hash;  ///< empty where nobody followed it to the end
  double removed_mm3 = 0;
  std::string dust_hash;         ///< empty where the scene has none, or nobody followed it to the end
  std::uint64_t ticks_lost = 0;  ///< of `ticks`: not recorded
};

/// Ticks that could not be recorded, at the place where they would be. What they changed and what was done meanwhile follows it (the last
/// density of each voxel), so that bone behind it is right; but not where `bone_lost`.
struct RecordingGap {
  std::uint64_t first_tick = 0, ticks = 0;
  std::uint64_t bone_lost = 0;  ///< 1: changes or actions of that time are lost as well
};
static_assert(sizeof(RecordingGap) == 24);

/// Where the bytes of a session go: a file, or what stands in for one.
class SessionSink {
 public:
  virtual ~SessionSink() = default;
  /// All of them. Error(cannot_write).
  virtual void write(std::span<const std::byte> bytes) = 0;
  /// To the disk, not only to the system. Error(cannot_write).
  virtual void sync() = 0;
};
/// Creates the file. Errors: cannot_write, also when it exists.
[[nodiscard]] std::unique_ptr<SessionSink> session_file(const std::filesystem::path& path);

/// Makes frames. Errors of all: what the sink throws.
class SessionWriter {
 public:
  SessionWriter(std::unique_ptr<SessionSink> sink, const SessionHeader& header);
  SessionWriter(const std::filesystem::path& path, const SessionHeader& header) : SessionWriter(session_file(path), header) {}

  /// At the beginning of a tick: after the ticks and changes before it, before those of it.
  void append(const SceneAction& action);
  /// Ticks in order; changes of the same ticks, any number a voxel, the last one counts.
  void append(std::span<const TickRecord> ticks, std::span<const VoxelChange> changes);
  void append(const RecordingGap& gap);
  void sync() { sink_->sync(); }
  void finish(const SessionEnd& end);
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  void frame(std::uint32_t type, std::span<const std::byte> payload);
  void write();
  std::unique_ptr<SessionSink> sink_;
  std::uint64_t bytes_ = 0;
  std::vector<std::byte> out_;
  std::vector<VoxelChange> coalesced_;
};

/// Something done to the scene, and how many of the changes came before it.
struct RecordedAction {
  SceneAction action;
  std::size_t changes_before = 0;
};

/// What is missing in the middle of a session, and how much of it stands before.
struct Gap {
  std::uint64_t first_tick = 0, ticks = 0;  ///< 0 ticks: only changes or actions
  bool bone_lost = false;                   ///< changes or actions are missing too: bone behind it is not known until the end
  std::uint64_t at_byte = 0, bytes = 0;     ///< of the file, where it is damaged; 0: the recorder could not keep up and said so
  std::size_t ticks_before = 0, changes_before = 0, actions_before = 0;
};

struct Session {
  SessionHeader header;
  std::vector<TickRecord> ticks;  ///< of each tick one for each hand, in order; their numbers rise by one but over gaps
  std::vector<VoxelChange>
      changes;  ///< in the order written; applied in this order, with the actions between them, they give the scene at the end
  std::vector<RecordedAction> actions;
  std::vector<Gap> gaps;
  std::uint64_t torn_bytes = 0;   ///< behind the last whole frame, left out
  std::uint64_t torn_ticks = 0;   ///< whose changes did not reach the file any more, left out
  std::optional<SessionEnd> end;  ///< absent when the program was stopped before it could close the file

  [[nodiscard]] bool damaged() const;
  /// The gap behind which changes and actions do not give the bone any more; null: they give it to the end. (Bone that the recorder lost on
  /// the way stands at the end of a session that was closed.)
  [[nodiscard]] const Gap* bone_known_until() const;
};

/// What to do about a file that is damaged in the middle.
enum class Damage {
  refuse,  ///< Error(corrupt), which says where and how much
  keep,    ///< frames before and behind it are read; `gaps` tells what is missing
};

/// Reads all whole frames; behind damage it looks for the next. Errors: no_input, cannot_read; corrupt when the header is damaged, a frame
/// in the middle is (Damage::refuse), or ticks are missing without anything that says so. A cut or damaged last frame is left out without
/// error: `end` is then absent, and `torn_bytes` not 0.
[[nodiscard]] Session read_session(const std::filesystem::path& path, Damage damage = Damage::refuse);

/// For people: what is missing, a line for each gap and for a torn end. Empty when the session is whole.
[[nodiscard]] std::vector<std::string> losses(const Session& session);

}  // namespace osteo
