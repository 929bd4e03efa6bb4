// The usual windows of grey values, as one chooses them beside a cut. Private to libs/app/window; ImGui, no GL.
#pragma once
#include <string>

#include "ui_kit.h"

namespace osteo::inline app {

/// One of grey_presets() that was pressed now, else -1; hovering says what each is, with `more` below. `first_key`: of
/// the function key that takes the first of them; 0: there are none.
[[nodiscard]] int grey_choice(int selected, float high = kControl, int first_key = 0, const std::string& more = {});

}  // namespace osteo::inline app
