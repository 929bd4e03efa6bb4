// A page that asks for the code of a session that is joined.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "osteo/app/window/window_shell.h"

namespace osteo::inline app {

/// What was typed, as it was; nothing: the person closed the page, or `stop` said so. `state_file`: for tests,
/// "code_page": true while it is shown; never what is typed.
[[nodiscard]] std::optional<std::string> ask_for_code(WindowShell& shell, const std::string& host,
                                                      const std::function<bool()>& stop,
                                                      const std::filesystem::path& state_file);

}  // namespace osteo::inline app
