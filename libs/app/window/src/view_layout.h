// Where everything is in the window: rectangles from its size, the size of text and the layout. Private to
// libs/app/window; no ImGui, no GL.
#pragma once
#include <array>
#include <string>

#include "local_text.h"
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

/// operate: the picture fills the window, cuts lie on it; plan: picture and three cuts, four up; review: after the end.
enum class Layout : int { operate, plan, review };
[[nodiscard]] constexpr std::array<std::string_view, 3> enum_names(Layout) {
  return {"operate", "plan", "review"};
}
/// The two that one works in, in turns.
[[nodiscard]] Layout next_layout(Layout layout);

struct ViewLayout {
  Layout shown = Layout::operate;  ///< what there was room for
  LocalText why;                   ///< when that is not what was asked for; else empty
  ScreenBox tray;                  ///< the strip of tools
  ScreenBox side;                  ///< in plan, where there is room: grey values, structures, planned cuts; else empty
  ScreenBox view;                  ///< the bone
  ScreenBox state;                 ///< the strip of what the burr does now, at the bottom
  bool two_rows = false;           ///< of the state: the nearest structure is below the figures
  std::array<ScreenBox, 3> cuts;   ///< four up; empty in other layouts
  std::array<ScreenBox, 3> over;   ///< cuts that lie on the picture; those without room are empty
  ScreenBox cut_tile;              ///< where operate has no room for a cut: what brings one over the picture; else empty
  ScreenBox page;                  ///< of the end, in review; else empty
  float unit = 1;                  ///< pixels for one of the design's
  /// From the view's left edge as far as cuts, or the tile in their place, lie on it; all of it where none do.
  [[nodiscard]] float free_width() const {
    const ScreenBox& first = over[0].empty() ? cut_tile : over[0];
    return first.empty() ? view.width : first.x - view.x;
  }
  /// Of the window: what cuts on it leave to the picture.
  [[nodiscard]] double picture_share(int width, int height) const;
};
/// Of the window, in operate, at scale 1 from 1024 x 700 on.
inline constexpr double kPictureShare = 0.8;
/// `em_pixels`: height of text. The boxes but `over` tile the window. Any size; below the least that plan needs (52 x
/// 34 em, with a side 60 x 30) it is operate that is shown, and says why. `cut_side`: of the cuts on the picture as the
/// person dragged it, within limits; 0: the largest that leaves the picture its share, three where the window is 1200
/// of the design's pixels wide, else one.
[[nodiscard]] ViewLayout lay_out(Layout wanted, int width, int height, float em_pixels, float cut_side = 0);
/// A strip above the state, as high as asked for but never more than half the pictures' height, for something that is
/// shown for a while: the pictures make room, all else stays. Empty in review.
[[nodiscard]] ScreenBox take_strip(ViewLayout& layout, float high);

/// A column at the right, so wide but at most half of the pictures' width: the pictures make room, state and strip
/// stay. Empty in review.
[[nodiscard]] ScreenBox take_column(ViewLayout& layout, float wide);

/// Of the design's pixels: in a view that is no wider what the scale bar has beside it is left out, so that a message
/// has room there.
inline constexpr float kNarrow = 720;
/// Height of text at scale 1.
inline constexpr double kTextPixels = 16;
/// A monitor's scale as the system tells it; where that is 1 on a large framebuffer, which many systems leave so, by
/// its size: text keeps its share of a picture of 1920 x 1080. From 1 to 4.
[[nodiscard]] double automatic_scale(double reported_by_monitor, int width, int height);
/// Times what the person chose, as far as the smallest layout still fits (2 in 1024 x 700); at least 0.7.
[[nodiscard]] double scale_that_fits(double automatic, double by_hand, int width, int height);
/// Pixels of text in a window; `fixed`: a scale that was asked for in place of the monitor's; 0: none.
[[nodiscard]] int em_that_fits(double fixed, double reported_by_monitor, double by_hand, int width, int height);
/// A step of Ctrl + or -: 10 %, between 0.6 and 2.5.
[[nodiscard]] double next_scale(double by_hand, int steps);

}  // namespace osteo::inline app
