// The camera as an operating microscope: a focus on the bone, a working distance, a magnification. Plain values, no
// VTK, no screen.
//
// Model: field of view = field number of the eyepieces / magnification, 200 mm here (10x eyepieces with a field number
// of 20; magnifications of 4 to 25 then show 50 to 8 mm, as operating microscopes do at an objective of 250 mm).
// Magnification says what is seen on the bone, not how large the screen is. It is parfocal: another magnification
// changes the angle of view, neither the eye nor the focus. Lengths in mm, LPS; angles in radians where a name does not
// say otherwise. Every call is O(1).
#pragma once
#include <array>
#include <optional>
#include <string_view>

#include "osteo/core/data/vec.h"

namespace osteo::inline simulation {

inline constexpr double kFieldNumberMm = 200;
/// Where the magnification changer clicks in.
inline constexpr std::array<double, 5> kMagnifications{4, 6, 10, 16, 25};
/// Below 4 it is the naked eye: a whole head at 0.8.
inline constexpr double kMinMagnification = 0.2, kMaxMagnification = 40;
inline constexpr double kMinWorkingMm = 100, kMaxWorkingMm = 1500;

/// A rectangle of a window in pixels, y downwards.
struct PictureArea {
  double x = 0, y = 0, width = 1, height = 1;
  friend bool operator==(const PictureArea&, const PictureArea&) = default;
};

/// Where one looks from; what a bookmark keeps. `back` and `up` are unit vectors at right angles.
struct ScopeView {
  Vec3 focus_mm;
  Vec3 back{1, 0, 0};  ///< from the focus to the eye
  Vec3 up{0, 0, 1};
  double working_distance_mm = 250;  ///< from the eye to the focus
  double magnification = 4;
  bool upright = true;  ///< the head stays up when it is turned

  [[nodiscard]] Vec3 right() const { return cross(up, back); }
  [[nodiscard]] Vec3 eye_mm() const { return focus_mm + back * working_distance_mm; }
  /// Diameter of what is seen in the plane of the focus: the circle that the picture's shorter side holds.
  [[nodiscard]] double field_mm() const { return kFieldNumberMm / magnification; }
  /// Between the shorter sides of the picture.
  [[nodiscard]] double field_angle_rad() const;
  /// From the picture's lower edge to its upper.
  [[nodiscard]] double view_angle_deg(const PictureArea& area) const;
  /// In the plane of the focus.
  [[nodiscard]] double pixels_per_mm(const PictureArea& area) const;
  /// Unit vector from the eye through a pixel.
  [[nodiscard]] Vec3 ray(const PictureArea& area, double x, double y) const;
  /// Under a pixel, as deep in the view as `reference`.
  [[nodiscard]] Vec3 at_depth_of(Vec3 reference_mm, const PictureArea& area, double x, double y) const;
  /// Pixel of a place; nothing where it is behind the eye.
  [[nodiscard]] std::optional<std::array<double, 2>> pixel(Vec3 place_mm, const PictureArea& area) const;
  friend bool operator==(const ScopeView&, const ScopeView&) = default;
};

/// A motion in the axes of the view: right, up, towards the eye. Turns are right-handed about these axes through the
/// focus.
struct ScopeMotion {
  Vec3 shift_mm, turn_rad;
};

/// All that can be done to a view. Each keeps what it does not name; magnification and working distance are kept in
/// their ranges. The focus stays in the middle whatever is done.
void magnify(ScopeView& view, double magnification);
/// The next click of the changer, up (+1) or down (-1); the last one stays.
void step_magnification(ScopeView& view, int direction);
/// The eye goes around the focus, to its right and up. Upright: about the axis of the head, and never over its top (89
/// degrees).
void orbit(ScopeView& view, double right_rad, double up_rad);
/// About the axis of the view, counter-clockwise as one sees it; it is not upright any more.
void roll(ScopeView& view, double angle_rad);
/// Eye and focus together, at right angles to the view: the working distance stays.
void pan(ScopeView& view, double right_mm, double up_mm);
/// Eye and focus together along the view: what is in focus is so much deeper.
void focus_deeper(ScopeView& view, double deeper_mm);
/// Along the view until the plane of the focus holds this place: autofocus, when the place is the bone in the middle of
/// the picture.
void focus_on_depth_of(ScopeView& view, Vec3 place_mm);
/// Another objective: the eye goes, the focus stays, and so does what is seen of its plane.
void set_working_distance(ScopeView& view, double working_distance_mm);
/// All six degrees at once. Upright: the part that would tilt the head is left out.
void move(ScopeView& view, const ScopeMotion& motion);
/// From somewhere: `towards_eye` and, unless it is to be upright, `up` need not be unit vectors, but not parallel.
void look_from(ScopeView& view, Vec3 towards_eye, std::optional<Vec3> up = std::nullopt);
/// Head up as far as the direction allows.
void level(ScopeView& view);

/// The whole of a ball, as the naked eye sees it.
[[nodiscard]] ScopeView overview(Vec3 centre_mm, double radius_mm, Vec3 towards_eye);

/// Part of the way from one view to another, 0 to 1: straight, turning about one axis, magnification evenly in its
/// logarithm. Exact at both ends.
[[nodiscard]] ScopeView between(const ScopeView& from, const ScopeView& to, double share);

/// A length of 1, 2 or 5 times a power of ten, at most `most_px` long in the plane of the focus.
struct ScaleBar {
  double length_mm = 1, length_px = 1;
};
[[nodiscard]] ScaleBar scale_bar(double pixels_per_mm, double most_px);

/// How far apart two views are, as a hand feels it.
struct ViewError {
  double place_mm = 0;   ///< between the foci
  double angle_rad = 0;  ///< of the one turn that leads from one to the other
  double zoom = 1;       ///< ratio of the magnifications, at least 1
};
[[nodiscard]] ViewError view_error(const ScopeView& a, const ScopeView& b);
/// The turn from `from` to `to` in the axes of `from`: its axis times its angle.
[[nodiscard]] Vec3 turn_between(const ScopeView& from, const ScopeView& to);

// -- Where one looked from, as sessions keep it: the value of a "camera" note.

/// The view of a "camera" note. Where it names no magnification, from its angle of view (30 degrees where that is
/// missing too); where it names no upward direction, head up. Nothing for what is no such note: no JSON, no eye or
/// target, both in one place.
[[nodiscard]] std::optional<ScopeView> view_of_note(std::string_view json);

}  // namespace osteo::inline simulation
