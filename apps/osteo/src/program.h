// The program: all its stages and commands.
#pragma once
#include "osteo/app/cli/command.h"

namespace osteo {

/// All stages and commands of osteo, with their parameters at the defaults.
[[nodiscard]] cli::Program make_osteo_program();

}  // namespace osteo
