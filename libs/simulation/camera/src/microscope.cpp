#include "osteo/simulation/camera/microscope.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace osteo::inline simulation {
namespace {

constexpr double kTopRad = 89 * std::numbers::pi / 180;

// Rodrigues' formula.
Vec3 turned(Vec3 v, Vec3 axis, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return v * c + cross(axis, v) * s + axis * (dot(axis, v) * (1 - c));
}

// Rounding adds up over thousands of moves.
void straighten(ScopeView& view) {
  view.back = normalized(view.back);
  view.up = normalized(view.up - view.back * dot(view.up, view.back));
}

void turn(ScopeView& view, Vec3 axis, double angle) {
  view.back = turned(view.back, axis, angle);
  view.up = turned(view.up, axis, angle);
  straighten(view);
}

double shorter(const PictureArea& area) {
  return std::max(1.0, std::min(area.width, area.height));
}

}  // namespace

double ScopeView::field_angle_rad() const {
  return 2 * std::atan(field_mm() / 2 / working_distance_mm);
}

double ScopeView::view_angle_deg(const PictureArea& area) const {
  return 2 * std::atan(field_mm() / 2 / working_distance_mm * area.height / shorter(area)) * 180 / std::numbers::pi;
}

double ScopeView::pixels_per_mm(const PictureArea& area) const {
  return shorter(area) / field_mm();
}

Vec3 ScopeView::ray(const PictureArea& area, double x, double y) const {
  return normalized(at_depth_of(focus_mm, area, x, y) - eye_mm());
}

Vec3 ScopeView::at_depth_of(Vec3 reference_mm, const PictureArea& area, double x, double y) const {
  const Vec3 eye = eye_mm();
  const double depth = dot(eye - reference_mm, back), mm = depth / working_distance_mm / pixels_per_mm(area);
  return eye - back * depth + right() * ((x - area.x - area.width / 2) * mm) +
         up * ((area.y + area.height / 2 - y) * mm);
}

std::optional<std::array<double, 2>> ScopeView::pixel(Vec3 place_mm, const PictureArea& area) const {
  const Vec3 from_eye = place_mm - eye_mm();
  const double depth = -dot(from_eye, back);
  if (depth < 1e-6 * working_distance_mm) return std::nullopt;
  const double px = pixels_per_mm(area) * working_distance_mm / depth;
  return std::array<double, 2>{area.x + area.width / 2 + dot(from_eye, right()) * px,
                               area.y + area.height / 2 - dot(from_eye, up) * px};
}

void magnify(ScopeView& view, double magnification) {
  view.magnification = std::clamp(magnification, kMinMagnification, kMaxMagnification);
}

void step_magnification(ScopeView& view, int direction) {
  constexpr double kSame = 1e-6;
  if (direction > 0) {
    for (const double m : kMagnifications) {
      if (m > view.magnification * (1 + kSame)) {
        view.magnification = m;
        return;
      }
    }
  } else {
    for (auto m = kMagnifications.rbegin(); m != kMagnifications.rend(); ++m) {
      if (*m < view.magnification * (1 - kSame)) {
        view.magnification = *m;
        return;
      }
    }
  }
}

void level(ScopeView& view) {
  view.upright = true;
  // At the top and below the patient's face is up.
  if (std::hypot(view.back.x, view.back.y) < 1e-9) {
    view.up = {0, -1, 0};
  } else {
    view.up = normalized(Vec3{0, 0, 1} - view.back * view.back.z);
  }
}

void orbit(ScopeView& view, double right_rad, double up_rad) {
  if (view.upright) {
    const double height = std::clamp(std::asin(std::clamp(view.back.z, -1.0, 1.0)) + up_rad, -kTopRad, kTopRad);
    // Straight above there is no azimuth: what is up in the picture says it.
    const bool steep = std::hypot(view.back.x, view.back.y) < 1e-9;
    const Vec3 level_back = steep ? view.up * (view.back.z > 0 ? -1.0 : 1.0) : view.back;
    const double around = std::atan2(level_back.y, level_back.x) + right_rad;
    view.back = {std::cos(height) * std::cos(around), std::cos(height) * std::sin(around), std::sin(height)};
    level(view);
    return;
  }
  turn(view, view.up, right_rad);
  turn(view, view.right(), -up_rad);
}

void roll(ScopeView& view, double angle_rad) {
  view.upright = false;
  turn(view, view.back, angle_rad);
}

void pan(ScopeView& view, double right_mm, double up_mm) {
  view.focus_mm += view.right() * right_mm + view.up * up_mm;
}

void focus_deeper(ScopeView& view, double deeper_mm) {
  view.focus_mm += view.back * -deeper_mm;
}

void focus_on_depth_of(ScopeView& view, Vec3 place_mm) {
  view.focus_mm += view.back * dot(place_mm - view.focus_mm, view.back);
}

void set_working_distance(ScopeView& view, double working_distance_mm) {
  view.working_distance_mm = std::clamp(working_distance_mm, kMinWorkingMm, kMaxWorkingMm);
}

void move(ScopeView& view, const ScopeMotion& motion) {
  const Vec3 right = view.right(), up = view.up, back = view.back;
  view.focus_mm += right * motion.shift_mm.x + up * motion.shift_mm.y + back * motion.shift_mm.z;
  const Vec3 about = right * motion.turn_rad.x + up * motion.turn_rad.y + back * motion.turn_rad.z;
  const double angle = length(about);
  if (angle == 0) return;
  if (view.upright) {
    orbit(view, motion.turn_rad.y, -motion.turn_rad.x);
    return;
  }
  turn(view, about / angle, angle);
}

void look_from(ScopeView& view, Vec3 towards_eye, std::optional<Vec3> up) {
  view.back = normalized(towards_eye);
  if (!up) {
    if (std::abs(view.back.z) > std::sin(kTopRad)) {
      const double h = std::hypot(view.back.x, view.back.y), z = std::copysign(std::sin(kTopRad), view.back.z);
      // From straight above the eye comes from a little behind, so that the face is up.
      const Vec3 flat = h < 1e-9 ? Vec3{0, view.back.z > 0 ? 1.0 : -1.0, 0} : Vec3{view.back.x / h, view.back.y / h, 0};
      view.back = flat * std::cos(kTopRad) + Vec3{0, 0, z};
    }
    level(view);
    return;
  }
  view.upright = false;
  view.up = *up;
  straighten(view);
}

ScopeView overview(Vec3 centre_mm, double radius_mm, Vec3 towards_eye) {
  // What an eye angle of 30 degrees shows of it, from at least the usual working distance.
  ScopeView view;
  view.focus_mm = centre_mm;
  const double near_mm = radius_mm / 0.3, field_mm = 2 * near_mm * std::tan(std::numbers::pi / 12);
  set_working_distance(view, std::max(250.0, near_mm));
  magnify(view, kFieldNumberMm / field_mm);
  look_from(view, towards_eye);
  return view;
}

Vec3 turn_between(const ScopeView& from, const ScopeView& to) {
  // The rotation's matrix in the axes of `from`, then its axis and angle.
  const Vec3 f[3] = {from.right(), from.up, from.back}, t[3] = {to.right(), to.up, to.back};
  double m[3][3];
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) m[r][c] = dot(f[r], t[c]);
  }
  const Vec3 axis{m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]};
  const double sine = length(axis) / 2, cosine = (m[0][0] + m[1][1] + m[2][2] - 1) / 2,
               angle = std::atan2(sine, cosine);
  if (sine > 1e-7) return axis * (angle / (2 * sine));
  if (cosine > 0) return axis / 2;
  // Half a turn: the axis is the column of m + 1 that is longest.
  Vec3 best;
  for (int c = 0; c < 3; ++c) {
    const Vec3 column{m[0][c] + (c == 0 ? 1 : 0), m[1][c] + (c == 1 ? 1 : 0), m[2][c] + (c == 2 ? 1 : 0)};
    if (length(column) > length(best)) best = column;
  }
  return normalized(best) * angle;
}

ScopeView between(const ScopeView& from, const ScopeView& to, double share) {
  if (share <= 0) return from;
  if (share >= 1) return to;
  ScopeView view = from;
  view.upright = to.upright;
  view.focus_mm = from.focus_mm + (to.focus_mm - from.focus_mm) * share;
  view.working_distance_mm = from.working_distance_mm + (to.working_distance_mm - from.working_distance_mm) * share;
  view.magnification = from.magnification * std::pow(to.magnification / from.magnification, share);
  const Vec3 about = turn_between(from, to);
  if (const double angle = length(about); angle > 0) {
    const Vec3 axis = normalized(from.right() * about.x + from.up * about.y + from.back * about.z);
    turn(view, axis, angle * share);
  }
  return view;
}

ScaleBar scale_bar(double pixels_per_mm, double most_px) {
  const double most_mm = most_px / pixels_per_mm, ten = std::pow(10, std::floor(std::log10(most_mm)));
  const double ratio = most_mm / ten * (1 + 1e-12), mm = ten * (ratio >= 5 ? 5 : ratio >= 2 ? 2 : 1);
  return {mm, mm * pixels_per_mm};
}

ViewError view_error(const ScopeView& a, const ScopeView& b) {
  return {length(a.focus_mm - b.focus_mm), length(turn_between(a, b)),
          std::max(a.magnification / b.magnification, b.magnification / a.magnification)};
}

}  // namespace osteo::inline simulation
