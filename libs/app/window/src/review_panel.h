// The findings and the course of a session that is over, drawn. Private to libs/app/window; ImGui, no GL.
#pragma once
#include <span>

#include "review_control.h"
#include "view_layout.h"

namespace osteo::inline app {

/// Height of the course along the lower edge of the picture, in heights of text.
inline constexpr float kCourseEm = 9;

/// Into the current window: how far it is made, or the three findings that matter most, each with its picture (a
/// texture; 0: none); a click looks at one.
void draw_findings(ReviewControl& control, std::span<const unsigned> pictures);
/// All findings in words, and what limits them.
void draw_all_findings(ReviewControl& control);
/// In a box: time, play and speed; force, distance, bone seen and unseen, events; a click or a drag goes there.
void draw_course(const ScreenBox& box, ReviewControl& control);

}  // namespace osteo::inline app
