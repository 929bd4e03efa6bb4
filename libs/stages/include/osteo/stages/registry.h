// All stages, for the program and for the tests that walk them all.
#pragma once
#include "osteo/stage/stage.h"

namespace osteo {

[[nodiscard]] Registry osteo_stages();

}  // namespace osteo
