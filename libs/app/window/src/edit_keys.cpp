#include "edit_keys.h"

#include <algorithm>
#include <iterator>

#include "osteo/core/base/translate.h"

namespace osteo::inline app {
namespace {

// GLFW's numbers for keys without a letter (GLFW 3, stable): letters and digits are their ASCII capitals.
enum : int {
  kMinus = 45,
  kEqual = 61,
  kLeftBracket = 91,
  kRightBracket = 93,
  kKeyEscape = 256,
  kEnter = 257,
  kRight = 262,
  kLeft = 263,
  kDown = 264,
  kUp = 265,
  kF1 = 290,
  kF2 = 291,
  kF3 = 292,
  kF4 = 293,
  kKeypad1 = 321,
  kKeypad3 = 323,
  kKeypad7 = 327,
  kKeypadEnter = 335,
};
using With = EditKeyRow::With;

constexpr EditKeyRow kRows[] = {
    {'1', EditKey::tool, 0},
    {'2', EditKey::tool, 1},
    {'3', EditKey::tool, 2},
    {'4', EditKey::tool, 3},
    {'5', EditKey::tool, 4},
    {'6', EditKey::tool, 5},
    {'7', EditKey::tool, 6},
    {'8', EditKey::tool, 7},
    {'9', EditKey::tool, 8},
    {'0', EditKey::tool, 9},
    {kUp, EditKey::next_slice},
    {kRight, EditKey::next_slice},
    {'F', EditKey::next_slice},
    {kDown, EditKey::previous_slice},
    {kLeft, EditKey::previous_slice},
    {'B', EditKey::previous_slice},
    {kRightBracket, EditKey::larger},
    {kEqual, EditKey::larger},
    {kLeftBracket, EditKey::smaller},
    {kMinus, EditKey::smaller},
    {'R', EditKey::fit},
    {kEnter, EditKey::apply},
    {kKeypadEnter, EditKey::apply},
    {kKeyEscape, EditKey::cancel},
    {'Z', EditKey::undo, 0, With::control},
    {'Z', EditKey::undo},
    {'Z', EditKey::redo, 0, With::control_shift},
    {'Y', EditKey::redo, 0, With::control},
    {'Y', EditKey::redo},
    {'S', EditKey::save, 0, With::control},
    {'C', EditKey::cross},
    {'O', EditKey::outline},
    {kF2, EditKey::preset, 0},
    {kF3, EditKey::preset, 1},
    {kF4, EditKey::preset, 2},
    {kKeypad1, EditKey::from_front, 0},
    {kKeypad1, EditKey::from_front, 1, With::shift},
    {kKeypad3, EditKey::from_left, 0},
    {kKeypad3, EditKey::from_left, 1, With::shift},
    {kKeypad7, EditKey::from_above, 0},
    {kKeypad7, EditKey::from_above, 1, With::shift},
    {kF1, EditKey::help},
    {'Q', EditKey::close},
    {'Q', EditKey::close, 0, With::control},
};

}  // namespace

const char* edit_tool_name(EditTool tool) {
  static constexpr const char* names[kEditTools] = {
      tr_later("Look"), tr_later("Ruler"), tr_later("Threshold"), tr_later("Piece"), tr_later("Small fragments"),
      tr_later("Box"),  tr_later("Fill"),  tr_later("Smooth"),    tr_later("Brush"), tr_later("Eraser")};
  return names[static_cast<int>(tool)];
}

std::span<const EditKeyRow> edit_key_table() {
  return kRows;
}

const EditKeyRow* find_edit_key(int code, bool control, bool shift) {
  const With with = control ? (shift ? With::control_shift : With::control) : shift ? With::shift : With::nothing;
  const auto* const at = std::find_if(std::begin(kRows), std::end(kRows),
                                      [&](const EditKeyRow& k) { return k.code == code && k.with == with; });
  return at == std::end(kRows) ? nullptr : at;
}

const std::vector<EditHelpLine>& edit_help_lines() {
  using enum EditKey;
  static const std::vector<EditHelpLine> lines = {
      {tr_later("wheel, Up, Down, Right, Left, F, B"),
       tr_later("next and previous slice of the view under the mouse"),
       {next_slice, previous_slice}},
      {tr_later("Shift-move"), tr_later("the crosshair goes to the mouse, and all views to it"), {}},
      {tr_later("left drag (Look)"), tr_later("window across, level up and down"), {}},
      {tr_later("Ctrl-double-click"), tr_later("window and level as at the beginning"), {}},
      {"F2, F3, F4", tr_later("grey values for bone, soft tissue, temporal bone"), {preset}},
      {tr_later("Ctrl-wheel, right drag"), tr_later("zoom"), {}},
      {tr_later("middle drag"), tr_later("moves the picture"), {}},
      {"R", tr_later("all views show the whole scan"), {fit}},
      {tr_later("double click"), tr_later("the view alone, and back to four"), {}},
      {tr_later("3D: left, right, middle drag, wheel"), tr_later("turns, zooms, moves, zooms"), {}},
      {tr_later("keypad 1, 3, 7"),
       tr_later("3D from the front, left, above; with Shift from the other side"),
       {from_front, from_left, from_above}},
      {"C", tr_later("crosshair on and off"), {cross}},
      {"O", tr_later("outlines on and off"), {outline}},
      {tr_later("1 to 9, 0"),
       tr_later("tool: look, ruler, threshold, piece, small fragments, box, fill, smooth, brush, eraser"),
       {tool}},
      {tr_later("left button"), tr_later("what the line at the bottom says"), {}},
      {tr_later("[ ], - =, Shift-wheel"), tr_later("brush smaller and larger"), {larger, smaller}},
      {"Enter", tr_later("applies the tool"), {apply}},
      {"Esc", tr_later("stops what is worked out; back to Look"), {cancel}},
      {"Ctrl-Z, Z", tr_later("undo"), {undo}},
      {"Ctrl-Y, Y, Ctrl-Shift-Z", tr_later("redo"), {redo}},
      {"Ctrl-S", tr_later("save into the case"), {save}},
      {"F1", tr_later("shows this, and hides it"), {help}},
      {"Q, Ctrl-Q", tr_later("close; asks when something is not saved"), {close}},
  };
  return lines;
}

std::string edit_help_table() {
  std::string text = "| mouse, key | what it does |\n|---|---|\n";
  for (const EditHelpLine& l : edit_help_lines()) text += "| " + std::string(l.keys) + " | " + l.text + " |\n";
  return text;
}

}  // namespace osteo::inline app
