// The hand's tools as one sees them: cursors in the scene, a section of the panel. Private to libs/window.
#pragma once
#include <vtkSmartPointer.h>

#include "hand_tools.h"
#include "osteo/view/plate_view.h"

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
  void show(const HandTools& tools, const TickRecord& tick, const World& world);

 private:
  vtkRenderer* renderer_;
  vtkSmartPointer<vtkActor> plane_;
  vtkSmartPointer<vtkPolyData> plane_data_;
  PlateView hand_plate_;
  double hand_in_bone_mm_ = 0;
};

}  // namespace osteo
