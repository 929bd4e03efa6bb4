#include "osteo/core/base/shell.h"

#include <algorithm>
#include <cctype>
#include <string_view>

namespace osteo {

std::string shell_path(const std::filesystem::path& path) {
  constexpr std::string_view kPlain = "_-./+,:@%=";
  const std::string text = path.string();
  // Letters beyond ASCII are plain ones to a shell.
  const bool plain = !text.empty() && std::all_of(text.begin(), text.end(), [&](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte >= 0x80 || std::isalnum(byte) != 0 || kPlain.find(c) != std::string_view::npos;
  });
  if (plain) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

}  // namespace osteo
