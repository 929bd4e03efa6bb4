// The one window of the surgeon's programs: start page, rehearsals and what is between them are shown in it one after
// another.
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "osteo/core/base/context.h"

struct GLFWwindow;

namespace osteo::inline app {

struct ShellOptions {
  int width = 1360, height = 860;  ///< made smaller where the screen is
  std::string title = "Osteotome";
  double scale = 0;    ///< of text and panels; 0: by the monitor
  double by_hand = 1;  ///< times that: what the person last chose
  bool full_screen = false;
  bool two_buffers = false;  ///< one for each eye, where the display has them
};

/// GLFW's window with an OpenGL 3.2 context that is current in this thread, and Dear ImGui's. One thread.
class WindowShell {
 public:
  /// Error(failed) when no window can be opened.
  explicit WindowShell(const ShellOptions& options);
  ~WindowShell();
  WindowShell(const WindowShell&) = delete;
  WindowShell& operator=(const WindowShell&) = delete;

  [[nodiscard]] GLFWwindow* window() const { return window_; }
  void set_title(const std::string& title);
  /// Keys as GLFW numbers them; released 0, pressed 1, repeated 2; shift 1, Ctrl 2, Alt 4 were down with it. Ctrl with
  /// + and - is the shell's.
  std::function<void(int key, int action, int modifiers)> on_key;
  /// A letter that was typed (Unicode), in its order among the keys.
  std::function<void(char32_t letter)> on_letter;
  /// The mouse as it went, in pixels of the window; buttons 0 left, 1 right, 2 middle, after mirror_mouse; steps of the
  /// wheel, positive away from the person. Modifiers as of on_key.
  std::function<void(double x, double y, int modifiers)> on_pointer;
  std::function<void(int button, bool down, int modifiers)> on_button;
  std::function<void(double steps, int modifiers)> on_wheel;
  /// The window has the keys; before it has ever had them, too.
  [[nodiscard]] bool attended() const { return attended_; }
  /// The mouse's right and left button change places, for all of the window.
  bool mirror_mouse = false;
  /// Files and folders that were dropped onto the window since the last call.
  [[nodiscard]] std::vector<std::filesystem::path> take_dropped();

  /// Events, size and, where the scale has changed, text. False: the window is put away, and there is nothing to draw;
  /// then it waits a moment, as no picture makes the loop wait.
  bool poll();
  /// Since the last call the system has asked for the picture again: something had covered it.
  [[nodiscard]] bool take_uncovered() { return std::exchange(uncovered_, false); }
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  /// Height of text in pixels.
  [[nodiscard]] int em_pixels() const { return em_; }
  [[nodiscard]] double by_hand() const { return by_hand_; }
  void change_scale(int steps);  ///< of 10 %; 0: as the monitor has it
  void set_scale(double by_hand) { by_hand_ = by_hand; }
  [[nodiscard]] bool full_screen() const { return full_screen_; }
  void toggle_full_screen();
  /// The close button was pressed, or the system asks for it.
  [[nodiscard]] bool closing() const;

  /// Begins ImGui's frame.
  void new_frame();
  /// A picture of ImGui alone: clears, draws, shows. What the OpenGL says is counted.
  void show_page();
  [[nodiscard]] int gl_errors() const { return gl_errors_; }
  void count_gl_errors();

  /// Does `work` in a thread of its own and meanwhile shows what is being done and how far it is, so that the window
  /// answers. Returns when it has ended, throws what it threw. `work` gets a context whose progress is shown.
  void while_working(const std::string& words, const Context& context, const std::function<void(const Context&)>& work);

 private:
  void apply_scale();
  GLFWwindow* window_ = nullptr;
  int width_ = 0, height_ = 0, em_ = 0;
  double reported_scale_ = 1, fixed_scale_, by_hand_;
  bool full_screen_ = false, attended_ = true, uncovered_ = false, put_away_ = false;
  int windowed_[4] = {0, 0, 0, 0};
  int gl_errors_ = 0;
  std::vector<std::filesystem::path> dropped_;
};

}  // namespace osteo::inline app
