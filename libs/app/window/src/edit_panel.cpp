#include "edit_panel.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "osteo/core/base/translate.h"

namespace osteo::inline app {
namespace {

void heading(const char* text) {
  ImGui::Dummy({0, 4});
  ImGui::TextColored({0.62F, 0.72F, 0.85F, 1}, "%s", text);
  ImGui::Separator();
}

bool wide_button(const char* text, bool enabled = true) {
  if (!enabled) ImGui::BeginDisabled();
  const bool pressed = ImGui::Button(text, {-1, ImGui::GetFontSize() * 1.9F});
  if (!enabled) ImGui::EndDisabled();
  return pressed;
}

bool slider(const char* name, double& value, double lo, double hi, const char* format, bool logarithmic = false) {
  auto v = static_cast<float>(value);
  ImGui::SetNextItemWidth(-1);
  const bool changed = ImGui::SliderFloat(name, &v, static_cast<float>(lo), static_cast<float>(hi), format,
                                          logarithmic ? ImGuiSliderFlags_Logarithmic : 0);
  if (changed) value = std::clamp(static_cast<double>(v), lo, hi);
  return changed;
}

}  // namespace

EditPanel::Wishes EditPanel::draw(EditControl& control, float width, float height, float scale, bool saving) {
  Wishes wishes;
  ImGui::SetNextWindowPos({0, 0});
  ImGui::SetNextWindowSize({width, height});
  ImGui::Begin("Edit", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoBringToFrontOnFocus);
  // What is always needed stays at the bottom, whatever is above it.
  const float line = ImGui::GetFontSize() * 1.9F + ImGui::GetStyle().ItemSpacing.y;
  ImGui::BeginChild("upper", {0, height - 3 * line - 3 * ImGui::GetStyle().WindowPadding.y});
  slider_ = {};
  tools(control, scale);
  options(control);
  heading(tr("Grey values"));
  ImGui::TextUnformatted(filled(tr("window {window}, level {level} HU"), {{"window", shown_number(control.hu.width, 0)},
                                                                          {"level", shown_number(control.hu.level, 0)}})
                             .c_str());
  for (std::size_t i = 0; i < grey_presets().size(); ++i) {
    const GreyPreset& p = grey_presets()[i];
    if (i > 0) ImGui::SameLine();
    const char* const names[] = {tr("Bone"), tr("Soft"), tr("Temporal")};
    if (ImGui::Button(names[i])) {
      EditKeyRow row{0, EditKey::preset, static_cast<int>(i)};
      control.key(row);
    }
    if (ImGui::IsItemHovered())
      ImGui::SetTooltip(
          "%s", filled(tr("{name}: window {window}, level {level} (F{key})"), {{"name", names[i]},
                                                                               {"window", shown_number(p.hu.width, 0)},
                                                                               {"level", shown_number(p.hu.level, 0)},
                                                                               {"key", std::to_string(i + 2)}})
                    .c_str());
  }
  places(control);
  structures(control, scale);
  ImGui::EndChild();
  ImGui::Separator();
  const float half = (ImGui::GetContentRegionAvail().x - ImGui::GetStyle().ItemSpacing.x) / 2,
              tall = ImGui::GetFontSize() * 1.9F;
  const EditDocument& d = control.document();
  ImGui::BeginDisabled(!d.can_undo() || control.busy());
  if (ImGui::Button(tr("Undo (Ctrl-Z)"), {half, tall})) control.undo();
  if (ImGui::IsItemHovered())
    ImGui::SetTooltip("%s", filled(tr("takes back: {what}"), {{"what", d.undo_text()}}).c_str());
  ImGui::EndDisabled();
  ImGui::SameLine();
  ImGui::BeginDisabled(!d.can_redo() || control.busy());
  if (ImGui::Button(tr("Redo (Ctrl-Y)"), {half, tall})) control.redo();
  if (ImGui::IsItemHovered())
    ImGui::SetTooltip("%s", filled(tr("does again: {what}"), {{"what", d.redo_text()}}).c_str());
  ImGui::EndDisabled();
  const bool unsaved = control.unsaved();
  if (unsaved) ImGui::PushStyleColor(ImGuiCol_Button, {0.16F, 0.45F, 0.28F, 1});
  wishes.save = wide_button(saving    ? tr("Saving ...")
                            : unsaved ? tr("Save into the case (Ctrl-S)")
                                      : tr("Saved"),
                            unsaved && !saving && !control.busy());
  if (unsaved) ImGui::PopStyleColor();
  if (ImGui::Button(tr("Help (F1)"), {half, tall})) control.show_help = !control.show_help;
  ImGui::SameLine();
  wishes.close = ImGui::Button(tr("Close (Q)"), {half, tall});
  ImGui::End();
  return wishes;
}

void EditPanel::tools(EditControl& control, float) {
  heading(tr("Tool"));
  const float half = (ImGui::GetContentRegionAvail().x - ImGui::GetStyle().ItemSpacing.x) / 2;
  for (int t = 0; t < kEditTools; ++t) {
    const auto tool = static_cast<EditTool>(t);
    const bool taken = control.tool() == tool;
    if (taken) ImGui::PushStyleColor(ImGuiCol_Button, {0.20F, 0.42F, 0.68F, 1});
    const std::string name = std::to_string((t + 1) % 10) + "  " + tr(edit_tool_name(tool));
    if (t % 2 == 1) ImGui::SameLine();
    if (ImGui::Button(name.c_str(), {half, ImGui::GetFontSize() * 1.75F})) control.take(tool);
    if (taken) ImGui::PopStyleColor();
  }
}

void EditPanel::options(EditControl& control) {
  const bool free = !control.busy();
  const auto title = std::string(tr(edit_tool_name(control.tool())));
  switch (control.tool()) {
    case EditTool::look:
      return;
    case EditTool::ruler:
      heading(title.c_str());
      if (control.ruler_mm) {
        ImGui::Text("%s mm", shown_number(length((*control.ruler_mm)[1] - (*control.ruler_mm)[0]), 1).c_str());
        if (wide_button(tr("Take the ruler away"))) control.ruler_mm.reset();
      } else {
        ImGui::TextWrapped("%s", tr("Drag from one point to the other."));
      }
      return;
    case EditTool::threshold: {
      heading(title.c_str());
      double lower = control.lower_hu, upper = std::min(control.upper_hu, 4000.0);
      bool changed = slider("##lower", lower, -500, 2500, tr("from %.0f HU"));
      const ImVec2 lo = ImGui::GetItemRectMin(), size = ImGui::GetItemRectSize();
      slider_ = {lo.x, lo.y, size.x, size.y};
      const bool top = slider("##upper", upper, 0, 4000, upper >= 4000 ? tr("no upper end") : tr("to %.0f HU"));
      if (changed || top) control.set_threshold(lower, upper >= 4000 ? 32767 : upper);
      ImGui::Checkbox(tr("do later steps again"), &control.later_steps_again);
      if (ImGui::IsItemHovered())
        ImGui::SetTooltip(
            tr("what was done since the last threshold is done again on the new one; else it is forgotten"));
      if (wide_button(tr("Apply (Enter)"), free)) control.apply();
      return;
    }
    case EditTool::piece:
      heading(title.c_str());
      ImGui::TextWrapped("%s", tr("Click a piece of bone: it goes. Shift-click: all others go."));
      return;
    case EditTool::pieces:
      heading(title.c_str());
      slider("##mm3", control.pieces_mm3, 0, 5000, tr("smaller than %.0f mm³"), true);
      ImGui::SetNextItemWidth(ImGui::GetFontSize() * 6);
      ImGui::InputInt(tr("largest stay (0: all)"), &control.pieces_largest);
      control.pieces_largest = std::clamp(control.pieces_largest, 0, 1000);
      if (wide_button(tr("Remove small fragments (Enter)"), free)) control.apply();
      return;
    case EditTool::box:
      heading(title.c_str());
      ImGui::Text("%.0f x %.0f x %.0f mm", control.box_hi_mm[0] - control.box_lo_mm[0],
                  control.box_hi_mm[1] - control.box_lo_mm[1], control.box_hi_mm[2] - control.box_lo_mm[2]);
      if (wide_button(tr("Clear inside (Enter)"), free)) control.apply(BoxChoice::clear_inside);
      if (wide_button(tr("Keep only inside"), free)) control.apply(BoxChoice::keep_inside);
      return;
    case EditTool::fill:
      heading(title.c_str());
      slider("##fill", control.fill_mm3, 0, 20000, tr("cavities up to %.0f mm³"), true);
      if (wide_button(tr("Fill (Enter)"), free)) control.apply();
      return;
    case EditTool::smooth:
      heading(title.c_str());
      slider("##smooth", control.smooth_mm, 0.1, 5, tr("within %.1f mm"));
      ImGui::TextWrapped(
          "%s",
          tr("Nothing farther from the surface changes; walls thinner than this may go. The volume is reported."));
      if (wide_button(tr("Smooth (Enter)"), free)) control.apply();
      return;
    case EditTool::brush:
    case EditTool::eraser: {
      heading(title.c_str());
      double diameter = 2 * control.brush_radius_mm;
      if (slider("##size", diameter, 0.4, 60, tr("ball of %.1f mm"), true)) control.brush_radius_mm = diameter / 2;
      const EditStructure* const s = control.document().structure(control.structure);
      ImGui::TextWrapped("%s", filled(control.tool() == EditTool::brush ? tr("adds to {structure} (choose below)")
                                                                        : tr("takes from {structure} (choose below)"),
                                      {{"structure", s != nullptr ? s->is.name : tr("bone")}})
                                   .c_str());
      return;
    }
  }
}

// The network's own word on where it may be wrong; what was corrected since is still listed, to be looked at again.
void EditPanel::places(EditControl& control) {
  first_place_ = {};
  if (places_.empty()) return;
  heading(tr("Uncertain boundaries: look here first"));
  for (std::size_t n = 0; n < places_.size(); ++n) {
    const EditPlace& p = places_[n];
    ImGui::PushID(static_cast<int>(n));
    const std::string words =
        filled(tr("{structure}, {n} voxels"), {{"structure", tr(p.name)}, {"n", std::to_string(p.voxels)}});
    if (ImGui::Selectable(words.c_str(), length(control.cross_mm() - p.at_mm) < 1e-6)) {
      control.go_to(p.at_mm);
      if (control.document().structure(p.structure) != nullptr) control.structure = p.structure;
    }
    if (n == 0) {
      const ImVec2 lo = ImGui::GetItemRectMin(), size = ImGui::GetItemRectSize();
      first_place_ = {lo.x, lo.y, size.x, size.y};
    }
    ImGui::PopID();
  }
}

void EditPanel::structures(EditControl& control, float scale) {
  heading(tr("Structures"));
  const bool free = !control.busy();
  if (ImGui::Selectable(tr("bone"), control.structure == 0)) control.structure = 0;
  const std::vector<EditStructure> list = control.document().structures();  // a copy: rows change it
  for (const EditStructure& s : list) {
    ImGui::PushID(s.is.value);
    bool shown = s.shown;
    if (ImGui::Checkbox("##shown", &shown)) control.show_structure(s.is.value, shown);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip(tr("shown or hidden; no change of the structure"));
    ImGui::SameLine();
    const bool choosing = coloured_ == s.is.value;
    std::array<float, 3> rgb{};
    for (std::size_t c = 0; c < 3; ++c) rgb[c] = static_cast<float>(s.is.rgb[c]) / 255;
    if (choosing) rgb = colour_;
    if (ImGui::ColorEdit3("##colour", rgb.data(), ImGuiColorEditFlags_NoInputs)) {
      coloured_ = s.is.value;
      colour_ = rgb;
    }
    // One step for each drag in the picker, not one for each movement of the mouse.
    if (coloured_ == s.is.value && !ImGui::IsMouseDown(ImGuiMouseButton_Left)) {
      coloured_ = -1;
      std::vector<int> whole;
      for (const float c : rgb) whole.push_back(static_cast<int>(std::lround(c * 255)));
      control.at_once(ChangeStructureEdit{s.is.value, s.is.name, whole, s.role});
    }
    ImGui::SameLine();
    if (ImGui::Selectable(s.is.name.c_str(), control.structure == s.is.value)) control.structure = s.is.value;
    ImGui::PopID();
  }
  if (const EditStructure* const s = control.document().structure(control.structure)) {
    if (named_ != s->is.value) {
      named_ = s->is.value;
      name_.fill(0);
      std::strncpy(name_.data(), s->is.name.c_str(), name_.size() - 1);
    }
    const std::vector<int> rgb{s->is.rgb[0], s->is.rgb[1], s->is.rgb[2]};
    ImGui::SetNextItemWidth(-1);
    ImGui::InputText("##name", name_.data(), name_.size());
    const bool renamed = ImGui::IsItemDeactivatedAfterEdit() && s->is.name != name_.data();
    int role = static_cast<int>(s->role);
    ImGui::SetNextItemWidth(-1);
    const char* const roles[] = {tr("at risk: goes into the case"), tr("landmark: stays in the edits")};
    const bool other_role = ImGui::Combo("##role", &role, roles, IM_ARRAYSIZE(roles));
    const int value = s->is.value;
    if (renamed || other_role) {
      control.at_once(ChangeStructureEdit{value, renamed ? std::string(name_.data()) : s->is.name, rgb,
                                          static_cast<StructureRole>(role)});
      named_ = -1;
    }
    if (wide_button(tr("Delete this structure"), free)) {
      control.at_once(DeleteStructureEdit{value});
      control.structure = 0;
    }
  }
  ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x - 64 * scale);
  const bool entered = ImGui::InputTextWithHint("##new", tr("new structure"), new_name_.data(), new_name_.size(),
                                                ImGuiInputTextFlags_EnterReturnsTrue);
  ImGui::SameLine();
  if ((ImGui::Button(tr("Add"), {-1, 0}) || entered) && new_name_[0] != 0 && control.add_structure(new_name_.data()))
    new_name_.fill(0);
}

}  // namespace osteo::inline app
