// The bone as a session began with it, in place of what it is now. Private to libs/app/window.
#pragma once
#include <vtkNew.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>

#include "osteo/core/data/tri_mesh.h"

class vtkRenderWindow;

namespace osteo::inline app {

/// A renderer of its own beside the other one's, with its camera: nothing of what is drawn there has to be hidden.
class BeforeView {
 public:
  BeforeView(vtkRenderWindow* window, const TriMesh& mesh);
  ~BeforeView();
  BeforeView(const BeforeView&) = delete;
  BeforeView& operator=(const BeforeView&) = delete;

  /// Before each picture: this (true) or `now` is drawn, from the same place.
  void place(vtkRenderer* now, bool shown);

 private:
  vtkRenderWindow* window_;
  vtkRenderer* now_ = nullptr;
  vtkNew<vtkRenderer> renderer_;
};

}  // namespace osteo::inline app
