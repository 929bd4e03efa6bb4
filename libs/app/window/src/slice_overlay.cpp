#include "slice_overlay.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "osteo/core/base/translate.h"

namespace osteo::inline app {
namespace {

constexpr ImU32 kText = IM_COL32(235, 235, 235, 255), kShadow = IM_COL32(0, 0, 0, 200);

float width_of(const std::string& words, float size) {
  return ImGui::GetFont()->CalcTextSizeA(size, 1e9F, 0, words.c_str()).x;
}

}  // namespace

void shadowed_text(ImDrawList* draw, ImVec2 at, const std::string& words, ImU32 ink, float size) {
  if (size <= 0) size = ImGui::GetFontSize();
  draw->AddText(ImGui::GetFont(), size, {at.x + 1, at.y + 1}, kShadow, words.c_str());
  draw->AddText(ImGui::GetFont(), size, at, ink, words.c_str());
}

float SliceOnScreen::text_size() const {
  return std::max(ImGui::GetFontSize(), 13 * scale);
}

void SliceOnScreen::title(const std::string& words) const {
  // Where it would meet the letter at the upper edge it stands below that.
  const float line = text_size(), edge = 8 * scale;
  const bool meets = edge + width_of(words, line) > static_cast<float>(view.width) / 2 - line;
  shadowed_text(draw, {lo.x + edge, lo.y + 6 * scale + (meets ? 1.25F * line : 0)}, words, kText, line);
}

ImVec2 SliceOnScreen::place(Vec3 mm) const {
  const auto p = view.pixel(mm);
  return {lo.x + static_cast<float>(p[0]) + 0.5F, lo.y + static_cast<float>(p[1]) + 0.5F};
}

void SliceOnScreen::cross(Vec3 cross_mm) const {
  const auto w = static_cast<float>(view.width), h = static_cast<float>(view.height);
  const ImVec2 c = place(cross_mm);
  const float hole = 12 * scale;
  draw->AddLine({lo.x, c.y}, {c.x - hole, c.y}, kCrossColour);
  draw->AddLine({c.x + hole, c.y}, {lo.x + w, c.y}, kCrossColour);
  draw->AddLine({c.x, lo.y}, {c.x, c.y - hole}, kCrossColour);
  draw->AddLine({c.x, c.y + hole}, {c.x, lo.y + h}, kCrossColour);
}

void SliceOnScreen::letters() const {
  const auto w = static_cast<float>(view.width), h = static_cast<float>(view.height);
  const float edge = 6 * scale;
  const ImU32 ink = IM_COL32(255, 225, 140, 255);
  const auto words = edge_letters(view);
  const float line = text_size();
  const auto size = [&](const std::string& s) { return width_of(s, line); };
  shadowed_text(draw, {lo.x + edge, lo.y + h / 2 - line / 2}, words[0], ink, line);
  shadowed_text(draw, {lo.x + w - edge - size(words[1]), lo.y + h / 2 - line / 2}, words[1], ink, line);
  shadowed_text(draw, {lo.x + (w - size(words[2])) / 2, lo.y + edge}, words[2], ink, line);
  shadowed_text(draw, {lo.x + (w - size(words[3])) / 2, lo.y + h - line - edge}, words[3], ink, line);
}

void SliceOnScreen::scale_bar() const {
  const auto w = static_cast<float>(view.width), h = static_cast<float>(view.height);
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
  const float line = text_size();
  shadowed_text(draw, {end.x - std::max(bar, width_of(words, line)), end.y - line - 6 * scale}, words, kText, line);
}

void SliceOnScreen::ruler(const std::array<Vec3, 2>& r) const {
  const Vec3 n = view.normal();
  if (std::abs(dot(r[0] - view.through_mm, n)) > 0.01 || std::abs(dot(r[1] - view.through_mm, n)) > 0.01) return;
  const ImVec2 a = place(r[0]), b = place(r[1]);
  const ImU32 colour = IM_COL32(255, 120, 120, 255);
  draw->AddLine(a, b, colour, 2 * scale);
  draw->AddCircleFilled(a, 3 * scale, colour);
  draw->AddCircleFilled(b, 3 * scale, colour);
  const std::string words = shown_number(length(r[1] - r[0]), 1) + " mm";
  shadowed_text(draw, {b.x + 8 * scale, b.y - text_size()}, words, IM_COL32(255, 150, 150, 255), text_size());
}

void SliceOnScreen::line(const CutLine& l, ImU32 colour, float pixels) const {
  // Points nearer than the screen shows would cost as much as others.
  std::vector<ImVec2> points;
  for (const Vec3 mm : l.points_mm) {
    const ImVec2 p = place(mm);
    if (!points.empty() && std::abs(p.x - points.back().x) + std::abs(p.y - points.back().y) < 0.7F) continue;
    points.push_back(p);
  }
  if (points.size() == 1) points.push_back({points[0].x + 1, points[0].y});  // thinner than a pixel: still there
  draw->AddPolyline(points.data(), static_cast<int>(points.size()), colour, l.closed ? ImDrawFlags_Closed : 0, pixels);
}

}  // namespace osteo::inline app
