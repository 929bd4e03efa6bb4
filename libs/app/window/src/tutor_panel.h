// Who teaches and who learns, in the window: a small panel, names beside the hands of others, who cuts. Private to
// libs/app/window; ImGui.
#pragma once
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "local_text.h"
#include "osteo/app/window/tutor_now.h"
#include "osteo/session/scene/rehearsal.h"
#include "palette.h"
#include "view_layout.h"

namespace osteo::inline app {

/// Of the hands of others, distinguished from the own; the own has none.
inline constexpr Colour kPartnerColour = palette::kPurple;

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

class TutorPanel {
 public:
  using Project = std::function<std::optional<std::array<float, 2>>(Vec3)>;
  /// Between ImGui::NewFrame and Render; `area`: of the bone, at whose upper right corner it is.
  static void draw(const TutorNow& now, const std::vector<TickRecord>& hands, const ScreenBox& area,
                   const Project& project);
};

}  // namespace osteo::inline app
