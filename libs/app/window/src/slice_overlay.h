// What is drawn over any slice: crosshair, letters, scale, ruler, outlines. Private to libs/app/window.
#pragma once
#include <imgui.h>

#include <array>
#include <string>

#include "osteo/display/view/live_cut.h"
#include "osteo/display/view/slices.h"

namespace osteo::inline app {

inline constexpr ImU32 kCrossColour = IM_COL32(120, 200, 120, 170);

/// Light, with a dark edge, so that it can be read on bone. `size`: height of a line, pixels; 0: the font's.
void shadowed_text(ImDrawList* draw, ImVec2 at, const std::string& words, ImU32 ink = IM_COL32(235, 235, 235, 255),
                   float size = 0);

/// A slice on the screen: `lo` its upper left corner in the window, `scale` of lines and distances, as of the text.
struct SliceOnScreen {
  ImDrawList* draw;
  const SliceView& view;
  ImVec2 lo;
  float scale;
  [[nodiscard]] ImVec2 place(Vec3 mm) const;
  /// The font's height, or 13 pixels at a scale of 1 where that is more.
  [[nodiscard]] float text_size() const;

  /// At the upper left.
  void title(const std::string& words) const;

  void cross(Vec3 cross_mm) const;
  /// At the four edges.
  void letters() const;
  /// A bar of a round length, at most a quarter of the view.
  void scale_bar() const;
  /// Only where it lies in this cut, so that no length is foreshortened.
  void ruler(const std::array<Vec3, 2>& line_mm) const;
  void line(const CutLine& line_mm, ImU32 colour, float pixels) const;
};

}  // namespace osteo::inline app
