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
#include <cstdio>
#include <new>
#include <optional>

#include "cuts_panel.h"
#include "gamepad.h"
#include "help_panel.h"
#include "keys.h"
#include "osteo/base/error.h"
#include "osteo/grid/brick_places.h"
#include "osteo/io/surface_io.h"
#include "osteo/scene/free_ways.h"
#include "osteo/view/actors.h"
#include "osteo/view/offscreen.h"
#include "osteo/view/world_view.h"
#include "scene_tools.h"
#include "status_panel.h"
#include "window_state.h"

namespace osteo {
namespace {

constexpr int kPanelWidth = 270, kSliceWidth = 290;
constexpr Vec3 kFromLeft{0.94, -0.25, 0.22};

class RehearsalWindow {
 public:
  RehearsalWindow(const WindowOptions& options, const SparseGrid* hu, const WindowActions& actions)
      : actions_(actions), scan_(options.scan), state_file_(options.state_file), tool_(options.tool), device_name_(options.device) {
    if (hu != nullptr) cuts_.set_hu(*hu);
    open(options);
    make_scene();
    look_from(kFromLeft);
    show_words("loading the case");
    attempt(options.from_case, false);
    look_from(kFromLeft);
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
    if (failure_) throw Error(*failure_);  // nothing was begun
    while (glfwWindowShouldClose(window_) == 0 && !quit_ && !actions_.stop()) frame();
    if (failure_) throw Error(*failure_);
    if (lost_) throw Error(*lost_);
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
    int width = options.width, height = options.height, x = 0, y = 0, screen_width = 0, screen_height = 0;
    if (GLFWmonitor* const monitor = glfwGetPrimaryMonitor()) glfwGetMonitorWorkarea(monitor, &x, &y, &screen_width, &screen_height);
    if (screen_width > 0) width = std::min(width, screen_width);
    if (screen_height > 0) height = std::min(height, screen_height);
    window_ = glfwCreateWindow(width, height, options.title.c_str(), nullptr, nullptr);
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

    // ImGui chains this callback behind its own.
    glfwSetWindowUserPointer(window_, this);
    glfwSetKeyCallback(window_, [](GLFWwindow* w, int key, int, int action, int) {
      static_cast<RehearsalWindow*>(glfwGetWindowUserPointer(w))->keyboard_.on(key, static_cast<Keyboard::Event>(action));
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
    Rehearsal& rehearsal = *actions_.rehearsal();
    world_view_ = std::make_unique<WorldView>(renderer_, rehearsal.structures());
    Vec3 lo{1e30, 1e30, 1e30}, hi{-1e30, -1e30, -1e30};
    rehearsal.look([&](const World& world, Follower& follower) {
      world_view_->update(world, follower);
      const BrickGrid& bone = world.bodies().front().body->bone;
      for (std::uint32_t b = 0; b < bone.brick_count(); ++b) {
        const Vec3 p = middle_of_brick_mm(bone, b);
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

  // --- sessions ---------------------------------------------------------------------------------------------------

  // Saves what runs, where asked, and begins anew. False: something failed, and the window says what.
  bool attempt(bool from_case, bool save_first) {
    failure_.reset();
    leading_.reset();
    ran_ = drill_latched_ = sucking_ = washing_ = false;
    const bool saved = !save_first || guarded([&] { actions_.save(); });
    if (!saved) lost_ = failure_;
    const bool begun = saved && guarded([&] {
                         goal_ = actions_.begin(from_case, {towards_eye(), wanted_axis(), tool_});
                         axis_ = from_floats(goal_.axis);
                         new_bone();
                       });
    // A session that nobody can see is closed, with the reason kept.
    if (saved && !begun && actions_.rehearsal() != nullptr) {
      const std::optional<Error> why = failure_;
      guarded([&] { actions_.save(); });
      failure_ = why;
    }
    return begun;
  }

  template <class F>
  bool guarded(F&& f) {
    try {
      f();
      return true;
    } catch (const Error& e) {
      failure_ = e;
    } catch (const std::bad_alloc&) {
      failure_ = Error(ExitCode::resources, "out of memory");
    } catch (const std::exception& e) {
      failure_ = Error(ExitCode::unspecified, std::string("unexpected: ") + e.what(), "this is a defect of the program; please report it");
    }
    return false;
  }

  // What can no longer be recorded is ended; a rehearsal that has ended without having been asked to says why when it is closed.
  void watch() {
    const Rehearsal* const rehearsal = actions_.rehearsal();
    if (rehearsal == nullptr || failure_) return;
    if (const std::optional<Error> failed = actions_.failure()) {
      guarded([&] {
        actions_.save();
        throw Error(*failed);
      });
      lost_ = failure_;
    } else if (rehearsal->running()) {
      ran_ = true;
    } else if (ran_) {
      guarded([&] {
        actions_.save();
        throw Error(ExitCode::failed, "the session has ended by itself; it is saved", "please report this with the session");
      });
      lost_ = failure_;
    }
  }

  void reset() {
    if (attempt(true, true)) say("the bone is whole again; the session before was saved");
  }

  void save() {
    if (attempt(false, true)) say("saved; a new session goes on from here");
  }

  // --- the hand ---------------------------------------------------------------------------------------------------

  [[nodiscard]] Vec3 view_direction() const {
    double d[3];
    renderer_->GetActiveCamera()->GetDirectionOfProjection(d);
    return {d[0], d[1], d[2]};
  }

  [[nodiscard]] Vec3 towards_eye() const {
    double p[3];
    renderer_->GetActiveCamera()->GetPosition(p);
    return normalized(Vec3{p[0], p[1], p[2]} - centre_);
  }

  [[nodiscard]] bool plate_in_hand() const { return tools_ && tools_->tool() == SceneTools::Tool::plate; }

  // A drill is held from the right; a plate lies flat against what one looks at.
  [[nodiscard]] Vec3 wanted_axis() const {
    const Vec3 forward = view_direction();
    double up[3];
    renderer_->GetActiveCamera()->GetViewUp(up);
    const Vec3 right = normalized(cross(forward, {up[0], up[1], up[2]})), above = cross(right, forward);
    return plate_in_hand() ? forward * -1 : normalized(right * 0.62 + above * 0.45 - forward * 0.64);
  }

  // Where the hand is; before the first tick, where it will be.
  [[nodiscard]] HandPose hand_pose(Rehearsal& rehearsal) const {
    const TickRecord tick = rehearsal.latest();
    if (tick.tick == 0) return {goal_.position_mm, from_floats(goal_.axis)};
    return {from_floats(tick.device.position_mm), from_floats(tick.device.axis)};
  }

  [[nodiscard]] bool outside(Rehearsal& rehearsal) const {
    const FreeWays ways = free_ways(rehearsal, true);
    return length(hand_pose(rehearsal).at_mm - ways.centre_mm()) > ways.radius_mm();
  }

  [[nodiscard]] FreeWays free_ways(Rehearsal& rehearsal, bool whole_tool) const {
    const auto drill = static_cast<std::size_t>(tool_);
    ToolSkin skin = plate_in_hand() ? skin_of_plate(tools_->plate(), tools_->plate_grip()) : skin_of_burr(drill, whole_tool);
    std::optional<FreeWays> ways;
    rehearsal.look([&](const World& world, Follower&) { ways.emplace(world, std::move(skin), rehearsal.structures()); });
    return *std::move(ways);
  }

  // The handle follows the view, as far as bone lets it.
  void turn_handle(Rehearsal& rehearsal, double seconds) {
    constexpr double kRadPerS = 4;
    const Vec3 wanted = wanted_axis();
    if (length(wanted - axis_) < 1e-3) return;
    axis_ = free_ways(rehearsal, false).turned({hand_pose(rehearsal).at_mm, axis_}, wanted, kRadPerS * std::min(seconds, 0.2));
  }

  void send_goal(Rehearsal& rehearsal, double seconds) {
    Device& device = rehearsal.device();
    device.set_tool(static_cast<std::uint8_t>(tool_));
    if (leading_) {
      drill_latched_ = false;
      return;
    }
    auto* const mouse = dynamic_cast<MouseDevice*>(&device);
    if (mouse == nullptr) return;  // it moves and drills by itself
    turn_handle(rehearsal, seconds);
    goal_.axis = to_floats(axis_);
    goal_.tool = static_cast<std::uint8_t>(tool_);
    goal_.drill_on = drill_latched_ || drill_held_ ? 1 : 0;
    mouse->set_goal(goal_);
  }

  // --- the hand goes somewhere by itself --------------------------------------------------------------------------

  // No way was free of structures at risk.
  static constexpr const char* kPastStructures = "; past a structure at risk, since no other way was free";

  // First it lets go of the bone; then the way is found from where it is.
  struct Leading {
    enum class Stage { letting_go, on_the_way, put } stage = Stage::letting_go;
    std::optional<std::uint64_t> quiet_tick;  // when it had let go: what is known of the hand may be older
    std::optional<Vec3> seen_mm;              // bone to come down at; none: out
    Vec3 forward;
    std::string done;
  };

  void lead(Rehearsal& rehearsal, std::optional<Vec3> seen_mm, Vec3 forward) {
    if (!rehearsal.device().lead({})) {
      say("the drill is in your own hand");
      return;
    }
    leading_ = Leading{Leading::Stage::letting_go, {}, seen_mm, forward, {}};
    drill_latched_ = false;
    wait_for_release_ = true;
  }

  void bring_drill_to_bone(Rehearsal& rehearsal, double x, double y) {
    // The bone under the mouse: a ray through the live voxels.
    const Vec3 eye = view_axes().eye_mm, forward = normalized(unproject(x, y, centre_) - eye);
    std::optional<BoneHit> hit;
    rehearsal.look([&](const World& world, Follower&) { hit = bone_on_ray(world, eye, forward, length(centre_ - eye) + 4 * radius_); });
    if (!hit) {
      say("no bone under the mouse");
      return;
    }
    lead(rehearsal, hit->at_mm, forward);
  }

  void go_on_leading(Rehearsal& rehearsal) {
    if (!leading_) return;
    Device& device = rehearsal.device();
    const Led led = device.led();
    if (led == Led::on_the_way) return;
    const auto go = [&](Leading::Stage stage, const HandWay& way, const HandPose& end) {
      leading_->stage = stage;
      goal_.position_mm = end.at_mm;
      axis_ = end.axis;
      goal_.axis = to_floats(axis_);
      goal_.drill_on = 0;
      device.lead(way);
    };
    const auto waiting = [&](const FreeWays& ways) { return ways.waiting(towards_eye(), wanted_axis()); };
    if (leading_->stage == Leading::Stage::letting_go) {
      const std::uint64_t tick = rehearsal.latest().tick;
      if (!leading_->quiet_tick) leading_->quiet_tick = tick;
      if (tick <= *leading_->quiet_tick) return;
      const FreeWays ways = free_ways(rehearsal, true);
      const HandPose from = hand_pose(rehearsal);
      if (leading_->seen_mm) {
        const FreeWays::Found a = ways.approach(from, *leading_->seen_mm, leading_->forward, wanted_axis());
        const double gap = length(a.end.at_mm - *leading_->seen_mm) - burr_library()[static_cast<std::size_t>(tool_)].diameter_mm / 2;
        char far[80];
        std::snprintf(far, sizeof far, "the drill gets no nearer than %.0f mm this way", gap);
        leading_->done = a.way.put ? "the drill was shut in; it was taken out and set down there"
                         : gap > 6 ? far
                                   : "drill brought to the bone";
        if (a.past_structures) leading_->done += kPastStructures;
        go(Leading::Stage::on_the_way, a.way, a.end);
      } else {
        const HandPose to = waiting(ways);
        const FreeWays::Found out = ways.way(from, to);
        leading_->done = out.way.put ? "the drill was shut in; it was taken out" : "drill lifted out";
        if (out.past_structures) leading_->done += kPastStructures;
        go(Leading::Stage::on_the_way, out.way, to);
      }
    } else if (led == Led::blocked && leading_->stage == Leading::Stage::on_the_way) {
      leading_->done = "the drill was stuck; it was taken out";
      const HandPose to = waiting(free_ways(rehearsal, true));
      HandWay way;
      way.put = true;
      way.points[0] = {to.at_mm, to_floats(to.axis), false};
      way.count = 1;
      go(Leading::Stage::put, way, to);
    } else {
      say(leading_->done);
      leading_.reset();
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
    if (leading_) {  // on a way that was found for the burr that it has
      say("the drill is on its way: change the burr when it has arrived");
      return;
    }
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

  // --- one frame --------------------------------------------------------------------------------------------------

  void frame() {
    glfwPollEvents();
    glfwGetFramebufferSize(window_, &width_, &height_);
    watch();
    if (width_ < 200 || height_ < 150) {  // put away
      write_state();
      glfwWaitEventsTimeout(0.05);
      return;
    }
    begin_picture();
    if (failure_) {
      tell_failure();
    } else {
      Rehearsal& rehearsal = *actions_.rehearsal();
      mouse_and_keys(rehearsal);
      if (!failure_) show(*actions_.rehearsal());  // F5 and R make another
    }
    end_picture();
    ++pictures_;
    write_state();
  }

  void begin_picture() {
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
  }

  void show(Rehearsal& rehearsal) {
    panel(rehearsal);
    if (failure_) return;
    Rehearsal& now = *actions_.rehearsal();
    cuts_.draw(now, tool_, {static_cast<float>(width_ - kSliceWidth), 0, static_cast<float>(kSliceWidth), static_cast<float>(height_)});
    if (show_help_) draw_help(show_help_, width_);
    now.look([&](const World& world, Follower& follower) {
      world_view_->update(world, follower);
      if (now.soft() != nullptr) world_view_->update_soft(*now.soft());
    });
    world_view_->highlight(tools_->piece());
    const TickRecord tick = now.latest();
    place_tool(tick);
    tools_->show(tick);
    wash(now, tick);
  }

  void end_picture() {
    ImGui::Render();
    render_window_->SetSize(width_, height_);
    const double left = static_cast<double>(kPanelWidth) / width_, right = 1 - static_cast<double>(kSliceWidth) / width_;
    renderer_->SetViewport(left, 0, right, 1);
    renderer_->ResetCameraClippingRange();
    if (world_view_ && !failure_) world_view_->rest(width_ - kPanelWidth - kSliceWidth, height_);
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

  // While there is nothing else to see.
  void show_words(const char* words) {
    glfwPollEvents();
    glfwGetFramebufferSize(window_, &width_, &height_);
    begin_picture();
    ImGui::SetNextWindowPos({static_cast<float>(width_) / 2 - 100, static_cast<float>(height_) / 2 - 20});
    ImGui::Begin("words", nullptr, ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize);
    ImGui::Text("%s", words);
    ImGui::End();
    end_picture();
  }

  // What failed, what is kept, and what can be done now. Nothing runs.
  void tell_failure() {
    ImGui::SetNextWindowPos({static_cast<float>(width_) / 2 - 240, static_cast<float>(height_) / 3});
    ImGui::SetNextWindowSize({480, 0});
    ImGui::Begin("No session runs", nullptr, ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse);
    ImGui::TextWrapped("%s", failure_->what());
    if (!failure_->advice().empty()) ImGui::TextWrapped("%s", failure_->advice().c_str());
    ImGui::Separator();
    if (const auto folder = actions_.folder(); !folder.empty())
      ImGui::TextWrapped("What was recorded is kept: %s", folder.string().c_str());
    bool go_on = ImGui::Button("Go on from there (F5)", {-1, 0});
    bool anew = ImGui::Button("Begin anew from the case (R)", {-1, 0});
    if (ImGui::Button("Close (Q)", {-1, 0})) quit_ = true;
    ImGui::End();
    for (const Keyboard::Press& press : keyboard_.frame(ImGui::GetIO().WantTextInput)) {
      go_on = go_on || press.command == Command::save;
      anew = anew || press.command == Command::reset;
      quit_ = quit_ || press.command == Command::quit;
      screenshot_wanted_ = screenshot_wanted_ || press.command == Command::screenshot;
    }
    if ((go_on || anew) && attempt(anew, false)) say(anew ? "the bone is whole again" : "a new session goes on from what was recorded");
  }

  // The second hand: a sucker (V) and water (I) at the burr.
  void wash(Rehearsal& rehearsal, const TickRecord& tick) {
    constexpr double kNozzleMm = 4, kMm3PerS = 60, kSprayMm = 8, kSharePerS = 3;
    const Vec3 at = from_floats(tick.device.position_mm);
    const auto say_once = [&](bool wanted, bool& on, const SceneAction& with, const SceneAction& without) {
      if (wanted || on) rehearsal.act(wanted ? with : without);
      on = wanted;
    };
    say_once(keyboard_.held(Command::suck), sucking_, SceneAction::suction(at, kNozzleMm, kMm3PerS),
             SceneAction::suction(at, kNozzleMm, 0));
    say_once(keyboard_.held(Command::wash), washing_, SceneAction::irrigate(at, kSprayMm, kSharePerS),
             SceneAction::irrigate(at, kSprayMm, 0));
  }
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

  void mouse_and_keys(Rehearsal& rehearsal) {
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
        use_tool(rehearsal, m, io);
      } else if (leading_) {
        // It goes by itself.
      } else if (io.KeyShift && ImGui::IsMouseDown(ImGuiMouseButton_Left)) {
        goal_.position_mm += view_direction() * (0.05 * static_cast<double>(-io.MouseDelta.y));
      } else if (io.MouseDelta.x != 0 || io.MouseDelta.y != 0) {
        goal_.position_mm = unproject(static_cast<double>(m.x), static_cast<double>(m.y), goal_.position_mm);
      }
      if (io.MouseWheel != 0) {
        if (io.KeyCtrl) {
          camera->Dolly(std::pow(1.1, static_cast<double>(io.MouseWheel)));
        } else if (!tools_->in_hand()) {
          tools_->push(1.0 * static_cast<double>(io.MouseWheel), rehearsal, view_axes());
        } else if (!leading_) {
          goal_.position_mm += view_direction() * (0.5 * static_cast<double>(io.MouseWheel));
        }
      }
    }
    // A button that was held when the hand was led away does not drill where it arrives.
    const bool pressed = ImGui::IsMouseDown(ImGuiMouseButton_Left);
    if (!pressed && !leading_) wait_for_release_ = false;
    drill_held_ = pressed && !wait_for_release_ && in_view && !io.WantCaptureMouse && tools_->tool() == SceneTools::Tool::drill;
    gamepad(static_cast<double>(io.DeltaTime));
    for (const Keyboard::Press& press : keyboard_.frame(io.WantTextInput)) {
      command(press, static_cast<double>(m.x), static_cast<double>(m.y), in_view);
      if (failure_) return;
    }
    Rehearsal& now = *actions_.rehearsal();  // F5 and R make another
    // Who takes up the saw or a piece lets go of the drill: it does not stay in the bone.
    const bool in_hand = tools_->in_hand();
    if (in_hand_ && !in_hand && !leading_ && !outside(now)) lead(now, std::nullopt, {});
    in_hand_ = in_hand;
    go_on_leading(now);
    send_goal(now, static_cast<double>(io.DeltaTime));
  }

  // Saw and pieces: what the mouse drags is not the hand.
  void use_tool(Rehearsal& rehearsal, const ImVec2& m, const ImGuiIO& io) {
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
      const Vec3 eye = view_axes().eye_mm;
      tools_->pick(rehearsal, eye, normalized(unproject(static_cast<double>(m.x), static_cast<double>(m.y), centre_) - eye));
    }
    if (!ImGui::IsMouseDown(ImGuiMouseButton_Left) || (io.MouseDelta.x == 0 && io.MouseDelta.y == 0)) return;
    const Vec3 at = tools_->position_mm();
    const Vec3 by = unproject(static_cast<double>(m.x), static_cast<double>(m.y), at) -
                    unproject(static_cast<double>(m.x - io.MouseDelta.x), static_cast<double>(m.y - io.MouseDelta.y), at);
    const ViewAxes view = view_axes();
    tools_->drag(dot(by, view.right), dot(by, view.up), io.KeyShift, rehearsal, view);
  }

  void gamepad(double seconds) {
    const auto pad = read_gamepad();
    if (!pad || leading_) return;
    double up[3];
    renderer_->GetActiveCamera()->GetViewUp(up);
    const Vec3 forward = view_direction(), right = normalized(cross(forward, {up[0], up[1], up[2]})), above = cross(right, forward);
    goal_.position_mm += (right * pad->right_mm_s + above * pad->up_mm_s + forward * pad->deeper_mm_s) * std::min(seconds, 0.1);
    if (!pad->drill && !drill_held_) wait_for_release_ = false;
    drill_held_ = drill_held_ || (pad->drill && !wait_for_release_);
  }

  void command(const Keyboard::Press& press, double x, double y, bool in_view) {
    Rehearsal& rehearsal = *actions_.rehearsal();
    if (tools_->key(press.command, rehearsal, view_axes())) return;
    switch (press.command) {
      case Command::deeper:
        if (!leading_) goal_.position_mm += view_direction() * 0.25;
        break;
      case Command::back:
        if (!leading_) goal_.position_mm -= view_direction() * 0.25;
        break;
      case Command::bring:
        if (in_view) bring_drill_to_bone(rehearsal, x, y);
        break;
      case Command::lift:
        lead(rehearsal, std::nullopt, {});
        break;
      case Command::drill:
        drill_latched_ = !drill_latched_ && !leading_;
        break;
      case Command::diameter:
        set_diameter(press.value);
        break;
      case Command::cutting:
        set_kind(BurrKind::cutting);
        break;
      case Command::diamond:
        set_kind(BurrKind::diamond);
        break;
      case Command::ball:
        set_shape(BurrShape::ball);
        break;
      case Command::cylinder:
        set_shape(BurrShape::cylinder);
        break;
      case Command::taper:
        set_shape(BurrShape::taper);
        break;
      case Command::screenshot:
        screenshot_wanted_ = true;
        break;
      case Command::save:
        save();
        break;
      case Command::reset:
        reset();
        break;
      case Command::home:
        look_from(kFromLeft);
        break;
      case Command::help:
        show_help_ = !show_help_;
        break;
      case Command::quit:
        quit_ = true;
        break;
      case Command::suck:  // while held: wash()
      case Command::wash:
      case Command::saw:  // the tools'
      case Command::pieces:
      case Command::plates:
      case Command::turn_left:
      case Command::turn_right:
      case Command::perform:
      case Command::undo:
      case Command::put_away:
        break;
    }
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

  void panel(Rehearsal& rehearsal) {
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
    if (ImGui::Button("Drill to bone under mouse (F)", {-1, 0})) say("point at the bone and press F");
    if (ImGui::Button("Lift the drill out (U)", {-1, 0})) lead(rehearsal, std::nullopt, {});
    if (ImGui::Button("Screenshot (S)", {-1, 0})) screenshot_wanted_ = true;
    const bool saves = ImGui::Button("Save and go on (F5)", {-1, 0});
    ImGui::Dummy({0, 6});
    const bool resets = ImGui::Button("Reset the bone (R)", {-1, 0});
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
    draw_status(rehearsal, tick);  // below the buttons, which its lines would move
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
    if (leading_ || std::chrono::steady_clock::now() < message_until_) {
      ImGui::Separator();
      ImGui::TextWrapped("%s", leading_ ? "the drill is on its way, off" : message_.c_str());
    }
    ImGui::End();
    // Last: the rehearsal is another one afterwards.
    if (saves) {
      save();
    } else if (resets) {
      reset();
    }
  }

  // For tests: what can be seen, as numbers. Whole at any moment.
  void write_state() {
    if (state_file_.empty()) return;
    WindowState state;
    state.pictures = pictures_;
    state.failure = failure_ ? failure_->what() : "";
    state.message = leading_ ? "on the way" : message_;
    state.leading = leading_.has_value();
    state.session = actions_.folder();
    state.tool = burr_library()[static_cast<std::size_t>(tool_)].name();
    state.drill_latched = drill_latched_;
    state.help = show_help_;
    state.sucking = sucking_;
    state.washing = washing_;
    state.hand = tools_ ? static_cast<int>(tools_->tool()) : 0;
    state.cut = tools_ ? tools_->cut() : SawCut{};
    state.plate = tools_ ? tools_->plate_grip() : RigidTransform{};
    state.eye = towards_eye();
    state.centre_mm = centre_;
    state.radius_mm = radius_;
    state.goal_mm = goal_.position_mm;
    state.width = width_;
    state.height = height_;
    if (Rehearsal* const rehearsal = actions_.rehearsal(); rehearsal != nullptr && !failure_) {
      state.tick = rehearsal->latest();
      state.removed_mm3 = rehearsal->removed_mm3();
      rehearsal->look([&](const World& world, Follower&) {
        state.bodies = world.bodies().size();
        state.fixtures = world.fixtures().size();
        state.undo_steps = world.undo_steps();
        for (const PlacedBody& b : world.bodies()) state.places_mm.push_back(b.world_from_body.shift_mm);
      });
    }
    write_window_state(state, state_file_);
  }

  WindowActions actions_;
  VerdictSummary scan_;
  std::filesystem::path state_file_;
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
  Vec3 axis_{0, 0, 1};  // of the handle, on its way to what the view wants
  std::optional<Leading> leading_;
  std::optional<Error> failure_;  // nothing runs until something is begun
  std::optional<Error> lost_;     // and this was lost for good
  int tool_;
  std::string device_name_;
  int gl_errors_ = 0;
  std::uint64_t pictures_ = 0;
  bool sucking_ = false, washing_ = false, ran_ = false, wait_for_release_ = false, in_hand_ = true;
  bool drill_latched_ = false, drill_held_ = false, show_help_ = false, screenshot_wanted_ = false, quit_ = false;
  Keyboard keyboard_;
  std::string message_;
  std::chrono::steady_clock::time_point message_until_{};
};

}  // namespace

int run_rehearsal_window(const WindowOptions& options, const SparseGrid* hu, const WindowActions& actions) {
  return RehearsalWindow(options, hu, actions).run();
}

}  // namespace osteo
