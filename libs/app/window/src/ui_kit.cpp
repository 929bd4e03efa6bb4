#include "ui_kit.h"

#include <imgui_internal.h>
#include <imgui_stdlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "icon_lines.h"
#include "osteo/core/base/translate.h"
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

struct Places {
  bool kept = false;
  int picture = -1;
  std::map<std::string, std::array<float, 2>> all;
};
Places& places() {
  static Places p;
  return p;
}
// Of the last item, where it can be seen.
void note_place(std::string_view words) {
  Places& p = places();
  if (!p.kept || !ImGui::IsItemVisible()) return;
  if (const int now = ImGui::GetFrameCount(); p.picture != now) {
    p.picture = now;
    p.all.clear();
  }
  const ImVec2 lo = ImGui::GetItemRectMin(), hi = ImGui::GetItemRectMax();
  p.all[std::string(words.substr(0, words.find("##")))] = {(lo.x + hi.x) / 2, (lo.y + hi.y) / 2};
}

struct Item {
  bool pressed, hovered, active;
  ImVec2 lo, hi;
};
Item item(const char* id, ImVec2 size) {
  Item i{};
  i.pressed = ImGui::InvisibleButton(id, size);
  note_place(id);
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

// Words without what ImGui tells items apart by.
std::string shown_part(const std::string& words) {
  return words.substr(0, words.find("##"));
}

// Lines in a width, which a text that has no space to part it at may still be too wide for: then its middle goes.
struct Lines {
  std::string words;
  float wide, high;
};
Lines lines_of(const std::string& words, float width, float size) {
  need_letters(words);
  ImFont* const font = ImGui::GetFont();
  float longest = 0;
  for (std::size_t at = 0; at < words.size();) {
    const std::size_t end = std::min(words.find(' ', at), words.size());
    longest = std::max(longest, font->CalcTextSizeA(size, FLT_MAX, 0, words.c_str() + at, words.c_str() + end).x);
    at = end + 1;
  }
  // Chinese stands without spaces: it is parted anywhere. From U+2E80 on, so not at a dash or an ellipsis.
  bool anywhere = false;
  for (std::size_t n = 0; n + 1 < words.size() && !anywhere; ++n) {
    const auto lead = static_cast<unsigned char>(words[n]), next = static_cast<unsigned char>(words[n + 1]);
    anywhere = (lead & 0xF0) == 0xE0 && ((lead & 0x0F) << 6 | (next & 0x3F)) >= 0x2E80 >> 6;
  }
  const std::string shown = longest > width && !anywhere ? shortened(words, width, size) : words;
  const ImVec2 taken = font->CalcTextSizeA(size, FLT_MAX, std::max(width, size), shown.c_str());
  return {shown, std::min(taken.x, width), taken.y};
}
void draw_lines(ImDrawList* draw, ImVec2 at, float width, const std::string& words, Colour colour) {
  draw->AddText(ImGui::GetFont(), ImGui::GetFontSize(), {std::floor(at.x), std::floor(at.y)},
                im_colour32(colour, ImGui::GetStyle().Alpha), words.c_str(), nullptr,
                std::max(width, ImGui::GetFontSize()));
}

}  // namespace

void keep_places() {
  places().kept = true;
}

const std::map<std::string, std::array<float, 2>>& kept_places() {
  return places().all;
}

std::vector<ShownWindow> shown_windows() {
  std::vector<ShownWindow> all;
  for (const ImGuiWindow* const w : GImGui->Windows) {
    const std::string_view name = w->Name;
    if (!w->WasActive || w->Hidden || name.starts_with("Debug##")) continue;
    const float slack = 2 + ImGui::GetStyle().WindowBorderSize;
    const bool scrolls = (w->Flags & ImGuiWindowFlags_NoScrollWithMouse) == 0;
    const bool cut = w->ContentSize.x + 2 * w->WindowPadding.x > w->Size.x - w->ScrollbarSizes.x + slack ||
                     (!scrolls && w->ContentSize.y + 2 * w->WindowPadding.y > w->Size.y + slack);
    all.push_back({std::string(name), {w->Pos.x, w->Pos.y, w->Size.x, w->Size.y}, cut});
  }
  return all;
}

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
  const float u = unit(), room = std::max(ImGui::GetContentRegionAvail().x, 64 * u), wanted = button_width(words);
  const std::string shown = shown_part(words);
  const float wide = wanted > room + 1 ? room : std::max(std::min(width, room), wanted);
  const Lines lines = wanted > room + 1 ? lines_of(shown, room - 16 * u, ImGui::GetFontSize())
                                        : Lines{shown, wanted - 32 * u, ImGui::GetFontSize()};
  const Item i = item(words.c_str(), {wide, std::max(high * u, lines.high + 12 * u)});
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const Theme& t = theme();
  // One that is off is not what comes next.
  const bool off = (GImGui->CurrentItemFlags & ImGuiItemFlags_Disabled) != 0;
  const bool main = look == ButtonLook::main && !off;
  if (off) look = ButtonLook::usual;
  if (look != ButtonLook::quiet || i.hovered)
    draw->AddRectFilled(i.lo, i.hi, im_colour32(main ? t.text : t.raised), kRound * u);
  if (i.hovered || i.active) draw->AddRectFilled(i.lo, i.hi, im_colour32(t.line, i.active ? 0.6F : 0.3F), kRound * u);
  if (look == ButtonLook::usual) draw->AddRect(i.lo, i.hi, im_colour32(t.line), kRound * u, 0, std::max(1.0F, u));
  if (lines.high > ImGui::GetFontSize() * 1.5F) {
    draw_lines(draw, {(i.lo.x + i.hi.x - lines.wide) / 2, (i.lo.y + i.hi.y - lines.high) / 2}, lines.wide + 1,
               lines.words, main ? t.ground : t.text);
  } else {
    centred(draw, i.lo, i.hi, lines.words, main ? t.ground : t.text);
  }
  focus_and_text({});
  return i.pressed;
}

namespace {
float choice_width(const std::string& word) {
  return ImGui::CalcTextSize(word.c_str()).x + 24 * unit();
}
}  // namespace

float choice_width(std::span<const std::string> words) {
  float wide = 0;
  for (const std::string& w : words) wide += choice_width(w);
  return wide;
}

int choice(const char* id, std::span<const std::string> words, int selected, float high) {
  const float u = unit();
  ImGui::PushID(id);
  ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {0, ImGui::GetStyle().ItemSpacing.y});
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const Theme& t = theme();
  const ImVec2 begin = ImGui::GetCursorScreenPos();
  const float all = choice_width(words);
  float widest = 0;
  for (const std::string& w : words) widest = std::max(widest, choice_width(w));
  const bool below = all > ImGui::GetContentRegionAvail().x + 1;
  const ImVec2 end{begin.x + (below ? widest : all),
                   begin.y + high * u * (below ? static_cast<float>(words.size()) : 1)};
  draw->AddRectFilled(begin, end, im_colour32(t.ground), kRound * u);
  draw->AddRect(begin, end, im_colour32(t.line), kRound * u, 0, std::max(1.0F, u));
  int pressed = -1;
  for (std::size_t n = 0; n < words.size(); ++n) {
    if (n > 0 && !below) ImGui::SameLine();
    if (below) ImGui::SetCursorScreenPos({begin.x, begin.y + high * u * static_cast<float>(n)});
    const Item i = item(words[n].c_str(), {below ? widest : choice_width(words[n]), high * u});
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

int narrow_choice(const char* id, std::span<const std::string> words, int selected, float width) {
  const float u = unit();
  if (choice_width(words) <= width) return choice(id, words, selected, kSmallControl);
  ImGui::PushID(id);
  const std::string& now = words[static_cast<std::size_t>(std::max(0, selected))];
  const Item i = item("next", {width, kSmallControl * u});
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const Theme& t = theme();
  if (i.hovered || i.active)
    draw->AddRectFilled(i.lo, i.hi, im_colour32(i.active ? t.line : t.raised, i.active ? 0.6F : 1), kRound * u);
  draw->AddRect(i.lo, i.hi, im_colour32(t.line), kRound * u, 0, std::max(1.0F, u));
  centred(draw, i.lo, i.hi, now, t.text);
  std::string others;
  for (const std::string& w : words) others += (others.empty() ? "" : ", ") + w;
  focus_and_text(others);
  ImGui::PopID();
  return i.pressed ? (selected + 1) % static_cast<int>(words.size()) : -1;
}

bool kit_switch(const std::string& words, bool& on, float width) {
  const float u = unit();
  if (width <= 0) width = std::max(ImGui::GetContentRegionAvail().x, 48 * u);
  const Lines lines = lines_of(shown_part(words), width - (40 + kGap) * u, ImGui::GetFontSize());
  const Item i = item(words.c_str(), {width, std::max(kControl * u, lines.high + 8 * u)});
  if (i.pressed) on = !on;
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const Theme& t = theme();
  const float y = (i.lo.y + i.hi.y) / 2, x = i.hi.x - 40 * u;
  draw->AddRectFilled({x, y - 10 * u}, {x + 36 * u, y + 10 * u}, im_colour32(on ? t.text : t.raised), 10 * u);
  draw->AddRect({x, y - 10 * u}, {x + 36 * u, y + 10 * u}, im_colour32(t.line), 10 * u, 0, std::max(1.0F, u));
  draw->AddCircleFilled({x + (on ? 26 : 10) * u, y}, 7 * u, im_colour32(on ? t.ground : t.text), 20);
  draw_lines(draw, {i.lo.x, y - lines.high / 2}, x - i.lo.x - kGap * u, lines.words, t.text);
  focus_and_text({});
  return i.pressed;
}

bool kit_slider(const std::string& name, const std::string& value, double& at, double least, double most, double step,
                float width) {
  const float u = unit(), knob = 8 * u;
  if (width <= 0) width = std::max(ImGui::GetContentRegionAvail().x, 96 * u);
  const float value_wide = ImGui::CalcTextSize(value.c_str()).x;
  const bool two = ImGui::CalcTextSize(name.c_str(), nullptr, true).x + value_wide + kGap * u > width;
  const Item i = item(name.c_str(), {width, (kSlider + (two ? 20 : 0)) * u});
  const float from = i.lo.x + knob, to = i.hi.x - knob, y = i.hi.y - 14 * u;
  // A value beyond the ends stays as it is until a hand moves the knob.
  const double before = at;
  if (i.active) {
    const double share = static_cast<double>((ImGui::GetIO().MousePos.x - from) / std::max(1.0F, to - from));
    at = least + step * std::round(std::clamp(share, 0.0, 1.0) * (most - least) / step);
  } else if (ImGui::IsItemFocused() && ImGui::GetIO().NavVisible) {
    const double by = step * (ImGui::GetIO().KeyShift ? 10 : 1);
    if (ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_LeftArrow))) at -= by;
    if (ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_RightArrow))) at += by;
    if (at != before) ImGui::NavMoveRequestCancel();  // they are the knob's here
    if (at != before) at = std::clamp(at, least, most);
  }
  const double shown_at = std::clamp(at, least, most);
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const Theme& t = theme();
  draw->AddText({i.lo.x, i.lo.y}, im_colour32(t.quiet),
                shortened(shown_part(name), two ? width : width - value_wide - kGap * u, ImGui::GetFontSize()).c_str());
  draw->AddText({i.hi.x - value_wide, i.lo.y + (two ? 20 * u : 0)}, im_colour32(t.text), value.c_str());
  const float x = from + (to - from) * static_cast<float>(most > least ? (shown_at - least) / (most - least) : 0);
  draw->AddRectFilled({i.lo.x, y - u}, {i.hi.x, y + u}, im_colour32(t.line), u);
  draw->AddRectFilled({i.lo.x, y - 2 * u}, {x, y + 2 * u}, im_colour32(t.text), 2 * u);
  draw->AddCircleFilled({x, y}, knob, im_colour32(t.text), 20);
  if (i.hovered || i.active) draw->AddCircle({x, y}, knob + 2 * u, im_colour32(t.line), 20, 2 * u);
  focus_and_text({});
  return at != before;
}

bool kit_root_slider(const std::string& name, const std::string& value, double& at, double least, double most) {
  const double from = std::cbrt(least), to = std::cbrt(most);
  double root = std::cbrt(at);
  if (!kit_slider(name, value, root, from, to, (to - from) / 200)) return false;
  at = std::clamp(root * root * root, least, most);
  return true;
}

namespace {
// True: pressed.
bool swatch(const char* id, const std::array<float, 3>& rgb, float side) {
  const float u = unit();
  const Item i = item(id, {side * u, side * u});
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  draw->AddRectFilled(i.lo, i.hi, im_colour32({rgb[0], rgb[1], rgb[2]}), kRound * u);
  draw->AddRect(i.lo, i.hi, im_colour32(i.hovered ? theme().text : theme().line), kRound * u, 0, std::max(1.0F, u));
  focus_and_text({});
  return i.pressed;
}
}  // namespace

bool kit_colour(const char* id, std::array<float, 3>& rgb, float side) {
  // Far from each other, and from bone.
  static constexpr std::array<float, 3> kSwatches[] = {
      {0.90F, 0.62F, 0},     {0.34F, 0.71F, 0.91F}, {0, 0.62F, 0.45F},     {0.94F, 0.89F, 0.26F},
      {0, 0.45F, 0.70F},     {0.84F, 0.37F, 0},     {0.80F, 0.47F, 0.65F}, {0.55F, 0.55F, 1},
      {0.80F, 0.12F, 0.15F}, {0.45F, 0.80F, 0.30F}, {0.60F, 0.40F, 0.25F}, {0.75F, 0.75F, 0.78F}};
  constexpr int kInRow = 6;
  const float u = unit();
  ImGui::PushID(id);
  if (swatch("colour", rgb, side)) ImGui::OpenPopup("colours");
  bool changed = false;
  ImGui::SetNextWindowSize({(kInRow * kRow + (kInRow - 1) * kGap + 24) * u, 0});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {12 * u, 12 * u});
  const bool open = ImGui::BeginPopup("colours");
  ImGui::PopStyleVar();
  if (open) {
    for (int n = 0; n < static_cast<int>(std::size(kSwatches)); ++n) {
      if (n % kInRow != 0) ImGui::SameLine(0, kGap * u);
      ImGui::PushID(n);
      if (swatch("usual", kSwatches[n], kRow)) {
        rgb = kSwatches[n];
        changed = true;
      }
      ImGui::PopID();
    }
    const std::string names[] = {tr("Red"), tr("Green"), tr("Blue")};
    for (std::size_t c = 0; c < 3; ++c) {
      double at = std::round(255 * static_cast<double>(rgb[c]));
      if (!kit_slider(names[c], shown_number(at, 0), at, 0, 255, 1)) continue;
      rgb[c] = static_cast<float>(at / 255);
      changed = true;
    }
    ImGui::EndPopup();
  }
  ImGui::PopID();
  return changed;
}

int kit_list(const std::string& name, std::span<const std::string> words, int selected, const std::string& shown) {
  const float u = unit();
  ImGui::PushID(name.c_str());
  if (!name.empty()) ImGui::TextDisabled("%s", name.c_str());
  const float wide = ImGui::GetContentRegionAvail().x;
  // ImGui's own field has one line: what needs more is written over it.
  const std::string field = selected < 0 ? shown : words[static_cast<std::size_t>(selected)];
  const float room = std::max(24 * u, wide - (kControl + 20) * u);
  const Lines lines = lines_of(field, room, ImGui::GetFontSize());
  const float high = std::max(kControl * u, lines.high + 12 * u);
  const ImVec2 at = ImGui::GetCursorScreenPos();
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  ImGui::SetNextItemWidth(wide);
  ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, {12 * u, (high - ImGui::GetFontSize()) / 2});
  int chosen = -1;
  const bool open = ImGui::BeginCombo("##list", "");
  ImGui::PopStyleVar();
  draw_lines(draw, {at.x + 12 * u, at.y + (high - lines.high) / 2}, room, lines.words, theme().text);
  if (!open) note_place(name.empty() ? field : name);
  if (open) {
    for (int n = 0; n < static_cast<int>(words.size()); ++n) {
      need_letters(words[static_cast<std::size_t>(n)]);
      if (ImGui::Selectable(words[static_cast<std::size_t>(n)].c_str(), n == selected)) chosen = n;
      // In its first picture a list is not seen, and not where it will be.
      if (!ImGui::IsWindowAppearing() && !ImGui::GetCurrentWindow()->Hidden)
        note_place(words[static_cast<std::size_t>(n)]);
      if (n == selected) ImGui::SetItemDefaultFocus();
    }
    ImGui::EndCombo();
  }
  ImGui::PopID();
  return chosen;
}

bool list_row(const std::string& words, const std::string& right, bool selected, float high, std::string_view icon,
              float width) {
  const float u = unit(), wide = std::max(width > 0 ? width : ImGui::GetContentRegionAvail().x, 48 * u);
  const std::string shown = shown_part(words);
  const float behind = icon.empty() ? 0 : 28 * u, end = ImGui::CalcTextSize(right.c_str()).x + behind;
  const float words_wide = ImGui::CalcTextSize(shown.c_str()).x;
  const bool two = !right.empty() && words_wide + end + 36 * u > wide;
  // Words alone have as many lines as they need.
  const bool alone = right.empty() && words_wide + behind + 24 * u > wide;
  const Lines lines = alone ? lines_of(shown, wide - behind - 24 * u, ImGui::GetFontSize()) : Lines{};
  const float tall = alone ? std::max(high * u, lines.high + 12 * u) : (two ? std::max(high, 60.0F) : high) * u;
  const Item i = item(words.c_str(), {wide, tall});
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const Theme& t = theme();
  if (selected || i.hovered) draw->AddRectFilled(i.lo, i.hi, im_colour32(t.raised), kRound * u);
  if (selected)
    draw->AddRectFilled({i.lo.x, i.lo.y + 6 * u}, {i.lo.x + 4 * u, i.hi.y - 6 * u}, im_colour32(t.accent), 2 * u);
  const float middle = std::floor((i.lo.y + i.hi.y - ImGui::GetFontSize()) / 2), by = two ? 11 * u : 0;
  if (!icon.empty())
    draw_icon(draw, {i.hi.x - 32 * u, std::floor((i.lo.y + i.hi.y) / 2 - 10 * u)}, 20 * u, icon, im_colour32(t.quiet));
  const std::string told = two ? shortened(right, wide - behind - 24 * u, ImGui::GetFontSize()) : right;
  draw->AddText({i.hi.x - ImGui::CalcTextSize(told.c_str()).x - behind - 12 * u, middle + by}, im_colour32(t.quiet),
                told.c_str());
  if (alone) {
    draw_lines(draw, {i.lo.x + 12 * u, (i.lo.y + i.hi.y - lines.high) / 2}, wide - behind - 24 * u, lines.words,
               t.text);
    focus_and_text(lines.words == shown ? std::string() : shown);
    return i.pressed;
  }
  const std::string name =
      shortened(shown, wide - (two ? behind + 24 * u : end + (right.empty() ? 24 : 36) * u), ImGui::GetFontSize());
  draw->AddText({i.lo.x + 12 * u, middle - by}, im_colour32(t.text), name.c_str());
  focus_and_text(name == shown ? std::string() : shown);
  return i.pressed;
}

void kit_title(const std::string& words, float ems) {
  ImGui::PushFont(bold_font());
  ImGui::SetWindowFontScale(ems / kBoldEm);
  kit_text(words, theme().text);
  ImGui::SetWindowFontScale(1);
  ImGui::PopFont();
}

void kit_heading(const std::string& words) {
  ImGui::Dummy({0, 4 * unit()});
  kit_text(words, theme().quiet);
}

void kit_text(const std::string& words, Colour colour) {
  need_letters(words);
  ImGui::PushStyleColor(ImGuiCol_Text, im_colour(colour));
  ImGui::PushTextWrapPos(0);
  ImGui::TextUnformatted(words.c_str());
  ImGui::PopTextWrapPos();
  ImGui::PopStyleColor();
}

bool kit_field(const char* id, const std::string& hint, std::string& text, float less, ImGuiInputTextFlags more) {
  const float u = unit();
  need_letters(text);
  ImGui::SetNextItemWidth(std::max(48 * u, ImGui::GetContentRegionAvail().x - less));
  ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, {12 * u, (kControl * u - ImGui::GetFontSize()) / 2});
  const bool entered = ImGui::InputTextWithHint(id, hint.c_str(), &text, ImGuiInputTextFlags_EnterReturnsTrue | more);
  ImGui::PopStyleVar();
  return entered;
}

int kit_dialog(const ScreenBox& window, const std::string& title, std::span<const std::string> texts,
               std::span<const std::string> answers) {
  const float u = unit(), gap = kGap * u, wide = std::min(448 * u, window.width - 16 * u);
  ImGui::SetNextWindowPos({std::floor(window.x + (window.width - wide) / 2), std::floor(window.y + window.height / 4)});
  // In a low window its words scroll, not its answers away.
  ImGui::SetNextWindowSizeConstraints({wide, 0}, {wide, 0.74F * window.height});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, kCardRound * u);
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {16 * u, 16 * u});
  ImGui::Begin(title.c_str(), nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoNav);
  ImGui::PopStyleVar(2);
  kit_title(title);
  for (const std::string& text : texts) {
    if (!text.empty()) kit_text(text, theme().text);
  }
  ImGui::Dummy({0, 4 * u});
  const float room = ImGui::GetContentRegionAvail().x, n = static_cast<float>(answers.size());
  const float each = std::floor((room - gap * (n - 1)) / n);
  const bool beside =
      std::all_of(answers.begin(), answers.end(), [&](const std::string& a) { return button_width(a) <= each; });
  int pressed = -1;
  for (std::size_t a = 0; a < answers.size(); ++a) {
    if (a > 0 && beside) ImGui::SameLine(0, gap);
    if (kit_button(answers[a], a == 0 ? ButtonLook::main : ButtonLook::usual, beside ? each : room))
      pressed = static_cast<int>(a);
  }
  ImGui::End();
  return pressed;
}

bool fold(const char* words) {
  ImGui::PushStyleColor(ImGuiCol_Header, im_colour(theme().raised));
  ImGui::PushStyleColor(ImGuiCol_HeaderActive, im_colour(theme().line, 0.6F));
  const bool open = ImGui::CollapsingHeader(words);
  note_place(words);
  ImGui::PopStyleColor(2);
  return open;
}

float chip_width(const std::string& words) {
  return ImGui::CalcTextSize(words.c_str()).x + 48 * unit();
}

float chip_height(const std::string& words, float width) {
  const float u = unit();
  if (chip_width(words) <= width + 1) return 32 * u;
  return std::max(32 * u, lines_of(words, width - 48 * u, kLineEm * kLabelEm * em()).high + 12 * u);
}

void draw_chip(ImDrawList* draw, const ScreenBox& box, const std::string& words, const ChipLook& look) {
  const float u = unit();
  const ImVec2 lo{box.x, box.y}, hi{box.right(), box.bottom()};
  const bool wraps = chip_width(words) > box.width + 1;
  const float round = std::min(box.height / 2, 16 * u);
  draw->AddRectFilled(lo, hi, im_colour32(look.filled ? look.colour : theme().surface, look.filled ? 1 : 0.94F), round);
  draw->AddRect(lo, hi, im_colour32(look.colour), round, 0, 2 * u);
  const Colour ink = look.filled ? Colour{0, 0, 0} : theme().text;
  draw_sign(draw, {box.x + 20 * u, box.y + box.height / 2}, 9 * u, look.corners,
            look.filled ? Colour{0, 0, 0} : look.colour);
  const ScreenBox inside{box.x + 36 * u, box.y, box.width - 48 * u, box.height};
  if (!wraps) return fitted_text(draw, inside, em(), ink, words);
  const float size = kLineEm * kLabelEm * em();
  const Lines lines = lines_of(words, inside.width, size);
  draw->AddText(ImGui::GetFont(), size, {inside.x, std::floor(box.y + (box.height - lines.high) / 2)}, im_colour32(ink),
                lines.words.c_str(), nullptr, inside.width);
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
