// Reads sessions: what there is of one, then its records, a frame at a time.
#pragma once
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <string_view>
#include "osteo/session/recording/records.h"
#include "osteo/session/recording/session_file.h"
#include "osteo/simulation/bone/world.h"

namespace osteo::inline session {

/// What is missing in the middle of a session.
struct Gap {
  std::uint64_t first_tick = 0, ticks = 0;  ///< 0 ticks: only changes or actions
  bool bone_lost = false;  ///< changes or actions are missing too: bone behind it is not known until the end
  std::uint64_t at_byte = 0,
                bytes = 0;  ///< of the file, where it is damaged; 0: the recorder could not keep up and said so
};

/// What is known of a session before its records are read.
struct SessionOutline {
  SessionHeader header;
  std::vector<Gap> gaps;
  std::uint64_t torn_bytes = 0;   ///< behind the last whole frame, left out
  std::optional<SessionEnd> end;  ///< absent when the program was stopped before it could close the file
  std::uint64_t tick_records = 0;

  std::vector<const RecordField*> tick_fields;        ///< those of ours that the file has
  std::map<std::uint32_t, std::string> action_names;  ///< as the file has them
  /// Instruments and plates by the numbers that its records carry as they are read: those of this build's libraries,
  /// whatever numbers the file has for the same names. What it lists and this build does not know has no number: a
  /// record that tells of it is rejected.
  std::vector<std::string> tools, plates;
  bool numbered_alike = true;  ///< the file has the same numbers for what both know
  /// Of its settings, under the numbers that its `setting` actions carry in the file; read, they carry the numbers of
  /// this build, kNobody where it has no such setting (then it is not replayable).
  std::vector<std::string> setting_names;
  std::string not_replayable;      ///< why this build's servo cannot repeat it; empty: it can
  std::vector<std::string> newer;  ///< what it holds that this build does not know and leaves out, each in a line

  [[nodiscard]] bool damaged() const;
  /// The gap behind which changes and actions do not give the bone any more; null: they give it to the end. (Bone that
  /// the recorder lost on the way stands at the end of a session that was closed.)
  [[nodiscard]] const Gap* bone_known_until() const;
};

/// For people: what is missing, a line for each gap and for a torn end. Empty when the session is whole.
[[nodiscard]] std::vector<std::string> losses(const SessionOutline& session);

/// What to do about a file that is damaged in the middle.
enum class Damage {
  refuse,  ///< Error(corrupt), which says where and how much
  keep,    ///< frames before and behind it are read; `gaps` tells what is missing
};

/// One of these, the others are empty.
struct SessionPart {
  std::span<const SceneAction> actions;  ///< each at the beginning of its tick, in order with changes that matter to it
  std::span<const TickRecord> ticks;
  std::span<const VoxelChange> changes;  ///< of the ticks just before, each voxel once, ascending
  std::span<const Note> notes;
  const Gap* gap = nullptr;
  std::optional<std::uint64_t> checkpoint;  ///< all before this tick has come, and is in the checkpoints up to here
};

/// An open session. Holds an index of its frames, 32 bytes for each tenth of a second, and no records.
class SessionReader {
 public:
  /// Looks through the whole file: all checksums, none of the records. Behind damage it looks for the next whole frame.
  /// Errors: no_input, cannot_read; corrupt when it is of another format (says which), the header is damaged, a frame
  /// in the middle is (Damage::reject), or ticks are missing without anything that says so. A cut or damaged last frame
  /// is left out without error: `end` is then absent, and `torn_bytes` not 0.
  explicit SessionReader(const std::filesystem::path& path, Damage damage = Damage::refuse);
  ~SessionReader();
  SessionReader(SessionReader&&) noexcept;

  [[nodiscard]] const SessionOutline& outline() const;
  [[nodiscard]] const SessionHeader& header() const { return outline().header; }

  /// Goes through records in the order in which they happened; memory is that of a frame. The reader must outlive it.
  class Parts {
   public:
    ~Parts();
    Parts(Parts&&) noexcept;
    /// The next; null behind the last. Holds until the next call. Error(corrupt) where a frame is not what its checksum
    /// promised, or tells of an instrument or a plate that this build does not know (says which).
    const SessionPart* next();

   private:
    friend class SessionReader;
    struct State;
    explicit Parts(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
  };
  /// All there is.
  [[nodiscard]] Parts parts() const;
  /// The contents of the checkpoints: actions and changes that give the same scene at each.
  [[nodiscard]] Parts checkpoints() const;
  /// The fewest actions and changes that give the scene in which `tick` begins, and nothing else. They give it at
  /// `reached`: where the frame ends that holds the tick before, so at most a tenth of a second later. Error(corrupt)
  /// where that scene is not known, since something is missing before.
  [[nodiscard]] Parts scene_at(std::uint64_t tick, std::uint64_t& reached) const;

 private:
  struct File;
  std::unique_ptr<File> file_;
};

/// Something done to the scene, and how many of the changes came before it.
struct RecordedAction {
  SceneAction action;
  std::size_t changes_before = 0;
};

/// A whole session in memory: for small ones.
struct Session : SessionOutline {
  std::vector<TickRecord> ticks;  ///< their numbers rise by one but over gaps
  /// In the order written; applied in this order, with the actions between them, they give the scene at the end.
  std::vector<VoxelChange> changes;
  std::vector<RecordedAction> actions;
  std::vector<Note> notes;
};
/// Errors: as SessionReader.
[[nodiscard]] Session read_session(const std::filesystem::path& path, Damage damage = Damage::refuse);

// -- What a session's records do to a scene: one stepping for whoever follows one, from its file or while it runs.

/// Does what the scene's owner did; of what the servo did by itself only the scene's strokes are told (its changes of
/// bone are records).
World::Effect apply_action(const SceneAction& action, World& world);

/// Gives a voxel its recorded density, and tells the change with the density before. Nothing where the bone has no such
/// voxel.
std::optional<VoxelChange> apply_change(const VoxelChange& change, World& world);

/// A part of a session file, in order. The last density of a voxel before each action that parts changes
/// (parts_changes) is enough: strokes end there, and what was before is in the bone. Error(corrupt) where it changes a
/// voxel that the bone does not have.
void apply_part(const SessionPart& part, World& world);

/// The kind of the note at the beginning of a session by a simulated trainee; its value names skill and seed.
inline constexpr std::string_view kSimulatedNote = "simulated";

/// For whoever shows a session, in a sentence; empty where a person drilled it. Reads until the first note at most.
[[nodiscard]] std::string simulated_text(const SessionReader& session);

}  // namespace osteo::inline session
