#include "keys.h"

#include <algorithm>
#include <utility>

#include "osteo/simulation/bone/burr_kind.h"

namespace osteo::inline app {
namespace {

// GLFW's numbers for keys without a letter (GLFW 3, stable): letters and digits are their ASCII capitals.
enum : int {
  kSpace = 32,
  kKeyEscape = 256,
  kEnter = 257,
  kTab = 258,
  kBackspace = 259,
  kInsert = 260,
  kRight = 262,
  kLeft = 263,
  kDown = 264,
  kUp = 265,
  kPageUp = 266,
  kPageDown = 267,
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
  kKeypad0 = 320,
  kKeypad2 = 322,
  kKeypad4 = 324,
  kKeypad5 = 325,
  kKeypad6 = 326,
  kKeypad7 = 327,
  kKeypad8 = 328,
  kKeypad9 = 329,
  kKeypadPoint = 330,
  kKeypadEnter = 335,
};

constexpr Key kFixedKeys[] = {
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
    {'B', Command::ball},
    {'Y', Command::cylinder},
    {'T', Command::taper},
    {'V', Command::suck, Key::When::held},
    {'I', Command::irrigation},
    {'X', Command::saw},
    {'P', Command::pieces},
    {'L', Command::plates},
    {'A', Command::turn_left, Key::When::repeated},
    {'E', Command::turn_right, Key::When::repeated},
    {kEnter, Command::perform},
    {kKeypadEnter, Command::perform},
    {'Z', Command::undo},
    {'Z', Command::undo, Key::When::pressed, 0, kWithCtrl},
    {kKeyEscape, Command::put_away},
    {'M', Command::mark},
    {'S', Command::screenshot},
    {kF5, Command::save},
    {'R', Command::reset},
    {kHome, Command::home},
    {'N', Command::sound},
    {kF1, Command::help},
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
    {kF10, Command::settings},
    {kTab, Command::focus_next},
    {kTab, Command::wheel, Key::When::pressed, 0, kWithCtrl},
    {'K', Command::palette, Key::When::pressed, 0, kWithCtrl},
    {kF9, Command::ruler},
    {'W', Command::before},
    {kLeft, Command::tilt, Key::When::repeated, 0, kWithAlt},
    {kRight, Command::tilt, Key::When::repeated, 1, kWithAlt},
    {kUp, Command::tilt, Key::When::repeated, 2, kWithAlt},
    {kDown, Command::tilt, Key::When::repeated, 3, kWithAlt},
    {kPageUp, Command::roll, Key::When::repeated, -1},
    {kPageDown, Command::roll, Key::When::repeated, 1},
    {kKeypad7, Command::roll, Key::When::repeated, -1},
    {kKeypad9, Command::roll, Key::When::repeated, 1},
    {kInsert, Command::straight},
    {kKeypad5, Command::straight},
    {'\'', Command::clutch, Key::When::held},
    {kKeypad0, Command::clutch, Key::When::held},
    {'\\', Command::wrist_rest, Key::When::held},
    {kKeypadPoint, Command::wrist_rest, Key::When::held},
    {'`', Command::second_mouse, Key::When::held},
    {'-', Command::motion, Key::When::pressed, -1},
    {'=', Command::motion, Key::When::pressed, 1},
    {'9', Command::burr_speed, Key::When::pressed, -1},
    {'0', Command::burr_speed, Key::When::pressed, 1},
    {'H', Command::hand_page, Key::When::pressed, 0, kWithAlt},
    {'T', Command::timeline, Key::When::pressed, 0, kWithCtrl},
    {kLeft, Command::earlier, Key::When::repeated},
    {kRight, Command::later, Key::When::repeated},
    {'H', Command::hints, Key::When::pressed, 0, kWithCtrl},
    {'N', Command::monitor, Key::When::pressed, 0, kWithCtrl},
    {'M', Command::mute_monitor, Key::When::pressed, 0, kWithCtrl},
    {'L', Command::regions, Key::When::pressed, 0, kWithCtrl},
    {'G', Command::lead, Key::When::pressed, 0, kWithCtrl},
};

const std::vector<Key>& all_keys() {
  static const std::vector<Key> keys = [] {
    std::vector<Key> all(std::begin(kFixedKeys), std::end(kFixedKeys));
    for (std::size_t n = 0; n < kBurrKinds.size(); ++n)
      all.push_back({kBurrKinds[n].key, Command::burr_kind, Key::When::pressed, static_cast<int>(n)});
    return all;
  }();
  return keys;
}

bool has(const std::vector<Command>& list, Command c) {
  return std::find(list.begin(), list.end(), c) != list.end();
}

}  // namespace

std::span<const Key> key_table() {
  return all_keys();
}

const Key* find_key(int code, int modifiers) {
  const auto with = [&](int wanted) -> const Key* {
    const auto& keys = all_keys();
    const auto at =
        std::find_if(keys.begin(), keys.end(), [&](const Key& k) { return k.code == code && k.with == wanted; });
    return at == keys.end() ? nullptr : &*at;
  };
  const Key* const own = with(modifiers & (kWithCtrl | kWithAlt));
  return own != nullptr ? own : with(0);
}

std::string key_word(int code) {
  static const std::pair<int, const char*> kNames[] = {{kSpace, "Space"},
                                                       {kKeyEscape, "Esc"},
                                                       {kEnter, "Enter"},
                                                       {kTab, "Tab"},
                                                       {kBackspace, "Backspace"},
                                                       {kInsert, "Insert"},
                                                       {261, "Delete"},
                                                       {kRight, "Right"},
                                                       {kLeft, "Left"},
                                                       {kDown, "Down"},
                                                       {kUp, "Up"},
                                                       {kPageUp, "Page Up"},
                                                       {kPageDown, "Page Down"},
                                                       {kHome, "Home"},
                                                       {269, "End"},
                                                       {kKeypadPoint, "keypad ."},
                                                       {331, "keypad /"},
                                                       {332, "keypad *"},
                                                       {333, "keypad -"},
                                                       {334, "keypad +"},
                                                       {kKeypadEnter, "keypad Enter"},
                                                       {'\'', "apostrophe"},
                                                       {'\\', "backslash"},
                                                       {'`', "left of 1"},
                                                       {'-', "minus"},
                                                       {'=', "equals"},
                                                       {',', "comma"},
                                                       {'.', "full stop"},
                                                       {'/', "slash"},
                                                       {';', "semicolon"}};
  for (const auto& [known, name] : kNames) {
    if (known == code) return name;
  }
  if (code >= kF1 && code < kF1 + 25) return "F" + std::to_string(code - kF1 + 1);
  if (code >= kKeypad0 && code < kKeypad0 + 10) return "keypad " + std::to_string(code - kKeypad0);
  if (code > kSpace && code < 127) return {static_cast<char>(code)};
  return std::to_string(code);
}

std::string key_name(Command command, std::optional<int> value) {
  for (const Key& key : all_keys()) {
    if (key.command == command && (!value || key.value == *value))
      return (key.with == kWithCtrl ? "Ctrl-" : key.with == kWithAlt ? "Alt-" : "") + key_word(key.code);
  }
  return {};
}

ButtonCommand command_of(HandFunction function) {
  switch (function) {
    case HandFunction::drill:
      return {Command::pedal, 0};
    case HandFunction::clutch:
      return {Command::clutch, 0};
    case HandFunction::wrist_rest:
      return {Command::wrist_rest, 0};
    case HandFunction::second_hand:
      return {Command::second_mouse, 0};
    case HandFunction::camera:
      return {Command::guide_camera, 0};
    case HandFunction::suck:
      return {Command::suck, 0};
    case HandFunction::water:
      return {Command::wash, 0};
    case HandFunction::undo:
      return {Command::undo, 0};
    case HandFunction::bring:
      return {Command::bring, 0};
    case HandFunction::lift:
      return {Command::lift, 0};
    case HandFunction::other_burr:
      return {Command::other_burr, 0};
    case HandFunction::larger_burr:
      return {Command::next_burr, 1};
    case HandFunction::smaller_burr:
      return {Command::next_burr, -1};
    case HandFunction::tool_wheel:
      return {Command::wheel, 0};
    case HandFunction::faster:
      return {Command::burr_speed, 1};
    case HandFunction::slower:
      return {Command::burr_speed, -1};
    case HandFunction::finer:
      return {Command::motion, -1};
    case HandFunction::coarser:
      return {Command::motion, 1};
    case HandFunction::straight:
      return {Command::straight, 0};
  }
  return {Command::pedal, 0};
}

void Keyboard::on(int code, Event event, int modifiers) {
  if (event == Event::released) {
    std::erase_if(down_, [&](const Down& d) { return d.code == code; });
    return;
  }
  Key key{code, Command::pedal};
  if (const auto given = bound_ != nullptr ? bound_->function(code) : std::nullopt) {
    const ButtonCommand does = command_of(*given);
    key.command = does.command;
    key.value = does.value;
  } else if (const Key* const known = find_key(code, modifiers)) {
    key = *known;
  } else {
    return;
  }
  const bool shift = (modifiers & kWithShift) != 0;
  if (event == Event::pressed || key.when == Key::When::repeated) presses_.push_back({key.command, key.value, shift});
  if (std::none_of(down_.begin(), down_.end(), [&](const Down& d) { return d.code == code; }))
    down_.push_back({code, key.command});
  if (!has(since_, key.command)) since_.push_back(key.command);
}

std::vector<Keyboard::Press> Keyboard::frame(bool ignore) {
  held_.clear();
  if (!ignore) {
    for (const Down& d : down_) held_.push_back(d.command);
  }
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

}  // namespace osteo::inline app
