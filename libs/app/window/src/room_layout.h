// Where everything is in the window: rectangles from its size, the size of text and the layout. Private to
// libs/app/window; no ImGui, no GL.
#pragma once
#include <array>
#include <string>

#include "osteo/core/base/param.h"

namespace osteo::inline app {

/// Pixels of the framebuffer, from the upper left corner.
struct ScreenBox {
  float x = 0, y = 0, width = 0, height = 0;
  [[nodiscard]] float right() const { return x + width; }
  [[nodiscard]] float bottom() const { return y + height; }
  [[nodiscard]] bool empty() const { return width <= 0 || height <= 0; }
  [[nodiscard]] bool holds(float px, float py) const { return px >= x && px < right() && py >= y && py < bottom(); }
  friend bool operator==(const ScreenBox&, const ScreenBox&) = default;
};

/// beside: panel, picture and cuts; operate: the picture fills the window; plan: picture and three cuts, four up;
/// review: after the end.
enum class Layout : int { beside, operate, plan, review };
[[nodiscard]] constexpr std::array<std::string_view, 4> enum_names(Layout) {
  return {"beside", "operate", "plan", "review"};
}
/// The three that one works in, in a circle.
[[nodiscard]] Layout next_layout(Layout layout);

struct RoomLayout {
  Layout shown = Layout::beside;  ///< what there was room for
  std::string why;                ///< when that is not what was asked for; else empty
  ScreenBox panel;                ///< all that can be set; empty where it is folded to the tray
  ScreenBox tray;                 ///< buttons of instruments; empty where the panel has them
  ScreenBox view;                 ///< the bone
  ScreenBox state;                ///< what the burr does now: always at the bottom of the view, of the same rows
  ScreenBox column;               ///< of cuts, one below the other; empty in other layouts
  std::array<ScreenBox, 3> cuts;  ///< four up; empty in other layouts
  ScreenBox page;                 ///< of the end, in review; else empty
};
/// `em_pixels`: height of text. The boxes tile the window. Any size; below the least that a layout needs (60 em wide
/// beside, 52 x 34 plan) it is operate that is shown, and says why. `column_width`: as the person dragged it, within
/// limits; 0: by the window.
[[nodiscard]] RoomLayout lay_out(Layout wanted, int width, int height, float em_pixels, float column_width = 0);

/// A strip above the state, as high as asked for but never more than half the pictures' height, for something that is
/// shown for a while: the pictures make room, all else stays. Empty in review.
[[nodiscard]] ScreenBox take_strip(RoomLayout& room, float high);

/// Height of text at scale 1.
inline constexpr double kTextPixels = 16;
/// A monitor's scale as the system tells it; where that is 1 on a large framebuffer, which many systems leave so, by
/// its size: text keeps its share of a picture of 1920 x 1080. From 1 to 4.
[[nodiscard]] double automatic_scale(double reported_by_monitor, int width, int height);
/// Times what the person chose, as far as the smallest layout still fits; at least 0.7.
[[nodiscard]] double scale_that_fits(double automatic, double by_hand, int width, int height);
/// A step of Ctrl + or -: 10 %, between 0.6 and 2.5.
[[nodiscard]] double next_scale(double by_hand, int steps);

}  // namespace osteo::inline app
