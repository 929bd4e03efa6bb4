#include "osteo/app/window/hand_buttons.h"

#include <span>

#include "keys.h"

namespace osteo::inline app {
namespace {

constexpr int kFirstKey = 32, kLastKey = 348;

struct Kind {
  const char* word;
  int first, count;
  std::span<const std::string_view> names;  // empty: numbered from 1
};

// As GLFW orders the buttons of a gamepad; then its triggers.
constexpr std::string_view kPadNames[] = {
    "A",          "B",           "X",  "Y",     "left bumper", "right bumper", "back",         "start",        "guide",
    "left thumb", "right thumb", "up", "right", "down",        "left",         "left trigger", "right trigger"};

std::span<const Kind> kinds() {
  static const Kind all[] = {{"pedal", button::kPedal, 32, {}}, {"device", button::kDevice, 8, {}},
                             {"mouse", button::kMouse, 8, {}},  {"pad", button::kPad, 17, kPadNames},
                             {"stick", button::kStick, 32, {}}, {"axis", button::kAxis, 16, {}}};
  return all;
}

}  // namespace

std::string button_name(int button) {
  if (button >= kFirstKey && button <= kLastKey) return "key " + key_word(button);
  for (const Kind& k : kinds()) {
    const int n = button - k.first;
    if (n < 0 || n >= k.count) continue;
    return std::string(k.word) + " " +
           (k.names.empty() ? std::to_string(n + 1) : std::string(k.names[static_cast<std::size_t>(n)]));
  }
  return "button " + std::to_string(button);
}

std::optional<int> button_named(std::string_view name) {
  const auto look = [&](int first, int count) -> std::optional<int> {
    for (int b = first; b < first + count; ++b) {
      if (button_name(b) == name) return b;
    }
    return std::nullopt;
  };
  if (name.starts_with("key ")) return look(kFirstKey, kLastKey - kFirstKey + 1);
  for (const Kind& k : kinds()) {
    if (name.starts_with(k.word)) return look(k.first, k.count);
  }
  return std::nullopt;
}

HandButtons HandButtons::usual() {
  HandButtons b;
  b.assign(button::kPedal, HandFunction::drill);
  b.assign(button::kPedal + 1, HandFunction::clutch);
  b.assign(button::kPedal + 2, HandFunction::camera);
  b.assign(button::kDevice, HandFunction::drill);
  b.assign(button::kPadRightTrigger, HandFunction::drill);
  b.assign(button::kMouse + 3, HandFunction::clutch);
  b.assign(button::kMouse + 4, HandFunction::wrist_rest);
  return b;
}

std::optional<HandFunction> HandButtons::function(int button) const {
  const auto at = all_.find(button);
  return at == all_.end() ? std::nullopt : std::optional(at->second);
}

std::optional<HandFunction> HandButtons::assign(int button, HandFunction function) {
  const std::optional<HandFunction> before = this->function(button);
  all_[button] = function;
  return before;
}

std::vector<int> HandButtons::buttons_of(HandFunction function) const {
  std::vector<int> found;
  for (const auto& [b, f] : all_) {
    if (f == function) found.push_back(b);
  }
  return found;
}

unsigned HandButtons::mask(int first, HandFunction function) const {
  unsigned bits = 0;
  for (const auto& [b, f] : all_) {
    if (f == function && b >= first && b < first + 32) bits |= 1U << (b - first);
  }
  return bits;
}

}  // namespace osteo::inline app
