#include "edit_overlay.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/translate.h"

namespace osteo::inline app {

void annotate_slice(ImDrawList* draw, const EditControl& control, int v, ImVec2 lo, float scale) {
  const SliceView& view = control.view(v);
  const SliceOnScreen on{draw, view, lo, scale};
  const auto place = [&](Vec3 mm) { return on.place(mm); };
  if (control.show_cross) on.cross(control.cross_mm());
  static constexpr const char* names[] = {tr_later("Axial"), tr_later("Coronal"), tr_later("Sagittal")};
  const auto [slice, slices] = control.slice(v);
  on.title(std::string(tr(names[v])) + "  " + std::to_string(slice) + " / " + std::to_string(slices));
  on.letters();
  on.scale_bar();
  if (control.ruler_mm) on.ruler(*control.ruler_mm);
  if (control.tool() == EditTool::box) {
    const auto& l = control.box_lo_mm;
    const auto& u = control.box_hi_mm;
    const ImVec2 a = place({l[0], l[1], l[2]}), b = place({u[0], u[1], u[2]});
    const ImVec2 c0{std::min(a.x, b.x), std::min(a.y, b.y)}, c1{std::max(a.x, b.x), std::max(a.y, b.y)};
    draw->AddRectFilled(c0, c1, IM_COL32(255, 120, 120, 30));
    draw->AddRect(c0, c1, IM_COL32(255, 120, 120, 255), 0, 0, 2 * scale);
  }
  const bool brushes = control.tool() == EditTool::brush || control.tool() == EditTool::eraser;
  if (brushes && control.under_mouse()) {
    // The ball cuts the other slices too, smaller the farther they are.
    const Vec3 m = *control.under_mouse();
    const double off = dot(m - view.through_mm, view.normal()),
                 r2 = control.brush_radius_mm * control.brush_radius_mm - off * off;
    if (r2 > 0)
      draw->AddCircle(place(m), static_cast<float>(std::sqrt(r2) / view.mm_per_pixel),
                      control.tool() == EditTool::brush ? IM_COL32(120, 255, 120, 255) : IM_COL32(255, 120, 120, 255),
                      0, 1.5F * scale);
  }
}

}  // namespace osteo::inline app
