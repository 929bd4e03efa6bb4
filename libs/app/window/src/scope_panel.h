// The microscope as one sees it: what stands in the picture, and its page of the settings. Private to libs/app/window.
#pragma once
#include "osteo/display/view/quality.h"
#include "scope_input.h"
#include "stereo_screen.h"

namespace osteo::inline app {

/// Magnification, field of view, working distance and a scale bar, in the lower left corner of the picture (of each
/// eye's).
void draw_scope(const ScopeView& view, const PictureArea& area, StereoMode stereo);
/// Into the settings: how the picture is drawn; where one looks from, the microscope, stereo.
void draw_quality(QualityChoice& quality);
void draw_scope_panel(ScopeInput& scope, StereoScreen& stereo, const ScopeScene& scene);

}  // namespace osteo::inline app
