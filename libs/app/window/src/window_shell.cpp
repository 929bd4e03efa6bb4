#include "osteo/app/window/window_shell.h"

// GLEW, through VTK, must come before anything that includes GL.
#include <vtk_glew.h>

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <mutex>
#include <utility>

#include "open_window.h"
#include "ui_style.h"
#include "view_layout.h"

namespace osteo::inline app {
namespace {

constexpr int kModifiers = GLFW_MOD_SHIFT | GLFW_MOD_CONTROL | GLFW_MOD_ALT;

// Moves and wheels come without them.
int modifiers_now(GLFWwindow* window) {
  const auto down = [&](int left, int right) {
    return glfwGetKey(window, left) == GLFW_PRESS || glfwGetKey(window, right) == GLFW_PRESS;
  };
  return (down(GLFW_KEY_LEFT_SHIFT, GLFW_KEY_RIGHT_SHIFT) ? GLFW_MOD_SHIFT : 0) |
         (down(GLFW_KEY_LEFT_CONTROL, GLFW_KEY_RIGHT_CONTROL) ? GLFW_MOD_CONTROL : 0) |
         (down(GLFW_KEY_LEFT_ALT, GLFW_KEY_RIGHT_ALT) ? GLFW_MOD_ALT : 0);
}

}  // namespace

WindowShell::WindowShell(const ShellOptions& options) : fixed_scale_(options.scale), by_hand_(options.by_hand) {
  window_ = open_window(options.title, options.width, options.height,
                        "is there a display? Without one: osteo rehearse CASE --headless", options.two_buffers);
  glewExperimental = GL_TRUE;
  glewInit();
  while (glGetError() != GL_NO_ERROR) {
  }
  glfwSetWindowUserPointer(window_, this);
  // ImGui chains these callbacks behind its own.
  glfwSetKeyCallback(window_, [](GLFWwindow* w, int key, int, int action, int modifiers) {
    auto* const shell = static_cast<WindowShell*>(glfwGetWindowUserPointer(w));
    if ((modifiers & GLFW_MOD_CONTROL) != 0 && action != GLFW_RELEASE) {
      const bool larger = key == GLFW_KEY_EQUAL || key == GLFW_KEY_KP_ADD,
                 smaller = key == GLFW_KEY_MINUS || key == GLFW_KEY_KP_SUBTRACT;
      if (larger || smaller) return shell->change_scale(larger ? 1 : -1);
      if (key == GLFW_KEY_0 || key == GLFW_KEY_KP_0) return shell->change_scale(0);
    }
    if (shell->on_key) shell->on_key(key, action, modifiers & kModifiers);
  });
  glfwSetCharCallback(window_, [](GLFWwindow* w, unsigned letter) {
    auto* const shell = static_cast<WindowShell*>(glfwGetWindowUserPointer(w));
    need_letter(letter);
    if (shell->on_letter) shell->on_letter(letter);
  });
  glfwSetCursorPosCallback(window_, [](GLFWwindow* w, double x, double y) {
    auto* const shell = static_cast<WindowShell*>(glfwGetWindowUserPointer(w));
    if (shell->on_pointer) shell->on_pointer(x, y, modifiers_now(w));
  });
  glfwSetMouseButtonCallback(window_, [](GLFWwindow* w, int which, int action, int modifiers) {
    auto* const shell = static_cast<WindowShell*>(glfwGetWindowUserPointer(w));
#if IMGUI_VERSION_NUM < 18700  // later ones hand on what is mirrored already, below
    if (shell->mirror_mouse && which <= GLFW_MOUSE_BUTTON_RIGHT) which = GLFW_MOUSE_BUTTON_RIGHT - which;
#endif
    if (shell->on_button) shell->on_button(which, action == GLFW_PRESS, modifiers & kModifiers);
  });
  glfwSetScrollCallback(window_, [](GLFWwindow* w, double, double steps) {
    auto* const shell = static_cast<WindowShell*>(glfwGetWindowUserPointer(w));
    if (shell->on_wheel) shell->on_wheel(steps, modifiers_now(w));
  });
  glfwSetWindowFocusCallback(window_, [](GLFWwindow* w, int has) {
    static_cast<WindowShell*>(glfwGetWindowUserPointer(w))->attended_ = has != GLFW_FALSE;
  });
  glfwSetWindowRefreshCallback(
      window_, [](GLFWwindow* w) { static_cast<WindowShell*>(glfwGetWindowUserPointer(w))->uncovered_ = true; });
  glfwSetWindowIconifyCallback(window_, [](GLFWwindow* w, int away) {
    auto* const shell = static_cast<WindowShell*>(glfwGetWindowUserPointer(w));
    shell->put_away_ = away != GLFW_FALSE;
    shell->uncovered_ = true;
  });
  glfwSetDropCallback(window_, [](GLFWwindow* w, int count, const char** paths) {
    auto* const shell = static_cast<WindowShell*>(glfwGetWindowUserPointer(w));
    shell->dropped_.insert(shell->dropped_.end(), paths, paths + count);
  });
  glfwSetWindowContentScaleCallback(window_, [](GLFWwindow* w, float x, float y) {
    static_cast<WindowShell*>(glfwGetWindowUserPointer(w))->reported_scale_ = static_cast<double>(std::max(x, y));
  });
  float x = 1, y = 1;
  glfwGetWindowContentScale(window_, &x, &y);
  reported_scale_ = static_cast<double>(std::max(x, y));
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;
  ImGui_ImplGlfw_InitForOpenGL(window_, true);
#if IMGUI_VERSION_NUM >= 18700
  glfwSetMouseButtonCallback(window_, [](GLFWwindow* w, int which, int action, int modifiers) {
    const bool mirror = static_cast<WindowShell*>(glfwGetWindowUserPointer(w))->mirror_mouse;
    if (mirror && which <= GLFW_MOUSE_BUTTON_RIGHT) which = GLFW_MOUSE_BUTTON_RIGHT - which;
    ImGui_ImplGlfw_MouseButtonCallback(w, which, action, modifiers);
  });
#endif
  ImGui_ImplOpenGL3_Init("#version 150");
  glfwGetFramebufferSize(window_, &width_, &height_);
  apply_scale();
  if (options.full_screen) toggle_full_screen();
}

WindowShell::~WindowShell() {
  glfwMakeContextCurrent(window_);
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
  glfwDestroyWindow(window_);
  glfwTerminate();
}

void WindowShell::set_title(const std::string& title) {
  glfwSetWindowTitle(window_, title.c_str());
}

std::vector<std::filesystem::path> WindowShell::take_dropped() {
  return std::exchange(dropped_, {});
}

void WindowShell::apply_scale() {
  const int wanted = em_that_fits(fixed_scale_, reported_scale_, by_hand_, width_, height_);
  if (wanted == em_ && !letters_missing()) return;
  const bool had = em_ > 0;
  em_ = wanted;
  set_ui_style(em_);
  if (had) ImGui_ImplOpenGL3_DestroyFontsTexture();
  ImGui_ImplOpenGL3_CreateFontsTexture();
}

bool WindowShell::poll() {
  glfwPollEvents();
  glfwGetFramebufferSize(window_, &width_, &height_);
  if (put_away_ || width_ < 200 || height_ < 150) {
    // Nothing is drawn, so nothing else makes the loop wait.
    glfwWaitEventsTimeout(0.05);
    return false;
  }
  apply_scale();
  return true;
}

void WindowShell::change_scale(int steps) {
  by_hand_ = steps == 0 ? 1 : next_scale(by_hand_, steps);
}

void WindowShell::toggle_full_screen() {
  full_screen_ = !full_screen_;
  if (!full_screen_) {
    glfwSetWindowMonitor(window_, nullptr, windowed_[0], windowed_[1], windowed_[2], windowed_[3], GLFW_DONT_CARE);
    return;
  }
  glfwGetWindowPos(window_, &windowed_[0], &windowed_[1]);
  glfwGetWindowSize(window_, &windowed_[2], &windowed_[3]);
  // The monitor that holds the window's middle.
  const int cx = windowed_[0] + windowed_[2] / 2, cy = windowed_[1] + windowed_[3] / 2;
  int count = 0;
  GLFWmonitor** const all = glfwGetMonitors(&count);
  GLFWmonitor* chosen = glfwGetPrimaryMonitor();
  for (int k = 0; k < count; ++k) {
    int x = 0, y = 0;
    glfwGetMonitorPos(all[k], &x, &y);
    const GLFWvidmode* const mode = glfwGetVideoMode(all[k]);
    if (mode != nullptr && cx >= x && cx < x + mode->width && cy >= y && cy < y + mode->height) chosen = all[k];
  }
  const GLFWvidmode* const mode = chosen != nullptr ? glfwGetVideoMode(chosen) : nullptr;
  if (mode == nullptr) {
    full_screen_ = false;
    return;
  }
  glfwSetWindowMonitor(window_, chosen, 0, 0, mode->width, mode->height, mode->refreshRate);
  glfwSwapInterval(1);
}

bool WindowShell::closing() const {
  return glfwWindowShouldClose(window_) != 0;
}

void WindowShell::new_frame() {
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
#if IMGUI_VERSION_NUM < 18700
  // It asks for states, not for events.
  if (mirror_mouse) std::swap(ImGui::GetIO().MouseDown[0], ImGui::GetIO().MouseDown[1]);
#endif
  ImGui::NewFrame();
}

void WindowShell::count_gl_errors() {
  for (GLenum e = glGetError(); e != GL_NO_ERROR && gl_errors_ < 1000; e = glGetError()) ++gl_errors_;
}

void WindowShell::show_page() {
  ImGui::Render();
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glViewport(0, 0, width_, height_);
  glClearColor(0.05F, 0.06F, 0.08F, 1);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  count_gl_errors();
  glfwSwapBuffers(window_);
}

void WindowShell::while_working(const std::string& words, const Context& context,
                                const std::function<void(const Context&)>& work) {
  struct Progress {
    std::mutex mutex;
    double fraction = 0;
    std::string activity;
  } progress;
  // A context of its own, which tells the given one too, and stops when that is stopped.
  Context inside;
  inside.threads = context.threads;
  inside.seed = context.seed;
  inside.on_log([&context](LogLevel level, std::string_view text) {
    level == LogLevel::warning ? context.warn(text) : context.info(text);
  });
  inside.on_progress([&](double fraction, std::string_view activity) {
    context.progress(fraction, activity);
    const std::lock_guard lock(progress.mutex);
    progress.fraction = fraction;
    if (!activity.empty()) progress.activity = activity;
  });
  std::future<void> done = std::async(std::launch::async, [&] { work(inside); });
  const auto began = std::chrono::steady_clock::now();
  while (done.wait_for(std::chrono::milliseconds(30)) != std::future_status::ready) {
    if (!poll()) continue;
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    std::string activity;
    double fraction = 0;
    {
      const std::lock_guard lock(progress.mutex);
      fraction = progress.fraction;
      activity = progress.activity;
    }
    new_frame();
    const auto w = static_cast<float>(width_), h = static_cast<float>(height_), e = static_cast<float>(em_);
    begin_fixed("working", {w / 2 - std::min(15 * e, w / 2), h / 2 - 4 * e, std::min(30 * e, w), 8 * e},
                ImGuiWindowFlags_NoScrollbar);
    ImGui::TextUnformatted(words.c_str());
    // Where nobody says how far it is, that it goes on can be seen at least.
    const float shown =
        fraction > 0 ? static_cast<float>(fraction) : static_cast<float>(0.5 - 0.5 * std::cos(seconds * 2));
    ImGui::ProgressBar(shown, {-1, 1.5F * e}, fraction > 0 ? nullptr : "");
    ImGui::Text("%s%s%.0f s", activity.c_str(), activity.empty() ? "" : ", ", seconds);
    ImGui::End();
    show_page();
  }
  done.get();
}

}  // namespace osteo::inline app
