#include "cuts_control.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/translate.h"

namespace osteo::inline app {
namespace {

constexpr double kFirstSpanMm = 90;
constexpr double kDragPixels = 4;  // less is a click

}  // namespace

CutsControl::CutsControl() {
  for (std::size_t c = 0; c < kCuts; ++c) {
    views_[c].plane = static_cast<Plane>(c);
    views_[c].mm_per_pixel = kFirstSpanMm / views_[c].width;
  }
  take_preset(0);
}

void CutsControl::resize(int cut, int width, int height) {
  at(cut).resize(width, height);
}

void CutsControl::set_bounds(Vec3 lo, Vec3 hi, double step_mm) {
  bounds_mm_ = {lo, hi};
  step_mm_ = step_mm;
  for (SliceView& v : views_) v.centre_mm = (lo + hi) * 0.5;
  centred_ = true;
}

const char* CutsControl::name(int cut) const {
  static constexpr const char* kBody[] = {tr_later("Axial"), tr_later("Coronal"), tr_later("Sagittal")};
  static constexpr const char* kTool[] = {tr_later("Across the tool"), tr_later("Along the tool"),
                                          tr_later("Along it, the other way")};
  return tr((planes_ == Planes::body ? kBody : kTool)[cut]);
}

void CutsControl::set_cross(Vec3 world_mm) {
  if (bounds_mm_) {
    for (std::size_t a = 0; a < 3; ++a) world_mm[a] = std::clamp(world_mm[a], (*bounds_mm_)[0][a], (*bounds_mm_)[1][a]);
  }
  cross_mm_ = world_mm;
  for (SliceView& v : views_) v.through_mm = cross_mm_;
  if (pointer_.view >= 0)
    under_mouse_ = view(pointer_.view).world(pointer_.x, pointer_.y);  // another slice is under it
}

void CutsControl::go_to(Vec3 world_mm) {
  follows_ = false;
  set_cross(world_mm);
}

void CutsControl::begin_at(Vec3 world_mm) {
  waits_ = true;
  set_cross(world_mm);
  for (SliceView& v : views_) v.centre_mm = cross_mm_;
  centred_ = true;
}

void CutsControl::follow(bool on) {
  follows_ = on;
  waits_ = false;
  centred_ = !on;
  if (on) tool_is(tip_mm_, axis_);
}

void CutsControl::tool_is(Vec3 tip_mm, Vec3 axis, bool touches) {
  tip_mm_ = tip_mm;
  axis_ = axis;
  waits_ = waits_ && !touches;
  if (!follows_) return;
  if (planes_ == Planes::tool) turn_to_tool();
  if (waits_) return;
  set_cross(tip_mm);
  if (!centred_) {
    for (SliceView& v : views_) v.centre_mm = cross_mm_;
  }
  centred_ = true;
  keep_cross_in_view();
}

void CutsControl::keep_cross_in_view() {
  constexpr double kMargin = 0.2;
  for (SliceView& v : views_) {
    const auto p = v.pixel(cross_mm_);
    const double x = std::clamp(p[0], kMargin * v.width, (1 - kMargin) * v.width);
    const double y = std::clamp(p[1], kMargin * v.height, (1 - kMargin) * v.height);
    v.drag(x - p[0], y - p[1]);
  }
}

void CutsControl::turn_to_tool() {
  // Carried along by the smallest turn: taken from the body's axes at each moment it would jump where the tool passes
  // one of them.
  Vec3 right = beside_.right - axis_ * dot(beside_.right, axis_);
  if (length(right) < 0.05) right = beside_.down - axis_ * dot(beside_.down, axis_);
  beside_.right = normalized(right);
  beside_.down = cross(axis_, beside_.right);
  // Across: as one who holds it sees it, looking along the handle down to the tip. Along: the handle up.
  views_[0].oblique = SliceAxes{beside_.right, -beside_.down};
  views_[1].oblique = SliceAxes{beside_.right, -axis_};
  views_[2].oblique = SliceAxes{beside_.down, -axis_};
}

void CutsControl::take_planes(Planes planes) {
  planes_ = planes;
  if (planes == Planes::tool) {
    // The body's left lies to the right as in an axial cut, where the tool lets it.
    beside_ = {{1, 0, 0}, {0, 1, 0}};
    turn_to_tool();
  } else {
    for (SliceView& v : views_) v.oblique.reset();
  }
  for (SliceView& v : views_) v.centre_mm = cross_mm_;
}

void CutsControl::enlarge_or_back() {
  enlarged_ = enlarged_ >= 0 ? -1 : pointer_.view >= 0 ? pointer_.view : last_;
  if (enlarged_ >= 0) last_ = enlarged_;
}

void CutsControl::take_preset(int number) {
  preset_ = number;
  hu = grey_presets()[static_cast<std::size_t>(number)].hu;
}

void CutsControl::press(SlicePointer p, SliceButton button) {
  move(p);
  if (p.view < 0 || held_) return;
  held_ = button;
  pressed_ = p;
  dragged_ = false;
}

void CutsControl::move(SlicePointer p) {
  const double dx = p.x - pointer_.x, dy = p.y - pointer_.y;
  pointer_ = p;
  under_mouse_ = p.view >= 0 ? std::optional(view(p.view).world(p.x, p.y)) : std::nullopt;
  if (!held_) {
    if (p.shift && under_mouse_ && (dx != 0 || dy != 0)) go_to(*under_mouse_);
    return;
  }
  // What is dragged belongs to the cut where it began.
  SliceView& v = at(pressed_.view);
  const bool begins = !dragged_ && std::hypot(p.x - pressed_.x, p.y - pressed_.y) >= kDragPixels;
  if (begins) dragged_ = true;
  if (!dragged_) return;
  const double from_x = begins ? p.x - pressed_.x : dx, from_y = begins ? p.y - pressed_.y : dy;
  switch (*held_) {
    case SliceButton::left:
      ruler_ = Ruler{v.world(pressed_.x, pressed_.y), v.world(p.x, p.y)};
      break;
    case SliceButton::right:
      hu.drag(from_x, from_y);
      break;
    case SliceButton::middle:
      v.drag(from_x, from_y);
      break;
  }
}

void CutsControl::release(SlicePointer p, SliceButton button) {
  if (held_ != button) return;
  move(p);
  held_.reset();
  if (dragged_) return;
  if (button == SliceButton::right) take_preset(preset_);
  if (button == SliceButton::left) {
    ruler_.reset();
    go_to(view(pressed_.view).world(pressed_.x, pressed_.y));
  }
}

void CutsControl::wheel(SlicePointer p, double notches) {
  move(p);
  if (p.view < 0 || notches == 0) return;
  if (p.control) {
    at(p.view).zoom_about(p.x, p.y, std::pow(1.15, notches));
  } else {
    go_to(cross_mm_ + view(p.view).normal() * (step_mm_ * notches));
  }
}

void CutsControl::double_click(SlicePointer p) {
  move(p);
  if (p.view >= 0) enlarge_or_back();
}

}  // namespace osteo::inline app
