// A window with an OpenGL 3.2 context. Private to libs/app/window.
#pragma once
#include <string>

struct GLFWwindow;

namespace osteo::inline app {

/// Of so many pixels, less where the screen has less; its context is current, pictures wait for the screen.
/// Error(failed), with the reason, when none can be opened; `without_display`: what to do on a machine that has no
/// display. `two_buffers`: one for each eye, where the display has them (GL_STEREO tells); else a window without.
[[nodiscard]] GLFWwindow* open_window(const std::string& title, int width, int height,
                                      const std::string& without_display, bool two_buffers = false);

}  // namespace osteo::inline app
