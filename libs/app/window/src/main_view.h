// The main view around the bone: layouts, panels, tray, wheel, help, questions, ruler, notes, first steps, the page at
// the end. Private to libs/app/window; ImGui, no VTK and no GL: what it draws on the bone it projects itself.
#pragma once
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "command_palette.h"
#include "marks.h"
#include "osteo/app/window/person_settings.h"
#include "osteo/app/window/sound_out.h"
#include "osteo/app/window/window_shell.h"
#include "osteo/simulation/bone/posture.h"
#include "rehearsal_control.h"
#include "settings_dialog.h"
#include "steps.h"
#include "view_panels.h"
#include "work_done.h"

namespace osteo::inline app {

/// What of the machine and the case there is to say.
struct MachineFacts {
  std::string device;
  double drawn_millions = 0, triangles_millions = 0;
  const VerdictSummary* scan = nullptr;
  std::string approval, case_hash;
  std::string pictures;  ///< how they are drawn and what they take
  bool approval_ended = false;
};

/// A rehearsal that runs, and how it is seen now.
struct ViewScene {
  RehearsalControl& control;
  SoundOut& sound;
  TickRecord tick;
  MachineFacts machine;
  double pixels_per_mm = 1;  ///< where one looks at
  double magnification = 1;
  /// A point of the world in pixels of the window; nothing behind the eye.
  std::function<std::optional<std::array<float, 2>>(Vec3)> project;
  std::function<void()> draw_camera;  ///< views, the microscope, the picture: into the settings
  std::function<void()> draw_tools;   ///< saw, fragments, plates: into their card
  ScreenBox side;                     ///< CutsPanel::room(): where the card is then
  std::function<void()> draw_hand;    ///< its handle, pedals and buttons: into the settings
  std::span<const StartProcedure> procedures;
  bool alone = true;  ///< nobody takes part from elsewhere: another session can be begun with other settings
  std::optional<WarmthNow> warmth;  ///< where the scene has heat
  bool cut_over = false;            ///< one of the cuts has the picture's place
};

enum class EndChoice { none, again, resume, another, close };
/// What others draw into the page at the end, and whether its one next step is to try again.
struct EndParts {
  std::function<void()> findings, all_findings, course;
  bool try_again = false;
};

class MainView {
 public:
  MainView(WindowShell& shell, PersonSettings& person);

  /// For the window as it is now; `over`: the session has ended; `cut_side`: see lay_out().
  const ViewLayout& lay_out(bool over, float cut_side);
  /// What strips and columns of others have left of it.
  void take_layout(const ViewLayout& layout) { layout_ = layout; }
  [[nodiscard]] const ViewLayout& layout() const { return layout_; }
  [[nodiscard]] Layout wanted() const { return wanted_; }
  /// Mouse and keys are for something in front of the bone.
  [[nodiscard]] bool in_front() const { return asking_ || wheel_.open() || writing_.has_value() || palette_.typing(); }
  [[nodiscard]] const CommandPalette& palette() const { return palette_; }
  [[nodiscard]] bool asking() const { return asking_; }
  /// There is one of the person's own, in the picture drawn last.
  [[nodiscard]] bool second_hand() const { return second_hand_; }
  [[nodiscard]] bool wheel_open() const { return wheel_.open(); }
  /// The settings are open, and the keys are theirs.
  [[nodiscard]] bool in_settings() const { return focus_ == Focus::settings; }
  [[nodiscard]] const SettingsDialog& settings() const { return settings_; }
  /// The person wants another session that continues from here with what was chosen; asked once.
  [[nodiscard]] bool take_another_session() { return std::exchange(another_session_, false); }
  /// Which part of the window has the arrows, Space and Enter; bone: none, they are the hand's.
  enum class Focus { bone, strip, card, cuts, state, settings };
  [[nodiscard]] Focus focus() const { return focus_; }
  [[nodiscard]] bool before() const { return before_; }
  void set_before(bool on) { before_ = on; }
  [[nodiscard]] const Ruler& ruler() const { return ruler_; }
  [[nodiscard]] const PinnedNotes& notes() const { return notes_; }
  [[nodiscard]] const FirstSteps& steps() const { return steps_; }
  [[nodiscard]] bool writing() const { return writing_.has_value(); }
  /// Letters are for a text, and no command.
  [[nodiscard]] bool typing() const { return writing() || palette_.typing(); }

  /// Of the view, what cards and cuts leave at its upper edge: below a low card, beside a high one.
  [[nodiscard]] ScreenBox free_room() const;

  /// Another session has begun.
  void renew();
  /// Each key as it is pressed or repeats, as GLFW numbers it: a note is finished by one that may be over before the
  /// next picture, which ImGui misses.
  void key(int code, int modifiers, bool repeated);
  /// Each letter as it is typed, for the search of commands.
  void letter(char32_t letter) { palette_.letter(letter); }
  /// A picture was kept; the session has ended and is saved.
  void picture_kept() { pictured_ = true; }
  void session_ended();
  /// For buttons of others.
  [[nodiscard]] Pressed& pressed() { return pressed_; }
  /// Presses of buttons since the last call, as if they were keys.
  [[nodiscard]] std::vector<Keyboard::Press> take_presses();
  /// A button that does it is held down.
  [[nodiscard]] bool holds(Command command) const;
  /// True when it was for the main view. `bone`: under the mouse, in the view.
  bool takes(const Keyboard::Press& press, RehearsalControl& control, const std::optional<Vec3>& bone);
  /// A click on the bone; true when it was a point of the ruler.
  bool click(std::optional<Vec3> bone, RehearsalControl& control);

  /// Between ImGui::NewFrame and Render.
  void draw(const ViewScene& scene);
  /// A caption over the picture, in the frame of a screenshot.
  void draw_caption(const ViewScene& scene);
  /// In review.
  [[nodiscard]] EndChoice draw_end(const EndFacts& facts, const EndParts& parts);
  /// What a key means on that page.
  [[nodiscard]] static EndChoice end_choice(Command command);

 private:
  void draw_settings(const ViewScene& scene);
  void take_settings(const PersonValues& before, const ViewScene& scene);
  void draw_cards(const ViewScene& scene, const HandFacts& hand);
  void draw_side(const ViewScene& scene, const HandFacts& hand);
  void move_focus(int by);
  void give_focus();
  void draw_palette(RehearsalControl& control);
  [[nodiscard]] bool takes_in_front(Command c, RehearsalControl& control);
  void show_wheel();
  void lay_patient(Posture posture, RehearsalControl& control);
  void draw_marks(const ViewScene& scene);
  void draw_note_field(RehearsalControl& control);
  void answer(int answer, RehearsalControl& control);
  void see(const ViewScene& scene);
  [[nodiscard]] HandFacts hand_facts(const RehearsalControl& control, const SoundOut& sound,
                                     std::size_t undo_steps) const;

  WindowShell& shell_;
  PersonSettings& person_;
  Layout wanted_ = Layout::operate;
  ViewLayout layout_;
  Pressed pressed_;
  ToolWheel wheel_;
  FirstSteps steps_;
  StepFacts seen_;  // by them, last
  Ruler ruler_;
  PinnedNotes notes_;
  CommandPalette palette_;
  Focus focus_ = Focus::bone;
  bool focus_moved_ = false;               // and ImGui is to be told
  std::optional<std::size_t> wanted_cut_;  // a planned one, until the saw is there
  bool second_hand_ = false, asking_ = false, before_ = false, undone_ = false, write_focus_ = false;
  bool lifting_ = false, lifted_ = false, pictured_ = false;  // for the first steps
  std::size_t undo_steps_ = 0;
  std::uint64_t times_undone_ = 0;
  std::optional<Vec3> writing_;  // where a note is pinned
  std::string note_text_;
  int note_answer_ = 0;  // 1: kept, -1: not
  ScreenBox card_;       // of the instrument, as it was drawn last; empty: none
  bool burr_unfolded_ = false, step_unfolded_ = false, another_session_ = false;
  SettingsDialog settings_;
  const PersonValues begun_;                // what the sessions of this sitting began with
  std::optional<HapticsParams> felt_then_;  // when the session began
  Latched latched_;
};

}  // namespace osteo::inline app
