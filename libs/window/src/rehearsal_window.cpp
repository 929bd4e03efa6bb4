#include "osteo/window/rehearsal_window.h"

// GLEW, through VTK, must come before anything that includes GL.
#include <vtk_glew.h>

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
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
#include "osteo/view/instrument_view.h"
#include "osteo/view/offscreen.h"
#include "osteo/view/scope_camera.h"
#include "osteo/view/structures_view.h"
#include "osteo/view/world_view.h"
#include "rehearsal_control.h"
#include "room.h"
#include "scene_painter.h"
#include "scene_tools.h"
#include "scope_panel.h"
#include "stereo_screen.h"
#include "trial_overlay.h"
#include "window_state.h"

namespace osteo {
namespace {

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
    cuts_.set_case(options.ct, hu, options.bone);
    stereo_.params = options.stereo;
    open();
    painter_ = std::make_unique<ScenePainter>(render_window_, renderer_);
    painter_->quality().want(options.quality);
    make_scene();
    scope_.overview(StandardView::left, scope_scene(), false);
    control_.look_from(view_axes());
    control_.begin(options.from_case, false);
    scope_.overview(StandardView::left, scope_scene(), false);
    if (options.camera_trial) trial_.begin(scope_.view(), middle_of_bone());
  }

  ~RehearsalWindow() {
    shell_.on_key = nullptr;
    // The session is the caller's to save, and goes on until then.
    if (Rehearsal* const rehearsal = actions_.rehearsal(); rehearsal != nullptr && work_) rehearsal->remove_reader(*work_);
    cuts_.release();
    structures_.reset();
    stereo_.release();
    for (auto& hand : hands_) hand.reset();
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
    render_window_->AddRenderer(renderer_);
    shell_.on_key = [this](int key, int action, bool shift) {
      if (action == 1) room_.key(key);
      keyboard_.on(key, static_cast<Keyboard::Event>(action), shift);
    };
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
    before_view_.reset();
    room_.renew();
    work_ = std::make_unique<WorkDone>();  // the session that the last one followed is over
    rehearsal.add_reader(*work_);
    ended_.reset();
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
    lay_out();
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

  void lay_out() {
    cuts_.lay_out(room_.lay_out(ended_.has_value(), cuts_.wished_width()));
    const ScreenBox& scene = cuts_.scene();
    scope_.area = {static_cast<double>(scene.x), static_cast<double>(scene.y), std::max(1.0, static_cast<double>(scene.width)),
                   std::max(1.0, static_cast<double>(scene.height))};
  }

  void show() {
    Rehearsal& now = control_.rehearsal();
    const RoomScene scene = room_scene(now);
    room_.draw(scene);
    if (screenshot_wanted_) room_.draw_caption(scene);
    cuts_.draw(now, control_.tools().tool() == HandTools::Tool::saw ? &control_.tools().cut() : nullptr);
    now.look([&](const World& world, SceneReaders& readers) {
      world_view_->update(world, readers);
      if (now.soft() != nullptr) world_view_->update_soft(*now.soft());
    });
    world_view_->highlight(control_.tools().piece());
    const TickRecord tick = now.latest();
    show_instruments(now);
    now.look([&](const World& world, SceneReaders&) { tools_->show(control_.tools(), tick, world); });
    control_.wash(keyboard_.held(Command::suck) || room_.holds(Command::suck), keyboard_.held(Command::wash) || room_.holds(Command::wash));
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
    if (before_view_) before_view_->place(renderer_, room_.before());
    renderer_->ResetCameraClippingRange();
    const bool scene = world_view_ && !control_.failure(), two_eyes = scene && stereo_.on();
    if (scene && !screenshot_wanted_) draw_scope(scope_.view(), area, stereo_.params.mode);  // the caption has a bar of its own
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
    shell_.count_gl_errors();
    glfwSwapBuffers(window_);
    if (!two_eyes) painter_->done();
  }

  [[nodiscard]] static bool input() {
    const ImGuiIO& io = ImGui::GetIO();
    return io.MouseDelta.x != 0 || io.MouseDelta.y != 0 || io.MouseWheel != 0 || ImGui::IsAnyMouseDown() ||
           !io.InputQueueCharacters.empty();
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
    machine.pictures = painter_->words();
    return {control_,
            sound_,
            now.latest(),
            machine,
            scope_.view().pixels_per_mm(scope_.area),
            [this](Vec3 at) { return project(at); },
            [this] { draw_scope_panel(scope_, stereo_, scope_scene()); },
            [this, &now] { tools_->panel(control_.tools(), now, view_axes()); }};
  }

  // A point of the world in pixels of the window, from its upper left corner.
  [[nodiscard]] std::optional<std::array<float, 2>> project(Vec3 at) const {
    const auto p = scope_.view().pixel(at, scope_.area);
    return p ? std::optional(std::array<float, 2>{static_cast<float>((*p)[0]), static_cast<float>((*p)[1])}) : std::nullopt;
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
    camera_by_mouse();
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

  [[nodiscard]] ScopeMouse mouse() const {
    const ImGuiIO& io = ImGui::GetIO();
    const auto [x, y] =
        unsqueezed(stereo_.params.mode, scope_.area, static_cast<double>(io.MousePos.x), static_cast<double>(io.MousePos.y));
    return {x,
            y,
            static_cast<double>(io.MouseDelta.x),
            static_cast<double>(io.MouseDelta.y),
            static_cast<double>(io.MouseWheel),
            ImGui::IsMouseDragging(ImGuiMouseButton_Right),
            ImGui::IsMouseDragging(ImGuiMouseButton_Middle),
            io.KeyCtrl,
            io.KeyShift};
  }
  // Where there is no hand to move.
  void camera_by_mouse() {
    const ImGuiIO& io = ImGui::GetIO();
    const auto seconds = static_cast<double>(io.DeltaTime);
    if (cuts_.scene().holds(io.MousePos.x, io.MousePos.y) && !io.WantCaptureMouse) scope_.mouse(mouse(), false, seconds);
    scope_.advance(keyboard_, io.KeyShift, {}, seconds);
  }

  void mouse_and_keys() {
    const ImGuiIO& io = ImGui::GetIO();
    const bool in_view = cuts_.scene().holds(io.MousePos.x, io.MousePos.y) && !room_.in_front();
    const auto seconds = static_cast<double>(io.DeltaTime);
    const CameraDevices devices = actions_.camera ? actions_.camera(scope_.lent()) : CameraDevices{};
    scope_.lend(keyboard_.held(Command::guide_camera) || devices.pedal);
    const ScopeMouse m = mouse();
    bool measured = false;
    if (in_view && !io.WantCaptureMouse) {
      if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) measured = room_.click(bone_seen(ray(m.x, m.y)), control_);
      if (!measured && !scope_.mouse(m, scope_.lent() && !devices.hand_mm, seconds)) use_mouse(m);
    }
    control_.look_from(view_axes());  // the mouse may have turned it
    const std::optional<Vec3> direction = in_view ? std::optional(ray(m.x, m.y)) : std::nullopt;
    std::vector<Keyboard::Press> presses = keyboard_.frame(io.WantTextInput || room_.writing());
    for (const Keyboard::Press& button : room_.take_presses()) presses.push_back(button);
    for (const Keyboard::Press& press : presses) {
      do_press(press, direction);
      if (control_.failure() || ended_ || quit_) return;
    }
    scope_.advance(keyboard_, io.KeyShift, devices, seconds);
    control_.look_from(view_axes());
    if (const auto said = trial_.advance(scope_.control, seconds, actions_.folder() / "camera-trial.csv")) control_.say(*said);
    const bool may_drill = in_view && !io.WantCaptureMouse && !measured && !room_.ruler().on() && !room_.before();
    control_.hold({seconds, ImGui::IsMouseDown(ImGuiMouseButton_Left) && !scope_.lent(), may_drill, read_gamepad()});
  }

  void do_press(const Keyboard::Press& press, const std::optional<Vec3>& direction) {
    // What begins or ends a session shows pictures of its own.
    const bool long_work = press.command == Command::save || press.command == Command::quit || press.command == Command::perform ||
                           press.command == Command::before;
    if (long_work) ImGui::EndFrame();
    const std::optional<Vec3> bone = press.command == Command::mark ? bone_seen(direction) : std::nullopt;
    if (press.command == Command::before) {
      show_before(!room_.before());
    } else if (!room_.takes(press, control_, bone) && !camera_takes(press, direction) && !control_.command(press, direction)) {
      command(press.command);
    }
    if (long_work) shell_.new_frame();
  }

  bool camera_takes(const Keyboard::Press& press, const std::optional<Vec3>& direction) {
    std::string said;
    if (!scope_.key(press, scope_scene(), direction, said)) return false;
    if (!said.empty()) control_.say(said);
    return true;
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
    state.help = room_.help();
    state.room = room_state();
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
    const ScreenBox& v = cuts_.scene();
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
  std::array<std::unique_ptr<InstrumentView>, kMostHands> hands_;
  std::unique_ptr<ScenePainter> painter_;
  std::unique_ptr<WorldView> world_view_;
  std::unique_ptr<StructuresView> structures_;
  std::unique_ptr<SceneTools> tools_;
  CutsPanel cuts_;
  std::string device_name_, case_hash_;
  bool end_page_;
  GLFWwindow* window_;
  int width_ = 0, height_ = 0;
  std::uint64_t pictures_ = 0;
  bool screenshot_wanted_ = false, quit_ = false;
  Keyboard keyboard_;
  ScopeInput scope_;
  StereoScreen stereo_;
  TrialOverlay trial_;
  CameraNotes camera_notes_;
};

}  // namespace

WindowEnd run_rehearsal_window(WindowShell& shell, PersonSettings& person, const WindowOptions& options, const SparseGrid* hu,
                               const WindowActions& actions, SoundOut& sound) {
  return RehearsalWindow(shell, person, options, hu, actions, sound).run();
}

}  // namespace osteo
