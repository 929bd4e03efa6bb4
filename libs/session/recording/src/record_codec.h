// Records as they stand in a frame: field by field, each as differences to the record before, the bytes of these
// transposed, so that what changes little compresses well.
#pragma once
#include <string>
#include <vector>

#include "osteo/session/recording/records.h"

namespace osteo::inline session {

/// A field as a file has it.
struct FileField {
  FieldType type{};
  const RecordField* ours = nullptr;  ///< null: not known here, skipped
};
/// A kind of record as a file has it.
struct FileTable {
  std::uint32_t part = 0;
  std::size_t bytes = 0;  ///< of a record
  bool text = false;      ///< bytes as they are; `bytes` is 1
  std::vector<FileField> fields;
};

/// Appends `n` records, `bytes` apart in memory.
void put_records(std::vector<std::byte>& out, std::span<const RecordField> fields, const void* records, std::size_t n,
                 std::size_t bytes);
/// The reverse: `from` holds n * table.bytes. Fields that the file lacks stay as they are in `records`; another type of
/// number is converted.
void get_records(const FileTable& table, std::span<const std::byte> from, std::size_t n, void* records,
                 std::size_t bytes);

}  // namespace osteo::inline session
