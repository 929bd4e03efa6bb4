// What mouse, keys and devices do to the microscope in the window. Private to libs/app/window; no GLFW, no ImGui, no
// VTK.
#pragma once
#include <functional>
#include <optional>
#include <string>

#include "keys.h"
#include "local_text.h"
#include "osteo/app/window/rehearsal_window.h"
#include "osteo/simulation/camera/scope_control.h"

namespace osteo::inline app {

/// Of a frame. Pixels, y downwards.
struct ScopeMouse {
  double x = 0, y = 0, dx = 0, dy = 0, wheel = 0;
  bool right = false, middle = false;  ///< down
  bool ctrl = false, shift = false, alt = false;
  bool left = false, clicked = false;  ///< the left button is down; it went down at the beginning, at (x - dx, y - dy)
  bool works = false;  ///< the left button is down, or another hand has the mouse: the wheel is not the camera's
};

/// What of the scene a key may ask for.
struct ScopeScene {
  Vec3 centre_mm;
  double radius_mm = 100;
  Vec3 drill_mm, handle{0, 0, 1};                                      ///< tip and axis of the instrument
  std::function<std::optional<Vec3>(Vec3 from, Vec3 direction)> bone;  ///< the first bone on a ray
};

/// Views of the procedure: from the sides, and from where the surgeon sits: beside the head, the face up in the
/// picture, from a little behind the ear, on the side that is looked at.
enum class StandardView { left, right, front, above, surgeon };

class ScopeInput {
 public:
  ScopeControl control;
  /// What the motion of a device means while O or the pedal is held; with Shift the other of shift and turn.
  CameraGuide mode = CameraGuide::shift;

  [[nodiscard]] const ScopeView& view() const { return control.view(); }
  /// Where the picture is; before anything else of a frame.
  PictureArea area;

  /// The mouse over the picture; `as_device`: it moves the camera as a device does. True when it was for the camera,
  /// and so not for the hand.
  bool mouse(const ScopeMouse& mouse, bool as_device, double seconds);
  /// True when the key was the camera's; `said` is what there is to say of it. `under_mouse`: ray through the mouse.
  bool key(const Keyboard::Press& press, const ScopeScene& scene, const std::optional<Vec3>& under_mouse,
           LocalText& said);
  /// Keys that are held, devices, flights: once a frame, after the mouse.
  void advance(const Keyboard& keyboard, bool shift, const CameraDevices& devices, double seconds);
  /// The whole bone, as when a session begins; `fly`: or at once.
  void overview(StandardView from, const ScopeScene& scene, bool fly);
  /// The camera has the hand: it rests where it is.
  [[nodiscard]] bool lent() const { return lent_; }
  void lend(bool on);

 private:
  [[nodiscard]] CameraGuide mode_now(bool shift) const;
  bool lent_ = false;
  std::optional<Vec3> hand_mm_, hand_axis_;
};

/// "10x  field 20 mm  WD 250 mm"; the naked eye has no magnification to speak of.
[[nodiscard]] std::string scope_text(const ScopeView& view);

}  // namespace osteo::inline app
