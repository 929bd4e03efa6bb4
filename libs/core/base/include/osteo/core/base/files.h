// Files that are written whole or not at all, read with errors that say what is wrong, and hashed.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/error.h"

namespace osteo {

namespace fs = std::filesystem;

/// Reads a whole file. Error(no_input) when it is missing, Error(cannot_read) when it may not be read.
[[nodiscard]] std::vector<std::byte> read_file(const fs::path& path);
[[nodiscard]] std::string read_text(const fs::path& path);
/// Checks that `path` exists (Error no_input) and may be read (Error cannot_read).
void require_readable(const fs::path& path);

/// Calls `write` with a temporary path beside `path`, syncs it, then renames it over `path`. When `write` throws, or
/// the process is stopped, `path` is as it was. The temporary keeps the suffix of `path`, so writers that look at it
/// work. Errors: cannot_write, with the reason (disk full, permission, a folder or device of that name, ...).
void write_atomically(const fs::path& path, const std::function<void(const fs::path& temporary)>& write);
void write_file(const fs::path& path, std::string_view content);

/// The same for a folder: `fill` fills a temporary folder beside `path`, which is then exchanged with it in one step,
/// so that at any moment either the old or the new one is there, whole. `path` may exist as an empty folder, or as a
/// folder that `may_replace` (when given) lets pass: it is asked before the work and again just before the exchange,
/// and throws when the folder holds what must not be lost. Which folder `path` stands for is as of output_folder.
void write_folder_atomically(const fs::path& path, const std::function<void(const fs::path& old)>& may_replace,
                             const std::function<void(const fs::path& temporary)>& fill);

/// The folder that an output of this name stands for: links followed, without "." and trailing slashes.
/// Error(cannot_write) where there is a file or a link that leads nowhere, and for the folder one is in or one above
/// it. It need not exist.
[[nodiscard]] fs::path output_folder(const fs::path& path);
/// Whether an output would meet something at `path`; a link that leads nowhere counts. Error(cannot_write) where that
/// cannot be told, such as below a folder that one may not enter.
[[nodiscard]] bool output_exists(const fs::path& path);
/// Makes the folder and those above it that are missing. Error(cannot_write), also when it is a file.
void make_output_folder(const fs::path& path);
/// What the standard library says of a path, in our words and with an exit code: cannot_write, or cannot_read for
/// something that is there.
[[nodiscard]] Error error_of(const fs::filesystem_error& error);

/// A folder of one's own among the system's temporary files, for this user only; gone with the object, and when the
/// process is stopped.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// Removes the temporaries of this process. Async-signal-unsafe: call it on the way out, not in a handler.
void remove_temporaries() noexcept;

/// 128-bit XXH3 of the bytes, as 32 hex digits. Not cryptographic: it tells change, not tampering.
[[nodiscard]] std::string hash_bytes(std::span<const std::byte> bytes);
[[nodiscard]] std::string hash_text(std::string_view text);
/// Content hash of a file, or of all files in a folder (by content, in sorted order of their hashes; names do not
/// count). Error(cannot_read) where a part of it may not be read.
[[nodiscard]] std::string hash_path(const fs::path& path);
/// Path below `folder` -> content hash, of every file in it. What is neither file nor folder, such as a link, has an
/// empty hash.
[[nodiscard]] std::map<std::string, std::string> hash_files(const fs::path& folder);

/// Incremental form of hash_bytes.
class Hasher {
 public:
  Hasher();
  ~Hasher();
  Hasher(const Hasher&) = delete;
  Hasher& operator=(const Hasher&) = delete;
  void add(const void* data, std::size_t bytes);
  [[nodiscard]] std::string hex() const;

 private:
  void* state_;
};

/// Peak resident memory of this process so far, in MB (10^6 bytes).
[[nodiscard]] double peak_memory_mb();

}  // namespace osteo
