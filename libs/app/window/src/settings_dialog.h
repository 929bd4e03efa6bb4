// Settings: all that a person can choose, in one dialog by pages, beside the tools and above the state. Private to
// libs/app/window; ImGui, no GL.
#pragma once
#include <array>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/app/window/person_settings.h"
#include "osteo/app/window/start_page.h"
#include "osteo/session/scene/rehearsal.h"
#include "view_layout.h"

namespace osteo::inline app {

enum class SettingsPage : int { view, display, sound, operation, controls, haptics, information };
[[nodiscard]] constexpr std::array<std::string_view, 7> enum_names(SettingsPage) {
  return {"view", "display", "sound", "operation", "controls", "haptics", "information"};
}

/// Where a member of PersonValues is chosen. A test holds that each has one.
struct SettingRow {
  std::string_view member;
  SettingsPage page;
  const char* name;       ///< of the catalogues
  const char* help = "";  ///< the same; empty: the name says it
};
[[nodiscard]] std::span<const SettingRow> setting_rows();

/// Of these a session keeps what it began with: another one continues from it with what is chosen now.
[[nodiscard]] bool needs_another_session(const PersonValues& begun, const PersonValues& now);

/// What a page has beside the person's values.
struct SettingsParts {
  std::span<const StartProcedure> procedures;
  /// Into the current ImGui window, below the page's rows; empty: nothing. A page with neither is not offered.
  std::array<std::function<void()>, EnumNames<SettingsPage>::values.size()> more;
  std::function<void()> foot;  ///< below the list of pages, so wide at least
  float foot_wide = 0;
  bool another = false;  ///< needs_another_session(), and one can be begun: the dialog offers it
};

/// Into the current ImGui window: a list of them, with "none" first and a file of the person's last.
void choose_procedure(const std::string& name, std::string& value, std::span<const StartProcedure> all);

class SettingsDialog {
 public:
  /// With the keys' cursor on the page's name, or on the first of what it has (`into`).
  void show(SettingsPage page, bool into = false);
  void close() { open_ = false; }
  [[nodiscard]] bool open() const { return open_; }
  [[nodiscard]] SettingsPage page() const { return page_; }
  /// Its box in a window of this layout.
  [[nodiscard]] static ScreenBox box_in(const ViewLayout& layout);
  /// Between ImGui::NewFrame and Render. True: the person wants the other session now.
  [[nodiscard]] bool draw(const ScreenBox& box, PersonValues& values, const SettingsParts& parts);
  /// Middles of what was drawn last, in pixels of the window, by member or by page: for who drives it.
  struct Place {
    std::string name;
    float x = 0, y = 0;
  };
  [[nodiscard]] const std::vector<Place>& places() const { return places_; }

 private:
  void note_place(std::string name);
  void draw_row(const SettingRow& row, PersonValues& values, const SettingsParts& parts);
  bool open_ = false, into_ = false;
  int taking_keys_ = 0;  // pictures until the cursor is there
  SettingsPage page_ = SettingsPage::view;
  std::vector<Place> places_;
};

/// Into the current ImGui window, each an action of the session when it is changed. All haptic settings, with a button
/// that brings back `begun`; how the head is turned, nothing in a scene without dust.
void draw_haptics(Rehearsal& rehearsal, const HapticsParams& begun);
void draw_head_turned(Rehearsal& rehearsal);
/// The bodies of soft tissue by name, with what was cut off each and how its time goes; nothing in a scene without.
void draw_tissue(const Rehearsal& rehearsal);

}  // namespace osteo::inline app
