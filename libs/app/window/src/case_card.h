// What the start page says of a case and of a session: read from small files, nothing of it is loaded. Private to
// libs/app/window; no ImGui.
#pragma once
#include <filesystem>
#include <string>

#include "osteo/imaging/dicom/verdict.h"

namespace osteo::inline app {

struct CaseCard {
  enum class State { plain, approved, doubtful, broken } state = State::plain;
  std::string name;               ///< the folder's
  std::string facts;              ///< voxels, sessions, when it was worked on last
  std::string words;              ///< of its approval; of a broken case that it cannot be opened
  std::string why;                ///< of a broken case: what is wrong, and what to do
  std::string structures;         ///< names, the first few; empty: none
  VerdictSummary scan;            ///< what its import found; status empty: unknown
  std::filesystem::path preview;  ///< a picture of four views (snapshot); empty: there is none
};
/// Never throws.
[[nodiscard]] CaseCard card_of(const std::filesystem::path& the_case);

/// "6 min, 627 mm³; nearest: sigmoid sinus, 0.4 mm"; empty where the session has no summary that can be read.
[[nodiscard]] std::string session_figures(const std::filesystem::path& session);

/// "today 09:40", "2026-11-21": of the system's clock and zone.
[[nodiscard]] std::string day_text(std::filesystem::file_time_type time);

}  // namespace osteo::inline app
