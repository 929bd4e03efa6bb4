// What the records of a session are made of, field by field: the one source for a file's header, for reading it by
// name, for what a replay compares, and for the columns of exports.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "osteo/session/recording/session_reader.h"
#include "osteo/simulation/bone/world.h"
#include "osteo/simulation/haptics/stream.h"

namespace osteo::inline session {

enum class FieldType : std::uint8_t { u8, u32, u64, f32, f64 };

/// What a field is to a replay.
enum class FieldRole : std::uint8_t {
  input,    ///< fed to the servo again: a replay needs all of them, and knows all
  result,   ///< has to come out the same, bit for bit
  machine,  ///< how the machine did: not compared
};

struct RecordField {
  std::string_view name;  ///< lower case, unit at its end where it has one; never used again for something else
  FieldType type;
  std::uint32_t offset;  ///< in the record in memory
  std::string_view unit;
  std::string_view meaning;
  FieldRole role = FieldRole::result;
};

struct RecordTable {
  std::string_view name;
  std::uint32_t part;          ///< its number in a frame
  std::uint32_t memory_bytes;  ///< of a record in memory
  std::span<const RecordField> fields;
};

/// TickRecord, VoxelChange, SceneAction. To record another field: a line in its table.
[[nodiscard]] const RecordTable& tick_table();
[[nodiscard]] const RecordTable& change_table();
[[nodiscard]] const RecordTable& action_record_table();
/// The part that holds notes, as lines of JSON.
inline constexpr std::uint32_t kNotesPart = 4;

[[nodiscard]] std::string_view name_of(FieldType type);
/// Bytes of a value: 1, 4 or 8.
[[nodiscard]] std::size_t size_of(FieldType type);
[[nodiscard]] inline bool is_whole(FieldType type) {
  return type == FieldType::u8 || type == FieldType::u32 || type == FieldType::u64;
}
/// The value of a field of a record. Exact below 2^53.
[[nodiscard]] double value_of(const RecordField& field, const void* record);
/// Bytes, not numbers: the same bits or not. Null: all that are a result are the same in both; else the first that
/// differs.
[[nodiscard]] const RecordField* first_difference(std::span<const RecordField* const> fields, const void* a,
                                                  const void* b);

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

}  // namespace osteo::inline session
