#include "command_palette.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "osteo/core/base/translate.h"
#include "ui_kit.h"

namespace osteo::inline app {
namespace {

enum : int {
  kEscapeKey = 256,
  kEnter = 257,
  kBackspace = 259,
  kArrowDown = 264,
  kArrowUp = 265,
  kPageUp = 266,
  kPageDown = 267
};
enum : int { kFirstFunctionKey = 290, kKeypadEnter = 335 };
constexpr int kPage = 8;
constexpr float kListWide = 680, kField = 56, kFoot = 36, kHeading = 36, kLine = 40, kTwoLines = 60, kPad = 16;
constexpr float kTenWide = 352, kTenRow = 26, kTenKeys = 112, kTenTitle = 44, kMouse = 84, kTenFoot = 32;

void text_at(ImDrawList* draw, ImVec2 at, Colour colour, const std::string& words, bool bold = false) {
  draw->AddText(bold ? bold_font() : ImGui::GetFont(), ImGui::GetFontSize(), {std::floor(at.x), std::floor(at.y)},
                im_colour32(colour), words.c_str());
}

float wide_of(const std::string& words) {
  return ImGui::CalcTextSize(words.c_str()).x;
}

// The mouse, and what its parts do, as far as `right`.
void draw_mouse(ImDrawList* draw, float x, float y, float right, float u) {
  const ImU32 ink = im_colour32(theme().quiet), strong = im_colour32(theme().text);
  const float wide = 40 * u, high = 60 * u, thick = std::max(1.0F, 2 * u);
  draw->AddRect({x, y}, {x + wide, y + high}, ink, 20 * u, 0, thick);
  draw->AddLine({x, y + 26 * u}, {x + wide, y + 26 * u}, ink, thick);
  draw->AddLine({x + wide / 2, y}, {x + wide / 2, y + 26 * u}, ink, thick);
  draw->AddRectFilled({x + wide / 2 - 4 * u, y + 6 * u}, {x + wide / 2 + 4 * u, y + 20 * u}, strong, 4 * u);
  const float words = x + wide + 16 * u;
  const auto line = [&](float top, const char* text) {
    fitted_text(draw, {words, top, right - words, ImGui::GetFontSize()}, em(), theme().text, text);
  };
  line(y - 4 * u, tr("Wheel zooms"));
  line(y + 20 * u, tr("Right drag turns the view"));
  line(y + 44 * u, tr("Alt-right drag tilts the drill"));
}

}  // namespace

std::vector<TenKeysRow> ten_keys() {
  const std::string sizes = filled(
      tr("{first} to {last}"), {{"first", key_name(Command::diameter, 1)}, {"last", key_name(Command::diameter, 7)}});
  return {{tr("left button"), tr("drills while held")},
          {tr("Shift-wheel"), tr("deeper, back")},
          {key_name(Command::bring), tr("approach the bone")},
          {key_name(Command::lift), tr("retract, out of the bone")},
          {sizes, tr("burr size, mm")},
          {key_name(Command::suck), tr("suction, while held")},
          {key_name(Command::irrigation), tr("irrigation on, off")},
          {key_name(Command::undo), tr("undo")},
          {key_name(Command::before), tr("compare with the start")},
          {key_name(Command::palette), tr("all commands")}};
}

void CommandPalette::show(Shown what) {
  shown_ = what;
  search_.clear();
  if (!opens_) pressed_.clear();
  opens_ = false;
  scroll_ = 0;
  shown_chosen_ = 0;
}

void CommandPalette::help() {
  show(shown_ == Shown::nothing ? Shown::ten_keys : shown_ == Shown::ten_keys ? Shown::all : Shown::nothing);
}

void CommandPalette::key(int code, int modifiers) {
  if (!typing() && !opens_ && code == 'K' && (modifiers & kWithCtrl) != 0) {
    opens_ = true;
    pressed_.clear();
  } else if (typing() || opens_) {
    pressed_.push_back({code, modifiers, 0});
  }
}

void CommandPalette::letter(char32_t letter) {
  if (typing() || opens_) pressed_.push_back({0, 0, letter});
}

// True: Enter was among them.
bool CommandPalette::take_keys() {
  bool run = false;
  for (const Pressed& p : std::exchange(pressed_, {})) {
    if (run) break;
    if (p.letter != 0) {
      search_.type(p.letter);
      continue;
    }
    switch (p.code) {
      case kEnter:
      case kKeypadEnter:
        run = true;
        break;
      case kEscapeKey:
      case kFirstFunctionKey:
        show(Shown::nothing);
        return false;
      case 'K':
        if ((p.modifiers & kWithCtrl) == 0) break;
        show(Shown::nothing);
        return false;
      case kBackspace:
        search_.erase();
        break;
      case kArrowDown:
      case kArrowUp:
        search_.move(p.code == kArrowDown ? 1 : -1);
        break;
      case kPageDown:
      case kPageUp:
        search_.move(p.code == kPageDown ? kPage : -kPage);
        break;
      default:
        break;
    }
  }
  return run;
}

const CommandRow* CommandPalette::draw(const ScreenBox& window, const ScreenBox& view) {
  if (shown_ == Shown::ten_keys) draw_ten_keys(view);
  opens_ = false;  // what was to open it has been looked at
  if (!typing()) return nullptr;
  const bool run = take_keys();
  // Above the state: a contact stays visible.
  return typing() ? draw_list({window.x, window.y, window.width, view.bottom() - window.y}, run) : nullptr;
}

std::vector<CommandPalette::Line> CommandPalette::lines(float wide) const {
  const float u = unit();
  std::vector<Line> all;
  const auto& found = search_.found();
  const bool grouped = shown_ == Shown::all && search_.text().empty();
  for (std::size_t n = 0; n < found.size(); ++n) {
    if (grouped && (n == 0 || found[n]->group != found[n - 1]->group))
      all.push_back({nullptr, 0, tr(found[n]->group), kHeading * u});
    // A name that is longer than a line has two, and the keys one below.
    const std::string name = shown_name(*found[n]), keys = shown_keys(*found[n]);
    const bool two = wide_of(name) + wide_of(keys) + 24 * u > wide;
    const float tall = ImGui::CalcTextSize(name.c_str(), nullptr, false, wide - 24 * u).y;
    const float more = tall - ImGui::GetFontSize() - (keys.empty() ? 20 * u : 0);
    all.push_back({found[n], n, {}, (two ? kTwoLines * u + more : kLine * u)});
  }
  return all;
}

const CommandRow* CommandPalette::draw_list(const ScreenBox& window, bool run) {
  const float u = unit(), pad = kPad * u, wide = std::min(kListWide * u, window.width - 2 * pad);
  const float inner = wide - 2 * pad - 24 * u;
  const std::vector<Line> all = lines(inner);
  float tall = 0;
  for (const Line& l : all) tall += l.high;
  const float least = kLine * u, fixed = (kField + kFoot) * u;
  const float most =
      std::max(least, std::min(window.height - 2 * pad - fixed, shown_ == Shown::all ? 1e6F : 9 * kLine * u));
  const float list = std::clamp(tall, least, most);
  const ScreenBox box{std::floor(window.x + (window.width - wide) / 2),
                      std::floor(window.y + std::min(96 * u, (window.height - fixed - list) / 2)), wide, fixed + list};
  // In front of all cards.
  ImGui::SetNextWindowFocus();
  ImGui::SetNextWindowPos({box.x, box.y});
  ImGui::SetNextWindowSize({box.width, box.height});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 0);
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {0, 0});
  ImGui::Begin("commands", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoBackground |
                   ImGuiWindowFlags_NoScrollWithMouse | ImGuiWindowFlags_NoNav);
  ImGui::PopStyleVar(2);
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const Theme& t = theme();
  draw->AddRectFilled({box.x, box.y}, {box.right(), box.bottom()}, im_colour32(t.surface), kCardRound * u);
  draw->AddRect({box.x, box.y}, {box.right(), box.bottom()}, im_colour32(t.line), kCardRound * u, 0, std::max(1.0F, u));
  // The field.
  const float line = ImGui::GetFontSize(), text_y = box.y + (kField * u - line) / 2;
  draw_icon(draw, {box.x + pad, box.y + 16 * u}, 24 * u, "search", im_colour32(t.quiet));
  const std::string& text = search_.text();
  const float text_x = box.x + pad + 36 * u;
  const std::string shown = shortened(text, box.right() - pad - text_x, line);
  text_at(draw, {text_x, text_y}, text.empty() ? t.quiet : t.text,
          text.empty() ? tr("Name of a command, or what it does") : shown);
  if (std::fmod(ImGui::GetTime(), 1.0) < 0.6 || text.empty())
    draw->AddRectFilled({text_x + (text.empty() ? -3 * u : wide_of(shown) + u), text_y},
                        {text_x + (text.empty() ? -u : wide_of(shown) + 3 * u), text_y + line}, im_colour32(t.accent));
  const float top = box.y + kField * u, bottom = top + list;
  draw->AddLine({box.x, top}, {box.right(), top}, im_colour32(t.line, 0.6F), std::max(1.0F, u));
  // What the keys choose comes into sight; the wheel goes where it wants.
  float at = 0;
  for (const Line& l : all) {
    if (l.row != nullptr && l.found == search_.chosen() && shown_chosen_ != search_.chosen()) {
      scroll_ = std::clamp(scroll_, at + l.high - list, l.found == 0 ? 0 : at);
      shown_chosen_ = search_.chosen();
    }
    at += l.high;
  }
  scroll_ = std::clamp(scroll_ - 2 * kLine * u * ImGui::GetIO().MouseWheel, 0.0F, std::max(0.0F, tall - list));
  const CommandRow* done = run ? search_.row() : nullptr;
  if (all.empty())
    text_at(draw, {box.x + pad + 12 * u, top + (list - line) / 2}, t.quiet, tr("No command has such a name"));
  ImGui::PushClipRect({box.x, top}, {box.right(), bottom}, true);
  float y = top - scroll_;
  for (const Line& l : all) {
    const float from = y;
    y += l.high;
    if (y < top || from > bottom) continue;
    if (l.row == nullptr) {
      text_at(draw, {box.x + pad + 12 * u, y - line - 4 * u}, t.quiet, l.heading);
      continue;
    }
    // As far as it is in sight.
    const float seen = std::max(from, top);
    ImGui::SetCursorScreenPos({box.x + pad, seen});
    ImGui::PushID(static_cast<int>(l.found));
    if (ImGui::InvisibleButton("row", {wide - 2 * pad, std::max(1.0F, std::min(y, bottom) - seen)})) done = l.row;
    const bool hovered = ImGui::IsItemHovered(), chosen = l.found == search_.chosen();
    ImGui::PopID();
    if (hovered && (ImGui::GetIO().MouseDelta.x != 0 || ImGui::GetIO().MouseDelta.y != 0))
      search_.choose(shown_chosen_ = l.found);
    const ImVec2 lo{box.x + pad, from}, hi{box.right() - pad, y};
    if (chosen) {
      draw->AddRectFilled(lo, hi, im_colour32(t.raised), kRound * u);
      draw->AddRectFilled({lo.x, lo.y + 8 * u}, {lo.x + 4 * u, hi.y - 8 * u}, im_colour32(t.accent), 2 * u);
    }
    const bool two = l.high > kLine * u + 1;
    draw->AddText(ImGui::GetFont(), line,
                  {std::floor(lo.x + 12 * u), std::floor(two ? from + 8 * u : from + (l.high - line) / 2)},
                  im_colour32(t.text), shown_name(*l.row).c_str(), nullptr, inner - 24 * u);
    const std::string keys = shown_keys(*l.row);
    text_at(draw, {hi.x - 12 * u - wide_of(keys), two ? y - line - 8 * u : from + (l.high - line) / 2}, t.quiet, keys);
  }
  ImGui::PopClipRect();
  if (tall > list) {  // how far down one is
    const float length = std::max(24 * u, list * list / tall), down = (list - length) * scroll_ / (tall - list);
    draw->AddRectFilled({box.right() - 8 * u, top + down}, {box.right() - 4 * u, top + down + length},
                        im_colour32(t.line), 2 * u);
  }
  draw->AddLine({box.x, bottom}, {box.right(), bottom}, im_colour32(t.line, 0.6F), std::max(1.0F, u));
  fitted_text(draw, {box.x + pad + 12 * u, bottom, wide - 2 * pad - 120 * u, kFoot * u}, kLabelEm * em(), t.quiet,
              tr("Up, Down choose    Enter does it    Esc closes"));
  const std::string count = filled(tr("{n} of {all}"), {{"n", std::to_string(search_.found().size())},
                                                        {"all", std::to_string(command_rows().size())}});
  text_at(draw, {box.right() - pad - 12 * u - wide_of(count), bottom + (kFoot * u - line) / 2}, t.quiet, count);
  ImGui::End();
  if (done != nullptr) show(Shown::nothing);
  return done;
}

float CommandPalette::card_width() {
  return kTenWide * unit();
}

void CommandPalette::draw_ten_keys(const ScreenBox& view) {
  const float u = unit(), wide = std::min(kTenWide * u, view.width - 32 * u);
  const auto count = static_cast<float>(ten_keys().size());
  // Above the place of messages at the foot of a narrow window.
  const float foot = 64 * u, most = view.height - foot - 8 * u, without = (kTenTitle + kTenFoot) * u;
  const bool mouse = most > without + (kMouse + count * kTenRow) * u;
  const float row = std::min(kTenRow * u, (most - without) / count);
  if (row < 18 * u || wide < 240 * u) return show(Shown::all);  // no room: the list can be scrolled
  const float high = without + count * row + (mouse ? kMouse * u : 0);
  const ScreenBox box{view.x + 16 * u, view.bottom() - foot - high, wide, high};
  begin_card("ten keys", box, {0, 0}, ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoFocusOnAppearing);
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const Theme& t = theme();
  text_at(draw, {box.x + 16 * u, box.y + 12 * u}, t.text, tr("Ten keys"), true);
  ImGui::SetCursorScreenPos({box.right() - 40 * u, box.y + 6 * u});
  const bool closed = ImGui::InvisibleButton("close", {32 * u, 32 * u});
  draw_icon(draw, {box.right() - 34 * u, box.y + 12 * u}, 20 * u, "x", im_colour32(t.quiet));
  float y = box.y + kTenTitle * u;
  if (mouse) {
    draw_mouse(draw, box.x + 24 * u, y + 8 * u, box.right() - 12 * u, u);
    y += kMouse * u;
  }
  const float line = ImGui::GetFontSize();
  for (const TenKeysRow& r : ten_keys()) {
    const float key_wide = kLineEm * kLabelEm * em() / line * wide_of(r.keys);
    const ScreenBox cap{box.x + 16 * u + kTenKeys * u - key_wide - 12 * u, y + (row - 24 * u) / 2, key_wide + 12 * u,
                        24 * u};
    draw->AddRectFilled({cap.x, cap.y}, {cap.right(), cap.bottom()}, im_colour32(t.raised), 6 * u);
    fitted_text(draw, cap, kLabelEm * em(), t.text, r.keys, true);
    const float text_x = box.x + (16 + kTenKeys + 12) * u;
    fitted_text(draw, {text_x, y + (row - line) / 2, box.right() - 12 * u - text_x, line}, em(), t.text, r.text);
    y += row;
  }
  text_at(draw, {box.x + 16 * u, box.bottom() - line - 8 * u}, t.quiet,
          filled(tr("{key} again: keys of all commands"), {{"key", key_name(Command::help)}}));
  ImGui::End();
  if (closed) show(Shown::nothing);
}

}  // namespace osteo::inline app
