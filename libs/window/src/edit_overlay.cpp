#include "edit_overlay.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace osteo {
namespace {

constexpr ImU32 kText = IM_COL32(235, 235, 235, 255), kShadow = IM_COL32(0, 0, 0, 200);

// A length is drawn where it lies, not where it is foreshortened.
bool lies_in(const SliceView& view, const std::array<Vec3, 2>& line) {
  const Vec3 n = normalized(cross(view.world(1, 0) - view.world(0, 0), view.world(0, 1) - view.world(0, 0)));
  return std::abs(dot(line[0] - view.through_mm, n)) < 0.01 && std::abs(dot(line[1] - view.through_mm, n)) < 0.01;
}

}  // namespace

void shadowed_text(ImDrawList* draw, ImVec2 at, const std::string& words, ImU32 ink) {
  draw->AddText({at.x + 1, at.y + 1}, kShadow, words.c_str());
  draw->AddText(at, ink, words.c_str());
}

void annotate_slice(ImDrawList* draw, const EditControl& control, int v, ImVec2 lo, float scale) {
  const SliceView& view = control.view(v);
  const auto place = [&](Vec3 mm) {
    const auto p = view.pixel(mm);
    return ImVec2{lo.x + static_cast<float>(p[0]) + 0.5F, lo.y + static_cast<float>(p[1]) + 0.5F};
  };
  const auto w = static_cast<float>(view.width), h = static_cast<float>(view.height);
  if (control.show_cross) {
    const ImVec2 c = place(control.cross_mm());
    const float hole = 12 * scale;
    draw->AddLine({lo.x, c.y}, {c.x - hole, c.y}, kCrossColour);
    draw->AddLine({c.x + hole, c.y}, {lo.x + w, c.y}, kCrossColour);
    draw->AddLine({c.x, lo.y}, {c.x, c.y - hole}, kCrossColour);
    draw->AddLine({c.x, c.y + hole}, {c.x, lo.y + h}, kCrossColour);
  }
  static constexpr const char* names[] = {"Axial", "Coronal", "Sagittal"};
  static constexpr const char* letters[] = {"RLAP", "RLHF", "APHF"};  // left, right, top, bottom
  const auto [slice, slices] = control.slice(v);
  shadowed_text(draw, {lo.x + 8 * scale, lo.y + 6 * scale},
                std::string(names[v]) + "  " + std::to_string(slice) + " / " + std::to_string(slices));
  const float line = ImGui::GetFontSize();
  const ImU32 ink = IM_COL32(255, 225, 140, 255);
  const auto letter = [&](int i) { return std::string(1, letters[v][i]); };
  shadowed_text(draw, {lo.x + 8 * scale, lo.y + h / 2 - line / 2}, letter(0), ink);
  shadowed_text(draw, {lo.x + w - line, lo.y + h / 2 - line / 2}, letter(1), ink);
  shadowed_text(draw, {lo.x + w / 2 - line / 4, lo.y + 6 * scale}, letter(2), ink);
  shadowed_text(draw, {lo.x + w / 2 - line / 4, lo.y + h - line - 6 * scale}, letter(3), ink);
  // A bar of a round length, about a fifth of the view.
  double mm = 1;
  for (const double step : {1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0}) {
    if (step / view.mm_per_pixel < view.width / 4.0) mm = step;
  }
  const auto bar = static_cast<float>(mm / view.mm_per_pixel);
  const ImVec2 end{lo.x + w - 14 * scale, lo.y + h - 12 * scale};
  draw->AddLine({end.x - bar, end.y}, end, kText, 2 * scale);
  draw->AddLine({end.x - bar, end.y - 5 * scale}, {end.x - bar, end.y + 1}, kText, 2 * scale);
  draw->AddLine({end.x, end.y - 5 * scale}, {end.x, end.y + 1}, kText, 2 * scale);
  char words[48];
  std::snprintf(words, sizeof words, "%.0f mm", mm);
  shadowed_text(draw, {end.x - bar, end.y - line - 6 * scale}, words);

  if (control.ruler_mm && lies_in(view, *control.ruler_mm)) {
    const auto& r = *control.ruler_mm;
    const ImVec2 a = place(r[0]), b = place(r[1]);
    draw->AddLine(a, b, IM_COL32(255, 120, 120, 255), 2 * scale);
    draw->AddCircleFilled(a, 3 * scale, IM_COL32(255, 120, 120, 255));
    draw->AddCircleFilled(b, 3 * scale, IM_COL32(255, 120, 120, 255));
    std::snprintf(words, sizeof words, "%.1f mm", length(r[1] - r[0]));
    shadowed_text(draw, {b.x + 8 * scale, b.y - line}, words, IM_COL32(255, 150, 150, 255));
  }
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
    const Vec3 n = cross(view.world(1, 0) - view.world(0, 0), view.world(0, 1) - view.world(0, 0));
    const double off = dot(m - view.through_mm, normalized(n)), r2 = control.brush_radius_mm * control.brush_radius_mm - off * off;
    if (r2 > 0)
      draw->AddCircle(place(m), static_cast<float>(std::sqrt(r2) / view.mm_per_pixel),
                      control.tool() == EditTool::brush ? IM_COL32(120, 255, 120, 255) : IM_COL32(255, 120, 120, 255), 0, 1.5F * scale);
  }
}

}  // namespace osteo
