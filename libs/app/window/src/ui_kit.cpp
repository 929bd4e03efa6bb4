#include "ui_kit.h"

#include <imgui_internal.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "icon_lines.h"
#include "ui_style.h"

namespace osteo::inline app {
namespace {

constexpr double kTooltipS = 0.4;

const IconLines* icon_named(std::string_view name) {
  const auto* const at =
      std::find_if(std::begin(kIcons), std::end(kIcons), [&](const IconLines& i) { return i.name == name; });
  return at == std::end(kIcons) ? nullptr : at;
}

// What every component's item has: a ring where the keys are, its words after a while.
void focus_and_text(const std::string& words) {
  const float u = unit();
  if (ImGui::IsItemFocused() && ImGui::GetIO().NavVisible) {
    const ImVec2 lo = ImGui::GetItemRectMin(), hi = ImGui::GetItemRectMax();
    ImGui::GetWindowDrawList()->AddRect({lo.x - 2 * u, lo.y - 2 * u}, {hi.x + 2 * u, hi.y + 2 * u},
                                        im_colour32(theme().accent), kRound * u, 0, 3 * u);
  }
  if (words.empty()) return;
  if (!ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled)) return;
  // By place: an item that is off has no other name here.
  static ImVec2 last{-1, -1};
  static double since = 0;
  if (const ImVec2 at = ImGui::GetItemRectMin(); at.x != last.x || at.y != last.y || ImGui::GetIO().MouseDown[0]) {
    last = at;
    since = ImGui::GetTime();
  }
  if (ImGui::GetTime() - since >= kTooltipS) ImGui::SetTooltip("%s", words.c_str());
}

struct Item {
  bool pressed, hovered, active;
  ImVec2 lo, hi;
};
Item item(const char* id, ImVec2 size) {
  Item i{};
  i.pressed = ImGui::InvisibleButton(id, size);
  i.hovered = ImGui::IsItemHovered();
  i.active = ImGui::IsItemActive();
  i.lo = ImGui::GetItemRectMin();
  i.hi = ImGui::GetItemRectMax();
  return i;
}

void centred(ImDrawList* draw, ImVec2 lo, ImVec2 hi, const std::string& words, Colour colour) {
  const std::string shown = shortened(words, hi.x - lo.x, ImGui::GetFontSize());
  const ImVec2 size = ImGui::CalcTextSize(shown.c_str());
  draw->AddText({std::floor((lo.x + hi.x - size.x) / 2), std::floor((lo.y + hi.y - size.y) / 2)},
                im_colour32(colour, ImGui::GetStyle().Alpha), shown.c_str());
}

}  // namespace

bool has_icon(std::string_view name) {
  return icon_named(name) != nullptr;
}

void draw_icon(ImDrawList* draw, ImVec2 corner, float side, std::string_view name, ImU32 colour) {
  const IconLines* const icon = icon_named(name);
  if (icon == nullptr) return;
  const float step = side / 240, thick = std::max(1.0F, side / 12);
  std::array<ImVec2, 256> points;
  for (const std::uint8_t* p = icon->lines; *p != 0;) {
    const int count = *p++;
    for (int n = 0; n < count; ++n, p += 2)
      points[static_cast<std::size_t>(n)] = {corner.x + step * static_cast<float>(p[0]),
                                             corner.y + step * static_cast<float>(p[1])};
    const bool closed = count > 3 && points[0].x == points[static_cast<std::size_t>(count - 1)].x &&
                        points[0].y == points[static_cast<std::size_t>(count - 1)].y;
    if (count == 2 && std::abs(points[1].x - points[0].x) + std::abs(points[1].y - points[0].y) < 2 * step) {
      draw->AddCircleFilled(points[0], thick * 0.75F, colour, 8);  // a dot
    } else {
      draw->AddPolyline(points.data(), closed ? count - 1 : count, colour, closed ? ImDrawFlags_Closed : 0, thick);
    }
  }
}

bool tile(const char* id, std::string_view icon, const TileLook& look, float side) {
  if (side <= 0) side = kTile * unit();
  const float u = side / kTile;
  if (!look.enabled) ImGui::BeginDisabled();
  const Item i = item(id, {side, side});
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const Theme& t = theme();
  if (look.on || look.selected || i.hovered || i.active)
    draw->AddRectFilled(i.lo, i.hi, im_colour32(i.active ? t.line : t.raised, i.active ? 0.6F : 1), kRound * u);
  if (look.selected) {
    draw->AddRect(i.lo, i.hi, im_colour32(t.accent), kRound * u, 0, 2 * u);
    draw->AddRectFilled({i.lo.x, i.lo.y + 10 * u}, {i.lo.x + 4 * u, i.hi.y - 10 * u}, im_colour32(t.accent), 2 * u);
  }
  if (look.on)
    draw->AddRectFilled({i.lo.x + 10 * u, i.hi.y - 5 * u}, {i.hi.x - 10 * u, i.hi.y - 2 * u}, im_colour32(t.text), u);
  draw_icon(draw, {i.lo.x + 8 * u, i.lo.y + 8 * u}, 24 * u, icon, im_colour32(look.enabled ? t.text : t.line));
  if (!look.enabled) ImGui::EndDisabled();
  focus_and_text(look.words);
  return i.pressed && look.enabled;
}

float button_width(const std::string& words) {
  return ImGui::CalcTextSize(words.c_str(), nullptr, true).x + 32 * unit();
}

bool kit_button(const std::string& words, ButtonLook look, float width, float high) {
  const float u = unit();
  const Item i = item(words.c_str(), {std::max(width, button_width(words)), high * u});
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const Theme& t = theme();
  const bool main = look == ButtonLook::main;
  if (look != ButtonLook::quiet || i.hovered)
    draw->AddRectFilled(i.lo, i.hi, im_colour32(main ? t.text : t.raised), kRound * u);
  if (i.hovered || i.active) draw->AddRectFilled(i.lo, i.hi, im_colour32(t.line, i.active ? 0.6F : 0.3F), kRound * u);
  if (look == ButtonLook::usual) draw->AddRect(i.lo, i.hi, im_colour32(t.line), kRound * u, 0, std::max(1.0F, u));
  centred(draw, i.lo, i.hi, words.substr(0, words.find("##")), main ? t.ground : t.text);
  focus_and_text({});
  return i.pressed;
}

int choice(const char* id, std::span<const std::string> words, int selected, float high) {
  const float u = unit();
  ImGui::PushID(id);
  ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {0, ImGui::GetStyle().ItemSpacing.y});
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const Theme& t = theme();
  const ImVec2 begin = ImGui::GetCursorScreenPos();
  float all = 0;
  for (const std::string& w : words) all += ImGui::CalcTextSize(w.c_str()).x + 24 * u;
  draw->AddRectFilled(begin, {begin.x + all, begin.y + high * u}, im_colour32(t.ground), kRound * u);
  draw->AddRect(begin, {begin.x + all, begin.y + high * u}, im_colour32(t.line), kRound * u, 0, std::max(1.0F, u));
  int pressed = -1;
  for (std::size_t n = 0; n < words.size(); ++n) {
    if (n > 0) ImGui::SameLine();
    const Item i = item(words[n].c_str(), {ImGui::CalcTextSize(words[n].c_str()).x + 24 * u, high * u});
    if (i.pressed) pressed = static_cast<int>(n);
    const bool is = static_cast<int>(n) == selected;
    if (is || i.hovered)
      draw->AddRectFilled({i.lo.x + u, i.lo.y + u}, {i.hi.x - u, i.hi.y - u}, im_colour32(t.raised), kRound * u);
    if (is) draw->AddRect(i.lo, i.hi, im_colour32(t.accent), kRound * u, 0, 2 * u);
    centred(draw, i.lo, i.hi, words[n], is ? t.text : t.quiet);
    focus_and_text({});
  }
  ImGui::PopStyleVar();
  ImGui::PopID();
  return pressed;
}

bool kit_switch(const std::string& words, bool& on, float width) {
  const float u = unit();
  if (width <= 0) width = std::max(ImGui::GetContentRegionAvail().x, 48 * u);
  const Item i = item(words.c_str(), {width, kControl * u});
  if (i.pressed) on = !on;
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const Theme& t = theme();
  const float y = (i.lo.y + i.hi.y) / 2, x = i.hi.x - 40 * u;
  draw->AddRectFilled({x, y - 10 * u}, {x + 36 * u, y + 10 * u}, im_colour32(on ? t.text : t.raised), 10 * u);
  draw->AddRect({x, y - 10 * u}, {x + 36 * u, y + 10 * u}, im_colour32(t.line), 10 * u, 0, std::max(1.0F, u));
  draw->AddCircleFilled({x + (on ? 26 : 10) * u, y}, 7 * u, im_colour32(on ? t.ground : t.text), 20);
  const std::string shown = shortened(words.substr(0, words.find("##")), x - i.lo.x - kGap * u, ImGui::GetFontSize());
  draw->AddText({i.lo.x, std::floor(y - ImGui::GetFontSize() / 2)}, im_colour32(t.text), shown.c_str());
  focus_and_text({});
  return i.pressed;
}

bool kit_slider(const std::string& name, const std::string& value, double& at, double least, double most, double step,
                float width) {
  const float u = unit(), knob = 8 * u;
  if (width <= 0) width = std::max(ImGui::GetContentRegionAvail().x, 96 * u);
  const Item i = item(name.c_str(), {width, kSlider * u});
  const float from = i.lo.x + knob, to = i.hi.x - knob, y = i.hi.y - 14 * u;
  const double before = at;
  if (i.active) {
    const double share = static_cast<double>((ImGui::GetIO().MousePos.x - from) / std::max(1.0F, to - from));
    at = least + step * std::round(std::clamp(share, 0.0, 1.0) * (most - least) / step);
  } else if (ImGui::IsItemFocused() && ImGui::GetIO().NavVisible) {
    const double by = step * (ImGui::GetIO().KeyShift ? 10 : 1);
    if (ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_LeftArrow))) at -= by;
    if (ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_RightArrow))) at += by;
    if (at != before) ImGui::NavMoveRequestCancel();  // they are the knob's here
  }
  at = std::clamp(at, least, most);
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const Theme& t = theme();
  const float value_wide = ImGui::CalcTextSize(value.c_str()).x;
  draw->AddText({i.lo.x, i.lo.y}, im_colour32(t.quiet),
                shortened(name, width - value_wide - kGap * u, ImGui::GetFontSize()).c_str());
  draw->AddText({i.hi.x - value_wide, i.lo.y}, im_colour32(t.text), value.c_str());
  const float x = from + (to - from) * static_cast<float>(most > least ? (at - least) / (most - least) : 0);
  draw->AddRectFilled({i.lo.x, y - u}, {i.hi.x, y + u}, im_colour32(t.line), u);
  draw->AddRectFilled({i.lo.x, y - 2 * u}, {x, y + 2 * u}, im_colour32(t.text), 2 * u);
  draw->AddCircleFilled({x, y}, knob, im_colour32(t.text), 20);
  if (i.hovered || i.active) draw->AddCircle({x, y}, knob + 2 * u, im_colour32(t.line), 20, 2 * u);
  focus_and_text({});
  return at != before;
}

int kit_list(const std::string& name, std::span<const std::string> words, int selected, const std::string& shown) {
  const float u = unit();
  ImGui::PushID(name.c_str());
  ImGui::TextDisabled("%s", name.c_str());
  const float wide = ImGui::GetContentRegionAvail().x;
  ImGui::SetNextItemWidth(wide);
  ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, {12 * u, (kControl * u - ImGui::GetFontSize()) / 2});
  const std::string field = shortened(selected < 0 ? shown : words[static_cast<std::size_t>(selected)],
                                      wide - kControl * u - 16 * u, ImGui::GetFontSize());
  int chosen = -1;
  const bool open = ImGui::BeginCombo("##list", field.c_str());
  ImGui::PopStyleVar();
  if (open) {
    for (int n = 0; n < static_cast<int>(words.size()); ++n) {
      if (ImGui::Selectable(words[static_cast<std::size_t>(n)].c_str(), n == selected)) chosen = n;
      if (n == selected) ImGui::SetItemDefaultFocus();
    }
    ImGui::EndCombo();
  }
  ImGui::PopID();
  return chosen;
}

bool list_row(const std::string& words, const std::string& right, bool selected, float high, std::string_view icon) {
  const float u = unit();
  const Item i = item(words.c_str(), {std::max(ImGui::GetContentRegionAvail().x, 48 * u), high * u});
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const Theme& t = theme();
  if (selected || i.hovered) draw->AddRectFilled(i.lo, i.hi, im_colour32(t.raised), kRound * u);
  if (selected)
    draw->AddRectFilled({i.lo.x, i.lo.y + 6 * u}, {i.lo.x + 4 * u, i.hi.y - 6 * u}, im_colour32(t.accent), 2 * u);
  const float y = std::floor((i.lo.y + i.hi.y - ImGui::GetFontSize()) / 2);
  const float behind = icon.empty() ? 0 : 28 * u, end = ImGui::CalcTextSize(right.c_str()).x + behind;
  if (!icon.empty())
    draw_icon(draw, {i.hi.x - 32 * u, std::floor((i.lo.y + i.hi.y) / 2 - 10 * u)}, 20 * u, icon, im_colour32(t.quiet));
  draw->AddText({i.hi.x - end - 12 * u, y}, im_colour32(t.quiet), right.c_str());
  draw->AddText(
      {i.lo.x + 12 * u, y}, im_colour32(t.text),
      shortened(words.substr(0, words.find("##")), i.hi.x - i.lo.x - end - 36 * u, ImGui::GetFontSize()).c_str());
  focus_and_text({});
  return i.pressed;
}

bool fold(const char* words) {
  ImGui::PushStyleColor(ImGuiCol_Header, im_colour(theme().raised));
  ImGui::PushStyleColor(ImGuiCol_HeaderActive, im_colour(theme().line, 0.6F));
  const bool open = ImGui::CollapsingHeader(words);
  ImGui::PopStyleColor(2);
  return open;
}

float chip_width(const std::string& words) {
  return ImGui::CalcTextSize(words.c_str()).x + 48 * unit();
}

void draw_chip(ImDrawList* draw, const ScreenBox& box, const std::string& words, const ChipLook& look) {
  const float u = unit();
  const ImVec2 lo{box.x, box.y}, hi{box.right(), box.bottom()};
  const bool wraps = chip_width(words) > box.width + 1 && box.height > 40 * u;
  const float round = std::min(box.height / 2, 16 * u);
  draw->AddRectFilled(lo, hi, im_colour32(look.filled ? look.colour : theme().surface, look.filled ? 1 : 0.94F), round);
  draw->AddRect(lo, hi, im_colour32(look.colour), round, 0, 2 * u);
  const Colour ink = look.filled ? Colour{0, 0, 0} : theme().text;
  draw_sign(draw, {box.x + 20 * u, box.y + box.height / 2}, 9 * u, look.corners,
            look.filled ? Colour{0, 0, 0} : look.colour);
  const ScreenBox inside{box.x + 36 * u, box.y, box.width - 48 * u, box.height};
  if (!wraps) return fitted_text(draw, inside, em(), ink, words);
  const float size = kLineEm * kLabelEm * em();
  const std::string shown = shortened(words, 1.8F * inside.width, size);
  const float tall = ImGui::GetFont()->CalcTextSizeA(size, FLT_MAX, inside.width, shown.c_str()).y;
  draw->AddText(ImGui::GetFont(), size, {inside.x, std::floor(box.y + (box.height - tall) / 2)}, im_colour32(ink),
                shown.c_str(), nullptr, inside.width);
}

void draw_card(ImDrawList* draw, const ScreenBox& box) {
  const float u = unit();
  draw->AddRectFilled({box.x, box.y}, {box.right(), box.bottom()}, im_colour32(theme().surface, 0.94F), kCardRound * u);
  draw->AddRect({box.x, box.y}, {box.right(), box.bottom()}, im_colour32(theme().line, 0.6F), kCardRound * u, 0,
                std::max(1.0F, u));
}

void begin_card(const char* name, const ScreenBox& box, ImVec2 padding, ImGuiWindowFlags more) {
  ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 0);
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, padding);
  begin_fixed(name, box, ImGuiWindowFlags_NoBackground | more);
  ImGui::PopStyleVar(2);
  draw_card(ImGui::GetWindowDrawList(), box);
}

}  // namespace osteo::inline app
