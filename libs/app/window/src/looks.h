// How structures and cuts are shown, as a session's notes keep it: who resumes one sees what was seen. Private to
// libs/app/window; no screen.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "osteo/display/view/structures_view.h"
#include "osteo/session/scene/rehearsal.h"

namespace osteo::inline app {

struct CutsLook {
  double window_hu = 1000, level_hu = 400;
  int preset = 0;
  bool along_tool = false, follow = true, removed = true, regions = true;
  friend bool operator==(const CutsLook&, const CutsLook&) = default;
};

struct Looks {
  std::map<std::uint8_t, StructureLook> structures;  ///< by value in the label map
  std::optional<CutsLook> cuts;
  std::size_t unreadable = 0;  ///< notes of these kinds that say something else
};
/// The value of a "structure" note and of a "cuts" note.
[[nodiscard]] std::string note_of(std::uint8_t value, const std::string& name, StructureLook look);
[[nodiscard]] std::string note_of(const CutsLook& cuts);
/// The last of each.
[[nodiscard]] Looks looks_of(std::span<const Note> notes);

/// When the looks of the cuts are to be noted: once they have stayed the same for half a second.
class CutsNotes {
 public:
  /// Another session, which begins with usual looks.
  void begin() { noted_ = seen_ = {}; }
  std::optional<std::string> next(const CutsLook& now, double now_s);

 private:
  CutsLook noted_, seen_;
  double since_s_ = 0;
};

}  // namespace osteo::inline app
