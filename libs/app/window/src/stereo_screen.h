// Pictures for two eyes, put together on the screen. Private to libs/app/window; in the window's OpenGL context.
#pragma once
#include <array>
#include <functional>

#include "osteo/simulation/camera/stereo.h"

class vtkGenericOpenGLRenderWindow;
class vtkRenderer;

namespace osteo::inline app {

class StereoScreen {
 public:
  StereoParams params;
  [[nodiscard]] bool on() const { return params.mode != StereoMode::off; }
  /// Whether this display has a buffer for each eye; asked once, in the context.
  [[nodiscard]] bool has_quad_buffer();

  /// Draws both eyes and leaves them in ImGui's background, before ImGui::Render(). The camera is the middle one again
  /// afterwards. Twice the time of one picture.
  void draw(vtkRenderer* renderer, vtkGenericOpenGLRenderWindow* window, const ScopeView& view, const PictureArea& area,
            int window_height);
  /// After ImGui::Render(): what ImGui drew, to each eye's buffer where there are two. `clear`: what stood there.
  void show(const std::function<void()>& clear);
  /// Of OpenGL; in the context.
  void release();

 private:
  std::array<unsigned, 2> textures_{};
  int width_ = 0, height_ = 0;
  int quad_buffer_ = -1;  // not asked yet
};

}  // namespace osteo::inline app
