// Draws a session's scene as of a tick, as the window does. Private to libs/assessment/movie.
#pragma once
#include <array>
#include <memory>
#include <string>
#include <vector>

#include <vtkNew.h>
#include <vtkRenderer.h>

#include "osteo/display/view/instrument_view.h"
#include "osteo/display/view/offscreen.h"
#include "osteo/display/view/structures_view.h"
#include "osteo/display/view/world_view.h"
#include "osteo/session/scene/session_scene.h"
#include "osteo/simulation/camera/microscope.h"

namespace osteo::inline assessment {

class MovieStage {
 public:
  /// `structures` may be null; must outlive this.
  MovieStage(int width, int height, const StructureMap* structures, bool deep);
  ~MovieStage();
  MovieStage(const MovieStage&) = delete;
  MovieStage& operator=(const MovieStage&) = delete;

  /// Brings the scene's surfaces up to date and draws it.
  Picture draw(SessionScene& scene, const ScopeView& view, std::size_t hands, double rate_hz);

 private:
  PictureArea area_;
  OffscreenWindow window_;
  vtkNew<vtkRenderer> renderer_;
  std::unique_ptr<WorldView> world_view_;
  std::unique_ptr<StructuresView> structures_;
  bool faded_ = false;  // those of them that run out of the bone
  std::array<std::unique_ptr<InstrumentView>, kMaxHands> hands_;
  bool deep_ = false;
};

/// Words in a row along the lower edge, on a darker strip; of what does not fit the last are left out. Text is as high
/// as a thirtieth of the picture.
void write_strip(Picture& picture, const std::vector<std::string>& words);

}  // namespace osteo::inline assessment
