#include "scope_input.h"

#include <cmath>
#include <numbers>

#include "osteo/core/base/translate.h"

namespace osteo::inline app {
namespace {

constexpr double kOrbitRadPerPx = 0.35 * std::numbers::pi / 180;
constexpr double kDeviceMmPerPx = 0.25;  // a screen of about 100 dots to the inch
constexpr double kZoomPerStep = 1.1;
constexpr double kKeyRadPerS = 0.8;
constexpr double kFocusPerKey = 0.02;  // of the field
constexpr double kNakedEye = 2;        // magnifications below are called so

Vec3 side(StandardView from) {
  switch (from) {
    case StandardView::right:
      return {-0.94, -0.25, 0.22};
    case StandardView::front:
      return {0, -1, 0.1};
    case StandardView::above:
      return {0, 0.02, 1};
    case StandardView::left:
    case StandardView::surgeon:
      break;
  }
  return {0.94, -0.25, 0.22};
}

}  // namespace

CameraGuide ScopeInput::mode_now(bool shift) const {
  if (!shift) return mode;
  return mode == CameraGuide::shift ? CameraGuide::turn : CameraGuide::shift;
}

void ScopeInput::lend(bool on) {
  if (lent_ && !on) control.brake();
  if (lent_ != on) hand_mm_.reset();
  lent_ = on;
}

bool ScopeInput::mouse(const ScopeMouse& m, bool as_device, double seconds) {
  const bool moved = m.dx != 0 || m.dy != 0;
  if (as_device) {
    // The mouse is the device: across its table, the wheel away and back.
    const Vec3 by{m.dx * kDeviceMmPerPx, -m.dy * kDeviceMmPerPx, -m.wheel * 5};
    if (moved || m.wheel != 0 || control.arm.moves()) control.guide(mode_now(m.shift), {by, {}}, seconds);
    return true;
  }
  if (m.right) {
    if (moved && m.shift) control.roll(kOrbitRadPerPx * m.dx);
    if (moved && !m.shift) control.orbit(-kOrbitRadPerPx * m.dx, kOrbitRadPerPx * m.dy);
    return true;
  }
  if (m.middle) {
    // What lies in the focus stays under the mouse.
    const double mm = 1 / view().pixels_per_mm(area);
    if (moved) control.pan(-m.dx * mm, m.dy * mm);
    return true;
  }
  if (m.wheel == 0 || (!m.ctrl && (m.shift || m.works))) return false;
  if (m.ctrl && m.shift) {
    control.focus(m.wheel * kFocusPerKey * view().field_mm());
    return true;
  }
  control.zoom(std::pow(kZoomPerStep, m.wheel));
  return m.ctrl || !moved;  // the hand does not lose what the mouse went meanwhile
}

bool ScopeInput::key(const Keyboard::Press& press, const ScopeScene& scene, const std::optional<Vec3>& under_mouse,
                     LocalText& said) {
  const auto bone = [&](Vec3 direction) { return scene.bone ? scene.bone(view().eye_mm(), direction) : std::nullopt; };
  switch (press.command) {
    case Command::magnify:
      // From the naked eye to the microscope: it comes down on the bone in the middle.
      if (press.value > 0 && view().magnification < kNakedEye) {
        ScopeView to = control.target();
        step_magnification(to, press.value);
        if (const auto at = bone(view().back * -1)) focus_on_depth_of(to, *at);
        control.go(to);
      } else {
        control.step(press.value);
      }
      return true;
    case Command::focus:
      control.focus(press.value * kFocusPerKey * view().field_mm());
      return true;
    case Command::autofocus:
      if (const auto at = bone(view().back * -1)) {
        ScopeView to = control.target();
        focus_on_depth_of(to, *at);
        control.go(to);
      } else {
        said = [&] { return tr("no bone in the middle of the picture: nothing to focus on"); };
      }
      return true;
    case Command::look_there:
      if (const auto at = under_mouse ? bone(*under_mouse) : std::nullopt) {
        control.look_at(*at);
      } else {
        said = [&] { return tr("no bone under the mouse: nothing to look at"); };
      }
      return true;
    case Command::look_at_drill:
      if (press.shift) {
        control.look_along(scene.drill_mm, scene.handle);
      } else {
        control.look_at(scene.drill_mm);
      }
      return true;
    case Command::bookmark:
      if (press.shift) {
        control.set_bookmark(static_cast<std::size_t>(press.value));
        said = [&] { return filled(tr("view {n} kept"), {{"n", std::to_string(press.value + 1)}}); };
      } else if (!control.go_to_bookmark(static_cast<std::size_t>(press.value))) {
        said = [&] {
          return filled(tr("no view {n} is kept yet: Shift-F{key} keeps this one"),
                        {{"n", std::to_string(press.value + 1)}, {"key", std::to_string(press.value + 6)}});
        };
      }
      return true;
    case Command::camera_back:
      if (!control.undo()) said = [&] { return tr("no move of the camera to take back"); };
      return true;
    case Command::home:
      overview(StandardView::left, scene, true);
      return true;
    default:
      return false;
  }
}

void ScopeInput::overview(StandardView from, const ScopeScene& scene, bool fly) {
  ScopeView to = osteo::overview(scene.centre_mm, scene.radius_mm, side(from));
  if (from == StandardView::surgeon) {
    const double out = view().back.x < 0 ? -1 : 1;
    look_from(to, {0.94 * out, 0.34, 0.05}, Vec3{0, -1, 0});
  }
  if (fly) {
    control.go(to);
  } else {
    control.jump(to);
  }
}

void ScopeInput::advance(const Keyboard& keyboard, bool shift, const CameraDevices& devices, double seconds) {
  if (lent_ && devices.hand_mm) {
    const Vec3 axis = devices.hand_axis.value_or(Vec3{0, 0, 1});
    if (hand_mm_) {
      const Vec3 turn = cross(*hand_axis_, axis);
      if (length(*devices.hand_mm - *hand_mm_) > 0 || length(turn) > 0 || control.arm.moves())
        control.guide(mode_now(shift), {*devices.hand_mm - *hand_mm_, turn}, seconds);
    }
    hand_mm_ = devices.hand_mm;
    hand_axis_ = axis;
  }
  const auto pair = [&](Command less, Command more) {
    return (keyboard.held(more) ? 1.0 : 0.0) - (keyboard.held(less) ? 1.0 : 0.0);
  };
  const double right = pair(Command::orbit_left, Command::orbit_right),
               up = pair(Command::orbit_down, Command::orbit_up);
  if (right != 0 || up != 0) {
    if (shift) {
      control.pan(right * 0.5 * view().field_mm() * seconds, up * 0.5 * view().field_mm() * seconds);
    } else {
      control.orbit(right * kKeyRadPerS * seconds, up * kKeyRadPerS * seconds);
    }
  }
  if (devices.push) control.drive(*devices.push, devices.turn, seconds);
  control.advance(seconds);
}

std::string scope_text(const ScopeView& view) {
  const bool eye = view.magnification < kNakedEye;
  return filled(
      eye ? tr("eye {times}x  field {field} mm  at {distance} mm") : tr("{times}x  field {field} mm  WD {distance} mm"),
      {{"times", shown_number(view.magnification, 1)},
       {"field", shown_number(view.field_mm(), eye ? 0 : 1)},
       {"distance", shown_number(view.working_distance_mm, 0)}});
}

}  // namespace osteo::inline app
