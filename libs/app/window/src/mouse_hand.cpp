#include "mouse_hand.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace osteo::inline app {

MouseStep mouse_step(const ScopeView& view, const PictureArea& area, double x, double y, double dx, double dy,
                     Vec3 at_mm) {
  const Vec3 under = view.at_depth_of(at_mm, area, x, y);
  return {under, under - view.at_depth_of(at_mm, area, x - dx, y - dy)};
}

void HandMotion::step(int by) {
  one_to = std::clamp(by > 0 ? one_to / 2 : one_to * 2, 1, kFinest);
}

Vec3 HandMotion::moved(Vec3 at_mm, const MouseStep& step) {
  const double f = factor();
  if (f == 1 && !parted_) return step.under_mm;
  if (dot(step.by_mm, step.by_mm) > 0) parted_ = true;
  return at_mm + step.by_mm * f;
}

Vec3 HandHold::usual() const {
  return plate_ ? Vec3{0, 0, 1} : Vec3{left_ ? -0.62 : 0.62, 0.45, 0.64};
}

void HandHold::set_left(bool left) {
  if (left == left_) return;
  left_ = left;
  for (Vec3& held : held_) held.x = -held.x;
}

void HandHold::take(bool plate) {
  if (plate == plate_) return;
  plate_ = plate;
  if (plate) straight();
}

Vec3 HandHold::axis(const ViewAxes& view) const {
  const Vec3 held = held_[plate_ ? 1 : 0];
  return normalized(view.right * held.x + view.up * held.y - view.forward * held.z);
}

void HandHold::tilt(double right_rad, double up_rad) {
  const double angle = std::hypot(right_rad, up_rad);
  if (!(angle > 0)) return;
  Vec3 to = normalized(rotation_about({}, Vec3{-up_rad, right_rad, 0} / angle, angle).rotation * now());
  const double least = -std::sin(20 * std::numbers::pi / 180);
  if (to.z < least) {
    const double across = std::hypot(to.x, to.y), wanted = std::sqrt(1 - least * least);
    to = {to.x * wanted / across, to.y * wanted / across, least};
  }
  now() = to;
}

void HandHold::roll(double rad) {
  now() = rotation_about({}, {0, 0, 1}, -rad).rotation * now();
}

void HandHold::straight() {
  now() = usual();
}

double HandHold::tilted_rad() const {
  const Vec3 a = normalized(held_[plate_ ? 1 : 0]), b = normalized(usual());
  return std::atan2(length(cross(a, b)), dot(a, b));
}

}  // namespace osteo::inline app
