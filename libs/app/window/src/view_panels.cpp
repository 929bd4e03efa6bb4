#include "view_panels.h"

#include <imgui.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "osteo/core/base/translate.h"
#include "osteo/simulation/bone/burr_kind.h"
#include "ui_kit.h"
#include "ui_style.h"

namespace osteo::inline app {
namespace {

// As a sentence begins; letters beyond ASCII stay as they are.
std::string capital(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

// Name and key of a command.
std::string words_of(const char* name, Command command) {
  const std::string key = key_name(command);
  return key.empty() ? name : std::string(name) + "   " + key;
}

// The nearest structure with its bar, which fills as it comes nearer. `own_line`: its name has a line of its own.
void draw_nearest(ImDrawList* draw, const ScreenBox& near, const StateFacts& f, bool own_line) {
  const Theme& t = theme();
  const float u = unit(), line = 22 * u;
  const NearnessLook& look = look_of(f.nearness);
  const bool contact = f.nearness == Nearness::touched;
  if (contact)  // as large as it can be
    draw->AddRectFilled({near.x - 8 * u, near.y - 2 * u}, {near.right() + 4 * u, near.bottom() + 2 * u},
                        im_colour32(look.colour), kRound * u);
  const Colour ink = contact ? Colour{0, 0, 0} : t.text;
  const bool is_near = !f.distance.empty() && f.nearness != Nearness::far;
  const std::string words = is_near ? f.distance + " " + tr(look.word) : f.distance;
  ImFont* const bold = bold_font();
  const float said = words.empty() ? 0 : bold->CalcTextSizeA(ImGui::GetFontSize(), FLT_MAX, 0, words.c_str()).x;
  const float name_wide = near.width - (own_line || words.empty() ? 0 : said + 34 * u);
  const std::string name = f.structure + (f.warmth.empty() ? "" : ", " + f.warmth);
  if (name_wide > 24 * u)
    fitted_text(draw, {near.x, near.y + 2 * u, name_wide, line}, em(), f.distance.empty() ? t.quiet : ink, name);
  if (!words.empty()) {
    const float y = near.y + (own_line ? line : 0),
                x = own_line ? near.x + (is_near ? 24 * u : 0) : near.right() - said;
    if (is_near) draw_sign(draw, {x - 14 * u, y + 13 * u}, 8 * u, look.corners, contact ? ink : look.colour);
    draw->AddText(bold, ImGui::GetFontSize(), {x, y + 2 * u}, im_colour32(ink), words.c_str());
  }
  const float bar_y = near.y + (own_line ? 2 * line + 2 * u : 34 * u);
  draw->AddRectFilled({near.x, bar_y}, {near.right(), bar_y + 8 * u}, im_colour32(contact ? Colour{0, 0, 0} : t.raised),
                      4 * u);
  if (f.near_share <= 0) return;
  const float full = near.x + std::max(8 * u, near.width * static_cast<float>(f.near_share));
  draw->AddRectFilled({near.x, bar_y}, {full, bar_y + 8 * u}, im_colour32(is_near ? look.colour : t.quiet), 4 * u);
  if (is_near && contrast(look.colour, t.surface) < 3)  // on a light ground it has a dark edge
    draw->AddRect({near.x, bar_y}, {full, bar_y + 8 * u}, im_colour32(t.text), 4 * u, 0, 1.5F * u);
}

// At the foot of the picture, beside the scale bar's box; in lines where one is too short.
void draw_message(const ScreenBox& view, const std::string& words, const ChipLook& look) {
  const float u = unit();
  constexpr float kScaleBar = 72;
  // In a low or narrow picture not beside the scale bar: in few lines, in front of it or above it.
  const bool low = view.height < 200 * u, narrow = view.width < 400 * u;
  const float most = view.width - (low || narrow ? 32 : view.width > kNarrow * u ? 352 : 160) * u;
  if (most < 64 * u) return;
  const float wide = std::min(chip_width(words), most), high = chip_height(words, wide);
  const float below = narrow && !low ? kScaleBar * u : 8 * u;
  ImDrawList* const draw = low || narrow ? ImGui::GetForegroundDrawList() : ImGui::GetBackgroundDrawList();
  draw_chip(draw, {view.x + 16 * u, view.bottom() - below - high, wide, high}, words, look);
}

}  // namespace

void draw_state(const ViewLayout& layout, const StateFacts& f, const std::optional<Message>& message,
                Pressed& pressed) {
  const ScreenBox& box = layout.state;
  const bool two = layout.two_rows;
  ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 0);
  begin_fixed("state", box, ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoScrollWithMouse);
  ImGui::PopStyleVar();
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const Theme& t = theme();
  const float u = unit(), label = kLabelEm * em();
  const float top = box.y + (two ? 4 : 8) * u, big = box.y + (two ? 20 : 26) * u, row = 32 * u;
  float x = box.x + 16 * u;
  const auto figure = [&](const std::string& name, const std::string& value, float wide) {
    fitted_text(draw, {x, top, wide - 8 * u, 18 * u}, label, t.quiet, name);
    fitted_text(draw, {x, big, wide - 8 * u, row}, kBoldEm * em(), t.text, value, false, true);
    x += wide;
  };
  figure(tr("Force"), f.force, 96 * u);
  const float bar = 3 * u, force_x = box.x + 16 * u, force_y = two ? box.y + 54 * u : box.bottom() - 2 * bar;
  draw->AddRectFilled({force_x, force_y}, {force_x + 80 * u, force_y + bar}, im_colour32(t.raised));
  draw->AddRectFilled({force_x, force_y}, {force_x + 80 * u * static_cast<float>(f.force_share), force_y + bar},
                      im_colour32(f.force_share < 1 ? t.text : palette::kVermillion));
  figure(tr("Burr, rpm"), f.turning ? f.speed.substr(0, f.speed.find(' ')) : "0", 104 * u);
  figure(tr("Bone below"), f.under, 112 * u);

  // From the right: the button, time and volume. What is left is the structure's and the message's, or, in two rows,
  // the lower one is the structure's and the button's.
  const float end_wide = std::max(72 * u, button_width(tr("End"))), right = box.right() - 16 * u;
  const float time_wide = 104 * u, time_x = right - time_wide - (two ? 0 : end_wide + 16 * u);
  const auto flush_right = [&](float y, const std::string& words, Colour colour) {
    const std::string shown = shortened(words, time_wide, kLineEm * label);
    const float wide = ImGui::GetFont()->CalcTextSizeA(kLineEm * label, FLT_MAX, 0, shown.c_str()).x;
    fitted_text(draw, {time_x + time_wide - wide, y, wide + 1, 18 * u}, label, colour, shown);
  };
  const float lines_y = box.y + (f.tissue.empty() ? 12 : 5) * u - (two ? 4 * u : 0);
  flush_right(lines_y, f.time, t.text);
  flush_right(lines_y + (f.tissue.empty() ? 22 : 18) * u, f.removed, t.quiet);
  if (!f.tissue.empty()) flush_right(lines_y + 36 * u, f.tissue, t.quiet);
  ImGui::SetCursorScreenPos({right - end_wide, box.y + (two ? 68 : 12) * u});
  if (kit_button(tr("End"), ButtonLook::usual, end_wide)) pressed.press(Command::quit);

  if (two) {
    draw_nearest(
        draw, {box.x + 16 * u, box.y + 60 * u, std::min(416 * u, right - end_wide - 24 * u - box.x - 16 * u), 56 * u},
        f, true);
  }
  // A name and its distance have room in a line of this width, in every language; in less they have a line each.
  const float rest = time_x - 16 * u - x, line_wide = 416 * u, chip_least = 176 * u;
  const bool inside = !two && rest >= line_wide + 24 * u + chip_least, own_line = rest < line_wide;
  const ScreenBox near{x, box.y + (own_line ? 2 : 6) * u, std::max(0.0F, inside ? line_wide : std::min(rest, 416 * u)),
                       (own_line ? 58 : 52) * u};
  if (!two) draw_nearest(draw, near, f, own_line);

  // One place for words.
  if (message) {
    static constexpr ChipLook kLooks[] = {
        {palette::kSkyBlue, 0, false}, {palette::kYellow, 3, false}, {palette::kVermillion, 8, true}};
    const ChipLook chip = kLooks[static_cast<std::size_t>(message->rank)];
    const float wide = chip_width(message->text);
    if (inside && wide <= time_x - 16 * u - near.right() - 24 * u) {
      draw_chip(draw, {near.right() + 24 * u, box.y + 16 * u, wide, 32 * u}, message->text, chip);
    } else {
      draw_message(layout.view, message->text, chip);
    }
  }
  ImGui::End();
}

void draw_tray(const ScreenBox& box, const HandFacts& hand, bool menu, Latched& latched, Pressed& pressed) {
  const float u = unit();
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {0, 0});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 0);
  begin_fixed("tray", box, ImGuiWindowFlags_NoScrollbar);
  ImGui::PopStyleVar(2);
  struct Row {
    const char *icon, *name;
    Command command;
    bool selected = false, on = false, enabled = true, group = false;  ///< group: a line above
    bool* latch = nullptr;
    const char* why = "";
  };
  const bool drill = hand.tool == 0 && !hand.saw;
  const char* const no_second = tr("there is no second hand in this session");
  const Row rows[] = {{"menu-2", tr("Menu and settings"), Command::settings, false, menu},
                      {"drill", tr("Drill"), Command::put_away, drill, hand.latched, true, true},
                      {"saw", tr("Saw"), Command::saw, hand.tool == 1 || hand.saw},
                      {"plate", tr("Plate"), Command::plates, hand.tool == 3},
                      {"fragments", tr("Fragments"), Command::pieces, hand.tool == 2},
                      {"suction", tr("Suction"), Command::suck, false, hand.sucking, hand.second_hand, true,
                       &latched.suction, no_second},
                      {"droplet", tr("Irrigation"), Command::irrigation, false, hand.washing, hand.second_hand, false,
                       &latched.irrigation, no_second},
                      {"arrow-bar-to-down", tr("Approach"), Command::bring, false, false, true, true},
                      {"arrow-bar-up", tr("Retract"), Command::lift},
                      {"arrow-back-up", tr("Undo"), Command::undo, false, false, hand.undo_steps > 0, false, nullptr,
                       tr("nothing to take back")},
                      {"versions", tr("Compare"), Command::before, false, hand.before, true, true},
                      {"ruler-measure", tr("Ruler"), Command::ruler, false, hand.ruler},
                      {"note", tr("Note"), Command::mark},
                      {"camera", tr("Picture"), Command::screenshot},
                      {"layout-grid", tr("Operate or plan"), Command::layout},
                      {"command", tr("All commands"), Command::palette, false, false, true, true},
                      {"help", tr("Ten keys"), Command::help}};
  // As far apart as there is room; smaller only where a screen is very low.
  const auto count = static_cast<float>(std::size(rows));
  const float inset = 8 * u, most = box.height - 2 * inset, line = 9 * u;
  float lines = 0;
  for (const Row& r : rows) lines += r.group ? 1 : 0;
  const float pitch = std::min(44 * u, (most - lines * line) / count);
  // Below a tile's height they go in two columns, so that none is smaller than what a finger hits.
  const bool two = pitch < 30 * u;
  float y = box.y + inset;
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  int number = 0;
  for (const Row& r : rows) {
    if (r.group && !two) {
      draw->AddLine({box.x + 12 * u, y + line / 2 - 2 * u}, {box.right() - 12 * u, y + line / 2 - 2 * u},
                    im_colour32(theme().line, 0.6F), std::max(1.0F, u));
      y += line;
    }
    TileLook look{r.selected, r.on || (r.latch != nullptr && *r.latch), r.enabled, {}};
    look.words = r.enabled ? words_of(r.name, r.command) : std::string(r.name) + ": " + r.why;
    const float side = two ? std::min(28 * u, box.width / 2) : std::min(40 * u, pitch);
    const float x = two ? box.x + (number % 2 == 0 ? 0 : box.width / 2) : box.x + (box.width - side) / 2;
    ImGui::SetCursorScreenPos({x, y});
    if (tile(r.icon, r.icon, look, side)) {
      if (r.latch != nullptr) {
        *r.latch = !*r.latch;
      } else if (r.command != Command::put_away || !drill) {
        pressed.press(r.command);
      }
    }
    ++number;
    if (!two || number % 2 == 0) y += two ? std::min(32 * u, 2 * most / (count + 1)) : pitch;
  }
  ImGui::End();
}

namespace {

// A burr as it is: its diameter in the pixels of a screen of 96 dots an inch, with flutes or grit.
void draw_burr(ImDrawList* draw, ImVec2 centre, float radius, const BurrKindRow& kind, float u) {
  const auto ink = [](const std::array<double, 3>& c) {
    return im_colour32({static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])});
  };
  draw->AddLine({centre.x, centre.y - radius - 8 * u}, {centre.x, centre.y}, ink(kind.raised),
                std::max(1.5F, radius / 3));
  draw->AddCircleFilled(centre, radius, ink(kind.colour), 24);
  if (radius < 3) return;
  const int flutes = kind.flutes[radius < 6 * u ? 0 : radius < 10 * u ? 1 : 2];
  if (flutes > 0) {
    for (int n = 1; n < flutes / 2 + 1; ++n) {
      const float at = radius * (2 * static_cast<float>(n) / static_cast<float>(flutes / 2 + 1) - 1);
      const float high = std::sqrt(std::max(0.0F, radius * radius - at * at)) * 0.9F;
      draw->AddBezierQuadratic({centre.x + at, centre.y - high}, {centre.x + at * 1.25F + radius * 0.2F, centre.y},
                               {centre.x + at, centre.y + high}, ink(kind.sunk), std::max(1.0F, radius / 9));
    }
  } else {
    for (int n = 0; n < 14; ++n) {
      const float angle = 2.39996F * static_cast<float>(n), r = radius * 0.85F * std::sqrt(static_cast<float>(n) / 14);
      draw->AddCircleFilled({centre.x + r * std::cos(angle), centre.y + r * std::sin(angle)},
                            std::max(0.7F, radius / 9), ink(n % 2 == 0 ? kind.raised : kind.sunk), 6);
    }
  }
  draw->AddCircleFilled({centre.x - radius * 0.35F, centre.y - radius * 0.35F}, radius * 0.22F,
                        IM_COL32(255, 255, 255, 120), 12);
}

}  // namespace

namespace {

// Folded to its name, where the card has no room. True: pressed.
bool draw_burr_name(const ScreenBox& box, const std::string& name) {
  const float u = unit();
  begin_card("burr", box, {0, 0}, ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoScrollWithMouse);
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  ImGui::SetCursorScreenPos({box.x, box.y});
  const bool pressed = ImGui::InvisibleButton("name", {box.width, box.height});
  fitted_text(draw, {box.x + 12 * u, box.y, box.width - 44 * u, box.height}, em(), theme().text, name);
  draw_icon(draw, {box.right() - 28 * u, box.y + (box.height - 20 * u) / 2}, 20 * u, "chevron-down",
            im_colour32(theme().quiet));
  ImGui::End();
  return pressed;
}

// How the card's parts stand: kinds, sizes and the chevron beside each other or in rows; below them, unfolded, shapes
// and speeds.
struct BurrCard {
  std::vector<std::string> kinds, shapes, speeds;
  float kinds_wide = 0, wide = 0, high = 0;
  bool rows = false;
};
constexpr float kBurrPad = 12, kBurrSize = 40, kBurrLine = 48, kBurrMore = 32;
BurrCard lay_out_burr_card(float room, bool unfolded) {
  const float u = unit(), sizes = 7 * kBurrSize * u;
  BurrCard c;
  for (const BurrKindRow& k : kBurrKinds) c.kinds.push_back(capital(tr(std::string(k.name))));
  c.shapes = {tr("Ball"), tr("Cylinder"), tr("Taper")};
  c.speeds = {"25", "50", "75", "100 %"};
  c.kinds_wide = choice_width(c.kinds);
  const float pad = 2 * kBurrPad * u, more = kBurrMore * u, one_row = pad + c.kinds_wide + 12 * u + sizes + more;
  c.rows = one_row > room;
  c.wide = c.rows ? pad + std::max(sizes, c.kinds_wide + more) : one_row;
  if (unfolded) {
    const float speed = ImGui::CalcTextSize(tr_of("of the burr", "Speed")).x + 12 * u + choice_width(c.speeds);
    c.wide = std::max({c.wide, pad + choice_width(c.shapes), pad + speed});
  }
  c.high = static_cast<float>((c.rows ? 2 : 1) + (unfolded ? 2 : 0)) * kBurrLine * u + 16 * u;
  return c;
}

// Its diameters, in true size.
void draw_burr_sizes(ImVec2 at, const Burr& burr, bool held, Pressed& pressed) {
  const float u = unit(), size = kBurrSize * u, line = kBurrLine * u;
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  constexpr float kPixelsPerMm = 96 / 25.4F;
  for (int d = 1; d <= 7; ++d, at.x += size) {
    ImGui::SetCursorScreenPos(at);
    const std::string name = std::to_string(d);
    const bool clicked = ImGui::InvisibleButton(name.c_str(), {size, line});
    const bool hovered = ImGui::IsItemHovered();
    const ImVec2 lo = at, hi{at.x + size, at.y + line};
    const bool is = held && std::lround(burr.diameter_mm) == d;
    if (is || hovered) draw->AddRectFilled(lo, hi, im_colour32(theme().raised), kRound * u);
    if (is) draw->AddRect(lo, hi, im_colour32(theme().accent), kRound * u, 0, 2 * u);
    const float radius = static_cast<float>(d) * kPixelsPerMm * u / 2;
    draw_burr(draw, {at.x + size / 2, at.y + 18 * u}, radius, kBurrKinds[static_cast<std::size_t>(burr.kind)], u);
    fitted_text(draw, {lo.x, at.y + line - 17 * u, size, 16 * u}, kLabelEm * em(), is ? theme().text : theme().quiet,
                name, true);
    if (clicked) pressed.press(Command::diameter, d);
    if (hovered) ImGui::SetTooltip("%d mm   %d", d, d);
  }
}

}  // namespace

ScreenBox draw_burr_card(const ScreenBox& view, float free_width, const HandFacts& hand, bool& unfolded,
                         Pressed& pressed) {
  const float u = unit(), pad = kBurrPad * u, line = kBurrLine * u, chevron = kBurrMore * u;
  const Burr& burr = burr_library()[static_cast<std::size_t>(hand.burr)];
  const bool held = hand.tool == 0 && !hand.saw;
  const float room = std::min(free_width, view.width) - 24 * u, high = view.height - 24 * u;
  // Room for it folded, it stays there; where even that is too much its name alone does, and a click on that opens
  // all of it over what lies there, to be scrolled where it has to be.
  const BurrCard least = lay_out_burr_card(room, false);
  const bool to_name = least.wide > room || least.high > 0.42F * view.height;
  ScreenBox box{view.x + 16 * u, view.y + 16 * u, 0, 0};
  if (to_name && !unfolded) {
    const std::string name = capital(tr(std::string(kBurrKinds[static_cast<std::size_t>(burr.kind)].name))) + " " +
                             shown_number(burr.diameter_mm, 0) + " mm";
    box.width = std::min(ImGui::CalcTextSize(name.c_str()).x + 48 * u, view.width - 32 * u);
    box.height = kControl * u;
    if (box.width < 48 * u || box.height > view.height) return {};
    if (draw_burr_name(box, name)) unfolded = true;
    return box;
  }
  const BurrCard card = lay_out_burr_card(to_name ? view.width - 32 * u : room, unfolded);
  box.width = std::min(card.wide, view.width - 32 * u);
  box.height = std::min(card.high, high);
  if (box.width < 48 * u || box.height < line) return {};
  const bool scrolls = card.high > box.height;
  begin_card("burr", box, {0, 0}, scrolls ? 0 : ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoScrollWithMouse);
  // Of what is drawn, with what has been scrolled.
  const float from = box.y - ImGui::GetScrollY();
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  ImGui::SetCursorScreenPos({box.x + pad, from + 12 * u});
  if (const int kind = choice("kind", card.kinds, held ? static_cast<int>(burr.kind) : -1); kind >= 0)
    pressed.press(Command::burr_kind, kind);
  const float y = from + 8 * u + (card.rows ? line : 0);
  draw_burr_sizes({card.rows ? box.x + pad : box.x + pad + card.kinds_wide + 12 * u, y}, burr, held, pressed);
  const ImVec2 more{box.right() - pad - chevron + 4 * u, from + 16 * u};
  ImGui::SetCursorScreenPos(more);
  if (ImGui::InvisibleButton("more", {chevron, chevron})) unfolded = !unfolded;
  draw_icon(draw, {more.x + 4 * u, more.y + 4 * u}, 24 * u, "chevron-down", im_colour32(theme().quiet));
  if (unfolded) {
    ImGui::SetCursorScreenPos({box.x + pad, y + line + 4 * u});
    static constexpr Command kCommands[] = {Command::ball, Command::cylinder, Command::taper};
    if (const int shape = choice("shape", card.shapes, static_cast<int>(burr.shape)); shape >= 0)
      pressed.press(kCommands[shape]);
    // A quarter a step, as its keys do.
    ImGui::SetCursorScreenPos({box.x + pad, y + 2 * line + 10 * u});
    ImGui::TextDisabled("%s", tr_of("of the burr", "Speed"));
    ImGui::SetCursorScreenPos({box.x + pad + ImGui::GetItemRectSize().x + 12 * u, y + 2 * line});
    const int now = static_cast<int>(std::lround(4 * hand.burr_share)) - 1;
    if (const int speed = choice("speed", card.speeds, now); speed >= 0) {
      for (int n = now; n != speed; n += speed > now ? 1 : -1) pressed.press(Command::burr_speed, speed > now ? 1 : -1);
    }
  }
  ImGui::End();
  return box;
}

ScreenBox draw_tool_card(const ScreenBox& view, float free_width, const char* name, const std::string& title,
                         const std::function<void()>& content) {
  // Left of the cuts; over them only where that would leave it too narrow.
  const float u = unit(), beside = std::min(view.width, free_width) - 24 * u;
  const float wide = std::min(312 * u, beside < 200 * u ? view.width - 32 * u : beside);
  if (wide < 120 * u) return {view.x, view.y, 0, 0};
  // Above the messages' place, where that leaves it anything.
  const float high = view.height - 96 * u, least = std::min(160 * u, view.height - 24 * u);
  ImGui::SetNextWindowPos({view.x + 16 * u, view.y + 16 * u});
  ImGui::SetNextWindowSizeConstraints({wide, 0}, {wide, std::max(least, high)});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, kCardRound * u);
  ImVec4 ground = im_colour(theme().surface, 0.94F);
  ImGui::PushStyleColor(ImGuiCol_WindowBg, ground);
  ImGui::Begin(name, nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize |
                   ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoBringToFrontOnFocus);
  ImGui::PopStyleColor();
  ImGui::PopStyleVar();
  kit_title(title, 1);
  content();
  const ImVec2 at = ImGui::GetWindowPos(), size = ImGui::GetWindowSize();
  ImGui::End();
  return {at.x, at.y, size.x, size.y};
}

ScreenBox cuts_foot_box(const ViewLayout& layout) {
  const ScreenBox& lowest = layout.over[1].empty() ? layout.over[0] : layout.over[2];
  const float u = layout.unit;
  return lowest.empty() ? ScreenBox{}
                        : ScreenBox{lowest.x, lowest.bottom() + kGap * u, lowest.width, kSmallControl * u};
}

CutsFoot draw_cuts_foot(const ScreenBox& box, bool alone, int chosen, bool settings_open, const std::string& help) {
  begin_card("cuts' foot", box, {0, 0}, ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoScrollWithMouse);
  CutsFoot pressed;
  const float side = box.height;
  ImGui::SetCursorScreenPos({box.x, box.y});
  const std::vector<std::string> words =
      alone ? std::vector<std::string>{"A", "C", "S"}
            : std::vector<std::string>{tr_of("planes of the cuts", "Body"), tr_of("planes of the cuts", "Drill")};
  pressed.chosen = narrow_choice(alone ? "which" : "planes", words, chosen, box.width - side);
  ImGui::SetCursorScreenPos({box.right() - side, box.y});
  pressed.settings = tile("settings", "settings", {false, settings_open, true, help}, side);
  ImGui::End();
  return pressed;
}

void draw_cut_tile(const ScreenBox& box, bool shown, Pressed& pressed) {
  if (box.empty()) return;
  begin_card("cut", box, {0, 0}, ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoFocusOnAppearing);
  const std::string words = filled(shown ? tr("the cut goes away ({key})") : tr("a cut over the picture ({key})"),
                                   {{"key", key_name(Command::cut_in_middle)}});
  if (tile("cut", shown ? "x" : "layout-grid", {false, shown, true, words}, box.width))
    pressed.press(Command::cut_in_middle);
  ImGui::End();
}

void draw_second_hand(Rehearsal& rehearsal, SecondHand& second, const std::function<void(const LocalText&)>& say) {
  const std::pair<const char*, std::size_t> things[] = {{tr("Suction"), SecondHand::kSucker},
                                                        {tr("Irrigation"), SecondHand::kIrrigator},
                                                        {tr("Probe"), SecondHand::kProbe},
                                                        {tr("Nothing"), 0}};
  ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {0, 0});
  for (const auto& [name, what] : things) {
    if (list_row(name, "", second.holds() == what)) say(second.take(rehearsal, what));
  }
  ImGui::PopStyleVar();
  ImGui::TextDisabled("%s", tr("Suction tube, French"));
  static constexpr int kFrench[] = {5, 7, 8, 10, 12};
  static const std::string kSizes[] = {"5", "7", "8", "10", "12"};
  const auto at = std::find(std::begin(kFrench), std::end(kFrench), second.sucker_french()) - std::begin(kFrench);
  if (const int size = choice("size", kSizes, static_cast<int>(at), kSmallControl); size >= 0)
    second.take_sucker(kFrench[size]);
}

void draw_apart(Pressed& pressed) {
  const float wide = ImGui::GetContentRegionAvail().x;
  if (kit_button(tr("Save and continue"), ButtonLook::usual, wide)) pressed.press(Command::save);
  if (kit_button(tr("Reset bone ..."), ButtonLook::usual, wide)) pressed.press(Command::reset);
}

float apart_width() {
  return std::max(button_width(tr("Save and continue")), button_width(tr("Reset bone ...")));
}

bool draw_next_step(const ScreenBox& view, float free_width, const ScreenBox& card, const FirstSteps& steps,
                    bool& unfolded) {
  const int next = steps.next();
  const float u = unit();
  // In a very low picture beside the card, or where that is wide close below it.
  const float end = view.x + std::min(view.width, free_width) - 16 * u;
  const bool low_by_far = view.height < 200 * u && !card.empty(), beside = low_by_far && end - card.right() > 208 * u;
  const float x = beside ? card.right() + 8 * u : view.x + 16 * u, wide = std::min(344 * u, end - x);
  if (next < 0 || wide < 120 * u) return true;
  const Step& step = steps.steps()[static_cast<std::size_t>(next)];
  int possible = 0, number = 0;
  for (int n = 0; n < static_cast<int>(steps.steps().size()); ++n) {
    possible += steps.steps()[static_cast<std::size_t>(n)].possible ? 1 : 0;
    if (n == next) number = possible;
  }
  const std::string name = step.name(), how = capital(step.how());
  // In a low picture its name alone, until that is pressed: what is to be done is over what lies there.
  const bool low = view.height < 360 * u, folded = low && !unfolded;
  const float text_wide = wide - 32 * u;
  const float high =
      folded ? kTile * u
             : std::min(52 * u + ImGui::CalcTextSize(how.c_str(), nullptr, false, text_wide).y, view.height - 24 * u);
  const float foot = view.bottom() - (view.width > kNarrow * u ? 64 : 80) * u;
  const ScreenBox box{x,
                      beside       ? card.y
                      : low_by_far ? std::max(card.bottom() + 8 * u, foot - high)
                                   : foot - high,
                      wide, high};
  begin_card("first steps", box, {0, 0}, ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoFocusOnAppearing);
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const std::string count =
      filled(tr("{n} of {all}"), {{"n", std::to_string(number)}, {"all", std::to_string(possible)}});
  // How far one is goes before the name does.
  const float name_wide = bold_font()->CalcTextSizeA(kLineEm * em(), FLT_MAX, 0, name.c_str()).x;
  float count_wide = ImGui::CalcTextSize(count.c_str()).x;
  const bool counted = name_wide <= wide - 80 * u - count_wide;
  if (!counted) count_wide = 0;
  const float title_y = box.y + (folded ? 10 : 12) * u;
  ImGui::SetCursorScreenPos({box.x, box.y});
  if (low && ImGui::InvisibleButton("unfold", {wide - 48 * u, kTile * u})) unfolded = !unfolded;
  fitted_text(draw, {box.x + 16 * u, title_y, wide - 80 * u - count_wide, ImGui::GetFontSize()}, em(), theme().text,
              name, false, true);
  if (counted) draw->AddText({box.right() - 48 * u - count_wide, title_y}, im_colour32(theme().quiet), count.c_str());
  ImGui::SetCursorScreenPos({box.right() - 40 * u, box.y + (folded ? 4 : 6) * u});
  const bool closed = ImGui::InvisibleButton("close", {32 * u, 32 * u});
  draw_icon(draw, {box.right() - 34 * u, title_y}, 20 * u, "x", im_colour32(theme().quiet));
  if (!folded)
    draw->AddText(ImGui::GetFont(), ImGui::GetFontSize(), {box.x + 16 * u, box.y + 38 * u}, im_colour32(theme().text),
                  how.c_str(), nullptr, text_wide);
  ImGui::End();
  return !closed;
}

void draw_wheel(const ToolWheel& wheel) {
  if (!wheel.open()) return;
  ImDrawList* const draw = ImGui::GetForegroundDrawList();
  const float e = em(), inner = ToolWheel::kInnerEm * e, outer = ToolWheel::kOuterEm * e;
  const ImVec2 middle{wheel.x(), wheel.y()};
  const auto items = wheel_items();
  const float step = 2 * std::numbers::pi_v<float> / static_cast<float>(items.size());
  draw->AddCircleFilled(middle, outer, im_colour32(theme().ground, 0.92F), 64);
  for (std::size_t n = 0; n < items.size(); ++n) {
    const float angle = step * static_cast<float>(n) - std::numbers::pi_v<float> / 2;
    const bool chosen = static_cast<int>(n) == wheel.chosen();
    if (chosen) {
      draw->PathArcTo(middle, (inner + outer) / 2, angle - step / 2, angle + step / 2, 24);
      draw->PathStroke(im_colour32(theme().accent, 0.5F), ImDrawFlags_None, outer - inner);
    }
    const float edge = angle + step / 2;
    draw->AddLine({middle.x + inner * std::cos(edge), middle.y + inner * std::sin(edge)},
                  {middle.x + outer * std::cos(edge), middle.y + outer * std::sin(edge)}, im_colour32(theme().quiet),
                  1);
    const float r = outer * 0.68F, wide = 5.6F * e;
    const ScreenBox box{middle.x + r * std::cos(angle) - wide / 2, middle.y + r * std::sin(angle) - e * 1.1F, wide,
                        e * 1.2F};
    fitted_text(draw, box, e * (chosen ? 1.15F : 1), theme().text, tr(items[n].word), true);
    fitted_text(draw, {box.x, box.bottom(), wide, e * 1.1F}, e * kLabelEm, theme().quiet,
                key_name(items[n].command, items[n].value), true);
  }
  draw->AddCircle(middle, outer, im_colour32(theme().quiet), 64, 1.5F);
  draw->AddCircleFilled(middle, inner, im_colour32(theme().raised), 32);
}

int draw_question(int width, int height, const std::string& title, const std::string& text, const std::string& yes) {
  const std::string texts[] = {text}, answers[] = {tr("no (Esc)"), yes + " (Enter)"};
  static constexpr int kSaid[] = {0, -1, 1};
  return kSaid[1 + kit_dialog({0, 0, static_cast<float>(width), static_cast<float>(height)}, title, texts, answers)];
}

}  // namespace osteo::inline app
