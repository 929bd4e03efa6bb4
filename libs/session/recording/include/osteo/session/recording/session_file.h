// The file of a rehearsal: the stream of the servo, in frames with a checksum each, only ever appended to. Whatever was
// written before a crash can be read. Format: docs/formats/session-format.md. Reading: session_reader.h.
#pragma once
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "osteo/simulation/bone/dust.h"
#include "osteo/simulation/haptics/renderer.h"
#include "osteo/simulation/haptics/stream.h"

namespace osteo::inline session {

/// What a replay repeats with: the same poses come out the same only where all of these are equal. Raise a number when
/// what it stands for gives other bits.
struct Kernels {
  int burrs = kBurrLibraryVersion;
  int contact = 6;  ///< forces, guard and removal; 2 to 5 are repeated by GuardParams::law 1 to 4
  int scene = 1;    ///< what World::act does
  friend bool operator==(const Kernels&, const Kernels&) = default;
};

/// What a replay needs to know before the first tick.
struct SessionHeader {
  std::string program_version;
  std::string bone_hash;  ///< World::hash() before the first tick
  double rate_hz = 1000;
  Kernels kernels;
  HapticSetup haptics;          ///< of how many hands, too: each tick has a record for each, in their order
  bool dust = false;            ///< the scene begins with bone dust
  bool heat = false;            ///< it begins with heat
  int dust_model = kDustModel;  ///< which its hash is of: a replay compares its own model's only
};

/// How it ended.
struct SessionEnd {
  std::uint64_t ticks = 0;
  std::string bone_hash;
  std::string surface_hash;  ///< empty where nobody followed it to the end
  double removed_mm3 = 0;
  std::string dust_hash;         ///< empty where the scene has none, or nobody followed it to the end
  std::uint64_t ticks_lost = 0;  ///< of `ticks`: not recorded
  std::uint64_t notes_lost = 0;
};

/// Ticks that could not be recorded, at the place where they would be. What they changed and what was done meanwhile
/// follows it (the last density of each voxel), so that bone behind it is right; but not where `bone_lost`.
struct RecordingGap {
  std::uint64_t first_tick = 0, ticks = 0;
  bool bone_lost = false;  ///< changes or actions of that time are lost as well
};

/// Something that does not touch physics: where the camera is, what was chosen or shown, a mark. Whoever does not know
/// a kind ignores it.
struct Note {
  std::uint64_t tick = 0;
  std::string kind;  ///< one word
  std::string json;  ///< its value; what is no JSON is kept as a text
};

/// A piece of the stream: first the actions, then the ticks, then what these changed. An action that looks at densities
/// may not stand behind changes of its own batch: it begins a new one.
struct SessionBatch {
  std::vector<SceneAction> actions;
  std::vector<TickRecord> ticks;
  std::vector<VoxelChange> changes;  ///< any number a voxel, the last one counts
  std::vector<Note> notes;
  [[nodiscard]] bool empty() const { return actions.empty() && ticks.empty() && changes.empty() && notes.empty(); }
};

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

/// Makes frames, each in one write, compressed. Keeps what it takes to write a checkpoint each minute: 8 bytes for each
/// voxel that changed since the last in each tenth of a second. Errors of all: what the sink throws.
class SessionWriter {
 public:
  static constexpr double kCheckpointEveryS = 60;

  SessionWriter(std::unique_ptr<SessionSink> sink, const SessionHeader& header);
  SessionWriter(const std::filesystem::path& path, const SessionHeader& header)
      : SessionWriter(session_file(path), header) {}

  /// Ticks in order, going on from those before.
  void append(const SessionBatch& batch);
  void append(const RecordingGap& gap);
  void sync() { sink_->sync(); }
  void finish(const SessionEnd& end);
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  struct Segment {
    std::vector<SceneAction> actions;
    std::vector<VoxelChange> changes;
  };
  void records(std::uint32_t type, std::uint64_t first_tick, std::uint64_t end_tick, const Segment& segment,
               std::span<const TickRecord> ticks = {}, std::span<const Note> notes = {});
  void frame(std::uint32_t type, std::uint64_t first_tick, std::uint64_t end_tick, std::span<const std::byte> payload);
  void remember(const SessionBatch& batch);
  void checkpoint();
  std::unique_ptr<SessionSink> sink_;
  double rate_hz_;
  std::uint64_t bytes_ = 0, next_tick_ = 0, checkpoint_tick_ = 0;
  std::vector<Segment> since_checkpoint_;
  std::vector<std::byte> raw_, out_;
};

}  // namespace osteo::inline session
