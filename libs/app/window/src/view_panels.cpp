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

// Of so many buttons in a row, each.
float share_of_row(int buttons) {
  const float gap = ImGui::GetStyle().ItemSpacing.x;
  return std::floor((ImGui::GetContentRegionAvail().x - gap * static_cast<float>(buttons - 1)) /
                    static_cast<float>(buttons));
}

}  // namespace

void draw_state(const ScreenBox& box, const ScreenBox& view, const StateFacts& f, const std::optional<Message>& message,
                Pressed& pressed) {
  ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 0);
  begin_fixed("state", box, ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoScrollWithMouse);
  ImGui::PopStyleVar();
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const Theme& t = theme();
  const float u = unit(), label = kLabelEm * em();
  const float top = box.y + 8 * u, big = box.y + 26 * u, row = 32 * u;
  float x = box.x + 16 * u;
  const auto figure = [&](const std::string& name, const std::string& value, float wide) {
    fitted_text(draw, {x, top, wide - 8 * u, 18 * u}, label, t.quiet, name);
    fitted_text(draw, {x, big, wide - 8 * u, row}, kBoldEm * em(), t.text, value, false, true);
    x += wide;
  };
  figure(tr("Force"), f.force, 96 * u);
  const float bar = 3 * u, force_x = box.x + 16 * u;
  draw->AddRectFilled({force_x, box.bottom() - 2 * bar}, {force_x + 80 * u, box.bottom() - bar}, im_colour32(t.raised));
  draw->AddRectFilled({force_x, box.bottom() - 2 * bar},
                      {force_x + 80 * u * static_cast<float>(f.force_share), box.bottom() - bar},
                      im_colour32(f.force_share < 1 ? t.text : palette::kVermillion));
  figure(tr("Burr, rpm"), f.turning ? f.speed.substr(0, f.speed.find(' ')) : "0", 104 * u);
  figure(tr("Bone below"), f.under, 112 * u);

  // From the right: the button, time and volume. What is left is the structure's and the message's.
  const float end_wide = std::max(72 * u, button_width(tr("End"))), right = box.right() - 16 * u;
  const float time_wide = 96 * u, time_x = right - end_wide - 16 * u - time_wide;
  const auto flush_right = [&](float y, float high, const std::string& words, Colour colour) {
    const std::string shown = shortened(words, time_wide, kLineEm * label);
    const float wide = ImGui::GetFont()->CalcTextSizeA(kLineEm * label, FLT_MAX, 0, shown.c_str()).x;
    fitted_text(draw, {time_x + time_wide - wide, y, wide + 1, high}, label, colour, shown);
  };
  flush_right(box.y + 12 * u, 18 * u, f.time, t.text);
  flush_right(box.y + 34 * u, 18 * u, f.removed, t.quiet);
  ImGui::SetCursorScreenPos({right - end_wide, box.y + 12 * u});
  if (kit_button(tr("End"), ButtonLook::usual, end_wide)) pressed.press(Command::quit);

  const float rest = time_x - 16 * u - x, chip_least = 176 * u;
  const bool inside = rest >= 264 * u + 24 * u + chip_least;
  const float near_wide =
      std::max(0.0F, std::min(inside ? 344 * u : 10000 * u, inside ? rest - 24 * u - chip_least : rest));
  const ScreenBox near{x, box.y + 6 * u, std::min(near_wide, 400 * u), 52 * u};
  const NearnessLook& look = look_of(f.nearness);
  const bool contact = f.nearness == Nearness::touched;
  if (contact)  // as large as it can be
    draw->AddRectFilled({near.x - 8 * u, near.y - 2 * u}, {near.right() + 4 * u, near.bottom() + 2 * u},
                        im_colour32(look.colour), kRound * u);
  const Colour ink = contact ? Colour{0, 0, 0} : t.text;
  const bool is_near = !f.distance.empty() && f.nearness != Nearness::far;
  std::string words = is_near ? f.distance + " " + tr(look.word) : f.distance;
  ImFont* const bold = bold_font();
  const float said = words.empty() ? 0 : bold->CalcTextSizeA(ImGui::GetFontSize(), FLT_MAX, 0, words.c_str()).x;
  const float name_wide = near.width - said - (words.empty() ? 0 : 34 * u);
  const std::string name = f.structure + (f.warmth.empty() ? "" : ", " + f.warmth);
  if (name_wide > 24 * u)
    fitted_text(draw, {near.x, near.y + 2 * u, name_wide, 22 * u}, em(), f.distance.empty() ? t.quiet : ink, name);
  if (!words.empty()) {
    if (is_near)
      draw_sign(draw, {near.right() - said - 14 * u, near.y + 13 * u}, 8 * u, look.corners,
                contact ? ink : look.colour);
    draw->AddText(bold, ImGui::GetFontSize(), {near.right() - said, near.y + 2 * u}, im_colour32(ink), words.c_str());
  }
  const float bar_y = near.y + 34 * u;
  draw->AddRectFilled({near.x, bar_y}, {near.right(), bar_y + 8 * u}, im_colour32(contact ? Colour{0, 0, 0} : t.raised),
                      4 * u);
  if (f.near_share > 0) {
    const float full = near.x + std::max(8 * u, near.width * static_cast<float>(f.near_share));
    draw->AddRectFilled({near.x, bar_y}, {full, bar_y + 8 * u}, im_colour32(is_near ? look.colour : t.quiet), 4 * u);
    if (is_near && contrast(look.colour, t.surface) < 3)  // on a light ground it has a dark edge
      draw->AddRect({near.x, bar_y}, {full, bar_y + 8 * u}, im_colour32(t.text), 4 * u, 0, 1.5F * u);
  }

  // One place for words.
  if (message) {
    static constexpr ChipLook kLooks[] = {
        {palette::kSkyBlue, 0, false}, {palette::kYellow, 3, false}, {palette::kVermillion, 8, true}};
    const ChipLook chip = kLooks[static_cast<std::size_t>(message->rank)];
    const std::string& reported = message->text;
    const float wide = chip_width(reported);
    const float room = time_x - 16 * u - near.right() - 24 * u;
    if (inside && wide <= room) {
      draw_chip(draw, {near.right() + 24 * u, box.y + 16 * u, wide, 32 * u}, reported, chip);
    } else {
      // Beside the scale bar's box, or in a small picture above it; in two lines where one is too short.
      const bool beside = view.width > 720 * u;
      const float most = view.width - (beside ? 352 : 32) * u, high = (wide > most ? 48 : 32) * u;
      const float foot = view.bottom() - (beside ? 8 : 88) * u;
      const ScreenBox at{view.x + 16 * u, foot - high, std::min(wide, most), high};
      if (at.width > 64 * u) draw_chip(ImGui::GetBackgroundDrawList(), at, reported, chip);
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
  const char* const no_second = tr("no second hand: start with --dust");
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

ScreenBox draw_burr_card(const ScreenBox& view, float free_width, const HandFacts& hand, bool& unfolded,
                         Pressed& pressed) {
  const float u = unit(), pad = 12 * u, size = 40 * u, line = 48 * u;
  const Burr& burr = burr_library()[static_cast<std::size_t>(hand.burr)];
  const bool held = hand.tool == 0 && !hand.saw;
  std::vector<std::string> kinds;
  for (const BurrKindRow& k : kBurrKinds) {
    kinds.push_back(capital(tr(std::string(k.name))));
  }
  float kinds_wide = 0;
  for (const std::string& k : kinds) kinds_wide += ImGui::CalcTextSize(k.c_str()).x + 24 * u;
  const float sizes = 7 * size, chevron = 32 * u;
  const float one_row = 2 * pad + kinds_wide + 12 * u + sizes + chevron;
  const bool rows = one_row > std::min(free_width, view.width) - 32 * u;
  const float wide = rows ? 2 * pad + std::max(sizes, kinds_wide + chevron) : one_row;
  const ScreenBox box{view.x + 16 * u, view.y + 16 * u, wide,
                      (rows ? 2 : 1) * line + 16 * u + (unfolded ? 2 * line : 0)};
  if (box.width > view.width - 16 * u || box.height > view.height) return {};
  begin_card("burr", box, {0, 0}, ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoScrollWithMouse);
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  ImGui::SetCursorScreenPos({box.x + pad, box.y + 12 * u});
  if (const int kind = choice("kind", kinds, held ? static_cast<int>(burr.kind) : -1); kind >= 0)
    pressed.press(Command::burr_kind, kind);
  float x = rows ? box.x + pad : box.x + pad + kinds_wide + 12 * u;
  const float y = rows ? box.y + 8 * u + line : box.y + 8 * u;
  constexpr float kPixelsPerMm = 96 / 25.4F;
  for (int d = 1; d <= 7; ++d, x += size) {
    ImGui::SetCursorScreenPos({x, y});
    const std::string name = std::to_string(d);
    const bool clicked = ImGui::InvisibleButton(name.c_str(), {size, line});
    const bool hovered = ImGui::IsItemHovered();
    const ImVec2 lo{x, y}, hi{x + size, y + line};
    const bool is = held && std::lround(burr.diameter_mm) == d;
    if (is || hovered) draw->AddRectFilled(lo, hi, im_colour32(theme().raised), kRound * u);
    if (is) draw->AddRect(lo, hi, im_colour32(theme().accent), kRound * u, 0, 2 * u);
    const float radius = static_cast<float>(d) * kPixelsPerMm * u / 2;
    draw_burr(draw, {x + size / 2, y + 18 * u}, radius, kBurrKinds[static_cast<std::size_t>(burr.kind)], u);
    fitted_text(draw, {lo.x, y + line - 17 * u, size, 16 * u}, kLabelEm * em(), is ? theme().text : theme().quiet, name,
                true);
    if (clicked) pressed.press(Command::diameter, d);
    if (hovered) ImGui::SetTooltip("%d mm   %d", d, d);
  }
  ImGui::SetCursorScreenPos({box.right() - pad - chevron + 4 * u, rows ? box.y + 16 * u : box.y + 16 * u});
  if (ImGui::InvisibleButton("more", {chevron, chevron})) unfolded = !unfolded;
  draw_icon(draw, {box.right() - pad - 24 * u, box.y + 20 * u}, 24 * u, "chevron-down", im_colour32(theme().quiet));
  if (unfolded) {
    ImGui::SetCursorScreenPos({box.x + pad, y + line + 4 * u});
    const std::string shapes[] = {tr("Ball"), tr("Cylinder"), tr("Taper")};
    static constexpr Command kCommands[] = {Command::ball, Command::cylinder, Command::taper};
    if (const int shape = choice("shape", shapes, static_cast<int>(burr.shape)); shape >= 0)
      pressed.press(kCommands[shape]);
    ImGui::SetCursorScreenPos({box.x + pad, y + 2 * line});
    // A quarter a step, as its keys do.
    ImGui::SetCursorScreenPos({box.x + pad, y + 2 * line + 10 * u});
    ImGui::TextDisabled("%s", tr_of("of the burr", "Speed"));
    ImGui::SetCursorScreenPos({box.x + pad + ImGui::GetItemRectSize().x + 12 * u, y + 2 * line});
    static const std::string kSpeeds[] = {"25", "50", "75", "100 %"};
    const int now = static_cast<int>(std::lround(4 * hand.burr_share)) - 1;
    if (const int speed = choice("speed", kSpeeds, now); speed >= 0) {
      for (int n = now; n != speed; n += speed > now ? 1 : -1) pressed.press(Command::burr_speed, speed > now ? 1 : -1);
    }
  }
  ImGui::End();
  return box;
}

float draw_tool_card(const ScreenBox& view, const char* name, const std::string& title,
                     const std::function<void()>& content) {
  const float u = unit(), wide = std::min(312 * u, view.width - 32 * u);
  if (wide < 160 * u) return view.y;
  ImGui::SetNextWindowPos({view.x + 16 * u, view.y + 16 * u});
  ImGui::SetNextWindowSizeConstraints({wide, 0}, {wide, std::max(96 * u, view.height - 96 * u)});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, kCardRound * u);
  ImVec4 ground = im_colour(theme().surface, 0.94F);
  ImGui::PushStyleColor(ImGuiCol_WindowBg, ground);
  ImGui::Begin(name, nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize |
                   ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoBringToFrontOnFocus);
  ImGui::PopStyleColor();
  ImGui::PopStyleVar();
  ImGui::PushFont(bold_font());
  ImGui::SetWindowFontScale(1 / kBoldEm);
  ImGui::TextUnformatted(title.c_str());
  ImGui::SetWindowFontScale(1);
  ImGui::PopFont();
  content();
  const float bottom = ImGui::GetWindowPos().y + ImGui::GetWindowHeight();
  ImGui::End();
  return bottom;
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

bool draw_next_step(const ScreenBox& view, const FirstSteps& steps) {
  const int next = steps.next();
  const float u = unit(), wide = std::min(344 * u, view.width - 32 * u);
  if (next < 0 || wide < 200 * u || view.height < 320 * u) return true;
  const Step& step = steps.steps()[static_cast<std::size_t>(next)];
  int possible = 0, number = 0;
  for (int n = 0; n < static_cast<int>(steps.steps().size()); ++n) {
    possible += steps.steps()[static_cast<std::size_t>(n)].possible ? 1 : 0;
    if (n == next) number = possible;
  }
  const std::string name = step.name(), how = capital(step.how());
  const float high = 52 * u + ImGui::CalcTextSize(how.c_str(), nullptr, false, wide - 32 * u).y;
  const ScreenBox box{view.x + 16 * u, view.bottom() - 64 * u - high, wide, high};
  begin_card("first steps", box, {0, 0}, ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoFocusOnAppearing);
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  draw->AddText(bold_font(), ImGui::GetFontSize(), {box.x + 16 * u, box.y + 12 * u}, im_colour32(theme().text),
                name.c_str());
  const std::string count =
      filled(tr("{n} of {all}"), {{"n", std::to_string(number)}, {"all", std::to_string(possible)}});
  const float count_wide = ImGui::CalcTextSize(count.c_str()).x;
  draw->AddText({box.right() - 48 * u - count_wide, box.y + 12 * u}, im_colour32(theme().quiet), count.c_str());
  ImGui::SetCursorScreenPos({box.right() - 40 * u, box.y + 6 * u});
  const bool closed = ImGui::InvisibleButton("close", {32 * u, 32 * u});
  draw_icon(draw, {box.right() - 34 * u, box.y + 12 * u}, 20 * u, "x", im_colour32(theme().quiet));
  draw->AddText(ImGui::GetFont(), ImGui::GetFontSize(), {box.x + 16 * u, box.y + 38 * u}, im_colour32(theme().text),
                how.c_str(), nullptr, wide - 32 * u);
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
  const auto w = static_cast<float>(width), h = static_cast<float>(height);
  const float wide = std::min(w - em(), 28 * em());
  ImGui::SetNextWindowPos({std::floor((w - wide) / 2), std::floor(h / 3)});
  ImGui::SetNextWindowSize({wide, 0});
  ImGui::Begin(title.c_str(), nullptr,
               ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse);
  ImGui::TextWrapped("%s", text.c_str());
  ImGui::Dummy({0, em() * 0.4F});
  int answer = 0;
  const float half = share_of_row(2);
  if (ImGui::Button(tr("no (Esc)"), {half, 0})) answer = -1;
  ImGui::SameLine();
  ImGui::PushStyleColor(ImGuiCol_Border, im_colour(palette::kVermillion));
  if (ImGui::Button((yes + " (Enter)").c_str(), {half, 0})) answer = 1;
  ImGui::PopStyleColor();
  ImGui::End();
  return answer;
}

}  // namespace osteo::inline app
