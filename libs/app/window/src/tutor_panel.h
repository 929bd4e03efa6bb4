// Who teaches and who learns, in the window: people, invitation, guidance, steps and harm in a column for who teaches,
// a card for who is taught, names beside the hands of others. Private to libs/app/window; ImGui.
#pragma once
#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "local_text.h"
#include "osteo/app/window/tutor_now.h"
#include "osteo/session/scene/rehearsal.h"
#include "palette.h"
#include "view_layout.h"
#include "view_panels.h"
#include "work_done.h"

namespace osteo::inline app {

/// Of the hands of others, distinguished from the own; the own has none.
inline constexpr Colour kPartnerColour = palette::kPurple;

/// Who takes part, in the language: of "trainee", "instructor" and what else the session calls them. No ImGui.
[[nodiscard]] std::string shown_who(const std::string& who);
/// Words of a link in a line: "trainee: there and back 12 ms, 1 % lost, clock 3.1 ms ahead, 20 ppm". No ImGui.
[[nodiscard]] std::string link_text(const TutorNow::Link& link);
/// Whose burr takes bone in this moment, by names; "nobody". No ImGui.
[[nodiscard]] std::string who_cuts(const std::vector<std::string>& names, const std::vector<TickRecord>& hands);

/// Tells once when a link drops and when it is back. No ImGui.
class LinkWatch {
 public:
  /// What is to be said now.
  std::optional<LocalText> look(const TutorNow& now);

 private:
  std::vector<std::pair<std::string, bool>> heard_;
};

/// What came near a structure so far, the worst first. No ImGui.
struct HarmLine {
  Nearness nearness = Nearness::near;
  std::string text;
};
[[nodiscard]] std::vector<HarmLine> harm_lines(const std::map<std::uint8_t, WorkDone::Harm>& harm,
                                               const StructureMap* structures);
/// Of TutorNow::invitation: what to start elsewhere, and the code to type there. No ImGui.
struct Invitation {
  std::string command, code;
};
[[nodiscard]] Invitation invitation_of(const std::string& text);

class TutorPanel {
 public:
  using Project = std::function<std::optional<std::array<float, 2>>(Vec3)>;
  /// Who teaches or watches has a column at the right, unless it would begin left of `from`.
  void lay_out(ViewLayout& layout, const TutorNow& now, float from);
  /// Between ImGui::NewFrame and Render; `area`: of the bone, on which names of other hands are, and for who is taught
  /// a card.
  void draw(const TutorNow& now, const std::vector<TickRecord>& hands, const std::vector<HarmLine>& harm,
            const ScreenBox& area, const Project& project, Pressed& pressed) const;

 private:
  ScreenBox box_;
};

}  // namespace osteo::inline app
