#include "keys.h"

#include <algorithm>
#include <utility>

#include "osteo/core/base/translate.h"
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
    {'I', Command::wash, Key::When::held},
    {'X', Command::saw},
    {'P', Command::pieces},
    {'L', Command::plates},
    {'A', Command::turn_left, Key::When::repeated},
    {'E', Command::turn_right, Key::When::repeated},
    {kEnter, Command::perform},
    {kKeypadEnter, Command::perform},
    {'Z', Command::undo},
    {kKeyEscape, Command::put_away},
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

bool is_burrs(const HelpLine& line) {
  return has(line.commands, Command::burr_kind);
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

const std::vector<HelpLine>& help_lines() {
  using enum Command;
  // "1 to 7, C, D", "burr: diameter, cutting, diamond".
  static const std::string burr_keys = [] {
    std::string all = tr_later("1 to 7");
    for (const BurrKindRow& kind : kBurrKinds) all += std::string(", ") + kind.key;
    return all;
  }();
  static const std::string burr_text = [] {
    std::string all = tr_later("burr: diameter");
    for (const BurrKindRow& kind : kBurrKinds) all += ", " + std::string(kind.name);
    return all;
  }();
  static const std::vector<HelpLine> lines = {
      {"", tr_later("the drill"), {}},
      {tr_later("move"), tr_later("moves the drill across the view"), {}},
      {"F", tr_later("lifts the drill over to the bone under the mouse, drill off"), {bring}},
      {"U", tr_later("lifts the drill out of the bone, drill off"), {lift}},
      {tr_later("wheel, Up, Down, Shift-drag"), tr_later("moves it deeper (away from you) or back"), {deeper, back}},
      {tr_later("left button, Space"), tr_later("drills while held; Space: on and off"), {drill}},
      {burr_keys.c_str(), burr_text.c_str(), {diameter, burr_kind}},
      {"B, Y, T", tr_later("ball, cylinder, taper"), {ball, cylinder, taper}},
      {"9, 0", tr_later("burr slower, faster: 25 to 100 %"), {burr_speed}},
      {"Tab", tr_later("wheel of tools: point or Up, Down; Tab, Enter or a click takes"), {wheel}},
      {"V, I", tr_later("suction, or irrigation, beside the burr (with --dust)"), {suck, wash}},
      {"K", tr_later("second hand: suction, irrigation, probe, nothing"), {second_hand}},
      {"Z", tr_later("takes back the last stroke, cut, move, plate"), {undo}},
      {"W", tr_later("compare: the bone at the start, and now"), {before}},
      {"", tr_later("saw, fragments, plates"), {}},
      {"X",
       tr_later("saw, at the bone under the mouse: drag moves the plane, Shift-drag turns it, wheel: deeper"),
       {saw}},
      {"P", tr_later("fragments: drag moves one, Shift-drag turns it, wheel: deeper"), {pieces}},
      {"L", tr_later("plate in the hand, moved like the drill"), {plates}},
      {"A, E", tr_later("turn the saw, the piece or the plate"), {turn_left, turn_right}},
      {"Enter", tr_later("cut; separate fragments; fix the plate"), {perform}},
      {"Esc", tr_later("back to the drill"), {put_away}},
      {"", tr_later("the microscope"), {}},
      {tr_later("right drag"), tr_later("turns the view about its focus; with Shift rolls it"), {}},
      {tr_later("middle drag"), tr_later("shifts the view"), {}},
      {tr_later("Ctrl-wheel"), tr_later("magnifies; with Shift focuses deeper and back"), {}},
      {"[, ]", tr_later("magnification, by its steps"), {magnify}},
      {tr_later("comma, full stop, /"), tr_later("focus back, deeper; on the bone in the middle"), {focus, autofocus}},
      {tr_later("; (semicolon)"), tr_later("looks at the bone under the mouse"), {look_there}},
      {"G", tr_later("looks at the drill; with Shift along it"), {look_at_drill}},
      {"O", tr_later("held, mouse or device move the camera; with Shift turn it"), {guide_camera}},
      {"F6, F7, F8", tr_later("go to a kept view; with Shift keep this one"), {bookmark}},
      {tr_later("keypad 4 6 8 2"), tr_later("turn the view"), {orbit_left, orbit_right, orbit_up, orbit_down}},
      {"Backspace", tr_later("takes back the camera's last move"), {camera_back}},
      {"Home", tr_later("the whole bone, from the left"), {home}},
      {"J", tr_later("how the picture is drawn: auto, plain, calm, deep"), {quality}},
      {"", tr_later("the cuts"), {}},
      {tr_later("wheel, Ctrl-wheel"), tr_later("scrolls; nearer and farther"), {}},
      {tr_later("click, Shift-move"), tr_later("looks there in all three"), {}},
      {tr_later("left drag"), tr_later("measures"), {}},
      {tr_later("right drag, click"), tr_later("window and level; as they were"), {}},
      {tr_later("middle drag"), tr_later("moves it"), {}},
      {tr_later("F3, double click"), tr_later("it takes the middle, and back"), {cut_in_middle}},
      {"F4", tr_later("along the tool, or along the body"), {cuts_along_tool}},
      {"Ctrl-L", tr_later("what the procedure wants removed (green) or left (orange)"), {regions}},
      {"", tr_later("the hand"), {}},
      {tr_later("Alt-right drag, Alt-arrows"), tr_later("tilts the handle; the burr stays where it is"), {tilt}},
      {tr_later("Alt-Shift-right drag, Page Up, Down, keypad 7 9"),
       tr_later("rolls it about the line of sight"),
       {roll}},
      {tr_later("Insert, keypad 5"), tr_later("the handle as the view holds it"), {straight}},
      {tr_later("' (apostrophe), keypad 0, mouse 4"),
       tr_later("clutch: held, the mouse moves without the drill"),
       {clutch}},
      {tr_later("\\ (backslash), keypad ., mouse 5"),
       tr_later("wrist rest: held, the hand moves finely"),
       {wrist_rest}},
      {tr_later("` (left of 1)"),
       tr_later("held, the mouse moves the second hand, its left button works"),
       {second_mouse}},
      {"-, =", tr_later("motion of the hand finer or coarser, 1:1 to 1:8"), {motion}},
      {"Alt-H", tr_later("hand and pedals in the panel, by keys"), {hand_page}},
      {"", tr_later("the session"), {}},
      {"S", tr_later("screenshot with its caption into its folder"), {screenshot}},
      {"M", tr_later("note pinned to the bone under the mouse; without text: marks this moment"), {mark}},
      {"F9", tr_later("ruler: two points on the bone, by clicks"), {ruler}},
      {"F5", tr_later("saves it and goes on"), {save}},
      {"R", tr_later("asks; saves the session and resets the bone"), {reset}},
      {"Q", tr_later("saves and ends it, and shows what was done"), {quit}},
      {"Ctrl-T", tr_later("then: its course, and the bone as of any time"), {timeline}},
      {"Left, Right", tr_later("in it: a second back, on; with Shift ten; Space plays"), {earlier, later}},
      {"", tr_later("the window"), {}},
      {"F1, H", tr_later("shows this, and hides it"), {help}},
      {"F2", tr_later("layout: operate, or plan with four pictures"), {layout}},
      {"F10", tr_later("menu: all settings, by arrows and Space; Esc closes it"), {panel_keys}},
      {"F11", tr_later("full screen, and back"), {full_screen}},
      {"Ctrl +, Ctrl -, Ctrl 0", tr_later("size of text and panels; as the monitor has it"), {}},
      {"N", tr_later("sound on and off"), {sound}},
      {"Ctrl-H, Ctrl-G", tr_later("hints; in a lesson, your hand led or not"), {hints, lead}},
      {"Ctrl-N, Ctrl-M", tr_later("nerve monitor, with --monitor; its sound"), {monitor, mute_monitor}}};
  return lines;
}

// The row of burrs lists what there is: its parts are in the catalogue, not the whole.
std::string shown_keys(const HelpLine& line) {
  const std::string text = line.keys;
  const auto end = text.find(", ");
  return is_burrs(line) ? tr(text.substr(0, end)) + text.substr(end) : tr(text);
}

std::string shown_text(const HelpLine& line) {
  if (!is_burrs(line)) return tr(line.text);
  std::string all = tr("burr: diameter");
  for (const BurrKindRow& kind : kBurrKinds) all += ", " + tr(std::string(kind.name));
  return all;
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
