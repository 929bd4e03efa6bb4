// A way through the scene, drawn as a line: where a recorded hand went.
#pragma once
#include <vtkActor.h>
#include <vtkSmartPointer.h>

#include <span>

#include "osteo/core/data/vec.h"

class vtkRenderer;

namespace osteo::inline app {

/// Seen through bone too, faintly. Fewer than two points: nothing.
class PathView {
 public:
  PathView(vtkRenderer* renderer, std::span<const Vec3> way_mm);
  ~PathView();
  PathView(const PathView&) = delete;
  PathView& operator=(const PathView&) = delete;

 private:
  vtkRenderer* renderer_;
  vtkSmartPointer<vtkActor> actor_;
};

}  // namespace osteo::inline app
