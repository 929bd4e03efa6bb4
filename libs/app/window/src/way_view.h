// A way through the scene, drawn as a line: where a recorded hand went.
#pragma once
#include <vtkActor.h>
#include <vtkSmartPointer.h>

#include <span>

#include "osteo/core/data/vec.h"

class vtkRenderer;

namespace osteo::inline app {

/// Seen through bone too, faintly. Fewer than two points: nothing.
class WayView {
 public:
  WayView(vtkRenderer* renderer, std::span<const Vec3> way_mm);
  ~WayView();
  WayView(const WayView&) = delete;
  WayView& operator=(const WayView&) = delete;

 private:
  vtkRenderer* renderer_;
  vtkSmartPointer<vtkActor> actor_;
};

}  // namespace osteo::inline app
