// What a hand does to the microscope: moves that can be taken back, flights to views that were kept, an arm with
// friction and inertia, a device that moves the camera while its brake is released. No VTK, no screen, no clock: time
// is given. Used by the window and by 'osteo experiment camera' alike.
#pragma once
#include <array>
#include <cstddef>
#include <deque>
#include <optional>
#include <string_view>

#include "osteo/core/base/param.h"
#include "osteo/simulation/camera/microscope.h"

namespace osteo::inline simulation {

/// Velocities in the axes of the view: right, up, towards the eye.
struct ScopeRates {
  Vec3 move_mm_s, turn_rad_s;
};

/// The arm that carries the microscope. Driven, its velocity comes up to the drive's with a time constant (inertia);
/// left alone it runs out by the same time constant and by dry friction, which brings it to rest for good. Both are
/// integrated in closed form, so that the way is the same however many pictures a second there are (as long as the
/// drive is).
class ScopeArm {
 public:
  struct Params {
    double inertia_s = 0.08;       ///< time constant, 0: none
    double friction_mm_s2 = 40;    ///< dry; of the shift
    double friction_rad_s2 = 0.8;  ///< and of the turn
    double most_mm_s = 400;        ///< limit of the drive
    double most_rad_s = 2;
  };
  Params params;

  ScopeArm() = default;
  explicit ScopeArm(const Params& p) : params(p) {}
  /// The way of the next `seconds`; no drive: it is let go, the brake still released.
  ScopeMotion advance(const std::optional<ScopeRates>& drive, double seconds);
  /// The brake: at rest at once.
  void brake() { velocity_ = {}; }
  [[nodiscard]] const ScopeRates& velocity() const { return velocity_; }
  [[nodiscard]] bool moves() const { return !(velocity_.move_mm_s == Vec3{} && velocity_.turn_rad_s == Vec3{}); }

 private:
  ScopeRates velocity_;
};

/// Kinds of moves of the camera.
enum class ScopeMove : int { orbit, pan, zoom, focus, roll, working_distance, guide, flight };
[[nodiscard]] constexpr std::array<std::string_view, 8> enum_names(ScopeMove) {
  return {"orbit", "pan", "zoom", "focus", "roll", "working_distance", "guide", "flight"};
}

/// What the motion of a device means to the camera (thesis 8.2.2): its translation moves the camera, or turns it, or
/// all six degrees of the device count at once.
enum class CameraGuide : int { shift, turn, six };
[[nodiscard]] constexpr std::array<std::string_view, 3> enum_names(CameraGuide) {
  return {"shift", "turn", "six"};
}

class ScopeControl {
 public:
  static constexpr std::size_t kBookmarks = 3;
  static constexpr double kFlightS = 0.4;
  /// One step of undo: input of one kind without a pause of this length.
  static constexpr double kPauseS = 0.6;
  /// 100 mm of a device: one field across, or a quarter of a turn.
  static constexpr double kFieldsPerMm = 0.01, kRadPerMm = 0.0157;

  [[nodiscard]] const ScopeView& view() const { return view_; }
  [[nodiscard]] bool flies() const { return flight_.has_value(); }
  /// Flights take 0.4 s; or none at all.
  bool flights = true;
  /// Of a device, and of rates.
  ScopeArm arm;

  // --- at once; input of one kind that goes on is one move
  using Kind = ScopeMove;
  using Moves = std::array<unsigned, EnumNames<ScopeMove>::values.size()>;
  /// How many of each there were.
  [[nodiscard]] const Moves& moves() const { return moves_; }
  void orbit(double right_rad, double up_rad);
  void pan(double right_mm, double up_mm);
  void roll(double angle_rad);
  void zoom(double factor);
  void step(int direction);
  void focus(double deeper_mm);
  void set_working_distance(double mm);
  void set_upright(bool on);

  // --- by a device. Each frame while the brake is released: the hand's motion since the frame before, in the device's
  // own right, up and towards the user. Where the hand is does not matter, only how it moves: letting go and taking up
  // again is the clutch.
  void guide(CameraGuide mode, const ScopeMotion& device, double seconds);
  /// The same by rates: a device that is pushed, not moved; deflection 1 is one field, or half a radian, a second.
  void drive(Vec3 shift, Vec3 turn, double seconds);
  /// The brake is set; at once.
  void brake() { arm.brake(); }

  // --- flights
  void go(const ScopeView& to);
  void jump(const ScopeView& to);  ///< without a flight, and nothing to take back: another bone
  void set_bookmark(std::size_t n) { bookmarks_.at(n) = target(); }
  /// False: none is set.
  bool go_to_bookmark(std::size_t n);
  [[nodiscard]] const std::optional<ScopeView>& bookmark(std::size_t n) const { return bookmarks_.at(n); }
  /// The focus comes to a place, which then is the middle.
  void look_at(Vec3 place_mm);
  /// And the eye lies on the axis of the instrument, as if one looked along its handle.
  void look_along(Vec3 place_mm, Vec3 handle);
  /// From there, with the focus where it is.
  void from_side(Vec3 towards_eye, std::optional<Vec3> up = std::nullopt);
  /// Takes back the last move, by a flight. False: there is none.
  bool undo();
  [[nodiscard]] std::size_t undo_steps() const { return undo_.size(); }
  /// What the camera comes to when it has arrived.
  [[nodiscard]] const ScopeView& target() const { return flight_ ? flight_->to : view_; }

  /// Once a frame.
  void advance(double seconds);

 private:
  struct Flight {
    ScopeView from, to;
    double gone_s = 0;
  };
  void begin(Kind kind);
  void keep();
  void fly(const ScopeView& to);

  ScopeView view_;
  std::optional<Flight> flight_;
  std::array<std::optional<ScopeView>, kBookmarks> bookmarks_;
  std::deque<ScopeView> undo_;
  std::optional<Kind> kind_;
  double quiet_s_ = 0;
  Moves moves_{};
};

}  // namespace osteo::inline simulation
