// What the editor draws over a slice. Private to libs/app/window.
#pragma once
#include "edit_control.h"
#include "slice_overlay.h"

namespace osteo::inline app {

/// `lo`: upper left corner of the slice in the window. `scale`: of lines and distances, as of the text.
void annotate_slice(ImDrawList* draw, const EditControl& control, int view, ImVec2 lo, float scale);

}  // namespace osteo::inline app
