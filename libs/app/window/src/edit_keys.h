// Which key does what in the editor: one table for the window, its help, its guide and its tests. Private to
// libs/app/window.
#pragma once
#include <span>
#include <string>
#include <vector>

namespace osteo::inline app {

enum class EditTool : int { look, ruler, threshold, piece, pieces, box, fill, smooth, brush, eraser };
inline constexpr int kEditTools = 10;
[[nodiscard]] const char* edit_tool_name(EditTool tool);

enum class EditKey {
  tool,  // value: which
  next_slice,
  previous_slice,
  larger,
  smaller,
  fit,
  apply,
  cancel,
  undo,
  redo,
  save,
  cross,
  outline,
  preset,  // value: which
  from_front,
  from_left,
  from_above,
  help,
  close,
};

struct EditKeyRow {
  int code;  ///< as GLFW numbers keys
  EditKey does;
  int value = 0;
  enum class With { nothing, control, control_shift, shift } with = With::nothing;
};
[[nodiscard]] std::span<const EditKeyRow> edit_key_table();
/// Null for a key, or a key with others held, that does nothing.
[[nodiscard]] const EditKeyRow* find_edit_key(int code, bool control, bool shift);

/// A line of the help and of docs/guides/edit.md, and the commands it tells of; none: of the mouse.
struct EditHelpLine {
  const char* keys;
  const char* text;
  std::vector<EditKey> commands;
};
[[nodiscard]] const std::vector<EditHelpLine>& edit_help_lines();
/// The help as a table in Markdown, as docs/guides/edit.md has it.
[[nodiscard]] std::string edit_help_table();

}  // namespace osteo::inline app
