// What mouse, keys and buttons do to a rehearsal: all of the window but its pictures. Private to libs/app/window; no
// GLFW, no ImGui, no VTK.
#pragma once
#include <functional>
#include <optional>
#include <string>

#include "gamepad.h"
#include "hand_tools.h"
#include "keys.h"
#include "lead_pause.h"
#include "local_text.h"
#include "messages.h"
#include "mouse_hand.h"
#include "osteo/app/window/rehearsal_window.h"
#include "osteo/session/scene/path_planner.h"
#include "second_hand.h"

namespace osteo::inline app {

/// What was done with hands since the last frame, as far as the drill is concerned.
struct HandInput {
  double seconds = 0;    ///< since then
  bool pressed = false;  ///< the button that drills is down
  bool on_bone = false;  ///< and the mouse is over the view
  double drill = 0;      ///< how far down what else drills is: pedals, triggers, keys; 0 to 1
  bool clutch = false, wrist_rest = false;
  bool second_hand = false;      ///< the mouse, with that button, is the second hand's
  std::optional<PadMotion> pad;  ///< of a gamepad, where there is one
};

/// Sessions that begin and end, the hand and where it is led, the tool in it, the second hand, and what is told. One
/// thread; between two calls nothing happens but what the rehearsal does by itself.
class RehearsalControl {
 public:
  /// `show` is called with each rehearsal that has begun, after bone() is known of it; what it throws ends that
  /// session.
  RehearsalControl(const WindowActions& actions, int tool, std::function<void(Rehearsal&)> show)
      : actions_(actions), show_(std::move(show)), tool_(tool) {}

  // --- sessions
  /// Saves what runs, where asked, and begins again. False: something failed, failure() says what, and nothing runs.
  bool begin(bool from_case, bool save_first);
  void save();   ///< and goes on from there
  void reset();  ///< saves, and begins with the case's bone
  bool end();    ///< saves; nothing runs then. False: it could not be saved, failure() says why
  /// Each frame: what can no longer be recorded is ended; a rehearsal that has ended without having been asked to says
  /// why.
  void watch();
  /// Why nothing runs.
  [[nodiscard]] const std::optional<Error>& failure() const { return failure_; }
  /// What was lost for good, since it could not be saved.
  [[nodiscard]] const std::optional<Error>& lost() const { return lost_; }
  /// Where there is no failure().
  [[nodiscard]] Rehearsal& rehearsal() const { return *actions_.rehearsal(); }
  /// A ball around the bone.
  [[nodiscard]] Vec3 centre_mm() const { return centre_mm_; }
  [[nodiscard]] double radius_mm() const { return radius_mm_; }

  // --- what is seen from where; before anything else in a frame
  void look_from(const ViewAxes& view) { view_ = view; }
  [[nodiscard]] const ViewAxes& view() const { return view_; }
  [[nodiscard]] Vec3 towards_eye() const { return normalized(view_.eye_mm - centre_mm_); }

  // --- the hand
  void move_hand(Vec3 to_mm);
  void drag_hand(const MouseStep& step);  ///< as the mouse did, by motion()
  void push_hand(double deeper_mm);       ///< of the hand, along the view
  /// The handle's end goes so far in the picture; the burr stays.
  void tilt_hand(double right_rad, double up_rad);
  void roll_hand(double rad);
  /// What the person chose.
  [[nodiscard]] HandMotion& motion() { return motion_; }
  [[nodiscard]] const HandMotion& motion() const { return motion_; }
  [[nodiscard]] HandHold& handle() { return handle_; }
  [[nodiscard]] const HandHold& handle() const { return handle_; }
  /// A device moves it, not the mouse.
  [[nodiscard]] bool moves_by_itself() const;
  double burr_share = 1;       ///< of the full speed, at a pedal that is all the way down: 0.25 to 1
  void bring(Vec3 direction);  ///< to the bone on a ray from the eye
  [[nodiscard]] std::optional<BoneHit> bone_seen(Vec3 direction) const;  ///< the first on a ray from the eye
  void lift();                                                           ///< out of the bone
  void take_burr(int tool);                                              ///< index in burr_library(); not on the way
  void take_burr(BurrKind kind);                                         ///< the same but for this
  void take_burr(BurrShape shape);
  void take_burr_of(int diameter_mm);
  [[nodiscard]] int tool() const { return tool_; }
  /// What is in the hand but for a plate, index in instrument_library(): the burr, or the saw.
  [[nodiscard]] int instrument() const;
  [[nodiscard]] Vec3 goal_mm() const { return goal_.position_mm; }
  [[nodiscard]] bool leading() const { return leading_.has_value(); }
  [[nodiscard]] bool latched() const { return latched_; }
  void latch(bool on) { latched_ = on && !leading_; }
  /// Saw, pieces, plates.
  [[nodiscard]] HandTools& tools() { return tools_; }
  [[nodiscard]] const HandTools& tools() const { return tools_; }

  /// A key that is not for the window itself (picture, view, help, closing): false then. `direction`: from the eye
  /// through the mouse; none: it is not over the view.
  bool command(const Keyboard::Press& press, const std::optional<Vec3>& direction);
  /// After all of a frame's mouse and keys: moves the hand on.
  void hold(const HandInput& input);
  /// The second hand, where no device moves it: what it holds is beside the burr, a sucker or water while one of the
  /// two is asked for, else out of the way.
  void wash(bool suck, bool wash);
  [[nodiscard]] SecondHand& second() { return second_; }
  [[nodiscard]] const SecondHand& second() const { return second_; }
  [[nodiscard]] bool sucking() const { return second_.sucking(); }
  [[nodiscard]] bool washing() const { return second_.washing(); }
  /// So far as the mouse went at its depth.
  void drag_second(Vec3 by_mm);
  [[nodiscard]] Vec3 second_mm() const;
  /// Nothing is in it, and nothing of it is to be drawn.
  [[nodiscard]] bool second_hand_empty() const { return second_.empty(); }

  // --- what is told
  /// Also a note of the session, in English whatever the language.
  void say(const LocalText& text, Message::Rank rank = Message::Rank::information);
  /// No note: it may name a file, and so a patient.
  void notify(const std::string& text, Message::Rank rank = Message::Rank::information) { messages_.say({rank, text}); }
  /// The last thing said.
  [[nodiscard]] const std::string& message() const { return messages_.last(); }
  /// What to show now; `causes`: what is so, beside what was said.
  [[nodiscard]] std::optional<Message> reported(std::vector<Message> causes);

 private:
  // First it lets go of the bone; then the way is found from where it is.
  struct Leading {
    enum class Stage { letting_go, on_the_way, put } stage = Stage::letting_go;
    int let_go = 0;                           // how often more, since the tool was not back at the hand
    std::optional<std::uint64_t> quiet_tick;  // when it had let go: what is known of the hand may be older
    std::optional<Vec3> seen_mm;              // bone to come down at; none: out
    Vec3 forward;
    LocalText done;
  };
  template <class F>
  bool guarded(F&& f);
  void measure(const World& world);
  [[nodiscard]] bool plate_in_hand() const { return tools_.tool() == HandTools::Tool::plate; }
  [[nodiscard]] Vec3 wanted_axis() const;
  [[nodiscard]] HandPose hand_pose() const;
  [[nodiscard]] bool outside() const;
  [[nodiscard]] PathPlanner path_planner(bool whole_tool) const;
  void turn_handle(double seconds);
  void next_burr(int by);
  void set_burr_share(int by);
  void send_goal(double seconds);
  void lead(std::optional<Vec3> seen_mm, Vec3 forward);
  void go_on_leading();
  void report_of_tools();
  [[nodiscard]] const Burr& burr() const { return burr_library()[static_cast<std::size_t>(tool_)]; }

  WindowActions actions_;
  std::function<void(Rehearsal&)> show_;
  int tool_;
  HandTools tools_;
  ViewAxes view_;
  Vec3 centre_mm_{};
  double radius_mm_ = 100;
  HandGoal goal_;
  Vec3 axis_{0, 0, 1};  // of the handle, on its way to what is wanted
  HandMotion motion_;
  HandHold handle_;
  SecondHand second_;
  std::optional<Leading> leading_;
  LeadPause lead_pause_{actions_};
  std::optional<Error> failure_, lost_;
  bool ran_ = false, latched_ = false, second_works_ = false;
  double held_ = 0;  // how far down
  bool wait_for_release_ = false, in_hand_ = true;
  LocalText reported_of_tools_;
  Messages messages_;
};

}  // namespace osteo::inline app
