#include "osteo/window/rehearsal_window.h"

// GLEW, through VTK, must come before anything that includes GL.
#include <vtk_glew.h>

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkOpenGLState.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <optional>

#include "cuts_panel.h"
#include "gamepad.h"
#include "help_panel.h"
#include "osteo/base/error.h"
#include "osteo/io/surface_io.h"
#include "osteo/view/actors.h"
#include "osteo/view/offscreen.h"
#include "osteo/view/world_view.h"
#include "scene_tools.h"
#include "status_panel.h"

namespace osteo {
namespace {

constexpr int kPanelWidth = 270, kSliceWidth = 290;
constexpr Vec3 kFromLeft{0.94, -0.25, 0.22};

class RehearsalWindow {
 public:
  RehearsalWindow(const WindowOptions& options, const SparseGrid* hu, const WindowActions& actions)
      : actions_(actions), scan_(options.scan), tool_(options.tool), device_name_(options.device) {
    if (hu != nullptr) cuts_.set_hu(*hu);
    open(options);
    make_scene();
    new_bone();
    look_from(kFromLeft);
    park_drill();
  }

  ~RehearsalWindow() {
    glfwMakeContextCurrent(window_);
    cuts_.release();
    tools_.reset();
    world_view_.reset();
    render_window_->Finalize();
    ImGui_ImplOpenGL3_Shutdown();
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
    glfwDestroyWindow(window_);
    glfwTerminate();
  }
  RehearsalWindow(const RehearsalWindow&) = delete;
  RehearsalWindow& operator=(const RehearsalWindow&) = delete;

  int run() {
    while (glfwWindowShouldClose(window_) == 0 && !quit_) frame();
    return gl_errors_;
  }

 private:
  // --- set-up -----------------------------------------------------------------------------------------------------

  void open(const WindowOptions& options) {
    static std::string reason;
    glfwSetErrorCallback([](int, const char* text) { reason = text; });
    if (glfwInit() == GLFW_FALSE)
      throw Error(ExitCode::failed, "no window can be opened: " + reason,
                  "is there a display? Without one: osteo rehearse CASE --headless");
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 2);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    window_ = glfwCreateWindow(options.width, options.height, options.title.c_str(), nullptr, nullptr);
    if (window_ == nullptr) {
      glfwTerminate();
      throw Error(ExitCode::failed, "no window can be opened: " + reason, "OpenGL 3.2 is needed");
    }
    glfwMakeContextCurrent(window_);
    glfwSwapInterval(1);

    render_window_ = vtkSmartPointer<vtkGenericOpenGLRenderWindow>::New();
    render_window_->SetOwnContext(0);
    render_window_->SetIsCurrent(true);
    render_window_->SetReadyForRendering(true);
    render_window_->SetMultiSamples(0);
    render_window_->OpenGLInitContext();
    render_window_->SetFrameBlitModeToBlitToCurrent();
    render_window_->AddRenderer(renderer_);

    // Keys are queued by a callback, which ImGui chains behind its own: at few pictures a second a short press begins and
    // ends between two frames, and asking for the state of a key would miss it.
    glfwSetWindowUserPointer(window_, this);
    glfwSetKeyCallback(window_, [](GLFWwindow* w, int key, int, int action, int) {
      auto* const self = static_cast<RehearsalWindow*>(glfwGetWindowUserPointer(w));
      if (action != GLFW_RELEASE) self->pressed_keys_.push_back({key, action == GLFW_REPEAT});
    });
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;
    ImGui::StyleColorsDark();
    ImGui::GetStyle().WindowRounding = 0;
    ImGui_ImplGlfw_InitForOpenGL(window_, true);
    ImGui_ImplOpenGL3_Init("#version 150");
    cuts_.create();
  }

  void make_scene() {
    set_up_scene(renderer_);
    for (const auto& [actor, mapper] : {std::pair<vtkActor*, vtkPolyDataMapper*>{burr_, burr_mapper_}, {shaft_, shaft_mapper_}}) {
      actor->SetMapper(mapper);
      actor->SetUserMatrix(tool_matrix_);
      renderer_->AddActor(actor);
    }
    burr_->GetProperty()->SetColor(0.75, 0.72, 0.62);
    burr_->GetProperty()->SetSpecular(0.6);
    burr_->GetProperty()->SetSpecularPower(40);
    shaft_->GetProperty()->SetColor(0.62, 0.66, 0.72);
    shaft_->GetProperty()->SetSpecular(0.5);
    set_tool(tool_);
  }

  // The running rehearsal has another bone: show it.
  void new_bone() {
    world_view_ = std::make_unique<WorldView>(renderer_, actions_.rehearsal().structures());
    Vec3 lo{1e30, 1e30, 1e30}, hi{-1e30, -1e30, -1e30};
    actions_.rehearsal().look([&](const World& world, Follower& follower) {
      world_view_->update(world, follower);
      const BrickGrid& bone = world.bodies().front().body->bone;
      for (std::uint32_t b = 0; b < bone.brick_count(); ++b) {
        const Ijk o = bone.brick_coordinate(b);
        const Vec3 p = bone.frame().world_from_index({o.i * 8 + 3.5, o.j * 8 + 3.5, o.k * 8 + 3.5});
        for (std::size_t a = 0; a < 3; ++a) {
          lo[a] = std::min(lo[a], p[a]);
          hi[a] = std::max(hi[a], p[a]);
        }
      }
    });
    centre_ = (lo + hi) * 0.5;
    radius_ = std::max(5.0, 0.5 * length(hi - lo));
    if (!tools_) tools_ = std::make_unique<SceneTools>(renderer_);
    tools_->renew(centre_, 2 * radius_);
    cuts_.renew();
  }

  void look_from(Vec3 eye) { look_at(renderer_, centre_, 0.8 * radius_, normalized(eye)); }

  // In front of the bone as seen now, drill off.
  void park_drill() {
    const Vec3 towards = view_direction() * -1;
    goal_ = {centre_ + towards * radius_, {}, 0, static_cast<std::uint8_t>(tool_)};
    send_goal();
  }

  // --- the hand ---------------------------------------------------------------------------------------------------

  [[nodiscard]] Vec3 view_direction() const {
    double d[3];
    renderer_->GetActiveCamera()->GetDirectionOfProjection(d);
    return {d[0], d[1], d[2]};
  }

  void send_goal() {
    const Vec3 forward = view_direction();
    double up[3];
    renderer_->GetActiveCamera()->GetViewUp(up);
    const Vec3 right = normalized(cross(forward, {up[0], up[1], up[2]})), above = cross(right, forward);
    // A drill is held from the right; a plate lies flat against what one looks at.
    const bool plate = tools_ && tools_->tool() == SceneTools::Tool::plate;
    const Vec3 axis = plate ? forward * -1 : normalized(right * 0.62 + above * 0.45 - forward * 0.64);
    goal_.axis = to_floats(axis);
    goal_.tool = static_cast<std::uint8_t>(tool_);
    goal_.drill_on = drill_latched_ || drill_held_ ? 1 : 0;
    Device& device = actions_.rehearsal().device();
    if (auto* const mouse = dynamic_cast<MouseDevice*>(&device)) {
      mouse->set_goal(goal_);
    } else {
      device.set_tool(static_cast<std::uint8_t>(tool_));  // it moves and drills by itself
    }
  }

  // The same burr but for one property.
  void set_kind(BurrKind kind) {
    const Burr& b = burr_library()[static_cast<std::size_t>(tool_)];
    set_tool(burr_index(kind, b.diameter_mm, b.shape));
  }
  void set_diameter(int diameter_mm) {
    const Burr& b = burr_library()[static_cast<std::size_t>(tool_)];
    set_tool(burr_index(b.kind, diameter_mm, b.shape));
  }
  void set_shape(BurrShape shape) {
    const Burr& b = burr_library()[static_cast<std::size_t>(tool_)];
    set_tool(burr_index(b.kind, b.diameter_mm, shape));
  }

  void set_tool(int tool) {
    tool_ = tool;
    const Burr& burr = burr_library()[static_cast<std::size_t>(tool)];
    burr_mapper_->SetInputData(round_cone_surface(burr.head()));
    shaft_mapper_->SetInputData(round_cone_surface(burr.shaft()));
  }

  // World point under a window position at the depth of `reference` along the view.
  [[nodiscard]] Vec3 unproject(double x, double y, Vec3 reference) {
    renderer_->SetWorldPoint(reference.x, reference.y, reference.z, 1);
    renderer_->WorldToDisplay();
    const double depth = renderer_->GetDisplayPoint()[2];
    renderer_->SetDisplayPoint(x, height_ - 1 - y, depth);
    renderer_->DisplayToWorld();
    const double* const w = renderer_->GetWorldPoint();
    return {w[0] / w[3], w[1] / w[3], w[2] / w[3]};
  }

  [[nodiscard]] ViewAxes view_axes() {
    double p[3], up[3];
    renderer_->GetActiveCamera()->GetPosition(p);
    renderer_->GetActiveCamera()->GetViewUp(up);
    const Vec3 forward = view_direction(), right = normalized(cross(forward, {up[0], up[1], up[2]}));
    return {{p[0], p[1], p[2]}, forward, right, cross(right, forward)};
  }

  void bring_drill_to_bone(double x, double y) {
    // The bone under the mouse: a ray through the live voxels.
    const Vec3 eye = view_axes().eye_mm;
    std::optional<BoneHit> hit;
    actions_.rehearsal().look([&](const World& world, Follower&) {
      hit = bone_on_ray(world, eye, normalized(unproject(x, y, centre_) - eye), length(centre_ - eye) + 4 * radius_);
    });
    if (!hit) {
      say("no bone under the mouse");
      return;
    }
    const double r = burr_library()[static_cast<std::size_t>(tool_)].diameter_mm / 2;
    goal_.position_mm = hit->at_mm - view_direction() * (r + 1);
    say("drill brought to the bone");
  }

  // --- one frame --------------------------------------------------------------------------------------------------

  void frame() {
    glfwPollEvents();
    glfwGetFramebufferSize(window_, &width_, &height_);
    if (width_ < 200 || height_ < 150) return;
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
    mouse_and_keys();
    panel();
    cuts_.draw(actions_.rehearsal(), tool_,
               {static_cast<float>(width_ - kSliceWidth), 0, static_cast<float>(kSliceWidth), static_cast<float>(height_)});
    if (show_help_) draw_help(show_help_, width_);
    ImGui::Render();

    Rehearsal& rehearsal = actions_.rehearsal();
    rehearsal.look([&](const World& world, Follower& follower) {
      world_view_->update(world, follower);
      if (rehearsal.soft() != nullptr) world_view_->update_soft(*rehearsal.soft());
    });
    world_view_->highlight(tools_->piece());
    const TickRecord tick = rehearsal.latest();
    place_tool(tick);
    tools_->show(tick);
    wash(rehearsal, tick);

    render_window_->SetSize(width_, height_);
    const double left = static_cast<double>(kPanelWidth) / width_, right = 1 - static_cast<double>(kSliceWidth) / width_;
    renderer_->SetViewport(left, 0, right, 1);
    renderer_->ResetCameraClippingRange();
    world_view_->rest(width_ - kPanelWidth - kSliceWidth, height_);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glClearColor(0.05F, 0.06F, 0.08F, 1);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    render_window_->GetState()->Reset();
    render_window_->Render();
    // VTK leaves its state for itself; ImGui saves and restores what it touches.
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
    if (screenshot_wanted_) save_screenshot();
    for (GLenum e = glGetError(); e != GL_NO_ERROR && gl_errors_ < 1000; e = glGetError()) ++gl_errors_;
    glfwSwapBuffers(window_);
  }

  // The second hand: a sucker (V) and water (I) at the burr.
  void wash(Rehearsal& rehearsal, const TickRecord& tick) {
    constexpr double kNozzleMm = 4, kMm3PerS = 60, kSprayMm = 8, kSharePerS = 3;
    const Vec3 at = from_floats(tick.device.position_mm);
    const auto say_once = [&](bool wanted, bool& on, const SceneAction& with, const SceneAction& without) {
      if (wanted || on) rehearsal.act(wanted ? with : without);
      on = wanted;
    };
    say_once(ImGui::IsKeyDown(ImGuiKey_V), sucking_, SceneAction::suction(at, kNozzleMm, kMm3PerS), SceneAction::suction(at, kNozzleMm, 0));
    say_once(key_held(GLFW_KEY_I), washing_, SceneAction::irrigate(at, kSprayMm, kSharePerS), SceneAction::irrigate(at, kSprayMm, 0));
  }
  [[nodiscard]] bool key_held(int key) const { return glfwGetKey(window_, key) == GLFW_PRESS && !ImGui::GetIO().WantTextInput; }

  void place_tool(const TickRecord& tick) {
    const Vec3 axis = normalized(from_floats(tick.device.axis));
    const Vec3 u = any_perpendicular(axis), v = cross(axis, u);
    const Vec3 columns[3] = {u, v, axis};
    for (int c = 0; c < 3; ++c) {
      for (int r = 0; r < 3; ++r) tool_matrix_->SetElement(r, c, columns[c][static_cast<std::size_t>(r)]);
    }
    for (int r = 0; r < 3; ++r) {
      // At the bone's surface, not in it, however far the hand has sunk in.
      const auto a = static_cast<std::size_t>(r);
      tool_matrix_->SetElement(r, 3, static_cast<double>(tick.device.position_mm[a] + tick.shown_offset_mm[a]));
    }
    tool_matrix_->Modified();
    const bool on = tick.device.drill_on != 0, shown = (tick.flags & kPlateInHand) == 0;
    burr_->SetVisibility(shown ? 1 : 0);
    shaft_->SetVisibility(shown ? 1 : 0);
    burr_->GetProperty()->SetColor(on ? 0.95 : 0.75, on ? 0.62 : 0.72, on ? 0.35 : 0.62);
  }

  void mouse_and_keys() {
    const ImGuiIO& io = ImGui::GetIO();
    const ImVec2 m = io.MousePos;
    const bool in_view = m.x >= kPanelWidth && m.x < static_cast<float>(width_ - kSliceWidth) && m.y >= 0 &&
                         m.y < static_cast<float>(height_) && !show_help_;
    vtkCamera* const camera = renderer_->GetActiveCamera();
    if (in_view && !io.WantCaptureMouse) {
      if (ImGui::IsMouseDragging(ImGuiMouseButton_Right)) {
        camera->Azimuth(-0.35 * static_cast<double>(io.MouseDelta.x));
        camera->Elevation(0.35 * static_cast<double>(io.MouseDelta.y));
        camera->OrthogonalizeViewUp();
      } else if (ImGui::IsMouseDragging(ImGuiMouseButton_Middle)) {
        double f[3], p[3];
        camera->GetFocalPoint(f);
        camera->GetPosition(p);
        const Vec3 focal{f[0], f[1], f[2]};
        const Vec3 shift = unproject(static_cast<double>(m.x - io.MouseDelta.x), static_cast<double>(m.y - io.MouseDelta.y), focal) -
                           unproject(static_cast<double>(m.x), static_cast<double>(m.y), focal);
        camera->SetFocalPoint(f[0] + shift.x, f[1] + shift.y, f[2] + shift.z);
        camera->SetPosition(p[0] + shift.x, p[1] + shift.y, p[2] + shift.z);
      } else if (!tools_->in_hand()) {
        use_tool(m, io);
      } else if (io.KeyShift && ImGui::IsMouseDown(ImGuiMouseButton_Left)) {
        goal_.position_mm += view_direction() * (0.05 * static_cast<double>(-io.MouseDelta.y));
      } else if (io.MouseDelta.x != 0 || io.MouseDelta.y != 0) {
        goal_.position_mm = unproject(static_cast<double>(m.x), static_cast<double>(m.y), goal_.position_mm);
      }
      if (io.MouseWheel != 0) {
        if (io.KeyCtrl) {
          camera->Dolly(std::pow(1.1, static_cast<double>(io.MouseWheel)));
        } else if (!tools_->in_hand()) {
          tools_->push(1.0 * static_cast<double>(io.MouseWheel), actions_.rehearsal(), view_axes());
        } else {
          goal_.position_mm += view_direction() * (0.5 * static_cast<double>(io.MouseWheel));
        }
      }
    }
    drill_held_ = in_view && !io.WantCaptureMouse && tools_->tool() == SceneTools::Tool::drill && ImGui::IsMouseDown(ImGuiMouseButton_Left);
    gamepad(static_cast<double>(io.DeltaTime));
    const std::vector<KeyPress> presses = std::exchange(pressed_keys_, {});
    if (!io.WantTextInput) {
      for (const KeyPress& k : presses) key(k, static_cast<double>(m.x), static_cast<double>(m.y), in_view);
    }
    send_goal();
  }

  // Saw and pieces: what the mouse drags is not the hand.
  void use_tool(const ImVec2& m, const ImGuiIO& io) {
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
      const Vec3 eye = view_axes().eye_mm;
      tools_->pick(actions_.rehearsal(), eye, normalized(unproject(static_cast<double>(m.x), static_cast<double>(m.y), centre_) - eye));
    }
    if (!ImGui::IsMouseDown(ImGuiMouseButton_Left) || (io.MouseDelta.x == 0 && io.MouseDelta.y == 0)) return;
    const Vec3 at = tools_->position_mm();
    const Vec3 by = unproject(static_cast<double>(m.x), static_cast<double>(m.y), at) -
                    unproject(static_cast<double>(m.x - io.MouseDelta.x), static_cast<double>(m.y - io.MouseDelta.y), at);
    const ViewAxes view = view_axes();
    tools_->drag(dot(by, view.right), dot(by, view.up), io.KeyShift, actions_.rehearsal(), view);
  }

  void gamepad(double seconds) {
    const auto pad = read_gamepad();
    if (!pad) return;
    double up[3];
    renderer_->GetActiveCamera()->GetViewUp(up);
    const Vec3 forward = view_direction(), right = normalized(cross(forward, {up[0], up[1], up[2]})), above = cross(right, forward);
    goal_.position_mm += (right * pad->right_mm_s + above * pad->up_mm_s + forward * pad->deeper_mm_s) * std::min(seconds, 0.1);
    drill_held_ = drill_held_ || pad->drill;
  }

  struct KeyPress {
    int key;
    bool repeated;
  };

  void key(KeyPress press, double x, double y, bool in_view) {
    if (press.key == GLFW_KEY_DOWN) goal_.position_mm += view_direction() * 0.25;
    if (press.key == GLFW_KEY_UP) goal_.position_mm -= view_direction() * 0.25;
    if ((!press.repeated || press.key == GLFW_KEY_A || press.key == GLFW_KEY_E) &&
        tools_->key(press.key, actions_.rehearsal(), view_axes()))
      return;
    if (press.repeated) return;
    if (press.key >= GLFW_KEY_1 && press.key <= GLFW_KEY_7) set_diameter(press.key - GLFW_KEY_1 + 1);
    switch (press.key) {
      case GLFW_KEY_F:
        if (in_view) bring_drill_to_bone(x, y);
        break;
      case GLFW_KEY_SPACE:
        drill_latched_ = !drill_latched_;
        break;
      case GLFW_KEY_S:
        screenshot_wanted_ = true;
        break;
      case GLFW_KEY_F1:
      case GLFW_KEY_H:
        show_help_ = !show_help_;
        break;
      case GLFW_KEY_R:
        reset();
        break;
      case GLFW_KEY_F5:
        save();
        break;
      case GLFW_KEY_Q:
        quit_ = true;
        break;
      case GLFW_KEY_C:
        set_kind(BurrKind::cutting);
        break;
      case GLFW_KEY_D:
        set_kind(BurrKind::diamond);
        break;
      case GLFW_KEY_B:
        set_shape(BurrShape::ball);
        break;
      case GLFW_KEY_Y:
        set_shape(BurrShape::cylinder);
        break;
      case GLFW_KEY_T:
        set_shape(BurrShape::taper);
        break;
      case GLFW_KEY_HOME:
        look_from(kFromLeft);
        break;
      default:
        break;
    }
  }

  void reset() {
    actions_.save();
    actions_.begin(true);
    new_bone();
    park_drill();
    say("the bone is whole again; the session before was saved");
  }

  void save() {
    actions_.save();
    actions_.begin(false);
    new_bone();
    say("saved; a new session goes on from here");
  }

  void save_screenshot() {
    screenshot_wanted_ = false;
    Picture picture{width_, height_, {}};
    std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) * 3);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadBuffer(GL_BACK);
    glReadPixels(0, 0, width_, height_, GL_RGB, GL_UNSIGNED_BYTE, pixels.data());
    const std::size_t row = static_cast<std::size_t>(width_) * 3;
    for (int y = height_ - 1; y >= 0; --y) {
      const auto* const begin = pixels.data() + static_cast<std::size_t>(y) * row;
      picture.rgb.insert(picture.rgb.end(), begin, begin + row);
    }
    int n = 1;
    std::filesystem::path path;
    do {
      path = actions_.folder() / ("screenshot-" + std::to_string(n++) + ".png");
    } while (std::filesystem::exists(path));
    try {
      save_picture(picture, path);
      say("saved " + path.filename().string());
    } catch (const Error& e) {
      say(e.what());
    }
  }

  // --- panel, slices, help ------------------------------------------------------------------------------------------

  void say(const std::string& text) {
    message_ = text;
    message_until_ = std::chrono::steady_clock::now() + std::chrono::seconds(4);
  }

  void panel() {
    Rehearsal& rehearsal = actions_.rehearsal();
    const TickRecord tick = rehearsal.latest();
    ImGui::SetNextWindowPos({0, 0});
    ImGui::SetNextWindowSize({static_cast<float>(kPanelWidth), static_cast<float>(height_)});
    ImGui::Begin("Rehearsal", nullptr, ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse);
    ImGui::Text("Burr");
    const Burr& burr = burr_library()[static_cast<std::size_t>(tool_)];
    if (ImGui::RadioButton("cutting (C)", burr.kind == BurrKind::cutting)) set_kind(BurrKind::cutting);
    ImGui::SameLine();
    if (ImGui::RadioButton("diamond (D)", burr.kind == BurrKind::diamond)) set_kind(BurrKind::diamond);
    if (ImGui::RadioButton("ball (B)", burr.shape == BurrShape::ball)) set_shape(BurrShape::ball);
    ImGui::SameLine();
    if (ImGui::RadioButton("cyl. (Y)", burr.shape == BurrShape::cylinder)) set_shape(BurrShape::cylinder);
    ImGui::SameLine();
    if (ImGui::RadioButton("taper (T)", burr.shape == BurrShape::taper)) set_shape(BurrShape::taper);
    int diameter = static_cast<int>(burr.diameter_mm);
    if (ImGui::SliderInt("mm (1-7)", &diameter, 1, 7)) set_diameter(diameter);
    ImGui::Checkbox("drill on (left button, Space)", &drill_latched_);
    ImGui::Separator();
    tools_->panel(rehearsal, view_axes());
    ImGui::Separator();
    draw_status(rehearsal, tick);
    ImGui::Separator();
    if (ImGui::Button("Drill to bone under mouse (F)", {-1, 0})) say("point at the bone and press F");
    if (ImGui::Button("Screenshot (S)", {-1, 0})) screenshot_wanted_ = true;
    if (ImGui::Button("Save and go on (F5)", {-1, 0})) save();
    if (ImGui::Button("Reset the bone (R)", {-1, 0})) reset();
    ImGui::Separator();
    ImGui::Text("Look from");
    if (ImGui::Button("left")) look_from(kFromLeft);
    ImGui::SameLine();
    if (ImGui::Button("right")) look_from({-0.94, -0.25, 0.22});
    ImGui::SameLine();
    if (ImGui::Button("front")) look_from({0, -1, 0.1});
    ImGui::SameLine();
    if (ImGui::Button("above")) look_from({0, -0.05, 1});
    ImGui::Separator();
    ImGui::Text("hand: %s", device_name_.c_str());
    ImGui::Text("%s", rehearsal.realtime() ? "real-time priority: yes" : "real-time priority: REFUSED");
    if (!rehearsal.realtime()) ImGui::TextWrapped("The force may stutter. Run as root, or allow rtprio in limits.conf.");
    ImGui::Text("servo %.0f us a tick, late %.0f us", static_cast<double>(tick.work_us), static_cast<double>(tick.lateness_us));
    ImGui::Text("%.2f of %.2f M triangles", static_cast<double>(world_view_->drawn_triangles()) / 1e6,
                static_cast<double>(world_view_->triangles()) / 1e6);
    ImGui::Text("%.0f pictures/s", static_cast<double>(ImGui::GetIO().Framerate));
    ImGui::Separator();
    draw_scan(scan_);
    ImGui::TextWrapped("F1: mouse and keys");
    if (std::chrono::steady_clock::now() < message_until_) {
      ImGui::Separator();
      ImGui::TextWrapped("%s", message_.c_str());
    }
    ImGui::End();
  }

  WindowActions actions_;
  VerdictSummary scan_;
  GLFWwindow* window_ = nullptr;
  int width_ = 0, height_ = 0;
  vtkSmartPointer<vtkGenericOpenGLRenderWindow> render_window_;
  vtkNew<vtkRenderer> renderer_;
  vtkNew<vtkPolyDataMapper> burr_mapper_, shaft_mapper_;
  vtkNew<vtkActor> burr_, shaft_;
  vtkNew<vtkMatrix4x4> tool_matrix_;
  std::unique_ptr<WorldView> world_view_;
  std::unique_ptr<SceneTools> tools_;
  CutsPanel cuts_;
  Vec3 centre_{};
  double radius_ = 100;
  HandGoal goal_;
  int tool_;
  std::string device_name_;
  int gl_errors_ = 0;
  bool sucking_ = false, washing_ = false;
  bool drill_latched_ = false, drill_held_ = false, show_help_ = false, screenshot_wanted_ = false, quit_ = false;
  std::vector<KeyPress> pressed_keys_;
  std::string message_;
  std::chrono::steady_clock::time_point message_until_{};
};

}  // namespace

int run_rehearsal_window(const WindowOptions& options, const SparseGrid* hu, const WindowActions& actions) {
  return RehearsalWindow(options, hu, actions).run();
}

}  // namespace osteo
