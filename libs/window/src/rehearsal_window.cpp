#include "osteo/window/rehearsal_window.h"

// GLEW, through VTK, must come before anything that includes GL.
#include <vtk_glew.h>

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <vtkActor.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <optional>
#include <utility>

#include "camera_notes.h"
#include "cuts_panel.h"
#include "gamepad.h"
#include "help_panel.h"
#include "open_window.h"
#include "osteo/base/error.h"
#include "osteo/grid/brick_places.h"
#include "osteo/io/surface_io.h"
#include "osteo/view/actors.h"
#include "osteo/view/instrument_view.h"
#include "osteo/view/offscreen.h"
#include "osteo/view/scope_camera.h"
#include "osteo/view/structures_view.h"
#include "osteo/view/world_view.h"
#include "rehearsal_control.h"
#include "scene_painter.h"
#include "scene_tools.h"
#include "scope_panel.h"
#include "settings_panel.h"
#include "sound_panel.h"
#include "status_panel.h"
#include "stereo_screen.h"
#include "trial_overlay.h"
#include "window_state.h"

namespace osteo {
namespace {

constexpr int kPanelWidth = 270;

class RehearsalWindow {
 public:
  RehearsalWindow(const WindowOptions& options, const SparseGrid* hu, const WindowActions& actions, SoundOut& sound)
      : control_(actions, options.tool, [this](Rehearsal& rehearsal) { show_bone(rehearsal); }),
        actions_(actions),
        sound_(sound),
        scan_(options.scan),
        approval_(options.approval),
        approval_ended_(options.approval_ended),
        state_file_(options.state_file),
        device_name_(options.device) {
    cuts_.set_case(options.ct, hu, options.bone);
    stereo_.params = options.stereo;
    open(options);
    painter_ = std::make_unique<ScenePainter>(render_window_, renderer_);
    painter_->quality().want(options.quality);
    make_scene();
    scope_.overview(StandardView::left, scope_scene(), false);
    show_words("loading the case");
    control_.look_from(view_axes());
    control_.begin(options.from_case, false);
    scope_.overview(StandardView::left, scope_scene(), false);
    if (options.camera_trial) trial_.begin(scope_.view(), middle_of_bone());
  }

  ~RehearsalWindow() {
    glfwMakeContextCurrent(window_);
    cuts_.release();
    structures_.reset();
    stereo_.release();
    for (auto& hand : hands_) hand.reset();
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
    if (control_.failure()) throw Error(*control_.failure());  // nothing was begun
    while (glfwWindowShouldClose(window_) == 0 && !quit_ && !actions_.stop()) frame();
    if (control_.failure()) throw Error(*control_.failure());
    if (control_.lost()) throw Error(*control_.lost());
    return gl_errors_;
  }

 private:
  // --- set-up -----------------------------------------------------------------------------------------------------

  void open(const WindowOptions& options) {
    window_ = open_window(options.title, options.width, options.height, "is there a display? Without one: osteo rehearse CASE --headless",
                          options.stereo.mode == StereoMode::quad_buffer);

    render_window_ = vtkSmartPointer<vtkGenericOpenGLRenderWindow>::New();
    render_window_->SetOwnContext(0);
    render_window_->SetIsCurrent(true);
    render_window_->SetReadyForRendering(true);
    render_window_->SetMultiSamples(0);
    render_window_->OpenGLInitContext();
    render_window_->AddRenderer(renderer_);

    // ImGui chains this callback behind its own.
    glfwSetWindowUserPointer(window_, this);
    glfwSetKeyCallback(window_, [](GLFWwindow* w, int key, int, int action, int mods) {
      static_cast<RehearsalWindow*>(glfwGetWindowUserPointer(w))
          ->keyboard_.on(key, static_cast<Keyboard::Event>(action), (mods & GLFW_MOD_SHIFT) != 0);
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
    for (auto& hand : hands_) hand = std::make_unique<InstrumentView>(renderer_);
  }

  // A rehearsal has begun, perhaps with another bone.
  void show_bone(Rehearsal& rehearsal) {
    world_view_ = std::make_unique<WorldView>(renderer_, rehearsal.structures());
    rehearsal.look([&](const World& world, SceneReaders& readers) { world_view_->update(world, readers); });
    if (!tools_) tools_ = std::make_unique<SceneTools>(renderer_);
    if (!structures_ && rehearsal.structures() != nullptr)  // the same in all sessions
      structures_ = std::make_unique<StructuresView>(renderer_, *rehearsal.structures());
    cuts_.begin(rehearsal, structures_.get());
  }

  // --- the view ---------------------------------------------------------------------------------------------------

  // World point under a window position at the depth of `reference` along the view.
  [[nodiscard]] Vec3 unproject(double x, double y, Vec3 reference) const { return scope_.view().at_depth_of(reference, scope_.area, x, y); }

  [[nodiscard]] ViewAxes view_axes() const {
    const ScopeView& view = scope_.view();
    return {view.eye_mm(), view.back * -1, view.right(), view.up};
  }

  // From the eye through a place of the window.
  [[nodiscard]] Vec3 ray(double x, double y) const { return scope_.view().ray(scope_.area, x, y); }

  // What the camera may be asked to look at.
  [[nodiscard]] ScopeScene scope_scene() {
    ScopeScene scene{control_.centre_mm(), control_.radius_mm(), control_.goal_mm(), {0, 0, 1}, {}};
    Rehearsal* const rehearsal = actions_.rehearsal();
    if (rehearsal == nullptr || control_.failure()) return scene;
    if (const TickRecord tick = rehearsal->latest(); tick.tick != 0) {
      scene.drill_mm = from_floats(tick.device.position_mm) + from_floats(tick.shown_offset_mm);
      scene.handle = normalized(from_floats(tick.device.axis));
    }
    scene.bone = [rehearsal, reach = length(scene.centre_mm - scope_.view().eye_mm()) + 4 * scene.radius_mm](Vec3 from, Vec3 direction) {
      std::optional<BoneHit> hit;
      rehearsal->look([&](const World& world, SceneReaders&) { hit = bone_on_ray(world, from, direction, reach); });
      return hit ? std::optional(hit->at_mm) : std::nullopt;
    };
    return scene;
  }

  // The bone in the middle of the picture; or the middle of all of it.
  [[nodiscard]] Vec3 middle_of_bone() {
    const ScopeScene scene = scope_scene();
    return (scene.bone ? scene.bone(scope_.view().eye_mm(), scope_.view().back * -1) : std::nullopt).value_or(scene.centre_mm);
  }

  // --- one frame --------------------------------------------------------------------------------------------------

  void frame() {
    glfwPollEvents();
    measure_window();
    control_.watch();
    control_.look_from(view_axes());
    if (width_ < 200 || height_ < 150) {  // put away
      write_state();
      glfwWaitEventsTimeout(0.05);
      return;
    }
    begin_picture();
    if (control_.failure()) {
      tell_failure();
    } else {
      mouse_and_keys();
      if (!control_.failure()) show();
    }
    end_picture();
    ++pictures_;
    write_state();
  }

  void measure_window() {
    glfwGetFramebufferSize(window_, &width_, &height_);
    cuts_.lay_out(width_, height_, kPanelWidth);
    const CutsPanel::Box& scene = cuts_.scene();
    scope_.area = {static_cast<double>(scene.x), static_cast<double>(scene.y), std::max(1.0, static_cast<double>(scene.width)),
                   std::max(1.0, static_cast<double>(scene.height))};
  }

  void begin_picture() {
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
  }

  void show() {
    panel();
    if (control_.failure()) return;
    Rehearsal& now = control_.rehearsal();
    cuts_.draw(now, control_.tools().tool() == HandTools::Tool::saw ? &control_.tools().cut() : nullptr);
    if (show_help_) draw_help(show_help_, width_);
    now.look([&](const World& world, SceneReaders& readers) {
      world_view_->update(world, readers);
      if (now.soft() != nullptr) world_view_->update_soft(*now.soft());
    });
    world_view_->highlight(control_.tools().piece());
    const TickRecord tick = now.latest();
    show_instruments(now);
    now.look([&](const World& world, SceneReaders&) { tools_->show(control_.tools(), tick, world); });
    control_.wash(keyboard_.held(Command::suck), keyboard_.held(Command::wash));
    note_camera(now);
  }

  void note_camera(Rehearsal& rehearsal) {
    const ScopeView& view = scope_.view();
    const CameraView noted{view.eye_mm(),     view.focus_mm, view.up, view.view_angle_deg(scope_.area), view.pixels_per_mm(scope_.area),
                           view.magnification};
    const double now_s = std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
    if (const auto note = camera_notes_.next(noted, now_s, &rehearsal)) rehearsal.note("camera", *note);
  }

  void end_picture() {
    render_window_->SetSize(width_, height_);
    const PictureArea& area = scope_.area;
    renderer_->SetViewport(area.x / width_, 1 - (area.y + area.height) / height_, (area.x + area.width) / width_, 1 - area.y / height_);
    aim(renderer_, scope_.view(), area);
    renderer_->ResetCameraClippingRange();
    const bool scene = world_view_ && !control_.failure(), two_eyes = scene && stereo_.on();
    if (scene) draw_scope(scope_.view(), area, stereo_.params.mode);
    if (scene) trial_.draw(scope_.view(), area);
    if (two_eyes) {
      world_view_->wake();  // what the middle of them cannot see, one of the eyes may
      stereo_.draw(renderer_, render_window_, scope_.view(), area, height_);
    }
    ImGui::Render();
    if (!two_eyes) {
      const auto whole = [](double x) { return static_cast<int>(std::lround(x)); };
      const SceneBox box{whole(area.x), height_ - whole(area.y + area.height), std::max(1, whole(area.width)),
                         std::max(1, whole(area.height))};
      const bool settled = !scene || world_view_->rest(box.width, box.height, painter_->coarse());
      if (!painter_->begin({box, width_, height_, settled, input(), screenshot_wanted_}, ImGui::GetDrawData())) return painter_->wait();
    }
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    stereo_.show([&] {
      glClearColor(0.05F, 0.06F, 0.08F, 1);
      glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
      if (!two_eyes) painter_->show();
    });
    if (screenshot_wanted_) save_screenshot();
    for (GLenum e = glGetError(); e != GL_NO_ERROR && gl_errors_ < 1000; e = glGetError()) ++gl_errors_;
    glfwSwapBuffers(window_);
    painter_->done();
  }

  [[nodiscard]] static bool input() {
    const ImGuiIO& io = ImGui::GetIO();
    return io.MouseDelta.x != 0 || io.MouseDelta.y != 0 || io.MouseWheel != 0 || ImGui::IsAnyMouseDown() ||
           !io.InputQueueCharacters.empty();
  }

  // While there is nothing else to see.
  void show_words(const char* words) {
    glfwPollEvents();
    measure_window();
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
    if ((go_on || anew) && control_.begin(anew, false))
      control_.say(anew ? "the bone is whole again" : "a new session goes on from what was recorded");
  }

  void show_instruments(Rehearsal& now) {
    now.look([&](const World& world, SceneReaders&) {
      const auto solid = [&](Vec3 p) { return is_bone(world, p); };
      for (std::size_t hand = 0; hand < now.hands(); ++hand) {
        TickRecord tick = now.latest(hand);
        if (tick.tick == 0 && hand == 0) tick.device.tool = static_cast<std::uint8_t>(control_.tool());
        if (hand > 0 && (tick.tick == 0 || control_.second_hand_empty())) {
          hands_[hand]->hide();
        } else {
          hands_[hand]->show(tick, now.rate_hz(), solid);
        }
      }
    });
  }

  void mouse_and_keys() {
    const ImGuiIO& io = ImGui::GetIO();
    const ImVec2 m = io.MousePos;
    const bool in_view = cuts_.scene().holds(m.x, m.y) && !show_help_;
    const auto [x, y] = unsqueezed(stereo_.params.mode, scope_.area, static_cast<double>(m.x), static_cast<double>(m.y));
    const auto seconds = static_cast<double>(io.DeltaTime);
    const CameraDevices devices = actions_.camera ? actions_.camera(scope_.lent()) : CameraDevices{};
    scope_.lend(keyboard_.held(Command::guide_camera) || devices.pedal);
    if (in_view && !io.WantCaptureMouse) {
      const ScopeMouse mouse{x,
                             y,
                             static_cast<double>(io.MouseDelta.x),
                             static_cast<double>(io.MouseDelta.y),
                             static_cast<double>(io.MouseWheel),
                             ImGui::IsMouseDragging(ImGuiMouseButton_Right),
                             ImGui::IsMouseDragging(ImGuiMouseButton_Middle),
                             io.KeyCtrl,
                             io.KeyShift};
      if (!scope_.mouse(mouse, scope_.lent() && !devices.hand_mm, seconds)) use_mouse(mouse);
    }
    control_.look_from(view_axes());  // the mouse may have turned it
    const std::optional<Vec3> direction = in_view ? std::optional(ray(x, y)) : std::nullopt;
    for (const Keyboard::Press& press : keyboard_.frame(io.WantTextInput)) {
      std::string said;
      if (scope_.key(press, scope_scene(), direction, said)) {
        if (!said.empty()) control_.say(said);
      } else if (!control_.command(press, direction)) {
        command(press.command);
      }
      if (control_.failure()) return;
    }
    scope_.advance(keyboard_, io.KeyShift, devices, seconds);
    control_.look_from(view_axes());
    if (const auto said = trial_.advance(scope_.control, seconds, actions_.folder() / "camera-trial.csv")) control_.say(*said);
    control_.hold({seconds, ImGui::IsMouseDown(ImGuiMouseButton_Left) && !scope_.lent(), in_view && !io.WantCaptureMouse, read_gamepad()});
  }

  // The mouse is the hand, or what the hand's tool is moved by.
  void use_mouse(const ScopeMouse& m) {
    Rehearsal& rehearsal = control_.rehearsal();
    HandTools& tools = control_.tools();
    if (!tools.in_hand()) {
      use_tool(tools, rehearsal, m);
      if (m.wheel != 0) tools.push(1.0 * m.wheel, rehearsal, view_axes());
      return;
    }
    if (m.shift && ImGui::IsMouseDown(ImGuiMouseButton_Left)) {
      control_.push_hand(0.05 * -m.dy);
    } else if (m.dx != 0 || m.dy != 0) {
      control_.move_hand(unproject(m.x, m.y, control_.goal_mm()));
    }
    if (m.wheel != 0) control_.push_hand(0.5 * m.wheel);
  }

  // Saw and pieces: what the mouse drags is not the hand.
  void use_tool(HandTools& tools, Rehearsal& rehearsal, const ScopeMouse& m) {
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) tools.pick(rehearsal, view_axes().eye_mm, ray(m.x, m.y));
    if (!ImGui::IsMouseDown(ImGuiMouseButton_Left) || (m.dx == 0 && m.dy == 0)) return;
    const Vec3 at = tools.position_mm();
    const Vec3 by = unproject(m.x, m.y, at) - unproject(m.x - m.dx, m.y - m.dy, at);
    const ViewAxes view = view_axes();
    tools.drag(dot(by, view.right), dot(by, view.up), m.shift, rehearsal, view);
  }

  // What is the window's own.
  void command(Command command) {
    if (command == Command::screenshot) screenshot_wanted_ = true;
    if (command == Command::help) show_help_ = !show_help_;
    if (command == Command::sound) sound_.turn(!sound_.on());
    if (command == Command::quality) {
      QualityChoice& q = painter_->quality();
      q.want(static_cast<Quality>((static_cast<int>(q.wish()) + 1) % 4));
    }
    if (command == Command::cut_in_middle) cuts_.control().enlarge_or_back();
    if (command == Command::cuts_along_tool) {
      const bool along = cuts_.control().planes() == CutsControl::Planes::tool;
      cuts_.control().take_planes(along ? CutsControl::Planes::body : CutsControl::Planes::tool);
    }
    if (command == Command::quit) quit_ = true;
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

  // --- panel, slices, help ------------------------------------------------------------------------------------------

  void panel() {
    Rehearsal& rehearsal = control_.rehearsal();
    const TickRecord tick = rehearsal.latest();
    ImGui::SetNextWindowPos({0, 0});
    ImGui::SetNextWindowSize({static_cast<float>(kPanelWidth), static_cast<float>(height_)});
    ImGui::Begin("Rehearsal", nullptr, ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse);
    ImGui::Text("Burr");
    const Burr& burr = burr_library()[static_cast<std::size_t>(control_.tool())];
    if (ImGui::RadioButton("cutting (C)", burr.kind == BurrKind::cutting)) control_.take_burr(BurrKind::cutting);
    ImGui::SameLine();
    if (ImGui::RadioButton("diamond (D)", burr.kind == BurrKind::diamond)) control_.take_burr(BurrKind::diamond);
    if (ImGui::RadioButton("ball (B)", burr.shape == BurrShape::ball)) control_.take_burr(BurrShape::ball);
    ImGui::SameLine();
    if (ImGui::RadioButton("cyl. (Y)", burr.shape == BurrShape::cylinder)) control_.take_burr(BurrShape::cylinder);
    ImGui::SameLine();
    if (ImGui::RadioButton("taper (T)", burr.shape == BurrShape::taper)) control_.take_burr(BurrShape::taper);
    int diameter = static_cast<int>(burr.diameter_mm);
    if (ImGui::SliderInt("mm (1-7)", &diameter, 1, 7)) control_.take_burr_of(diameter);
    if (bool on = control_.latched(); ImGui::Checkbox("drill on (left button, Space)", &on)) control_.latch(on);
    ImGui::Separator();
    tools_->panel(control_.tools(), rehearsal, view_axes());
    ImGui::Separator();
    if (ImGui::Button("Drill to bone under mouse (F)", {-1, 0})) control_.say("point at the bone and press F");
    if (ImGui::Button("Lift the drill out (U)", {-1, 0})) control_.lift();
    if (ImGui::Button("Screenshot (S)", {-1, 0})) screenshot_wanted_ = true;
    const bool saves = ImGui::Button("Save and go on (F5)", {-1, 0});
    ImGui::Dummy({0, 6});
    const bool resets = ImGui::Button("Reset the bone (R)", {-1, 0});
    ImGui::Separator();
    draw_scope_panel(scope_, stereo_, scope_scene());
    ImGui::Separator();
    draw_status(rehearsal, tick);  // below the buttons, which its lines would move
    draw_sound(sound_);
    draw_settings(rehearsal);
    draw_posture(rehearsal);
    ImGui::Separator();
    ImGui::Text("hand: %s", device_name_.c_str());
    ImGui::Text("%s", rehearsal.realtime() ? "real-time priority: yes" : "real-time priority: REFUSED");
    if (!rehearsal.realtime()) ImGui::TextWrapped("The force may stutter. Run as root, or allow rtprio in limits.conf.");
    ImGui::Text("servo %.0f us a tick, late %.0f us", static_cast<double>(tick.work_us), static_cast<double>(tick.lateness_us));
    ImGui::Text("%.2f of %.2f M triangles", static_cast<double>(world_view_->drawn_triangles()) / 1e6,
                static_cast<double>(world_view_->triangles()) / 1e6);
    ImGui::TextUnformatted(painter_->words().c_str());
    ImGui::Separator();
    draw_approval(approval_, approval_ended_);
    draw_scan(scan_);
    ImGui::TextWrapped("F1: mouse and keys");
    if (const std::string told = control_.told(); !told.empty()) {
      ImGui::Separator();
      ImGui::TextWrapped("%s", told.c_str());
    }
    ImGui::End();
    // Last: the rehearsal is another one afterwards.
    if (saves) {
      control_.save();
    } else if (resets) {
      control_.reset();
    }
  }

  // For tests: what can be seen, as numbers. Whole at any moment.
  void write_state() {
    if (state_file_.empty()) return;
    WindowState state;
    state.pictures = pictures_;
    state.drawn = painter_->drawn();
    state.at_rest = painter_->at_rest();
    state.scale = painter_->scale();
    state.quality = painter_->quality();
    state.failure = control_.failure() ? control_.failure()->what() : "";
    state.message = control_.leading() ? "on the way" : control_.message();
    state.leading = control_.leading();
    state.session = actions_.folder();
    state.tool = burr_library()[static_cast<std::size_t>(control_.tool())].name();
    state.drill_latched = control_.latched();
    state.help = show_help_;
    state.sucking = control_.sucking();
    state.washing = control_.washing();
    state.sound = sound_.on();
    state.cut_in_middle = cuts_.control().enlarged();
    state.cuts_along_tool = cuts_.control().planes() == CutsControl::Planes::tool;
    state.cuts_ms = cuts_.last_ms();
    state.hand = static_cast<int>(control_.tools().tool());
    state.cut = control_.tools().cut();
    state.plate = control_.tools().plate_grip();
    state.eye = control_.towards_eye();
    state.centre_mm = control_.centre_mm();
    state.radius_mm = control_.radius_mm();
    state.goal_mm = control_.goal_mm();
    state.view = scope_.view();
    state.pixels_per_mm = scope_.view().pixels_per_mm(scope_.area);
    state.camera_moves = scope_.control.flies();
    state.stereo = static_cast<int>(stereo_.params.mode);
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

  RehearsalControl control_;
  WindowActions actions_;
  SoundOut& sound_;
  VerdictSummary scan_;
  const std::string approval_;
  const bool approval_ended_;
  std::filesystem::path state_file_;
  GLFWwindow* window_ = nullptr;
  int width_ = 0, height_ = 0;
  vtkSmartPointer<vtkGenericOpenGLRenderWindow> render_window_;
  vtkNew<vtkRenderer> renderer_;
  std::array<std::unique_ptr<InstrumentView>, kMostHands> hands_;
  std::unique_ptr<ScenePainter> painter_;
  std::unique_ptr<WorldView> world_view_;
  std::unique_ptr<StructuresView> structures_;
  std::unique_ptr<SceneTools> tools_;
  CutsPanel cuts_;
  std::string device_name_;
  int gl_errors_ = 0;
  std::uint64_t pictures_ = 0;
  bool show_help_ = false, screenshot_wanted_ = false, quit_ = false;
  Keyboard keyboard_;
  ScopeInput scope_;
  StereoScreen stereo_;
  TrialOverlay trial_;
  CameraNotes camera_notes_;
};

}  // namespace

int run_rehearsal_window(const WindowOptions& options, const SparseGrid* hu, const WindowActions& actions, SoundOut& sound) {
  return RehearsalWindow(options, hu, actions, sound).run();
}

}  // namespace osteo
