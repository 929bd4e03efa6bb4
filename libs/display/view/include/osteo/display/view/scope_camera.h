// The microscope's view as VTK's camera.
#pragma once
#include "osteo/simulation/camera/stereo.h"

class vtkRenderer;

namespace osteo::inline display {

/// The renderer's camera looks as `view` says into a viewport of that size. Clipping planes are left as they were.
void aim(vtkRenderer* renderer, const ScopeView& view, const PictureArea& area);
/// The same for one eye of two (0: left).
void aim_eye(vtkRenderer* renderer, const ScopeView& view, const StereoParams& stereo, const PictureArea& area,
             int eye);

}  // namespace osteo::inline display
