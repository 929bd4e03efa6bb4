// What the records of a session are made of, field by field: the one source for a file's header, for reading it by
// name, for what a replay compares, and for the columns of exports.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

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

}  // namespace osteo::inline session
