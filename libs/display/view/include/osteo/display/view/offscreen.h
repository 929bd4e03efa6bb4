// Rendering without a window or an X server: an EGL context in memory under a VTK render window.
#pragma once
#include <memory>

#include "osteo/core/data/data.h"

class vtkRenderer;
class vtkGenericOpenGLRenderWindow;

namespace osteo::inline display {

class OffscreenWindow {
 public:
  /// Error(failed) when there is no OpenGL at all (install Mesa: libegl1 and libgl1-mesa-dri).
  OffscreenWindow(int width, int height);
  ~OffscreenWindow();
  OffscreenWindow(const OffscreenWindow&) = delete;
  OffscreenWindow& operator=(const OffscreenWindow&) = delete;

  [[nodiscard]] vtkGenericOpenGLRenderWindow* window();
  [[nodiscard]] Picture render();
  /// Several in one thread: before anything is done to the one that is not the last made.
  void make_current();
  /// Waits until what was asked to be drawn is drawn.
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// What the window shows now, as a picture.
[[nodiscard]] Picture grab(vtkGenericOpenGLRenderWindow* window);

}  // namespace osteo::inline display
