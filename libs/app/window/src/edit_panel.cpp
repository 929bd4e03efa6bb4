#include "edit_panel.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "grey_choice.h"
#include "osteo/core/base/translate.h"
#include "osteo/display/view/slices.h"
#include "ui_kit.h"

namespace osteo::inline app {
namespace {

bool wide_button(const std::string& text, bool enabled = true, ButtonLook look = ButtonLook::usual) {
  if (!enabled) ImGui::BeginDisabled();
  const bool pressed = kit_button(text, look, ImGui::GetContentRegionAvail().x);
  if (!enabled) ImGui::EndDisabled();
  return pressed;
}

// Two buttons beside each other, or below where one has no room; `second` begins at the cursor that is then.
struct Pair {
  float each;
  bool beside;
};
Pair pair_of(const std::string& first, const std::string& second) {
  const float room = ImGui::GetContentRegionAvail().x, half = std::floor((room - kGap * unit()) / 2);
  const bool beside = std::max(button_width(first), button_width(second)) <= half;
  return {beside ? half : room, beside};
}

void tip(const std::string& words) {
  if (ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled)) ImGui::SetTooltip("%s", words.c_str());
}

std::string with_number(const char* text, double value, int decimals) {
  return filled(text, {{"n", shown_number(value, decimals)}});
}

}  // namespace

EditPanel::Wishes EditPanel::draw(EditControl& control, float width, float height, bool saving) {
  Wishes wishes;
  const EditDocument& d = control.document();
  const std::string undo = tr("Undo (Ctrl-Z)"), redo = tr("Redo (Ctrl-Y)"), help = tr("Help (F1)"),
                    close = tr("Close (Q)");
  begin_fixed("Edit", {0, 0, width, height}, ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoScrollWithMouse);
  // What is always needed stays at the bottom, whatever is above it; in a very low window it is scrolled to.
  const Pair first = pair_of(undo, redo), last = pair_of(help, close);
  const float gap = ImGui::GetStyle().ItemSpacing.y, line = kControl * unit() + gap;
  const float foot = line * (static_cast<float>(first.beside ? 1 : 2) + 1 + static_cast<float>(last.beside ? 1 : 2));
  const bool low = ImGui::GetContentRegionAvail().y < 2 * foot;
  ImGui::BeginChild("upper", {0, low ? 0 : ImGui::GetContentRegionAvail().y - foot - gap});
  slider_ = {};
  tools(control);
  options(control);
  greys(control);
  wishes.find = network(control);
  places(control);
  structures(control);
  if (!low) {
    ImGui::EndChild();
    ImGui::Separator();
  }
  const auto step = [&](const std::string& name, bool can, const char* what, const std::string& told) {
    ImGui::BeginDisabled(!can || control.busy());
    const bool pressed = kit_button(name, ButtonLook::usual, first.each);
    if (can) tip(filled(what, {{"what", told}}));
    ImGui::EndDisabled();
    return pressed;
  };
  if (step(undo, d.can_undo(), tr("takes back: {what}"), d.undo_text())) control.undo();
  if (first.beside) ImGui::SameLine(0, kGap * unit());
  if (step(redo, d.can_redo(), tr("does again: {what}"), d.redo_text())) control.redo();
  const bool unsaved = control.unsaved();
  wishes.save = wide_button(saving    ? tr("Saving ...")
                            : unsaved ? tr("Save into the case (Ctrl-S)")
                                      : tr("Saved"),
                            unsaved && !saving && !control.busy(), ButtonLook::main);
  if (kit_button(help, ButtonLook::usual, last.each)) control.show_help = !control.show_help;
  if (last.beside) ImGui::SameLine(0, kGap * unit());
  wishes.close = kit_button(close, ButtonLook::usual, last.each);
  if (low) ImGui::EndChild();
  ImGui::End();
  return wishes;
}

void EditPanel::tools(EditControl& control) {
  kit_heading(tr("Tool"));
  // In two columns where the names have room in them, each as wide as its names.
  float widest[2] = {0, 0};
  for (int t = 0; t < kEditTools; ++t) {
    float& column = widest[t % 2];
    column = std::max(column, ImGui::CalcTextSize(tr(edit_tool_name(static_cast<EditTool>(t)))).x + 48 * unit());
  }
  const float room = ImGui::GetContentRegionAvail().x, left = std::floor(room * widest[0] / (widest[0] + widest[1]));
  const bool two = widest[0] + widest[1] <= room;
  ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {0, 0});
  for (int t = 0; t < kEditTools; ++t) {
    const auto tool = static_cast<EditTool>(t);
    if (two && t % 2 == 1) ImGui::SameLine();
    if (list_row(tr(edit_tool_name(tool)), std::to_string((t + 1) % 10), control.tool() == tool, kSmallControl, {},
                 !two         ? 0
                 : t % 2 == 0 ? left
                              : room - left))
      control.take(tool);
  }
  ImGui::PopStyleVar();
}

void EditPanel::greys(EditControl& control) {
  kit_heading(tr("Grey values"));
  kit_text(filled(tr("window {window}, level {level} HU"),
                  {{"window", shown_number(control.hu.width, 0)}, {"level", shown_number(control.hu.level, 0)}}),
           theme().text);
  int now = -1;
  for (std::size_t i = 0; i < grey_presets().size(); ++i) {
    const HuWindow& hu = grey_presets()[i].hu;
    if (hu.width == control.hu.width && hu.level == control.hu.level) now = static_cast<int>(i);
  }
  constexpr int kFirstKey = 2;  // F2
  const int pressed = grey_choice(now, kControl, kFirstKey);
  if (pressed >= 0) control.key(EditKeyRow{0, EditKey::preset, pressed});
}

void EditPanel::options(EditControl& control) {
  const bool free = !control.busy();
  const auto main = ButtonLook::main;
  if (control.tool() == EditTool::look) return;
  kit_heading(tr(edit_tool_name(control.tool())));
  switch (control.tool()) {
    case EditTool::look:
      return;
    case EditTool::ruler:
      if (control.ruler_mm) {
        kit_text(shown_number(length((*control.ruler_mm)[1] - (*control.ruler_mm)[0]), 1) + " mm", theme().text);
        if (wide_button(tr("Take the ruler away"))) control.ruler_mm.reset();
      } else {
        kit_text(tr("Drag from one point to the other."), theme().quiet);
      }
      return;
    case EditTool::threshold: {
      constexpr double kNoEnd = 4000;
      double lower = control.lower_hu, upper = std::min(control.upper_hu, kNoEnd);
      const bool changed =
          kit_slider(tr_of("of grey values", "from"), with_number("{n} HU", lower, 0), lower, -500, 2500, 1);
      const ImVec2 lo = ImGui::GetItemRectMin(), size = ImGui::GetItemRectSize();
      slider_ = {lo.x, lo.y, size.x, size.y};
      const bool top =
          kit_slider(tr_of("of grey values", "to"),
                     upper >= kNoEnd ? tr("no upper end") : with_number("{n} HU", upper, 0), upper, 0, kNoEnd, 1);
      if (changed || top) control.set_threshold(lower, upper >= kNoEnd ? 32767 : upper);
      static_cast<void>(kit_switch(tr("do later steps again"), control.later_steps_again));
      tip(tr("what was done since the last threshold is done again on the new one; else it is forgotten"));
      if (wide_button(tr("Apply (Enter)"), free, main)) control.apply();
      return;
    }
    case EditTool::piece:
      kit_text(tr("Click a piece of bone: it goes. Shift-click: all others go."), theme().quiet);
      return;
    case EditTool::pieces: {
      static_cast<void>(kit_root_slider(tr("smaller than"), with_number("{n} mm³", control.pieces_mm3, 0),
                                        control.pieces_mm3, 0, 5000));
      double largest = control.pieces_largest;
      if (kit_slider(tr("largest that stay"), largest < 0.5 ? tr("all") : with_number("{n}", largest, 0), largest, 0,
                     1000, 1))
        control.pieces_largest = static_cast<int>(std::lround(largest));
      if (wide_button(tr("Remove small fragments (Enter)"), free, main)) control.apply();
      return;
    }
    case EditTool::box:
      kit_text(shown_number(control.box_hi_mm[0] - control.box_lo_mm[0], 0) + " x " +
                   shown_number(control.box_hi_mm[1] - control.box_lo_mm[1], 0) + " x " +
                   shown_number(control.box_hi_mm[2] - control.box_lo_mm[2], 0) + " mm",
               theme().text);
      if (wide_button(tr("Clear inside (Enter)"), free, main)) control.apply(BoxChoice::clear_inside);
      if (wide_button(tr("Keep only inside"), free)) control.apply(BoxChoice::keep_inside);
      return;
    case EditTool::fill:
      static_cast<void>(kit_root_slider(tr("cavities up to"), with_number("{n} mm³", control.fill_mm3, 0),
                                        control.fill_mm3, 0, 20000));
      if (wide_button(tr("Fill (Enter)"), free, main)) control.apply();
      return;
    case EditTool::smooth:
      static_cast<void>(kit_slider(tr_of("of the surface", "within"), with_number("{n} mm", control.smooth_mm, 1),
                                   control.smooth_mm, 0.1, 5, 0.1));
      kit_text(tr("Nothing farther from the surface changes; walls thinner than this may go. The volume is reported."),
               theme().quiet);
      if (wide_button(tr("Smooth (Enter)"), free, main)) control.apply();
      return;
    case EditTool::brush:
    case EditTool::eraser: {
      double diameter = 2 * control.brush_radius_mm;
      if (kit_root_slider(tr("Diameter"), with_number("{n} mm", diameter, 1), diameter, 0.4, 60))
        control.brush_radius_mm = diameter / 2;
      const EditStructure* const s = control.document().structure(control.structure);
      kit_text(filled(control.tool() == EditTool::brush ? tr("adds to {structure} (choose below)")
                                                        : tr("takes from {structure} (choose below)"),
                      {{"structure", s != nullptr ? s->is.name : tr("bone")}}),
               theme().quiet);
      return;
    }
  }
}

// The network's own word on where it may be wrong; what was corrected since is still listed, to be looked at again.
void EditPanel::places(EditControl& control) {
  first_place_ = {};
  if (control.places.empty()) return;
  kit_heading(tr("Uncertain boundaries: look here first"));
  for (std::size_t n = 0; n < control.places.size(); ++n) {
    const EditPlace& p = control.places[n];
    ImGui::PushID(static_cast<int>(n));
    const std::string words =
        filled(tr("{structure}, {n} voxels"), {{"structure", tr(p.name)}, {"n", std::to_string(p.voxels)}});
    if (list_row(words, {}, length(control.cross_mm() - p.at_mm) < 1e-6)) {
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

// Structures by a trained network, in place of those of the same names. True: it was asked for.
bool EditPanel::network(const EditControl& control) {
  find_button_ = {};
  if (!can_find_) return false;
  kit_heading(tr("Trained network"));
  const bool entered = kit_field("##network", tr("folder of the network"), network_);
  const bool pressed = wide_button(tr("Find structures"), !control.busy() && !network_.empty());
  tip(tr("in place of those of the same names, as one step; Esc stops it"));
  const ImVec2 lo = ImGui::GetItemRectMin(), size = ImGui::GetItemRectSize();
  find_button_ = {lo.x, lo.y, size.x, size.y};
  return (entered || pressed) && !network_.empty();
}

// Its colour, which a click changes; true once the mouse lets go.
bool EditPanel::draw_colour(const EditStructure& s, std::array<float, 3>& rgb) {
  for (std::size_t c = 0; c < 3; ++c) rgb[c] = static_cast<float>(s.is.rgb[c]) / 255;
  if (coloured_ == s.is.value) rgb = colour_;
  if (kit_colour("colour", rgb)) {
    coloured_ = s.is.value;
    colour_ = rgb;
  }
  // One step for each drag of a slider, not one for each movement of the mouse.
  if (coloured_ != s.is.value || ImGui::IsMouseDown(ImGuiMouseButton_Left)) return false;
  coloured_ = -1;
  return true;
}

void EditPanel::structures(EditControl& control) {
  kit_heading(tr("Structures"));
  const bool free = !control.busy();
  const float u = unit();
  ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {4 * u, 0});
  if (list_row(tr("bone"), {}, control.structure == 0)) control.structure = 0;
  const std::vector<EditStructure> list = control.document().structures();  // a copy: rows change it
  for (const EditStructure& s : list) {
    ImGui::PushID(s.is.value);
    if (tile("shown", s.shown ? "eye" : "eye-off",
             {false, false, true, tr("shown or hidden; no change of the structure")}, kRow * u))
      control.show_structure(s.is.value, !s.shown);
    ImGui::SameLine();
    if (std::array<float, 3> rgb{}; draw_colour(s, rgb)) {
      std::vector<int> whole;
      for (const float c : rgb) whole.push_back(static_cast<int>(std::lround(c * 255)));
      control.at_once(ChangeStructureEdit{s.is.value, s.is.name, whole, s.role});
    }
    ImGui::SameLine();
    if (list_row(tr(s.is.name), {}, control.structure == s.is.value)) control.structure = s.is.value;
    ImGui::PopID();
  }
  ImGui::PopStyleVar();
  if (const EditStructure* const s = control.document().structure(control.structure)) {
    if (named_ != s->is.value) {
      named_ = s->is.value;
      name_ = s->is.name;
    }
    const std::vector<int> rgb{s->is.rgb[0], s->is.rgb[1], s->is.rgb[2]};
    static_cast<void>(kit_field("##name", {}, name_));
    const bool renamed = ImGui::IsItemDeactivatedAfterEdit() && s->is.name != name_;
    const std::string roles[] = {tr("at risk: goes into the case"), tr("landmark: stays in the edits")};
    const int role = kit_list({}, roles, static_cast<int>(s->role));
    const int value = s->is.value;
    const bool other_role = role >= 0 && role != static_cast<int>(s->role);
    if (renamed || other_role) {
      control.at_once(ChangeStructureEdit{value, renamed ? name_ : s->is.name, rgb,
                                          other_role ? static_cast<StructureRole>(role) : s->role});
      named_ = -1;
    }
    if (wide_button(tr("Delete this structure"), free)) {
      control.at_once(DeleteStructureEdit{value});
      control.structure = 0;
    }
  }
  const float add = button_width(tr("Add"));
  const bool entered = kit_field("##new", tr("new structure"), new_name_, add + kGap * u);
  ImGui::SameLine(0, kGap * u);
  if ((kit_button(tr("Add"), ButtonLook::usual, add) || entered) && !new_name_.empty() &&
      control.add_structure(new_name_))
    new_name_.clear();
}

}  // namespace osteo::inline app
