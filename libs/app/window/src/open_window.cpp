#include "open_window.h"

// GLEW, through VTK, must come before anything that includes GL.
#include <vtk_glew.h>

#include <GLFW/glfw3.h>

#include <algorithm>

#include "osteo/core/base/error.h"

namespace osteo::inline app {

GLFWwindow* open_window(const std::string& title, int width, int height, const std::string& without_display,
                        bool two_buffers) {
  static std::string reason;
  glfwSetErrorCallback([](int, const char* text) { reason = text; });
  if (glfwInit() == GLFW_FALSE) throw Error(ExitCode::failed, "no window can be opened: " + reason, without_display);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 2);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  int x = 0, y = 0, screen_width = 0, screen_height = 0;
  if (GLFWmonitor* const monitor = glfwGetPrimaryMonitor())
    glfwGetMonitorWorkarea(monitor, &x, &y, &screen_width, &screen_height);
  if (screen_width > 0) width = std::min(width, screen_width);
  if (screen_height > 0) height = std::min(height, screen_height);
  glfwWindowHint(GLFW_STEREO, two_buffers ? GLFW_TRUE : GLFW_FALSE);
  GLFWwindow* window = glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr);
  if (window == nullptr && two_buffers) {
    glfwWindowHint(GLFW_STEREO, GLFW_FALSE);
    window = glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr);
  }
  if (window == nullptr) {
    glfwTerminate();
    throw Error(ExitCode::failed, "no window can be opened: " + reason, "OpenGL 3.2 is needed");
  }
  glfwMakeContextCurrent(window);
  glfwSwapInterval(1);
  return window;
}

}  // namespace osteo::inline app
