// The hand's tools as one sees them: cursors in the scene, a section of the panel. Private to libs/window.
#pragma once
#include <vtkSmartPointer.h>

#include "hand_tools.h"

class vtkActor;
class vtkPolyData;
class vtkRenderer;

namespace osteo {

class SceneTools {
 public:
  explicit SceneTools(vtkRenderer* renderer);
  ~SceneTools();
  SceneTools(const SceneTools&) = delete;
  SceneTools& operator=(const SceneTools&) = delete;

  /// A section of the panel.
  void panel(HandTools& tools, Rehearsal& rehearsal, const ViewAxes& view);
  /// Cursors of the tools, before each frame.
  void show(const HandTools& tools, const TickRecord& tick);

 private:
  vtkRenderer* renderer_;
  vtkSmartPointer<vtkActor> plane_, plate_actor_;
  vtkSmartPointer<vtkPolyData> plane_data_;
  std::optional<std::size_t> plate_shown_;
};

}  // namespace osteo
