// The window of a rehearsal: one class in four files by what they do: rehearsal_window.cpp (sessions begin and end, a
// frame), rehearsal_input.cpp (mouse and keys), rehearsal_picture.cpp (what is seen), rehearsal_state.cpp (the same as
// numbers, for tests).
#pragma once
// GLEW, through VTK, must come before anything that includes GL.
#include <vtk_glew.h>

#include <GLFW/glfw3.h>
#include <imgui.h>

#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkRenderer.h>

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "before_view.h"
#include "camera_notes.h"
#include "cuts_panel.h"
#include "hand_controller.h"
#include "hint_controller.h"
#include "looks.h"
#include "main_view.h"
#include "monitor_panel.h"
#include "monitor_screen.h"
#include "mouse_trail.h"
#include "osteo/app/window/rehearsal_window.h"
#include "osteo/display/view/instrument_view.h"
#include "osteo/display/view/planned_regions.h"
#include "osteo/display/view/structures_view.h"
#include "osteo/display/view/world_view.h"
#include "path_view.h"
#include "rehearsal_control.h"
#include "review_scene.h"
#include "scene_painter.h"
#include "scene_tools.h"
#include "scope_input.h"
#include "simulation_switches.h"
#include "stereo_screen.h"
#include "tool_touch.h"
#include "trial_overlay.h"
#include "tutor_panel.h"
#include "window_state.h"

namespace osteo::inline app {

class RehearsalWindow {
 public:
  RehearsalWindow(WindowShell& shell, PersonSettings& person, const WindowOptions& options, const SparseGrid* hu,
                  const WindowActions& actions, SoundOut& sound);
  ~RehearsalWindow();
  RehearsalWindow(const RehearsalWindow&) = delete;
  RehearsalWindow& operator=(const RehearsalWindow&) = delete;

  WindowEnd run();

 private:
  // --- sessions, and a frame (rehearsal_window.cpp)

  // A session is begun and saved in a thread of its own: meanwhile the window says so, and answers.
  WindowActions working(WindowActions actions);
  void open();
  void make_scene();
  // A rehearsal has begun, perhaps with another bone.
  void show_bone(Rehearsal& rehearsal);
  void plan_and_looks(const Rehearsal& rehearsal);
  void show_spaces(const Rehearsal& rehearsal);
  void frame();
  void take_dropped();
  void lay_out();
  // The bone as it was: made when it is first asked for, kept while the session runs. Between two frames.
  void show_before(bool on);
  // The session is saved; what was done is shown beside the bone as it was left.
  void end_session();
  void show_end();
  // ImGui's frame is put aside meanwhile: what shows that it works needs one of its own.
  void begin_again(bool from_case);
  // What failed, what is kept, and what can be done now. Nothing runs.
  void report_failure();

  // --- the hand (rehearsal_input.cpp)

  // What the mouse did since the last picture, in order; at least what it is now.
  [[nodiscard]] std::vector<ScopeMouse> mouse();
  // What it did while the window said that it works was meant for nothing here.
  void forget_mouse() { static_cast<void>(trail_.take()); }
  // Where there is no hand to move.
  void camera_by_mouse();
  void mouse_and_keys();
  // Pedals and buttons, before keys are asked for.
  void read_hand();
  // Its handle's end goes with the mouse; with Shift it goes round.
  bool tilt_by_mouse(const ScopeMouse& m);
  // So far as the mouse went over the picture, at this depth.
  [[nodiscard]] MouseStep step_of(const ScopeMouse& m, Vec3 at) const {
    return mouse_step(scope_.view(), scope_.area, m.x, m.y, m.dx, m.dy, at);
  }
  void do_press(const Keyboard::Press& press, const std::optional<Vec3>& direction);
  bool camera_takes(const Keyboard::Press& press, const std::optional<Vec3>& direction);
  [[nodiscard]] std::optional<Vec3> bone_seen(const std::optional<Vec3>& direction);
  // The mouse is the hand, or what the hand's tool is moved by.
  void use_mouse(const ScopeMouse& m);
  // Saw and pieces: what the mouse drags is not the hand.
  void use_tool(HandTools& tools, Rehearsal& rehearsal, const ScopeMouse& m);
  [[nodiscard]] MonitorController* monitor_controller() const {
    return actions_.monitor ? actions_.monitor() : nullptr;
  }
  void monitor_command(Command command);
  // What the person has chosen meanwhile, by keys or in the settings: hardware, monitor and session follow.
  void look_at_settings();
  // Dust and heat, which begin and end in the session itself; whoever asks for water has it.
  void look_at_simulation();
  void use_water();
  [[nodiscard]] std::array<bool, 3> switches_now() const {
    return {sound_.on(), hints_.on(), monitor_controller() != nullptr};
  }
  // What is the window's own.
  void command(Command command);

  // --- the view (rehearsal_picture.cpp)

  [[nodiscard]] ViewAxes view_axes() const {
    const ScopeView& view = scope_.view();
    return {view.eye_mm(), view.back * -1, view.right(), view.up};
  }
  // From the eye through a place of the window.
  [[nodiscard]] Vec3 ray(double x, double y) const { return scope_.view().ray(scope_.area, x, y); }
  // What the camera may be asked to look at.
  [[nodiscard]] ScopeScene scope_scene();
  // The bone in the middle of the picture; or the middle of all of it.
  [[nodiscard]] Vec3 middle_of_bone();
  void show();
  void show_instruments(Rehearsal& now);
  // That two instruments touch: told, shown, noted.
  void report_touch(Rehearsal& now);
  // Who teaches and who learns; once in a frame, before the hands are shown.
  void look_at_tutor();
  void show_tutor(Rehearsal& now);
  void switch_lead();
  void look_at_warmth(const SceneReaders& readers);
  void note_camera(Rehearsal& rehearsal);
  [[nodiscard]] ViewScene view_scene(Rehearsal& now);
  // A point of the world in pixels of the window, from its upper left corner.
  [[nodiscard]] std::optional<std::array<float, 2>> project(Vec3 at) const;
  [[nodiscard]] static bool input();
  void end_picture();
  // While the window sleeps: whether hands, pedals or buttons do anything.
  [[nodiscard]] bool stirs();
  void save_screenshot();

  // --- the state (rehearsal_state.cpp)

  // For tests: what can be seen, as numbers. Whole at any moment.
  void write_state();
  [[nodiscard]] ViewState view_state() const;

  WindowShell& shell_;
  MainView main_view_;
  RehearsalControl control_;
  WindowActions actions_;
  SoundOut& sound_;
  VerdictSummary scan_;
  const std::string approval_;
  const bool approval_ended_;
  const std::vector<PlannedRegion> planned_;
  const std::vector<std::string> thinned_;
  const std::optional<Labels> uncertainty_;
  const std::vector<StartProcedure> procedures_;
  std::filesystem::path state_file_;
  Keyboard keyboard_;
  MouseTrail trail_;
  HandController controller_;
  std::unique_ptr<BeforeView> before_view_;
  std::unique_ptr<WorkDone> work_;
  std::optional<EndFacts> ended_;
  ReviewScene review_;
  HintController hints_;
  PersonSettings& person_;
  std::array<bool, 3> switches_{};  // sound, hints, monitor: as the session has them noted
  SimulationSwitches simulation_{person_.values};
  WindowEnd end_;
  vtkSmartPointer<vtkGenericOpenGLRenderWindow> render_window_;
  vtkSmartPointer<vtkRenderer> renderer_ = make_layered_renderer();
  std::unique_ptr<PathView> way_view_;
  std::array<std::unique_ptr<InstrumentView>, kMaxHands> hands_;
  std::unique_ptr<ScenePainter> painter_;
  std::unique_ptr<WorldView> world_view_;
  std::unique_ptr<StructuresView> structures_;
  std::unique_ptr<RegionsView> regions_;  // null: none are planned
  std::unique_ptr<SceneTools> tools_;
  CutsPanel cuts_;
  std::string device_name_, case_hash_;
  bool end_page_;
  GLFWwindow* window_;
  int width_ = 0, height_ = 0;
  std::uint64_t pictures_ = 0;
  bool screenshot_wanted_ = false, quit_ = false, has_plan_ = false;
  std::array<TickRecord, kMaxHands> last_seen_{};  // of each hand, when the window was drawn last
  ScopeInput scope_;
  StereoScreen stereo_;
  TrialOverlay trial_;
  CameraNotes camera_notes_;
  MonitorPanel monitor_;
  ToolTouch touch_;
  TutorNow tutor_;
  TutorPanel tutor_panel_;
  std::vector<HarmLine> harm_;
  LinkWatch links_;
  std::optional<WarmthNow> warmth_;
  std::chrono::steady_clock::time_point warmth_at_{};  // when it is looked at again
};

}  // namespace osteo::inline app
