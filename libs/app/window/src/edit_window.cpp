#include "osteo/app/window/edit_window.h"

// GLEW, through VTK, must come before anything that includes GL.
#include <vtk_glew.h>

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "cut_picture.h"
#include "edit_control.h"
#include "edit_overlay.h"
#include "edit_panel.h"
#include "edit_scene.h"
#include "edit_state.h"
#include "open_window.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/translate.h"
#include "osteo/imaging/edit/edit_file.h"
#include "ui_style.h"

namespace osteo::inline app {
namespace {

using Clock = std::chrono::steady_clock;

class EditWindow {
 public:
  EditWindow(EditDocument& document, const EditWindowOptions& options, const EditWindowActions& actions)
      : control_(document), actions_(actions), state_file_(options.state_file) {
    open(options);
    panel_.set_places(options.places);
    scene_ = std::make_unique<EditScene>();
    glGenTextures(3, textures_.data());
    for (const unsigned t : textures_) {
      glBindTexture(GL_TEXTURE_2D, t);
      glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
      glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    }
    glBindTexture(GL_TEXTURE_2D, 0);
    const auto* const renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    const std::string name = renderer != nullptr ? renderer : "";
    if (name.find("llvmpipe") != std::string::npos || name.find("softpipe") != std::string::npos)
      control_.preview_voxels = 500'000;
    control_.say(tr("F1 shows what mouse and keys do"));
  }

  ~EditWindow() {
    glfwMakeContextCurrent(window_);
    glDeleteTextures(3, textures_.data());
    scene_.reset();
    ImGui_ImplOpenGL3_Shutdown();
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
    glfwDestroyWindow(window_);
    glfwTerminate();
  }
  EditWindow(const EditWindow&) = delete;
  EditWindow& operator=(const EditWindow&) = delete;

  int run() {
    while (!quit_ && !actions_.stop()) {
      // Nothing moves by itself: a picture only when something happened, or may have behind the window.
      if (awake_ > 0) {
        --awake_;
        glfwPollEvents();
      } else {
        glfwWaitEventsTimeout(control_.busy() || control_.previewing() || saving_ ? 0.03 : 0.2);
      }
      frame();
    }
    return gl_errors_;
  }

 private:
  // --- set-up -----------------------------------------------------------------------------------------------------

  struct Event {
    enum class Kind { move, press, release, wheel, key } kind;
    double x = 0, y = 0;  // of the mouse then; of a wheel, notches are `value`
    int code = 0, mods = 0;
    double value = 0;
  };

  static EditWindow& self(GLFWwindow* w) { return *static_cast<EditWindow*>(glfwGetWindowUserPointer(w)); }
  void note(Event e) {
    if (e.kind != Event::Kind::move) {
      e.x = mouse_x_;
      e.y = mouse_y_;
    } else {
      mouse_x_ = e.x;
      mouse_y_ = e.y;
    }
    events_.push_back(e);
    awake_ = 3;
  }

  void open(const EditWindowOptions& options) {
    window_ = open_window(options.title, options.width, options.height,
                          "is there a display? Without one: osteo edit CASE --apply edits.json");
    glfwSetWindowUserPointer(window_, this);
    // ImGui chains these behind its own. Events, not states: at few pictures a second a click begins and ends between
    // two of them.
    using K = Event::Kind;
    glfwSetCursorPosCallback(window_, [](GLFWwindow* w, double px, double py) {
      self(w).note({K::move, px, py, 0, 0, 0});
    });
    glfwSetMouseButtonCallback(window_, [](GLFWwindow* w, int button, int action, int mods) {
      self(w).note({action == GLFW_PRESS ? K::press : K::release, 0, 0, button, mods, 0});
    });
    glfwSetScrollCallback(window_, [](GLFWwindow* w, double, double dy) { self(w).note({K::wheel, 0, 0, 0, 0, dy}); });
    glfwSetKeyCallback(window_, [](GLFWwindow* w, int key, int, int action, int mods) {
      EditWindow& me = self(w);
      const bool down = action != GLFW_RELEASE;
      if (key == GLFW_KEY_LEFT_SHIFT || key == GLFW_KEY_RIGHT_SHIFT) me.shift_ = down;
      if (key == GLFW_KEY_LEFT_CONTROL || key == GLFW_KEY_RIGHT_CONTROL) me.control_key_ = down;
      if (down) me.note({K::key, 0, 0, key, mods, 0});
      me.awake_ = 3;
    });
    glfwSetWindowCloseCallback(window_, [](GLFWwindow* w) {
      glfwSetWindowShouldClose(w, GLFW_FALSE);
      self(w).wants_close_ = true;
    });
    glfwSetWindowRefreshCallback(window_, [](GLFWwindow* w) { self(w).awake_ = 3; });
    glfwSetWindowFocusCallback(window_, [](GLFWwindow* w, int) { self(w).shift_ = self(w).control_key_ = false; });
    glfwSetWindowContentScaleCallback(window_, [](GLFWwindow* w, float sx, float) { self(w).new_scale_ = sx; });

    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;
    ImGui_ImplGlfw_InitForOpenGL(window_, true);
    ImGui_ImplOpenGL3_Init("#version 150");
    float sx = 1, sy = 1;
    glfwGetWindowContentScale(window_, &sx, &sy);
    new_scale_ = sx;
  }

  // Text of 16 pixels at 96 dots an inch, of any at the same size on the desk.
  void set_scale() {
    scale_ = std::clamp(std::exchange(new_scale_, 0.0F), 1.0F, 4.0F);
    set_ui_style(static_cast<int>(std::lround(kTextPixels * scale_)));
    ImGui_ImplOpenGL3_DestroyFontsTexture();
    ImGui_ImplOpenGL3_CreateFontsTexture();
    ImGui::GetStyle().WindowBorderSize = 0;
  }

  // --- one frame --------------------------------------------------------------------------------------------------

  void frame() {
    const Clock::time_point begin = Clock::now();
    if (new_scale_ > 0) set_scale();
    glfwGetFramebufferSize(window_, &width_, &height_);
    if (width_ < 200 || height_ < 150) {  // put away
      events_.clear();
      return;
    }
    lay_out();
    if (!asking_) handle_events();
    control_.tick();
    if (auto preview = control_.take_preview()) {
      scene_->show(*preview);
      awake_ = std::max(awake_, 2);
    }
    if (auto done = actions_.saved()) {
      saving_ = false;
      control_.say(done->text);
      if (done->ok) control_.saved(saving_version_);
      if (close_after_save_ && done->ok) quit_ = true;
      close_after_save_ = false;
      awake_ = 3;
    }
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
    const EditPanel::Wishes wishes = panel_.draw(control_, panel_width(), static_cast<float>(height_), scale_, saving_);
    if (wishes.save) save();
    wants_close_ = wants_close_ || wishes.close;
    status_bar();
    if (control_.show_help) help();
    if (std::exchange(wants_close_, false)) {
      if (control_.unsaved() || saving_) {
        asking_ = true;
      } else {
        quit_ = true;
      }
    }
    if (asking_) ask();
    views();
    ImGui::Render();
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, width_, height_);
    glDisable(GL_SCISSOR_TEST);
    glClearColor(0, 0, 0, 1);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
    for (GLenum e = glGetError(); e != GL_NO_ERROR && gl_errors_ < 1000; e = glGetError()) ++gl_errors_;
    const double ms = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
    if (++pictures_ > 3) worst_ms_ = std::max(worst_ms_, ms);  // the first ones compile shaders
    glfwSwapBuffers(window_);
    if (!state_file_.empty()) {
      EditWindowState state{pictures_,
                            width_,
                            height_,
                            boxes_,
                            saving_,
                            asking_,
                            worst_ms_,
                            scene_->triangles(),
                            panel_.threshold_slider(),
                            panel_.first_place()};
      write_edit_state(state, control_, state_file_);
    }
  }

  [[nodiscard]] float panel_width() const {
    return std::round(std::min(340 * scale_, static_cast<float>(width_) * 0.4F));
  }
  [[nodiscard]] int bar_height() const { return static_cast<int>(std::round(76 * scale_)); }

  void lay_out() {
    const int left = static_cast<int>(panel_width()) + 2, gap = 2;
    const int w = width_ - left, h = height_ - bar_height();
    boxes_ = {};
    if (control_.enlarged() >= 0) {
      boxes_[static_cast<std::size_t>(control_.enlarged())] = {left, 0, w, h};
    } else {
      const int half_w = (w - gap) / 2, half_h = (h - gap) / 2;
      boxes_[0] = {left, 0, half_w, half_h};
      boxes_[3] = {left + half_w + gap, 0, w - half_w - gap, half_h};
      boxes_[1] = {left, half_h + gap, half_w, h - half_h - gap};
      boxes_[2] = {left + half_w + gap, half_h + gap, w - half_w - gap, h - half_h - gap};
    }
    for (int v = 0; v < 3; ++v) {
      const EditViewBox& b = boxes_[static_cast<std::size_t>(v)];
      if (b.width > 0) control_.resize(v, b.width, b.height);
    }
    if (!fitted_) control_.fit();
    fitted_ = true;
  }

  [[nodiscard]] SlicePointer pointer(double x, double y, int view) const {
    SlicePointer p{view, 0, 0, shift_, control_key_};
    if (view >= 0) {
      p.x = x - boxes_[static_cast<std::size_t>(view)].x;
      p.y = y - boxes_[static_cast<std::size_t>(view)].y;
    }
    return p;
  }
  [[nodiscard]] int view_at(double x, double y) const {
    for (int v = 0; v < 4; ++v) {
      if (boxes_[static_cast<std::size_t>(v)].holds(x, y)) return v;
    }
    return -1;
  }

  void handle_events() {
    // Help lies over the views; a drag that began in a view goes on wherever the mouse is.
    const ImGuiIO& io = ImGui::GetIO();
    for (const Event& e : std::exchange(events_, {})) {
      const int view = dragging_ >= 0 ? dragging_ : control_.show_help && io.WantCaptureMouse ? -1 : view_at(e.x, e.y);
      const SlicePointer at = pointer(e.x, e.y, view);
      const SliceButton button = e.code == GLFW_MOUSE_BUTTON_LEFT    ? SliceButton::left
                                 : e.code == GLFW_MOUSE_BUTTON_RIGHT ? SliceButton::right
                                                                     : SliceButton::middle;
      switch (e.kind) {
        case Event::Kind::move:
          if (dragging_ == kView3D) {
            const double dx = e.x - drag_x_, dy = e.y - drag_y_;
            if (drag_button_ == SliceButton::left) scene_->turn(dx, dy);
            if (drag_button_ == SliceButton::right) scene_->zoom(std::exp(-dy * 0.01));
            if (drag_button_ == SliceButton::middle) scene_->shift(dx, dy);
            drag_x_ = e.x;
            drag_y_ = e.y;
          } else {
            control_.move(at);
          }
          break;
        case Event::Kind::press: {
          if (view < 0) break;
          const Clock::time_point now = Clock::now();
          const bool twice = button == SliceButton::left &&
                             std::chrono::duration<double>(now - last_press_).count() < 0.4 &&
                             std::abs(e.x - press_x_) < 6 && std::abs(e.y - press_y_) < 6;
          last_press_ = twice ? Clock::time_point() : now;
          press_x_ = drag_x_ = e.x;
          press_y_ = drag_y_ = e.y;
          if (twice) {
            control_.double_click(at);
            lay_out();
            break;
          }
          if (dragging_ >= 0) break;
          dragging_ = view;
          drag_button_ = button;
          if (view < kView3D) control_.press(at, button);
          break;
        }
        case Event::Kind::release:
          if (dragging_ < 0 || button != drag_button_) break;
          if (dragging_ < kView3D) control_.release(at, button);
          dragging_ = -1;
          break;
        case Event::Kind::wheel:
          if (view == kView3D) {
            scene_->zoom(std::pow(1.1, e.value));
          } else {
            control_.wheel(at, e.value);
          }
          break;
        case Event::Kind::key:
          if (!io.WantTextInput) key(e.code, e.mods);
          break;
      }
    }
  }

  void key(int code, int mods) {
    const EditKeyRow* const row = find_edit_key(code, (mods & GLFW_MOD_CONTROL) != 0, (mods & GLFW_MOD_SHIFT) != 0);
    if (row == nullptr || control_.key(*row)) return;
    const double other = row->value == 0 ? 1 : -1;
    if (row->does == EditKey::save) save();
    if (row->does == EditKey::help) control_.show_help = !control_.show_help;
    if (row->does == EditKey::close) wants_close_ = true;
    if (row->does == EditKey::from_front) scene_->look_from({0, -other, 0.05});
    if (row->does == EditKey::from_left) scene_->look_from({other, 0, 0.05});
    if (row->does == EditKey::from_above) scene_->look_from({0, -0.02, other});
  }

  void save() {
    if (saving_ || control_.busy() || !control_.unsaved()) return;
    if (control_.document().in_stroke()) return;
    saving_ = true;
    saving_version_ = control_.document().version();
    control_.say(tr("saving: rebuilding the bone of the case ..."));
    actions_.save(edits_text(recipe_of(control_.document())));
  }

  // --- what is drawn ------------------------------------------------------------------------------------------------

  void views() {
    const bool redraw = control_.take_redraw();
    CutLook look;
    look.hu = control_.hu;
    look.outlines = control_.show_outlines;
    look.line_pixels = scale_ > 1.4F ? 2 : 1;
    look.live = control_.live();
    ImDrawList* const draw = ImGui::GetBackgroundDrawList();
    for (int v = 0; v < 3; ++v) {
      const EditViewBox& b = boxes_[static_cast<std::size_t>(v)];
      if (b.width <= 0) continue;
      std::optional<SliceView>& drawn = drawn_[static_cast<std::size_t>(v)];
      if (redraw || !drawn || !same_picture(*drawn, control_.view(v))) {
        drawn = control_.view(v);
        draw_cut(control_.view(v), control_.document(), look, pixels_);
        glBindTexture(GL_TEXTURE_2D, textures_[static_cast<std::size_t>(v)]);
        glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
        glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, b.width, b.height, 0, GL_RGBA, GL_UNSIGNED_BYTE, pixels_.data());
        glBindTexture(GL_TEXTURE_2D, 0);
      }
      const ImVec2 lo{static_cast<float>(b.x), static_cast<float>(b.y)},
          hi{static_cast<float>(b.x + b.width), static_cast<float>(b.y + b.height)};
      draw->AddImage(reinterpret_cast<ImTextureID>(static_cast<std::intptr_t>(textures_[static_cast<std::size_t>(v)])),
                     lo, hi);
      draw->PushClipRect(lo, hi);
      annotate_slice(draw, control_, v, lo, scale_);
      draw->PopClipRect();
    }
    if (redraw) {
      for (int v = 0; v < 3; ++v) {
        if (boxes_[static_cast<std::size_t>(v)].width <= 0) drawn_[static_cast<std::size_t>(v)].reset();
      }
    }
    const EditViewBox& b = boxes_[kView3D];
    if (b.width > 0) {
      const unsigned texture = scene_->texture(b.width, b.height);
      const ImVec2 lo{static_cast<float>(b.x), static_cast<float>(b.y)},
          hi{static_cast<float>(b.x + b.width), static_cast<float>(b.y + b.height)};
      draw->AddImage(reinterpret_cast<ImTextureID>(static_cast<std::intptr_t>(texture)), lo, hi, {0, 1}, {1, 0});
      draw->PushClipRect(lo, hi);
      if (control_.show_cross) {
        const auto p = scene_->pixel(control_.cross_mm());
        const ImVec2 c{lo.x + static_cast<float>(p[0]), lo.y + static_cast<float>(p[1])};
        draw->AddCircle(c, 7 * scale_, kCrossColour, 0, 2 * scale_);
      }
      shadowed_text(draw, {lo.x + 8 * scale_, lo.y + 6 * scale_},
                    control_.previewing() ? tr("3D preview, being made ...")
                    : control_.live()     ? tr("3D preview of the threshold")
                                          : tr("3D preview, coarse"));
      draw->PopClipRect();
    }
  }

  // The crosshair may move within a slice, which stays the same.
  static bool same_picture(const SliceView& a, const SliceView& b) {
    return a.width == b.width && a.height == b.height && a.mm_per_pixel == b.mm_per_pixel &&
           length(a.world(0, 0) - b.world(0, 0)) < 1e-9;
  }

  void status_bar() {
    const float left = panel_width();
    ImGui::SetNextWindowPos({left, static_cast<float>(height_ - bar_height())});
    ImGui::SetNextWindowSize({static_cast<float>(width_) - left, static_cast<float>(bar_height())});
    ImGui::Begin("Status", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoBringToFrontOnFocus);
    const std::string place = control_.readout();
    ImGui::TextColored({0.75F, 0.85F, 1, 1}, "%s", control_.hint().c_str());
    if (!place.empty()) {
      ImGui::SameLine(std::max(0.0F, ImGui::GetWindowWidth() - ImGui::CalcTextSize(place.c_str()).x - 12 * scale_));
      ImGui::Text("%s", place.c_str());
    }
    if (control_.busy()) {
      ImGui::ProgressBar(static_cast<float>(control_.progress()), {160 * scale_, ImGui::GetFontSize()});
      ImGui::SameLine();
    }
    ImGui::Text("%s", control_.message().c_str());
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", control_.message().c_str());
    ImGui::End();
  }

  void help() {
    const float w = std::min(960 * scale_, static_cast<float>(width_) - 20),
                h = std::min(680 * scale_, static_cast<float>(height_) - 20);
    ImGui::SetNextWindowPos({(static_cast<float>(width_) - w) / 2, (static_cast<float>(height_) - h) / 2});
    ImGui::SetNextWindowSize({w, h});
    ImGui::Begin(tr("Mouse and keys"), &control_.show_help,
                 ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoMove);
    for (const EditHelpLine& l : edit_help_lines()) {
      ImGui::TextColored({1, 0.88F, 0.55F, 1}, "%s", tr(l.keys));
      ImGui::SameLine(400 * scale_);
      ImGui::TextWrapped("%s", tr(l.text));
    }
    ImGui::Separator();
    ImGui::TextWrapped(
        "%s",
        tr("Everything can be undone. The scan is never changed; what is saved is what was done, and the bone that "
           "follows from it."));
    ImGui::End();
  }

  void ask() {
    bool save_now = false, discard = false, go_on = false;
    for (const Event& e : std::exchange(events_, {})) {
      if (e.kind != Event::Kind::key) continue;
      save_now = save_now || e.code == GLFW_KEY_ENTER;
      discard = discard || e.code == GLFW_KEY_D;
      go_on = go_on || e.code == GLFW_KEY_ESCAPE;
    }
    const float w = 500 * scale_;
    ImGui::SetNextWindowPos({(static_cast<float>(width_) - w) / 2, static_cast<float>(height_) / 3});
    ImGui::SetNextWindowSize({w, 0});
    ImGui::SetNextWindowFocus();
    ImGui::Begin(tr("Close?"), nullptr,
                 ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoMove);
    ImGui::TextWrapped("%s", saving_ ? tr("It is being saved.") : tr("There are corrections that are not saved."));
    const ImVec2 size{-1, ImGui::GetFontSize() * 1.9F};
    if (saving_) {
      if (ImGui::Button(tr("Close when it is saved (Enter)"), size) || save_now) {
        close_after_save_ = true;
        asking_ = false;
      }
    } else {
      if (ImGui::Button(tr("Save and close (Enter)"), size) || save_now) {
        save();
        close_after_save_ = saving_;
        asking_ = false;
      }
      if (ImGui::Button(tr("Close without saving (D)"), size) || discard) quit_ = true;
    }
    if (ImGui::Button(tr("Go on editing (Esc)"), size) || go_on) {
      asking_ = false;
      close_after_save_ = false;
    }
    ImGui::End();
    awake_ = std::max(awake_, 1);
  }

  EditControl control_;
  EditWindowActions actions_;
  std::filesystem::path state_file_;
  GLFWwindow* window_ = nullptr;
  int width_ = 0, height_ = 0;
  float scale_ = 1, new_scale_ = 0;
  std::unique_ptr<EditScene> scene_;
  EditPanel panel_;
  std::array<unsigned, 3> textures_{};
  std::array<std::optional<SliceView>, 3> drawn_;
  std::vector<std::uint32_t> pixels_;
  std::array<EditViewBox, 4> boxes_;
  std::vector<Event> events_;
  double mouse_x_ = 0, mouse_y_ = 0, press_x_ = 0, press_y_ = 0, drag_x_ = 0, drag_y_ = 0;
  Clock::time_point last_press_;
  int dragging_ = -1;
  SliceButton drag_button_ = SliceButton::left;
  bool shift_ = false, control_key_ = false, fitted_ = false;
  bool quit_ = false, wants_close_ = false, asking_ = false, saving_ = false, close_after_save_ = false;
  std::uint64_t saving_version_ = 0, pictures_ = 0;
  double worst_ms_ = 0;
  int gl_errors_ = 0, awake_ = 5;
};

}  // namespace

int run_edit_window(EditDocument& document, const EditWindowOptions& options, const EditWindowActions& actions) {
  return EditWindow(document, options, actions).run();
}

}  // namespace osteo::inline app
