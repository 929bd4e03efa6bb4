// What the start page offers: cases opened last, sessions that can be gone on from, folders to look into. Private to
// libs/app/window; no ImGui.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "osteo/app/window/start_page.h"

namespace osteo::inline app {

enum class FolderKind { nothing, folder, the_case, session, demo, scan, network };
struct FolderLook {
  FolderKind kind = FolderKind::nothing;
  std::filesystem::path folder;
  std::string why;  ///< of nothing: what it is instead, and what to do
};
/// What a path stands for. A file that a case or a session is known by (manifest.json, session.json, stream.oss) stands
/// for its folder; a folder with DICOM files in it for a scan. Reads names, and of a few files whether they are DICOM.
/// Never throws.
[[nodiscard]] FolderLook look_at_path(const std::filesystem::path& path);

struct StartEntry {
  enum class Group { recent, session, browse } group = Group::recent;
  FolderKind kind = FolderKind::folder;
  std::filesystem::path folder;
  std::string words;
};

class StartList {
 public:
  static constexpr std::size_t kMaxListed = 500;
  /// `from`: the folder that the browser begins in; one that cannot be read is told in message().
  /// `demo`: the case of the demo ear, offered behind those opened last, whether it is there yet or not; empty: none.
  StartList(std::vector<std::filesystem::path> recent, std::filesystem::path from, std::filesystem::path demo = {});

  [[nodiscard]] const std::vector<StartEntry>& entries() const { return entries_; }
  [[nodiscard]] int selected() const { return selected_; }
  void select(int entry);
  void move(int by);  ///< stops at the ends
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  /// Opens the entry: a folder is looked into; a case or a session is a choice; of a demo that is not there yet
  /// wants_demo() is set.
  std::optional<StartChoice> open();
  void up();  ///< to the folder above
  /// What was dropped onto the window, or chosen in a dialog: of several things the first that is a case or a session.
  std::optional<StartChoice> take(const std::vector<std::filesystem::path>& paths);

  [[nodiscard]] const std::string& message() const { return message_; }
  void say(std::string text) { message_ = std::move(text); }
  void forget_recent();
  /// Once: the demo is to be made.
  [[nodiscard]] bool wants_demo() { return std::exchange(wants_demo_, false); }
  /// Looks again, and goes to the entry of that folder; where there is none it stays where it was.
  void refresh(const std::filesystem::path& chosen);

 private:
  std::optional<StartChoice> take_one(const std::filesystem::path& path);
  void list();
  void look_into(const std::filesystem::path& folder);
  std::vector<std::filesystem::path> recent_;
  std::filesystem::path folder_, demo_;
  bool wants_demo_ = false;
  std::vector<StartEntry> entries_;
  int selected_ = 0;
  std::string message_;
};

/// Sessions of a case, the last first; by the number or the name of their folders.
[[nodiscard]] std::vector<std::filesystem::path> sessions_of(const std::filesystem::path& the_case);

}  // namespace osteo::inline app
