// The desktop's own dialog for choosing a folder: zenity, where it is installed. Private to libs/app/window; no screen
// of its own.
#pragma once
#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>

namespace osteo::inline app {

/// One dialog at a time, in a process of its own: nothing waits for it.
class FileDialog {
 public:
  FileDialog() = default;
  ~FileDialog() { close(); }
  FileDialog(const FileDialog&) = delete;
  FileDialog& operator=(const FileDialog&) = delete;

  /// zenity can be found by PATH.
  [[nodiscard]] static bool there();
  /// Empty, or why it could not be opened. One that is open stays.
  std::string open(const std::filesystem::path& folder);
  [[nodiscard]] bool is_open() const { return process_ > 0; }
  /// Ends it; nothing is chosen.
  void close();

  struct Answer {
    std::optional<std::filesystem::path> chosen;  ///< absolute; whether it is a case is not looked at
    std::string why;                              ///< of nothing chosen: empty when the person gave up
  };
  /// Once, when it has ended; waits for nothing.
  [[nodiscard]] std::optional<Answer> poll();

 private:
  bool read_on();
  pid_t process_ = -1;
  int from_ = -1;
  std::string said_;
};

}  // namespace osteo::inline app
