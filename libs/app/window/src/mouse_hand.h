// How a mouse or keys are the hand: how far the tool goes for a motion, and how its handle is held. Private to
// libs/app/window; no screen.
#pragma once
#include "hand_tools.h"
#include "osteo/simulation/camera/microscope.h"

namespace osteo::inline app {

/// What the pointer did over the picture, at the depth of what it moves.
struct MouseStep {
  Vec3 under_mm;  ///< the place under it
  Vec3 by_mm;     ///< how far it went, across the view
};

/// Of a pointer that is at (x, y) now and has come by (dx, dy) pixels, at the depth of `at_mm`.
[[nodiscard]] MouseStep mouse_step(const ScopeView& view, const PictureArea& area, double x, double y, double dx,
                                   double dy, Vec3 at_mm);

/// Scaling, wrist rest and clutch. At 1:1 the tool is under the pointer; once the two have parted, by a clutch or a
/// finer motion, the tool goes as far as the pointer does, until they meet again.
class HandMotion {
 public:
  /// A mm of the hand is 1 / one_to mm of the tool: 1, 2, 4 or 8.
  int one_to = 1;
  double rest_share = 0.2;  ///< of that, while the wrist rests
  bool clutch = false, rest = false;

  static constexpr int kFinest = 8;
  /// The next: `by` 1 coarser, -1 finer; stops at the ends.
  void step(int by);
  /// mm of the tool for a mm of the hand; 0 while the clutch is held.
  [[nodiscard]] double factor() const { return clutch ? 0 : (rest ? rest_share : 1) / one_to; }
  /// Where a tool goes that is at `at_mm`.
  [[nodiscard]] Vec3 moved(Vec3 at_mm, const MouseStep& step);
  /// The tool has been brought to the pointer.
  void meet() { parted_ = false; }
  [[nodiscard]] bool parted() const { return parted_; }

 private:
  bool parted_ = false;
};

/// The handle as the view shows it: from the right, a little from above and towards the eye; a left hand from the left;
/// a plate flat against what one looks at. Tilted and rolled from there it stays so, also when the view turns. Turns
/// are about the tip, which stays.
class HandHold {
 public:
  /// Which hand holds it; how it is held is mirrored.
  void set_left(bool left);
  [[nodiscard]] bool left() const { return left_; }
  /// Another thing is in the hand: a drill keeps how it was held, a plate is held flat.
  void take(bool plate);
  /// Unit, from the tip along the handle.
  [[nodiscard]] Vec3 axis(const ViewAxes& view) const;
  /// The handle's end goes right and up in the picture by so many radians; behind the tip by no more than 20 degrees,
  /// since nobody reaches round what one looks at.
  void tilt(double right_rad, double up_rad);
  /// About the line of sight, clockwise as it is seen.
  void roll(double rad);
  void straight();
  /// Away from how it is held without being asked to.
  [[nodiscard]] double tilted_rad() const;

 private:
  [[nodiscard]] Vec3 usual() const;
  [[nodiscard]] Vec3& now() { return held_[plate_ ? 1 : 0]; }
  bool left_ = false, plate_ = false;
  Vec3 held_[2] = {{0.62, 0.45, 0.64}, {0, 0, 1}};  // in the view's right, up and towards the eye
};

}  // namespace osteo::inline app
