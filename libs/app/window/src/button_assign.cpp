#include "button_assign.h"

#include <algorithm>

#include "commands.h"
#include "osteo/core/base/translate.h"

namespace osteo::inline app {
namespace {

enum : int { kKeyEscape = 256, kDelete = 261, kF1 = 290, kF10 = 299, kFirstModifier = 340, kLastModifier = 347 };

}  // namespace

std::string words_of(HandFunction function) {
  std::string name(EnumNames<HandFunction>::values[static_cast<std::size_t>(function)]);
  std::replace(name.begin(), name.end(), '_', ' ');
  return tr(name);
}

std::string ButtonAssign::take(int button, HandButtons& buttons) {
  if (!for_) return {};
  const std::string does = words_of(*for_), name = button_name(button);
  if (button == kKeyEscape) {
    cancel();
    return tr("no button was given");
  }
  if (button == kDelete) {
    for (const int b : buttons.buttons_of(*for_)) buttons.clear(b);
    cancel();
    return filled(tr("{function} has no button now; its keys of the table (F1) go on"), {{"function", does}});
  }
  if (button == kF1 || button == kF10)
    return filled(tr("{button} stays what it is: the keys and the menu are reached by it; press another, or Esc"),
                  {{"button", name}});
  if (button >= kFirstModifier && button <= kLastModifier)
    return tr("Shift, Ctrl and Alt go with other keys; press another, or Esc");
  const std::optional<HandFunction> before = buttons.assign(button, *for_);
  std::string said = name + ": " + does;
  if (before == for_) {
    said = filled(tr("{button}: {function}, as before"), {{"button", name}, {"function", does}});
  } else if (before) {
    said = filled(tr("{button}: {function}; no longer {before}"),
                  {{"button", name}, {"function", does}, {"before", words_of(*before)}});
  } else if (const Key* const key = find_key(button); key != nullptr && key->command != command_of(*for_).command) {
    if (const CommandRow* const row = row_of(key->command, key->value))
      said += filled(tr("; no longer: {help}"), {{"help", shown_name(*row)}});
  }
  cancel();
  return said;
}

}  // namespace osteo::inline app
