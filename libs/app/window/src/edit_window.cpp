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
#include <string>
#include <utility>
#include <vector>

#include "cut_picture.h"
#include "edit_control.h"
#include "edit_overlay.h"
#include "edit_panel.h"
#include "edit_scene.h"
#include "edit_state.h"
#include "gl_texture.h"
#include "open_window.h"
#include "osteo/app/window/person_settings.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/translate.h"
#include "osteo/imaging/edit/edit_file.h"
#include "ui_kit.h"
#include "ui_style.h"
#include "view_layout.h"

namespace osteo::inline app {
namespace {

using Clock = std::chrono::steady_clock;

// Parted at spaces where a line would be wider.
std::string in_lines(const std::string& words, float width) {
  std::string lines;
  for (std::size_t at = 0, line = 0; at < words.size();) {
    const std::size_t end = std::min(words.find(' ', at), words.size());
    const std::string word = words.substr(at, end - at);
    if (!lines.empty()) {
      const std::string longer = lines.substr(line) + " " + word;
      const bool fits = ImGui::CalcTextSize(longer.c_str()).x <= width;
      lines += fits ? ' ' : '\n';
      if (!fits) line = lines.size();
    }
    lines += word;
    at = end + 1;
  }
  return lines;
}

class EditWindow {
 public:
  EditWindow(EditDocument& document, const EditWindowOptions& options, const EditWindowActions& actions)
      : control_(document), actions_(actions), state_file_(options.state_file) {
    open(options);
    if (!state_file_.empty()) keep_places();
    control_.places = options.places;
    panel_.set_network(
        static_cast<bool>(actions.find),
        options.network.empty() ? PersonSettings(PersonSettings::usual_file()).values.network : options.network);
    scene_ = std::make_unique<EditScene>();
    for (unsigned& t : textures_) t = make_texture(false);
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
    glfwSetWindowContentScaleCallback(
        window_, [](GLFWwindow* w, float sx, float) { self(w).reported_scale_ = static_cast<double>(sx); });

    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;
    ImGui_ImplGlfw_InitForOpenGL(window_, true);
    ImGui_ImplOpenGL3_Init("#version 150");
    float sx = 1, sy = 1;
    glfwGetWindowContentScale(window_, &sx, &sy);
    reported_scale_ = static_cast<double>(sx);
    fixed_scale_ = options.scale;
    const PersonSettings person(PersonSettings::usual_file());
    by_hand_ = person.values.scale;
    take_theme(person.values.theme);
  }

  // Text of 16 pixels at 96 dots an inch, of any at the same size on the desk, times what the person chose.
  void set_scale() {
    const int wanted = em_that_fits(fixed_scale_, reported_scale_, by_hand_, width_, height_);
    if (wanted == em_ && !letters_missing()) return;
    em_ = wanted;
    scale_ = static_cast<float>(em_) / static_cast<float>(kTextPixels);
    set_ui_style(em_);
    awake_ = 3;
    ImGui_ImplOpenGL3_DestroyFontsTexture();
    ImGui_ImplOpenGL3_CreateFontsTexture();
    ImGui::GetStyle().WindowBorderSize = 0;
  }

  void finish_saving() {
    const auto done = actions_.saved();
    if (!done) return;
    saving_ = false;
    control_.say(done->text);
    if (done->ok) control_.saved(saving_version_);
    if (close_after_save_ && done->ok) quit_ = true;
    close_after_save_ = false;
    awake_ = 3;
  }

  // --- one frame --------------------------------------------------------------------------------------------------

  void frame() {
    const Clock::time_point begin = Clock::now();
    glfwGetFramebufferSize(window_, &width_, &height_);
    if (width_ < 200 || height_ < 150 || glfwGetWindowAttrib(window_, GLFW_ICONIFIED) != 0) {  // put away
      events_.clear();
      awake_ = 0;
      control_.tick();
      finish_saving();
      if (wants_close_ && !control_.unsaved() && !saving_) quit_ = true;
      if (wants_close_ && !quit_) glfwRestoreWindow(window_);  // it asks, where it can be seen
      return;
    }
    set_scale();
    lay_out();
    if (!asking_) handle_events();
    control_.tick();
    if (auto preview = control_.take_preview()) {
      scene_->show(*preview);
      awake_ = std::max(awake_, 2);
    }
    finish_saving();
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
    const EditPanel::Wishes wishes = panel_.draw(control_, panel_width(), static_cast<float>(height_), saving_);
    if (wishes.save) save();
    if (wishes.find) find_structures();
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
                            panel_.first_place(),
                            panel_.find_button()};
      write_edit_state(state, control_, state_file_);
    }
  }

  [[nodiscard]] float panel_width() const {
    return std::round(std::min(340 * scale_, static_cast<float>(width_) * 0.4F));
  }
  // Of the words at the foot, which need more lines where it is narrow.
  [[nodiscard]] int bar_height() const {
    const bool narrow = static_cast<float>(width_) - panel_width() < 560 * scale_;
    return static_cast<int>(std::round((narrow ? 124 : 84) * scale_));
  }

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

  void find_structures() {
    const std::string folder = panel_.network(), name = std::filesystem::path(folder).filename().string();
    control_.find_structures(filled(tr("structures by {network}"), {{"network", name}}),
                             [find = actions_.find, ct = control_.document().ct(), folder](const Context& context) {
                               return find(ct, folder, context);
                             });
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
        put_pixels(textures_[static_cast<std::size_t>(v)], b.width, b.height, 4, pixels_.data());
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
      const std::string caption = control_.previewing() ? tr("3D preview, being made ...")
                                  : control_.live()     ? tr("3D preview of the threshold")
                                                        : tr("3D preview, coarse");
      shadowed_text(draw, {lo.x + 8 * scale_, lo.y + 6 * scale_},
                    in_lines(caption, static_cast<float>(b.width) - 16 * scale_));
      draw->PopClipRect();
    }
  }

  // The crosshair may move within a slice, which stays the same.
  static bool same_picture(const SliceView& a, const SliceView& b) {
    return a.width == b.width && a.height == b.height && a.mm_per_pixel == b.mm_per_pixel &&
           length(a.world(0, 0) - b.world(0, 0)) < 1e-9;
  }

  void status_bar() {
    const float left = panel_width(), u = unit(), wide = static_cast<float>(width_) - left,
                high = static_cast<float>(bar_height());
    // What is longer than it has room for can be scrolled to.
    begin_fixed("Status", {left, static_cast<float>(height_) - high, wide, high});
    // Above what can be done and where the mouse is, below what was said last.
    const std::string hint = control_.hint(), place = control_.readout();
    const float room = ImGui::GetContentRegionAvail().x, place_wide = ImGui::CalcTextSize(place.c_str()).x;
    ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {8 * u, 2 * u});
    kit_text(hint, theme().quiet);
    if (!place.empty()) {
      if (ImGui::CalcTextSize(hint.c_str()).x + place_wide + 16 * u <= room) ImGui::SameLine(room - place_wide);
      kit_text(place, theme().text);
    }
    if (control_.busy()) {
      ImGui::ProgressBar(static_cast<float>(control_.progress()), {std::min(160 * u, room), ImGui::GetFontSize()});
      ImGui::SameLine();
    }
    kit_text(control_.message(), theme().text);
    ImGui::PopStyleVar();
    ImGui::End();
  }

  void help() {
    const float u = unit(), w = std::min(960 * u, static_cast<float>(width_) - 16 * u),
                h = std::min(680 * u, static_cast<float>(height_) - 16 * u);
    begin_card("Mouse and keys", {(static_cast<float>(width_) - w) / 2, (static_cast<float>(height_) - h) / 2, w, h},
               {16 * u, 16 * u});
    kit_title(tr("Mouse and keys"));
    ImGui::SameLine(w - 72 * u);
    if (tile("close", "x", {false, false, true, tr("Close (F1)")}, 40 * u)) control_.show_help = false;
    const float keys = std::min(400 * u, 0.4F * w);
    if (ImGui::BeginTable("keys", 2)) {
      ImGui::TableSetupColumn("keys", ImGuiTableColumnFlags_WidthFixed, keys);
      ImGui::TableSetupColumn("what", ImGuiTableColumnFlags_WidthStretch);
      for (const EditHelpLine& l : edit_help_lines()) {
        ImGui::TableNextRow();
        ImGui::TableSetColumnIndex(0);
        kit_text(tr(l.keys), theme().quiet);
        ImGui::TableSetColumnIndex(1);
        kit_text(tr(l.text), theme().text);
      }
      ImGui::EndTable();
    }
    ImGui::Separator();
    kit_text(
        tr("Everything can be undone. The scan is never changed; what is saved is what was done, and the bone that "
           "follows from it."),
        theme().text);
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
    const std::string texts[] = {saving_ ? tr("It is being saved.") : tr("There are corrections that are not saved.")};
    std::vector<std::string> answers{tr("Go on editing (Esc)")};
    if (saving_) {
      answers.emplace_back(tr("Close when it is saved (Enter)"));
    } else {
      answers.emplace_back(tr("Save and close (Enter)"));
      answers.emplace_back(tr("Close without saving (D)"));
    }
    ImGui::SetNextWindowFocus();
    const int pressed =
        kit_dialog({0, 0, static_cast<float>(width_), static_cast<float>(height_)}, tr("Close?"), texts, answers);
    if (go_on || pressed == 0) {
      asking_ = false;
      close_after_save_ = false;
    } else if (save_now || pressed == 1) {
      if (!saving_) save();
      close_after_save_ = saving_;
      asking_ = false;
    } else if (!saving_ && (discard || pressed == 2)) {
      quit_ = true;
    }
    awake_ = std::max(awake_, 1);
  }

  EditControl control_;
  EditWindowActions actions_;
  std::filesystem::path state_file_;
  GLFWwindow* window_ = nullptr;
  int width_ = 0, height_ = 0;
  int em_ = 0;
  float scale_ = 1;
  double reported_scale_ = 1, fixed_scale_ = 0, by_hand_ = 1;
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
