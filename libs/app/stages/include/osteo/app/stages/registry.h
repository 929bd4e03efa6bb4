// All stages, for the program and for the tests that walk them all.
#pragma once
#include "osteo/core/stage/stage.h"

namespace osteo::inline app {

[[nodiscard]] Registry osteo_stages();

}  // namespace osteo::inline app
