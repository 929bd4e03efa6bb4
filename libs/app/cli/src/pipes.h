// '-' in place of a file: standard input for texts that a stage reads, standard output for documents that it writes.
#pragma once
#include <istream>
#include <optional>
#include <ostream>
#include <string>

#include "osteo/core/base/files.h"
#include "osteo/core/stage/stage.h"

namespace osteo::inline app::cli {

/// The files that stand for '-' while a stage runs. Meshes, volumes and pictures are written with a checksum beside
/// them, and tables that are read twice need a place, so these go through a temporary folder or are rejected.
class Pipes {
 public:
  /// A file that holds all of `in`, once. Error(usage) when the port takes no text or standard input is taken already.
  [[nodiscard]] fs::path input(const Port& port, std::istream& in);
  /// A file for the output of this port. Error(usage) when it is no document or standard output is taken already.
  [[nodiscard]] fs::path output(const Port& port);
  /// Copies what was written for '-' to `out`; nothing when there was none.
  void flush(std::ostream& out) const;
  [[nodiscard]] bool writes() const { return !output_.empty(); }

 private:
  [[nodiscard]] const fs::path& folder();
  std::optional<TemporaryFolder> folder_;
  bool read_ = false;
  fs::path output_;
};

}  // namespace osteo::inline app::cli
