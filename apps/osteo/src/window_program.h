// The windows are programs of their own beside osteo, so that servers need neither GLFW nor a display.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "osteo/app/cli/command.h"

namespace osteo {

/// Where a window's program is: beside this one. Error(failed) when it is not there, with how to get it and what
/// `instead` can be done without a window (a phrase like "use --headless"; may be empty).
[[nodiscard]] std::string window_program(std::string_view name, std::string_view instead);
/// The flags among `given` that differ from `usual`, as they are written on a command line. Both lists are of the same
/// declaration. A flag that the person wrote is passed on whatever its value, when `io` knows of it.
void add_changed_flags(std::vector<std::string>& command, const std::vector<FieldRef>& given,
                       const std::vector<FieldRef>& usual, const cli::Invocation& io);
/// Becomes the program `command[0]`. Returns only by an Error(failed), when that cannot be started.
[[noreturn]] void become(std::vector<std::string> command, const cli::Invocation& io);

}  // namespace osteo
