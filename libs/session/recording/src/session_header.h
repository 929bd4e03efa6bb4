// The header of a session file: JSON that describes what follows.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/session/recording/session_reader.h"
#include "record_codec.h"

namespace osteo::inline session {

inline constexpr int kSessionFormat = 2;

/// What the numbers of a file's library are here, by name.
class NamedNumbers {
 public:
  NamedNumbers() = default;
  /// `what`: "instrument", for errors. `here`: the names in this build's library, by number.
  NamedNumbers(std::string what, std::vector<std::string> names, const std::vector<std::string>& here);
  /// The number here of what has this number in the file. A number behind the file's last stands for its last, as
  /// instrument_of() has it; of a file that names none, it is its own. Error(corrupt) with the name where this build
  /// does not know it; `file`: its name, for that.
  [[nodiscard]] std::uint32_t operator()(std::uint32_t number, const std::string& file) const;
  [[nodiscard]] bool same() const {
    return same_;
  }  ///< each number that both know is its own: nothing to be done where all are known
  [[nodiscard]] bool all_known() const { return all_known_; }
  /// The same, -1 where this build does not know it.
  [[nodiscard]] int here_or_none(std::uint32_t number) const;

 private:
  std::string what_;
  std::vector<std::string> names_;
  std::vector<int> here_;
  bool same_ = true, all_known_ = true;
};

[[nodiscard]] std::string header_json(const SessionHeader& header);
/// Instruments and plates of a file.
struct FileNumbers {
  NamedNumbers tools, plates;
};

/// Fills all of the outline that a header tells, the kinds of records in the file, and what its numbers are here.
/// `name` is the file's, for errors. Throws Error(corrupt), nlohmann::json::exception.
void read_header(std::string_view text, const std::string& name, SessionOutline& outline,
                 std::vector<FileTable>& tables, FileNumbers& numbers);

}  // namespace osteo::inline session
