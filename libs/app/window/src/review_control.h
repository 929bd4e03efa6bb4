// A session that is over, looked at again: made in a thread, gone through in time, one finding after another. Private
// to libs/app/window; no ImGui, no VTK, no screen.
#pragma once
#include <atomic>
#include <functional>
#include <future>
#include <optional>
#include <string>

#include "keys.h"
#include "osteo/app/window/session_review.h"
#include "osteo/core/base/context.h"

namespace osteo::inline app {

/// Places among the findings of those that the page begins with: at most three, the most serious first; what is only to
/// be known is none of them.
inline constexpr std::size_t kShownFindings = 3;
[[nodiscard]] std::vector<std::size_t> shown_findings(const std::vector<ReviewFinding>& findings);
/// Something was found that one would do otherwise.
[[nodiscard]] bool serious(const std::vector<ReviewFinding>& findings);

class ReviewControl {
 public:
  using Make = std::function<SessionReview(const Context&)>;
  static constexpr double kStepS = 1, kLongStepS = 10;
  static constexpr std::array<double, 5> kSpeeds{0.5, 1, 2, 4, 8};

  ~ReviewControl() { end(); }

  /// Begins to make it, in a thread of its own.
  void begin(const Make& make);
  /// Stops that, and forgets all.
  void end();

  enum class State { none, making, ready, failed };
  /// Takes up what the thread has made.
  State poll();
  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] double progress() const { return fraction_; }
  [[nodiscard]] const std::string& failure() const { return failure_; }
  /// Where ready.
  [[nodiscard]] SessionReview& review() { return *review_; }
  [[nodiscard]] const SessionReview& review() const { return *review_; }

  /// The course over time is shown, and the arrows and Space are its.
  [[nodiscard]] bool shown() const { return shown_ && state_ == State::ready; }
  void show(bool on);
  [[nodiscard]] double now_s() const { return review_ ? review_->player->now_s() : 0; }
  void go_to(double t_s);
  [[nodiscard]] bool playing() const { return playing_; }
  void play(bool on);
  [[nodiscard]] double speed() const { return kSpeeds[speed_]; }
  void change_speed(int steps);
  /// While it plays, the picture is from where the surgeon looked.
  bool surgeons_view = false;
  /// Once a frame: goes on where it plays, and stops at the end.
  void advance(double seconds);
  /// The scene is another since it was last asked.
  [[nodiscard]] bool take_moved() { return std::exchange(moved_, false); }

  /// True when the key was for it: its own, and while it is shown Left, Right (with Shift ten times as far), Up, Down:
  /// speed, Space.
  bool key(const Keyboard::Press& press);

  /// A finding is looked at, and its first moment gone to; chosen again, its next. No such finding: none is.
  void choose(int finding);
  [[nodiscard]] int chosen() const { return chosen_; }
  /// The first of shown_findings() is looked at where it is serious, at the end of the session.
  void present();
  /// Where the camera is to go, once.
  [[nodiscard]] std::optional<Vec3> take_look() { return std::exchange(look_, std::nullopt); }
  /// The places of the chosen finding, when they are others since they were last asked for.
  [[nodiscard]] std::optional<std::vector<Vec3>> take_places();

 private:
  std::future<SessionReview> making_;
  std::atomic<bool> stop_{false};
  std::atomic<double> fraction_{0};
  State state_ = State::none;
  std::string failure_;
  std::optional<SessionReview> review_;
  bool shown_ = false, playing_ = false, moved_ = false, places_new_ = false;
  std::size_t speed_ = 1, moment_ = 0;
  int chosen_ = -1;
  std::optional<Vec3> look_;
};

}  // namespace osteo::inline app
