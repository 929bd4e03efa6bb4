#include "keys.h"

#include <algorithm>
#include <utility>

namespace osteo {
namespace {

// GLFW's numbers for keys without a letter (GLFW 3, stable): letters and digits are their ASCII capitals.
enum : int {
  kSpace = 32,
  kEscape = 256,
  kEnter = 257,
  kTab = 258,
  kBackspace = 259,
  kDown = 264,
  kUp = 265,
  kHome = 268,
  kF1 = 290,
  kF2 = 291,
  kF3 = 292,
  kF4 = 293,
  kF5 = 294,
  kF6 = 295,
  kF7 = 296,
  kF8 = 297,
  kF9 = 298,
  kF10 = 299,
  kF11 = 300,
  kKeypad2 = 322,
  kKeypad4 = 324,
  kKeypad6 = 326,
  kKeypad8 = 328,
  kKeypadEnter = 335,
};

constexpr Key kKeys[] = {
    {'F', Command::bring},
    {'U', Command::lift},
    {kDown, Command::deeper, Key::When::repeated},
    {kUp, Command::back, Key::When::repeated},
    {kSpace, Command::drill},
    {'1', Command::diameter, Key::When::pressed, 1},
    {'2', Command::diameter, Key::When::pressed, 2},
    {'3', Command::diameter, Key::When::pressed, 3},
    {'4', Command::diameter, Key::When::pressed, 4},
    {'5', Command::diameter, Key::When::pressed, 5},
    {'6', Command::diameter, Key::When::pressed, 6},
    {'7', Command::diameter, Key::When::pressed, 7},
    {'C', Command::cutting},
    {'D', Command::diamond},
    {'B', Command::ball},
    {'Y', Command::cylinder},
    {'T', Command::taper},
    {'V', Command::suck, Key::When::held},
    {'I', Command::wash, Key::When::held},
    {'X', Command::saw},
    {'P', Command::pieces},
    {'L', Command::plates},
    {'A', Command::turn_left, Key::When::repeated},
    {'E', Command::turn_right, Key::When::repeated},
    {kEnter, Command::perform},
    {kKeypadEnter, Command::perform},
    {'Z', Command::undo},
    {kEscape, Command::put_away},
    {'M', Command::mark},
    {'S', Command::screenshot},
    {kF5, Command::save},
    {'R', Command::reset},
    {kHome, Command::home},
    {'N', Command::sound},
    {kF1, Command::help},
    {'H', Command::help},
    {'Q', Command::quit},
    {'J', Command::quality},
    {kF3, Command::cut_in_middle},
    {kF4, Command::cuts_along_tool},
    {'[', Command::magnify, Key::When::pressed, -1},
    {']', Command::magnify, Key::When::pressed, 1},
    {',', Command::focus, Key::When::repeated, -1},
    {'.', Command::focus, Key::When::repeated, 1},
    {'/', Command::autofocus},
    {';', Command::look_there},
    {'G', Command::look_at_drill},
    {'O', Command::guide_camera, Key::When::held},
    {kF6, Command::bookmark, Key::When::pressed, 0},
    {kF7, Command::bookmark, Key::When::pressed, 1},
    {kF8, Command::bookmark, Key::When::pressed, 2},
    {kBackspace, Command::camera_back},
    {kKeypad4, Command::orbit_left, Key::When::held},
    {kKeypad6, Command::orbit_right, Key::When::held},
    {kKeypad8, Command::orbit_up, Key::When::held},
    {kKeypad2, Command::orbit_down, Key::When::held},
    {'K', Command::second_hand},
    {kF2, Command::layout},
    {kF11, Command::full_screen},
    {kF10, Command::panel_keys},
    {kTab, Command::wheel},
    {kF9, Command::ruler},
    {'W', Command::before},
};

bool has(const std::vector<Command>& list, Command c) {
  return std::find(list.begin(), list.end(), c) != list.end();
}

}  // namespace

std::span<const Key> key_table() {
  return kKeys;
}

const Key* find_key(int code) {
  const auto* const at = std::find_if(std::begin(kKeys), std::end(kKeys), [&](const Key& k) { return k.code == code; });
  return at == std::end(kKeys) ? nullptr : at;
}

std::string key_name(Command command) {
  static const std::pair<int, const char*> kNames[] = {{kSpace, "Space"}, {kEscape, "Esc"}, {kEnter, "Enter"}, {kTab, "Tab"},
                                                       {kDown, "Down"},   {kUp, "Up"},      {kHome, "Home"}};
  for (const Key& key : kKeys) {
    if (key.command != command) continue;
    for (const auto& [code, name] : kNames) {
      if (code == key.code) return name;
    }
    if (key.code >= kF1 && key.code < kF1 + 12) return "F" + std::to_string(key.code - kF1 + 1);
    if (key.code > kSpace && key.code < 127) return {static_cast<char>(key.code)};
  }
  return {};
}

const std::vector<HelpLine>& help_lines() {
  using enum Command;
  static const std::vector<HelpLine> lines = {{"move", "moves the drill across the view", {}},
                                              {"F", "lifts the drill over to the bone under the mouse, drill off", {bring}},
                                              {"U", "lifts the drill out of the bone, drill off", {lift}},
                                              {"wheel, Up, Down, Shift-drag", "moves it deeper or back", {deeper, back}},
                                              {"left button, Space", "drills while held; Space: on and off", {drill}},
                                              {"right drag", "turns the view about its focus; with Shift rolls it", {}},
                                              {"middle drag", "shifts the view", {}},
                                              {"Ctrl-wheel", "magnifies; with Shift focuses deeper and back", {}},
                                              {"1 to 7, C, D", "burr: diameter, cutting, diamond", {diameter, cutting, diamond}},
                                              {"B, Y, T", "ball, cylinder, taper", {ball, cylinder, taper}},
                                              {"Tab", "wheel of tools: point or Up, Down; Tab, Enter or a click takes", {wheel}},
                                              {"V, I", "a sucker, or water, beside the burr", {suck, wash}},
                                              {"X", "saw: drag moves the plane, Shift-drag turns it, wheel: deeper", {saw}},
                                              {"P", "pieces: drag moves one, Shift-drag turns it, wheel: deeper", {pieces}},
                                              {"L", "plate in the hand, moved like the drill", {plates}},
                                              {"A, E", "turn the saw, the piece or the plate", {turn_left, turn_right}},
                                              {"Enter", "cut; take apart; fix the plate", {perform}},
                                              {"Z", "takes back the last stroke, cut, move, plate", {undo}},
                                              {"Esc", "back to the drill", {put_away}},
                                              {"W", "the bone as it was at the beginning, and as it is", {before}},
                                              {"F9", "ruler: two points on the bone, by clicks", {ruler}},
                                              {"M", "note pinned to the bone under the mouse; without text: marks this moment", {mark}},
                                              {"S", "screenshot with its caption into the session's folder", {screenshot}},
                                              {"F5", "saves the session and goes on", {save}},
                                              {"R", "asks; saves the session, and the bone is whole again", {reset}},
                                              {"Home", "view from the left", {home}},
                                              {"N", "sound on and off", {sound}},
                                              {"F2", "layout: panel and cuts beside, picture alone, four pictures", {layout}},
                                              {"F10", "keys move in the panel: arrows, Space; Esc gives them back", {panel_keys}},
                                              {"F11", "full screen, and back", {full_screen}},
                                              {"Ctrl +, Ctrl -, Ctrl 0", "size of text and panels; as the monitor has it", {}},
                                              {"F1, H", "shows this, and hides it", {help}},
                                              {"Q", "saves, ends the session and shows what was done", {quit}},
                                              {"J", "how the picture is drawn: auto, plain, calm, deep", {quality}},
                                              {"F3", "a cut takes the middle, and back", {cut_in_middle}},
                                              {"F4", "cuts along the tool, or along the body", {cuts_along_tool}},
                                              {"cuts: wheel, Ctrl-wheel", "scrolls; nearer and farther", {}},
                                              {"cuts: click, Shift-move", "looks there in all three", {}},
                                              {"cuts: left drag", "measures", {}},
                                              {"cuts: right drag, right click", "window and level; as they were", {}},
                                              {"cuts: middle drag, double click", "moves it; takes the middle, and back", {}},
                                              {"[, ]", "magnification, by its steps", {magnify}},
                                              {"comma, full stop, /", "focus back, deeper; on the bone in the middle", {focus, autofocus}},
                                              {"; (semicolon)", "looks at the bone under the mouse", {look_there}},
                                              {"G", "looks at the drill; with Shift along it", {look_at_drill}},
                                              {"O", "mouse or device move the camera; with Shift turn it", {guide_camera}},
                                              {"F6, F7, F8", "go to a kept view; with Shift keep this one", {bookmark}},
                                              {"keypad 4 6 8 2", "turn the view", {orbit_left, orbit_right, orbit_up, orbit_down}},
                                              {"Backspace", "takes back the camera's last move", {camera_back}},
                                              {"K", "second hand: sucker, water, probe, nothing", {second_hand}}};
  return lines;
}

void Keyboard::on(int code, Event event, bool shift) {
  const Key* const key = find_key(code);
  if (key == nullptr) return;
  if (event == Event::released) {
    std::erase(down_, key->command);
    return;
  }
  if (event == Event::pressed || key->when == Key::When::repeated) presses_.push_back({key->command, key->value, shift});
  if (!has(down_, key->command)) down_.push_back(key->command);
  if (!has(since_, key->command)) since_.push_back(key->command);
}

std::vector<Keyboard::Press> Keyboard::frame(bool ignore) {
  held_ = ignore ? std::vector<Command>{} : down_;
  for (const Command c : std::exchange(since_, {})) {
    if (!ignore && !has(held_, c)) held_.push_back(c);
  }
  std::vector<Press> presses = std::exchange(presses_, {});
  if (ignore) presses.clear();
  return presses;
}

bool Keyboard::held(Command command) const {
  return has(held_, command);
}

}  // namespace osteo
