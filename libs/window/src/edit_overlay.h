// What is drawn over a slice: crosshair, letters, scale bar, ruler, box, brush. Private to libs/window.
#pragma once
#include <imgui.h>

#include <string>

#include "edit_control.h"

namespace osteo {

inline constexpr ImU32 kCrossColour = IM_COL32(120, 200, 120, 170);

/// Light, with a dark edge, so that it can be read on bone.
void shadowed_text(ImDrawList* draw, ImVec2 at, const std::string& words, ImU32 ink = IM_COL32(235, 235, 235, 255));

/// `lo`: upper left corner of the slice in the window. `scale`: of lines and distances, as of the text.
void annotate_slice(ImDrawList* draw, const EditControl& control, int view, ImVec2 lo, float scale);

}  // namespace osteo
