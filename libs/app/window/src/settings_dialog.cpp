#include "settings_dialog.h"

#include <imgui.h>
#include <imgui_internal.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>

#include "hint_controller.h"
#include "osteo/core/base/translate.h"
#include "osteo/simulation/bone/posture.h"
#include "ui_kit.h"
#include "ui_style.h"

namespace osteo::inline app {
namespace {

using enum SettingsPage;

constexpr SettingRow kRows[] = {
    {"language", display, tr_later("Language")},
    {"theme", display, tr_later("Colours")},
    {"scale", display, tr_later("Size of text")},
    {"full_screen", display, tr_later("Full screen")},
    {"layout", display, tr_later("Cases open in")},
    {"first_steps", display, tr_later("First steps, one at a time")},
    {"sound", sound, tr_later("Sound")},
    {"volume", sound, tr_later("Volume")},
    {"alarms", sound, tr_later("Alarms"), tr_later("a beep on contact with a critical structure")},
    {"hints", sound, tr_later("Hints")},
    {"hints_off", sound, tr_later("Hints")},
    {"procedure", operation, tr_later("Procedure")},
    {"mirror_procedure", operation, tr_later("For the other side, mirrored")},
    {"dust", operation, tr_later("Bone dust and irrigation")},
    {"heat", operation, tr_later("Heat")},
    {"monitor", operation, tr_later("Nerve monitor")},
    {"position", operation, tr_later("Patient position")},
    {"lessons_at", operation, tr_later("Lessons can be joined from")},
    {"motion_one_to", controls, tr_later("Motion of the hand")},
    {"wrist_rest", controls, tr_later("At wrist rest"), tr_later("of that motion, while \\ or keypad . is held")},
    {"burr_share", controls, tr_later("Burr at most"),
     tr_later("of its full speed, pedal or button all the way down; keys 9 and 0")},
    {"left_handed", controls, tr_later("Left-handed"),
     tr_later("the drill is held from the left, the second hand comes from the right")},
    {"mirror_mouse", controls, tr_later("Mouse buttons change places"),
     tr_later("where the system has not done so already")},
    {"remember_cases", information, tr_later("Remember cases")},
    {"network", information, tr_later("Remember cases")},
};
constexpr const char* kPageNames[] = {tr_later("View"),       tr_later("Display"),  tr_later("Sound and hints"),
                                      tr_later("Operation"),  tr_later("Controls"), tr_later("Haptics"),
                                      tr_later("Information")};
// Of the design, docs/design/window.md.
constexpr float kWide = 720, kPages = 184, kPad = 16, kHead = 56, kRing = 4;  // kRing: round what has the keys
// In less the pages have a field above them in place of a list beside them.
constexpr float kListed = 560, kField = 48;

std::string percent(double share) {
  return filled(tr("{share} %"), {{"share", shown_number(100 * share, 0)}});
}

// One of some texts that a file names; `ids` beside `words`.
template <class Ids>
bool choose(const char* id, const std::string& name, const std::vector<std::string>& words, const Ids& ids,
            std::string& value, bool beside) {
  const auto at = std::find(std::begin(ids), std::end(ids), value) - std::begin(ids);
  const int now = at < static_cast<std::ptrdiff_t>(words.size()) ? static_cast<int>(at) : -1;
  int chosen = -1;
  if (beside) {
    ImGui::TextDisabled("%s", name.c_str());
    chosen = choice(id, words, now);
  } else {
    chosen = kit_list(name, words, now, now < 0 ? value : std::string());
  }
  if (chosen < 0 || chosen == now) return false;
  value = std::string(ids[static_cast<std::size_t>(chosen)]);
  return true;
}

void choose_language(const std::string& name, std::string& value) {
  // Each in its own words, so that who cannot read the window finds theirs.
  std::vector<std::string> words{tr("as the system has it"), "English", "Deutsch", "Español", "Français", "简体中文"};
  std::vector<std::string> ids{"auto"};
  for (const std::string_view id : enum_names(Language{})) ids.emplace_back(id);
  static_cast<void>(choose("language", name, words, ids, value, false));
}

}  // namespace

void choose_procedure(const std::string& name, std::string& value, std::span<const StartProcedure> all) {
  std::vector<std::string> words{tr("none")}, ids{""};
  for (const StartProcedure& p : all) {
    words.push_back(tr(p.name));
    ids.push_back(p.id);
  }
  if (std::find(ids.begin(), ids.end(), value) == ids.end()) {  // a file of the person's
    words.push_back(std::filesystem::path(value).filename().string());
    ids.push_back(value);
  }
  static_cast<void>(choose("procedure", name, words, ids, value, false));
}

namespace {

void choose_hints(std::string& off) {
  ImGui::Indent(16 * unit());
  for (const HintRule& r : usual_hints()) {
    const auto left = hints_left({r}, off);
    bool on = !left.empty();
    if (kit_switch(tr(r.name.empty() ? r.id : r.name) + "##" + r.id, on)) off = with_hint(off, r.id, on);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", tr(r.words).c_str());
  }
  ImGui::Unindent(16 * unit());
}

// What is a text, with the texts that it may be.
void choose_text(const SettingRow& row, std::string& value, const SettingsParts& parts) {
  const std::string name = tr(row.name);
  if (row.member == "language") return choose_language(name, value);
  if (row.member == "procedure") return choose_procedure(name, value, parts.procedures);
  if (row.member == "hints_off") return choose_hints(value);
  if (row.member == "theme") {
    static_cast<void>(
        choose("theme", name, {tr("Dark"), tr("Light"), tr("High contrast")}, enum_names(ThemeName{}), value, true));
  } else if (row.member == "layout") {
    static constexpr std::string_view kIds[] = {"operate", "plan"};
    static_cast<void>(choose("layout", name, {tr("Operate"), tr("Plan")}, kIds, value, true));
  } else if (row.member == "lessons_at") {
    static constexpr std::string_view kIds[] = {"127.0.0.1", "0.0.0.0"};
    static_cast<void>(choose("lessons", name, {tr("This machine"), tr("The network")}, kIds, value, true));
  } else if (row.member == "position") {
    static_cast<void>(choose(
        "position", name, {tr("Supine"), tr("Prone"), tr("Sitting"), tr("On the left side"), tr("On the right side")},
        enum_names(Posture{}), value, false));
  } else {  // a folder that is chosen on the start page
    bool use = true;
    const std::string folder = std::filesystem::path(value).filename().string();
    if (value.empty()) {
      ImGui::TextWrapped("%s",
                         tr("No network finds structures in new cases. Choose its folder where cases are opened."));
    } else if (kit_switch(filled(tr("Find structures by {network}"), {{"network", folder}}), use)) {
      value.clear();
    }
  }
}

void choose_number(const SettingRow& row, const FieldDoc& doc, double& value) {
  const std::string name = tr(row.name);
  if (row.member == "motion_one_to") {
    ImGui::TextDisabled("%s", name.c_str());
    static const std::string kWords[] = {"1:1", "1:2", "1:4", "1:8"};
    if (const int n = choice("motion", kWords, static_cast<int>(std::lround(std::log2(value)))); n >= 0) value = 1 << n;
    return;
  }
  static_cast<void>(kit_slider(name, percent(value), value, doc.lo, doc.hi, row.member == "scale" ? 0.1 : 0.05));
}

// To three figures, which are more than a hand feels.
double to_three_figures(double value) {
  if (value == 0 || !std::isfinite(value)) return value;
  const double last = std::pow(10, std::floor(std::log10(std::abs(value))) - 2);
  return std::round(value / last) * last;
}
std::string figures(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return shown_figures(text);
}

// True when the user has changed it.
bool draw_field(const FieldRef& f) {
  if (auto* const flag = std::get_if<bool*>(&f.target)) return kit_switch(std::string(f.doc.name), **flag);
  if (auto* const picked = std::get_if<FieldRef::Choice>(&f.target)) {
    const std::vector<std::string> words(picked->names.begin(), picked->names.end());
    const int n = kit_list(std::string(f.doc.name), words, *picked->index);
    if (n < 0 || n == *picked->index) return false;
    *picked->index = n;
    return true;
  }
  double& value = **std::get_if<double*>(&f.target);
  if (!kit_root_slider(std::string(f.doc.name), figures(value), value, f.doc.lo, f.doc.hi)) return false;
  value = std::clamp(to_three_figures(value), f.doc.lo, f.doc.hi);
  return true;
}

void take_setting(Rehearsal& rehearsal, std::size_t n, const HapticsParams& params) {
  rehearsal.act(SceneAction::setting(static_cast<std::uint32_t>(n), setting_value(static_cast<int>(n), params)));
}

// Those that have anything.
std::vector<SettingsPage> pages_of(const SettingsParts& parts) {
  std::vector<SettingsPage> all;
  for (std::size_t n = 0; n < std::size(kPageNames); ++n) {
    const auto page = static_cast<SettingsPage>(n);
    if (parts.more[n] ||
        std::any_of(std::begin(kRows), std::end(kRows), [&](const SettingRow& r) { return r.page == page; }))
      all.push_back(page);
  }
  return all;
}

}  // namespace

std::span<const SettingRow> setting_rows() {
  return kRows;
}

bool needs_another_session(const PersonValues& begun, const PersonValues& now) {
  return begun.procedure != now.procedure || (!now.procedure.empty() && begun.mirror_procedure != now.mirror_procedure);
}

void SettingsDialog::show(SettingsPage page, bool into) {
  page_ = page;
  into_ = into;
  open_ = true;
  taking_keys_ = 2;
}

ScreenBox SettingsDialog::box_in(const ViewLayout& layout) {
  const float top = 0, bottom = layout.state.empty() ? layout.view.bottom() : layout.state.y;
  return {layout.tray.right(), top, std::min(std::round(kWide * layout.unit), layout.state.width), bottom - top};
}

bool SettingsDialog::draw(const ScreenBox& box, PersonValues& values, const SettingsParts& parts) {
  places_.clear();
  const float u = unit(), pad = kPad * u;
  float pages = std::max(kPages * u, parts.foot_wide + 1.5F * pad);
  for (const char* const name : kPageNames) pages = std::max(pages, ImGui::CalcTextSize(tr(name)).x + 40 * u + pad);
  const bool listed = box.width >= kListed * u;
  pages = listed ? std::min(pages, 0.45F * box.width) : 0;
  const float top = (listed ? kHead : kHead + kField) * u;
  begin_card("settings", box, {0, 0}, ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoScrollWithMouse);
  if (taking_keys_ > 0) {  // before what is drawn, which of it has them
    ImGui::FocusWindow(ImGui::GetCurrentWindow());
    ImGui::NavInitWindow(ImGui::GetCurrentWindow(), true);
    GImGui->NavDisableHighlight = false;
    GImGui->NavDisableMouseHover = true;
  }
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  draw->AddRectFilled({box.x, box.y}, {box.right(), box.bottom()}, im_colour32(theme().surface));
  draw->AddRect({box.x, box.y}, {box.right(), box.bottom()}, im_colour32(theme().line), 0, 0, std::max(1.0F, u));
  draw->AddText(bold_font(), ImGui::GetFontSize() * 1.25F, {box.x + pad, box.y + 12 * u}, im_colour32(theme().text),
                tr("Settings"));
  const ImGuiWindowFlags child = ImGuiWindowFlags_NavFlattened | ImGuiWindowFlags_AlwaysUseWindowPadding;
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {kRing * u, kRing * u});
  // Before the list of pages: the first that is drawn has the keys' cursor.
  const float another_high = parts.another ? 104 * u : 0;
  ImGui::SetCursorScreenPos({box.x + pages + pad - kRing * u, box.y + top - kRing * u});
  ImGui::BeginChild(("page " + std::to_string(static_cast<int>(page_))).c_str(),
                    {box.width - pages - 1.5F * pad + kRing * u, box.height - top - pad / 2 - another_high}, false,
                    child);
  ImGui::PushItemFlag(ImGuiItemFlags_NoNavDefaultFocus, !into_);
  for (const SettingRow& row : kRows) {
    if (row.page == page_) draw_row(row, values, parts);
  }
  if (const auto& more = parts.more[static_cast<std::size_t>(page_)]) more();
  if (!listed && parts.foot) {
    ImGui::Dummy({0, 8 * u});
    parts.foot();
  }
  ImGui::PopItemFlag();
  ImGui::EndChild();
  if (listed) {
    // The pages at the left.
    ImGui::SetCursorScreenPos({box.x + pad / 2 - kRing * u, box.y + (kHead - kRing) * u});
    ImGui::BeginChild("pages", {pages - pad + 2 * kRing * u, box.height - kHead * u - pad / 2}, false, child);
    ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {0, 0});
    for (const SettingsPage page : pages_of(parts)) {
      ImGui::PushItemFlag(ImGuiItemFlags_NoNavDefaultFocus, page != page_);
      if (list_row(tr(kPageNames[static_cast<std::size_t>(page)]), "", page == page_)) page_ = page;
      ImGui::PopItemFlag();
      note_place("page " + std::string(enum_names(SettingsPage{})[static_cast<std::size_t>(page)]));
    }
    ImGui::PopStyleVar();
    if (parts.foot) {
      ImGui::Dummy({0, 8 * u});
      parts.foot();
    }
    ImGui::EndChild();
    draw->AddLine({box.x + pages, box.y + kHead * u}, {box.x + pages, box.bottom() - pad},
                  im_colour32(theme().line, 0.6F), std::max(1.0F, u));
  } else {
    ImGui::SetCursorScreenPos({box.x + pad - kRing * u, box.y + (kHead - kRing) * u - 8 * u});
    ImGui::BeginChild("pages", {box.width - 1.5F * pad + kRing * u, kField * u}, false, child);
    const std::vector<SettingsPage> all = pages_of(parts);
    std::vector<std::string> names;
    for (const SettingsPage page : all) names.emplace_back(tr(kPageNames[static_cast<std::size_t>(page)]));
    const int now = static_cast<int>(std::find(all.begin(), all.end(), page_) - all.begin());
    if (const int chosen = kit_list("", names, now < static_cast<int>(all.size()) ? now : -1); chosen >= 0)
      page_ = all[static_cast<std::size_t>(chosen)];
    note_place("pages");
    ImGui::EndChild();
  }
  bool another = false;
  if (parts.another) {
    ImGui::SetCursorScreenPos({box.x + pages + pad, box.bottom() - another_high});
    ImGui::BeginChild("another", {box.width - pages - 1.5F * pad, another_high - pad / 2}, false, child);
    ImGui::TextWrapped("%s", tr("This session keeps what it began with. Another continues from here with the change."));
    another = kit_button(tr("Continue from here"), ButtonLook::main, ImGui::GetContentRegionAvail().x);
    note_place("another");
    ImGui::EndChild();
  }
  ImGui::PopStyleVar();
  ImGui::SetCursorScreenPos({box.right() - 48 * u, box.y + 8 * u});
  if (tile("close", "x", {false, false, true, tr("Close (Esc)")}, 40 * u)) open_ = false;
  ImGui::End();
  taking_keys_ = std::max(0, taking_keys_ - 1);
  return another;
}

// Of the item that was drawn last.
void SettingsDialog::note_place(std::string name) {
  const ImVec2 lo = ImGui::GetItemRectMin(), hi = ImGui::GetItemRectMax();
  places_.push_back({std::move(name), (lo.x + hi.x) / 2, (lo.y + hi.y) / 2});
}

void SettingsDialog::draw_row(const SettingRow& row, PersonValues& values, const SettingsParts& parts) {
  const std::vector<FieldRef> fields = fields_of<PersonValues>(values);
  const auto field =
      std::find_if(fields.begin(), fields.end(), [&](const FieldRef& f) { return f.doc.name == row.member; });
  if (row.member == "mirror_procedure" && values.procedure.empty()) return;
  ImGui::PushID(row.member.data());
  ImGui::BeginGroup();
  if (auto* const flag = std::get_if<bool*>(&field->target)) {
    static_cast<void>(kit_switch(tr(row.name), **flag));
  } else if (auto* const number = std::get_if<double*>(&field->target)) {
    choose_number(row, field->doc, **number);
  } else {
    choose_text(row, **std::get_if<std::string*>(&field->target), parts);
  }
  ImGui::EndGroup();
  ImGui::PopID();
  note_place(std::string(row.member));
  if (*row.help != 0 && ImGui::IsItemHovered()) ImGui::SetTooltip("%s", tr(row.help));
}

void draw_head_turned(Rehearsal& rehearsal) {
  std::optional<Vec3> down;
  rehearsal.look([&](const World&, SceneReaders& readers) {
    if (readers.dust) down = readers.dust->dust().gravity();
  });
  if (!down) return;
  const PostureNow now = posture_of(*down);
  double turned = now.head_turned_deg;
  if (now.posture != Posture::sitting &&
      kit_slider(tr("Head turned"), shown_number(turned, 0) + "°", turned, -90, 90, 5))
    rehearsal.act(SceneAction::posture(down_of(now.posture, turned)));
  if (ImGui::IsItemHovered())
    ImGui::SetTooltip("%s", tr("where dust and water fall to; positive: the face towards the patient's left"));
}

void draw_tissue(const Rehearsal& rehearsal) {
  const std::vector<SoftTissue::Facts> bodies = rehearsal.tissue();
  if (bodies.empty()) return;
  ImGui::TextDisabled("%s", tr("Soft tissue"));
  for (const SoftTissue::Facts& body : bodies) {
    // A name is a folder's: nothing in it is a format.
    ImGui::TextUnformatted(body.name.c_str());
    if (body.asleep) {
      ImGui::TextUnformatted(
          filled(tr("{mm3} mm³ cut off, at rest"), {{"mm3", shown_number(body.cut_off_mm3, 1)}}).c_str());
    } else {
      ImGui::TextUnformatted(
          filled(tr("{mm3} mm³ cut off, {share} % of real time"),
                 {{"mm3", shown_number(body.cut_off_mm3, 1)}, {"share", shown_number(100 * body.of_real_time, 0)}})
              .c_str());
    }
  }
}

void draw_haptics(Rehearsal& rehearsal, const HapticsParams& begun) {
  HapticsParams params = rehearsal.settings();
  const auto fields = fields_of<HapticsParams>(params);
  bool changed = false;
  for (std::size_t n = 0; n < fields.size(); ++n) {
    if (draw_field(fields[n])) take_setting(rehearsal, n, params);
    const FieldDoc& doc = fields[n].doc;
    if (ImGui::IsItemHovered())
      ImGui::SetTooltip("%s%s%s", std::string(doc.help).c_str(), doc.unit.empty() ? "" : ", ",
                        std::string(doc.unit).c_str());
    changed = changed || setting_value(static_cast<int>(n), params) != setting_value(static_cast<int>(n), begun);
  }
  if (!changed || !kit_button(tr("As at the start"), ButtonLook::usual, ImGui::GetContentRegionAvail().x)) return;
  for (std::size_t n = 0; n < fields.size(); ++n) {
    if (setting_value(static_cast<int>(n), params) != setting_value(static_cast<int>(n), begun))
      take_setting(rehearsal, n, begun);
  }
}

}  // namespace osteo::inline app
