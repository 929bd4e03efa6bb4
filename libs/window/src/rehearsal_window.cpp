#include "osteo/window/rehearsal_window.h"

// GLEW, through VTK, must come before anything that includes GL.
#include <vtk_glew.h>

#include <GLFW/glfw3.h>
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
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>
#include <utility>

#include "before_view.h"
#include "camera_notes.h"
#include "cuts_panel.h"
#include "gamepad.h"
#include "osteo/base/error.h"
#include "osteo/bone/world_mesh.h"
#include "osteo/grid/brick_places.h"
#include "osteo/io/surface_io.h"
#include "osteo/view/actors.h"
#include "osteo/view/offscreen.h"
#include "osteo/view/world_view.h"
#include "rehearsal_control.h"
#include "room.h"
#include "scene_tools.h"
#include "window_state.h"

namespace osteo {
namespace {

constexpr Vec3 kFromLeft{0.94, -0.25, 0.22};

class RehearsalWindow {
 public:
  RehearsalWindow(WindowShell& shell, PersonSettings& person, const WindowOptions& options, const SparseGrid* hu,
                  const WindowActions& actions, SoundOut& sound)
      : shell_(shell),
        room_(shell, person),
        control_(working(actions), options.tool, [this](Rehearsal& rehearsal) { show_bone(rehearsal); }),
        actions_(actions),
        sound_(sound),
        scan_(options.scan),
        approval_(options.approval),
        approval_ended_(options.approval_ended),
        state_file_(options.state_file),
        device_name_(options.device),
        case_hash_(options.case_hash),
        end_page_(options.end_page),
        window_(shell.window()) {
    if (hu != nullptr) cuts_.set_hu(*hu);
    open();
    make_scene();
    look_from(kFromLeft);
    control_.look_from(view_axes());
    control_.begin(options.from_case, false);
    look_from(kFromLeft);
  }

  ~RehearsalWindow() {
    shell_.on_key = nullptr;
    // The session is the caller's to save, and goes on until then.
    if (Rehearsal* const rehearsal = actions_.rehearsal(); rehearsal != nullptr && work_) rehearsal->remove_reader(*work_);
    cuts_.release();
    tools_.reset();
    before_view_.reset();
    world_view_.reset();
    render_window_->Finalize();
  }
  RehearsalWindow(const RehearsalWindow&) = delete;
  RehearsalWindow& operator=(const RehearsalWindow&) = delete;

  WindowEnd run() {
    if (control_.failure()) throw Error(*control_.failure());  // nothing was begun
    while (!shell_.closing() && !quit_ && !actions_.stop()) frame();
    if (control_.failure()) throw Error(*control_.failure());
    if (control_.lost()) throw Error(*control_.lost());
    return end_;
  }

 private:
  // --- set-up -----------------------------------------------------------------------------------------------------

  // A session is begun and saved in a thread of its own: meanwhile the window says so, and answers.
  WindowActions working(WindowActions actions) {
    actions.begin = [this, begin = actions.begin](bool from_case, const HandView& view) {
      HandGoal goal;
      shell_.while_working(from_case ? "the bone is made ready" : "the session is made ready", {},
                           [&](const Context&) { goal = begin(from_case, view); });
      return goal;
    };
    actions.save = [this, save = actions.save, rehearsal = actions.rehearsal] {
      if (rehearsal() != nullptr) shell_.while_working("the session is saved", {}, [&](const Context&) { save(); });
    };
    return actions;
  }

  void open() {
    render_window_ = vtkSmartPointer<vtkGenericOpenGLRenderWindow>::New();
    render_window_->SetOwnContext(0);
    render_window_->SetIsCurrent(true);
    render_window_->SetReadyForRendering(true);
    render_window_->SetMultiSamples(0);
    render_window_->OpenGLInitContext();
    render_window_->SetFrameBlitModeToBlitToCurrent();
    render_window_->AddRenderer(renderer_);
    shell_.on_key = [this](int key, int action) {
      if (action == 1) room_.key(key);
      keyboard_.on(key, static_cast<Keyboard::Event>(action));
    };
    cuts_.create();
  }

  void make_scene() {
    set_up_scene(renderer_);
    for (DrawnHand& hand : drawn_) {
      for (const auto& [actor, mapper] :
           {std::pair<vtkActor*, vtkPolyDataMapper*>{hand.head, hand.head_mapper}, {hand.shaft, hand.shaft_mapper}}) {
        actor->SetMapper(mapper);
        actor->SetUserMatrix(hand.matrix);
        actor->SetVisibility(0);
        renderer_->AddActor(actor);
      }
      hand.head->GetProperty()->SetSpecular(0.6);
      hand.head->GetProperty()->SetSpecularPower(40);
      hand.shaft->GetProperty()->SetColor(0.62, 0.66, 0.72);
      hand.shaft->GetProperty()->SetSpecular(0.5);
    }
    draw_instrument(drawn_[0], control_.tool());
  }

  // A rehearsal has begun, perhaps with another bone.
  void show_bone(Rehearsal& rehearsal) {
    world_view_ = std::make_unique<WorldView>(renderer_, rehearsal.structures());
    rehearsal.look([&](const World& world, SceneReaders& readers) { world_view_->update(world, readers); });
    if (!tools_) tools_ = std::make_unique<SceneTools>(renderer_);
    cuts_.renew();
    before_view_.reset();
    room_.renew();
    work_ = std::make_unique<WorkDone>();  // the session that the last one followed is over
    rehearsal.add_reader(*work_);
    ended_.reset();
  }

  void look_from(Vec3 eye) { look_at(renderer_, control_.centre_mm(), 0.8 * control_.radius_mm(), normalized(eye)); }

  // --- the view ---------------------------------------------------------------------------------------------------

  [[nodiscard]] Vec3 view_direction() const {
    double d[3];
    renderer_->GetActiveCamera()->GetDirectionOfProjection(d);
    return {d[0], d[1], d[2]};
  }

  // What a hand is drawn as.
  struct DrawnHand {
    vtkNew<vtkActor> head, shaft;
    vtkNew<vtkPolyDataMapper> head_mapper, shaft_mapper;
    vtkNew<vtkMatrix4x4> matrix;
    int tool = -1;
  };
  static void draw_instrument(DrawnHand& hand, int tool) {
    if (hand.tool == tool) return;
    hand.tool = tool;
    const Instrument& held = instrument_of(static_cast<std::uint8_t>(tool));
    hand.head_mapper->SetInputData(round_cone_surface(held.head));
    hand.shaft_mapper->SetInputData(round_cone_surface(held.shaft));
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

  // From the eye through a place of the window.
  [[nodiscard]] Vec3 ray(double x, double y) {
    const Vec3 eye = view_axes().eye_mm;
    return normalized(unproject(x, y, control_.centre_mm()) - eye);
  }

  // --- one frame --------------------------------------------------------------------------------------------------

  void frame() {
    const bool seen = shell_.poll();
    width_ = shell_.width();
    height_ = shell_.height();
    for (const auto& path : shell_.take_dropped()) {
      end_ = {true, path};
      quit_ = true;
    }
    control_.watch();
    control_.look_from(view_axes());
    if (!seen) {  // put away
      write_state();
      glfwWaitEventsTimeout(0.05);
      return;
    }
    room_.lay_out(ended_.has_value());
    shell_.new_frame();
    if (control_.failure()) {
      tell_failure();
    } else if (ended_) {
      show_end();
    } else {
      mouse_and_keys();
      if (!control_.failure() && !ended_) show();
    }
    end_picture();
    ++pictures_;
    write_state();
  }

  void show() {
    Rehearsal& now = control_.rehearsal();
    const RoomScene scene = room_scene(now);
    room_.draw(scene);
    if (screenshot_wanted_) room_.draw_caption(scene);
    draw_instrument(drawn_[0], control_.tool());
    const auto of = [](const Box& b) { return CutsPanel::Box{b.x, b.y, b.width, b.height}; };
    const RoomLayout& layout = room_.layout();
    if (!layout.column.empty()) cuts_.draw(now, control_.tool(), of(layout.column));
    if (!layout.cuts[0].empty()) cuts_.draw(now, control_.tool(), {of(layout.cuts[0]), of(layout.cuts[1]), of(layout.cuts[2])});
    now.look([&](const World& world, SceneReaders& readers) {
      world_view_->update(world, readers);
      if (now.soft() != nullptr) world_view_->update_soft(*now.soft());
    });
    world_view_->highlight(control_.tools().piece());
    const TickRecord tick = now.latest();
    place_tool(drawn_[0], tick);
    for (std::size_t hand = 1; hand < now.hands(); ++hand) {
      const TickRecord other = now.latest(hand);
      if (other.tick == 0) continue;
      draw_instrument(drawn_[hand], other.device.tool);
      place_tool(drawn_[hand], other);
    }
    tools_->show(control_.tools(), tick);
    control_.wash(keyboard_.held(Command::suck) || room_.holds(Command::suck), keyboard_.held(Command::wash) || room_.holds(Command::wash));
    note_camera(now);
  }

  void note_camera(Rehearsal& rehearsal) {
    vtkCamera* const camera = renderer_->GetActiveCamera();
    const auto vec = [](const double* v) { return Vec3{v[0], v[1], v[2]}; };
    CameraView view{vec(camera->GetPosition()), vec(camera->GetFocalPoint()), vec(camera->GetViewUp()), camera->GetViewAngle(), 0};
    view.pixels_per_mm = height_ / (2 * camera->GetDistance() * std::tan(view.view_angle_deg * std::numbers::pi / 360));
    const double now_s = std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
    if (const auto note = camera_notes_.next(view, now_s, &rehearsal)) rehearsal.note("camera", *note);
  }

  void end_picture() {
    ImGui::Render();
    render_window_->SetSize(width_, height_);
    const Box& view = room_.layout().view;
    const auto across = [&](float x) { return static_cast<double>(x) / width_; };
    const auto up = [&](float y) { return 1 - static_cast<double>(y) / height_; };
    renderer_->SetViewport(across(view.x), up(view.bottom()), across(view.right()), up(view.y));
    if (before_view_) before_view_->place(renderer_, room_.before());
    renderer_->ResetCameraClippingRange();
    if (world_view_ && !control_.failure()) world_view_->rest(static_cast<int>(view.width), static_cast<int>(view.height));
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glClearColor(0.05F, 0.06F, 0.08F, 1);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    render_window_->GetState()->Reset();
    render_window_->Render();
    // VTK leaves its state for itself; ImGui saves and restores what it touches.
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
    if (screenshot_wanted_) save_screenshot();
    shell_.count_gl_errors();
    glfwSwapBuffers(window_);
  }

  [[nodiscard]] RoomScene room_scene(Rehearsal& now) {
    MachineFacts machine;
    machine.device = device_name_;
    machine.drawn_millions = static_cast<double>(world_view_->drawn_triangles()) / 1e6;
    machine.triangles_millions = static_cast<double>(world_view_->triangles()) / 1e6;
    machine.scan = &scan_;
    machine.approval = approval_;
    machine.approval_ended = approval_ended_;
    machine.case_hash = case_hash_;
    vtkCamera* const camera = renderer_->GetActiveCamera();
    const double pixels_per_mm = static_cast<double>(room_.layout().view.height) /
                                 (2 * camera->GetDistance() * std::tan(camera->GetViewAngle() * std::numbers::pi / 360));
    return {control_,
            sound_,
            now.latest(),
            machine,
            pixels_per_mm,
            [this](Vec3 at) { return project(at); },
            [this](Vec3 eye) { look_from(eye); },
            [this, &now] { tools_->panel(control_.tools(), now, view_axes()); }};
  }

  // A point of the world in pixels of the window, from its upper left corner.
  [[nodiscard]] std::optional<std::array<float, 2>> project(Vec3 at) {
    const ViewAxes view = view_axes();
    if (dot(at - view.eye_mm, view.forward) <= 0) return std::nullopt;
    renderer_->SetWorldPoint(at.x, at.y, at.z, 1);
    renderer_->WorldToDisplay();
    const double* const p = renderer_->GetDisplayPoint();
    return std::array<float, 2>{static_cast<float>(p[0]), static_cast<float>(height_ - 1 - p[1])};
  }

  // The bone as it was: made when it is first asked for, kept while the session runs. Between two frames.
  void show_before(bool on) {
    room_.set_before(on);
    if (!on || before_view_) return;
    if (!actions_.world_at_begin) {
      room_.set_before(false);
      control_.say("how the bone was is not known");
      return;
    }
    try {
      TriMesh mesh;
      shell_.while_working("the bone as it was is made", {},
                           [&](const Context& context) { mesh = surface_of(actions_.world_at_begin(context), context); });
      before_view_ = std::make_unique<BeforeView>(render_window_, mesh);
    } catch (const Error& e) {
      room_.set_before(false);
      control_.say(e.what());
    }
  }

  // The session is saved; what was done is shown beside the bone as it was left.
  void end_session() {
    if (!end_page_ || !actions_.facts) {
      quit_ = true;
      return;
    }
    room_.set_before(false);
    if (!control_.end()) return;
    ended_ = end_facts(actions_.facts(), *work_);
  }

  void show_end() {
    turn_by_mouse();
    EndChoice choice = room_.draw_end(*ended_);
    for (const Keyboard::Press& press : keyboard_.frame(ImGui::GetIO().WantTextInput)) {
      if (choice == EndChoice::none) choice = Room::end_choice(press.command);
      if (press.command == Command::screenshot) screenshot_wanted_ = true;
      if (press.command == Command::full_screen) shell_.toggle_full_screen();
    }
    if (choice == EndChoice::another) end_.another = true;
    if (choice == EndChoice::close || choice == EndChoice::another) quit_ = true;
    if (choice == EndChoice::again || choice == EndChoice::resume) begin_again(choice == EndChoice::again);
  }

  // ImGui's frame is put aside meanwhile: what shows that it works needs one of its own.
  void begin_again(bool from_case) {
    ImGui::EndFrame();
    const bool begun = control_.begin(from_case, false);
    ended_.reset();  // failure() speaks for itself
    if (begun) control_.say(from_case ? "the bone is whole again" : "a new session goes on from what was recorded");
    shell_.new_frame();
  }

  // What failed, what is kept, and what can be done now. Nothing runs.
  void tell_failure() {
    const float wide = std::min(static_cast<float>(width_), 30 * ImGui::GetFontSize());
    ImGui::SetNextWindowPos({(static_cast<float>(width_) - wide) / 2, static_cast<float>(height_) / 3});
    ImGui::SetNextWindowSize({wide, 0});
    ImGui::Begin("No session runs", nullptr, ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse);
    ImGui::TextWrapped("%s", control_.failure()->what());
    if (!control_.failure()->advice().empty()) ImGui::TextWrapped("%s", control_.failure()->advice().c_str());
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
    if (go_on || anew) begin_again(anew);
  }

  void place_tool(DrawnHand& hand, const TickRecord& tick) {
    const Vec3 axis = normalized(from_floats(tick.device.axis));
    const Vec3 u = any_perpendicular(axis), v = cross(axis, u);
    const Vec3 columns[3] = {u, v, axis};
    for (int c = 0; c < 3; ++c) {
      for (int r = 0; r < 3; ++r) hand.matrix->SetElement(r, c, columns[c][static_cast<std::size_t>(r)]);
    }
    for (int r = 0; r < 3; ++r) {
      // At the bone's surface, not in it, however far the hand has sunk in.
      const auto a = static_cast<std::size_t>(r);
      hand.matrix->SetElement(r, 3, static_cast<double>(tick.device.position_mm[a] + tick.shown_offset_mm[a]));
    }
    hand.matrix->Modified();
    const bool on = tick.device.pedal != 0, shown = (tick.flags & kPlateInHand) == 0;
    hand.head->SetVisibility(shown ? 1 : 0);
    hand.shaft->SetVisibility(shown ? 1 : 0);
    hand.head->GetProperty()->SetColor(on ? 0.95 : 0.75, on ? 0.62 : 0.72, on ? 0.35 : 0.62);
  }

  void mouse_and_keys() {
    Rehearsal& rehearsal = control_.rehearsal();
    HandTools& tools = control_.tools();
    const ImGuiIO& io = ImGui::GetIO();
    const ImVec2 m = io.MousePos;
    const bool in_view = room_.layout().view.holds(m.x, m.y) && !room_.in_front();
    vtkCamera* const camera = renderer_->GetActiveCamera();
    const std::optional<Vec3> direction = in_view ? std::optional(ray(static_cast<double>(m.x), static_cast<double>(m.y))) : std::nullopt;
    bool measured = false;
    if (in_view && !io.WantCaptureMouse) {
      if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) measured = room_.click(bone_seen(direction), control_);
      if (measured || turn_by_mouse()) {
      } else if (ImGui::IsMouseDragging(ImGuiMouseButton_Middle)) {
        double f[3], p[3];
        camera->GetFocalPoint(f);
        camera->GetPosition(p);
        const Vec3 focal{f[0], f[1], f[2]};
        const Vec3 shift = unproject(static_cast<double>(m.x - io.MouseDelta.x), static_cast<double>(m.y - io.MouseDelta.y), focal) -
                           unproject(static_cast<double>(m.x), static_cast<double>(m.y), focal);
        camera->SetFocalPoint(f[0] + shift.x, f[1] + shift.y, f[2] + shift.z);
        camera->SetPosition(p[0] + shift.x, p[1] + shift.y, p[2] + shift.z);
      } else if (!tools.in_hand()) {
        use_tool(tools, rehearsal, m, io);
      } else if (io.KeyShift && ImGui::IsMouseDown(ImGuiMouseButton_Left)) {
        control_.push_hand(0.05 * static_cast<double>(-io.MouseDelta.y));
      } else if (io.MouseDelta.x != 0 || io.MouseDelta.y != 0) {
        control_.move_hand(unproject(static_cast<double>(m.x), static_cast<double>(m.y), control_.goal_mm()));
      }
      if (io.MouseWheel != 0) {
        if (io.KeyCtrl) {
          camera->Dolly(std::pow(1.1, static_cast<double>(io.MouseWheel)));
        } else if (!tools.in_hand()) {
          tools.push(1.0 * static_cast<double>(io.MouseWheel), rehearsal, view_axes());
        } else {
          control_.push_hand(0.5 * static_cast<double>(io.MouseWheel));
        }
      }
    }
    control_.look_from(view_axes());  // the mouse may have turned it
    std::vector<Keyboard::Press> presses = keyboard_.frame(io.WantTextInput || room_.writing());
    for (const Keyboard::Press& button : room_.take_presses()) presses.push_back(button);
    for (const Keyboard::Press& press : presses) {
      do_press(press, direction);
      if (control_.failure() || ended_ || quit_) return;
    }
    const bool may_drill = in_view && !io.WantCaptureMouse && !measured && !room_.ruler().on() && !room_.before();
    control_.hold({static_cast<double>(io.DeltaTime), ImGui::IsMouseDown(ImGuiMouseButton_Left), may_drill, read_gamepad()});
  }

  void do_press(const Keyboard::Press& press, const std::optional<Vec3>& direction) {
    // What begins or ends a session shows pictures of its own.
    const bool long_work = press.command == Command::save || press.command == Command::quit || press.command == Command::perform ||
                           press.command == Command::before;
    if (long_work) ImGui::EndFrame();
    const std::optional<Vec3> bone = press.command == Command::mark ? bone_seen(direction) : std::nullopt;
    if (press.command == Command::before) {
      show_before(!room_.before());
    } else if (!room_.takes(press, control_, bone) && !control_.command(press, direction)) {
      command(press.command);
    }
    if (long_work) shell_.new_frame();
  }

  [[nodiscard]] std::optional<Vec3> bone_seen(const std::optional<Vec3>& direction) {
    if (!direction) return std::nullopt;
    std::optional<BoneHit> hit;
    const ViewAxes view = view_axes();
    control_.rehearsal().look([&](const World& world, SceneReaders&) {
      hit = bone_on_ray(world, view.eye_mm, *direction, length(control_.centre_mm() - view.eye_mm) + 4 * control_.radius_mm());
    });
    return hit ? std::optional(hit->at_mm) : std::nullopt;
  }

  bool turn_by_mouse() {
    const ImGuiIO& io = ImGui::GetIO();
    if (io.WantCaptureMouse || !ImGui::IsMouseDragging(ImGuiMouseButton_Right)) return false;
    vtkCamera* const camera = renderer_->GetActiveCamera();
    camera->Azimuth(-0.35 * static_cast<double>(io.MouseDelta.x));
    camera->Elevation(0.35 * static_cast<double>(io.MouseDelta.y));
    camera->OrthogonalizeViewUp();
    return true;
  }

  // Saw and pieces: what the mouse drags is not the hand.
  void use_tool(HandTools& tools, Rehearsal& rehearsal, const ImVec2& m, const ImGuiIO& io) {
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
      tools.pick(rehearsal, view_axes().eye_mm, ray(static_cast<double>(m.x), static_cast<double>(m.y)));
    }
    if (!ImGui::IsMouseDown(ImGuiMouseButton_Left) || (io.MouseDelta.x == 0 && io.MouseDelta.y == 0)) return;
    const Vec3 at = tools.position_mm();
    const Vec3 by = unproject(static_cast<double>(m.x), static_cast<double>(m.y), at) -
                    unproject(static_cast<double>(m.x - io.MouseDelta.x), static_cast<double>(m.y - io.MouseDelta.y), at);
    const ViewAxes view = view_axes();
    tools.drag(dot(by, view.right), dot(by, view.up), io.KeyShift, rehearsal, view);
  }

  // What is the window's own.
  void command(Command command) {
    if (command == Command::screenshot) screenshot_wanted_ = true;
    if (command == Command::home) look_from(kFromLeft);
    if (command == Command::sound) sound_.turn(!sound_.on());
    if (command == Command::quit) end_session();
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
      control_.say("saved " + path.filename().string());
    } catch (const Error& e) {
      control_.say(e.what());
    }
  }

  // For tests: what can be seen, as numbers. Whole at any moment.
  void write_state() {
    if (state_file_.empty()) return;
    WindowState state;
    state.pictures = pictures_;
    state.failure = control_.failure() ? control_.failure()->what() : "";
    state.message = control_.leading() ? "on the way" : control_.message();
    state.leading = control_.leading();
    state.session = actions_.folder();
    state.tool = burr_library()[static_cast<std::size_t>(control_.tool())].name();
    state.drill_latched = control_.latched();
    state.help = room_.help();
    state.room = room_state();
    state.sucking = control_.sucking();
    state.washing = control_.washing();
    state.sound = sound_.on();
    state.hand = static_cast<int>(control_.tools().tool());
    state.cut = control_.tools().cut();
    state.plate = control_.tools().plate_grip();
    state.eye = control_.towards_eye();
    state.centre_mm = control_.centre_mm();
    state.radius_mm = control_.radius_mm();
    state.goal_mm = control_.goal_mm();
    state.width = width_;
    state.height = height_;
    if (Rehearsal* const rehearsal = actions_.rehearsal(); rehearsal != nullptr && !control_.failure()) {
      state.tick = rehearsal->latest();
      state.removed_mm3 = rehearsal->removed_mm3();
      rehearsal->look([&](const World& world, SceneReaders&) {
        state.bodies = world.bodies().size();
        state.fixtures = world.fixtures().size();
        state.undo_steps = world.undo_steps();
        for (const PlacedBody& b : world.bodies()) state.places_mm.push_back(b.world_from_body.shift_mm);
      });
    }
    write_window_state(state, state_file_);
  }

  [[nodiscard]] RoomState room_state() const {
    RoomState r;
    r.layout = EnumNames<Layout>::values[static_cast<std::size_t>(room_.layout().shown)];
    r.em_pixels = shell_.em_pixels();
    r.full_screen = shell_.full_screen();
    r.asking = room_.asking();
    r.wheel = room_.wheel_open();
    r.panel_keys = room_.keys_in_panel();
    r.before = room_.before() && before_view_;
    r.writing = room_.writing();
    r.ended = ended_.has_value();
    r.ruler = room_.ruler().on();
    r.ruler_mm = room_.ruler().length_mm().value_or(0);
    r.notes = room_.notes().all().size();
    for (const Step& s : room_.steps().steps()) r.steps_done += s.done ? 1 : 0;
    const Box& v = room_.layout().view;
    r.view = {v.x, v.y, v.width, v.height};
    return r;
  }

  WindowShell& shell_;
  Room room_;
  RehearsalControl control_;
  WindowActions actions_;
  SoundOut& sound_;
  VerdictSummary scan_;
  const std::string approval_;
  const bool approval_ended_;
  std::filesystem::path state_file_;
  std::unique_ptr<BeforeView> before_view_;
  std::unique_ptr<WorkDone> work_;
  std::optional<EndFacts> ended_;
  WindowEnd end_;
  vtkSmartPointer<vtkGenericOpenGLRenderWindow> render_window_;
  vtkNew<vtkRenderer> renderer_;
  std::array<DrawnHand, kMostHands> drawn_;
  std::unique_ptr<WorldView> world_view_;
  std::unique_ptr<SceneTools> tools_;
  CutsPanel cuts_;
  std::string device_name_, case_hash_;
  bool end_page_;
  GLFWwindow* window_;
  int width_ = 0, height_ = 0;
  std::uint64_t pictures_ = 0;
  bool screenshot_wanted_ = false, quit_ = false;
  Keyboard keyboard_;
  CameraNotes camera_notes_;
};

}  // namespace

WindowEnd run_rehearsal_window(WindowShell& shell, PersonSettings& person, const WindowOptions& options, const SparseGrid* hu,
                               const WindowActions& actions, SoundOut& sound) {
  return RehearsalWindow(shell, person, options, hu, actions, sound).run();
}

}  // namespace osteo
