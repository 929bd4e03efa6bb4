#include "osteo/display/view/slices.h"

#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkStdString.h>
#include <vtkTextProperty.h>
#include <vtkTextRenderer.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace osteo::inline display {
namespace {

// Distinct tints for the first labels; later ones repeat.
constexpr std::array<std::array<double, 3>, 8> kTints{{{235, 120, 60},
                                                       {90, 200, 120},
                                                       {90, 150, 255},
                                                       {240, 220, 80},
                                                       {220, 90, 200},
                                                       {80, 220, 220},
                                                       {255, 150, 150},
                                                       {180, 180, 90}}};

}  // namespace

SliceAxes axes_of(Plane plane) {
  switch (plane) {
    case Plane::axial:
      return {{1, 0, 0}, {0, 1, 0}};
    case Plane::coronal:
      return {{1, 0, 0}, {0, 0, -1}};
    case Plane::sagittal:
      return {{0, 1, 0}, {0, 0, -1}};
  }
  return {};
}

Vec3 SliceView::normal() const {
  const SliceAxes a = axes();
  return cross(a.right, a.down);
}

Vec3 SliceView::world(double px, double py) const {
  const SliceAxes a = axes();
  const Vec3 n = cross(a.right, a.down);
  const Vec3 base = centre_mm + n * dot(through_mm - centre_mm, n);
  return base + a.right * ((px + 0.5 - width / 2.0) * mm_per_pixel) +
         a.down * ((py + 0.5 - height / 2.0) * mm_per_pixel);
}

std::array<double, 2> SliceView::pixel(Vec3 world_mm) const {
  const SliceAxes a = axes();
  const Vec3 d = world_mm - centre_mm;
  return {dot(d, a.right) / mm_per_pixel + width / 2.0 - 0.5, dot(d, a.down) / mm_per_pixel + height / 2.0 - 0.5};
}

void SliceView::zoom_about(double px, double py, double factor) {
  const Vec3 before = world(px, py);
  mm_per_pixel = std::clamp(mm_per_pixel / factor, 0.005, 5.0);
  centre_mm += before - world(px, py);
}

void SliceView::drag(double dx, double dy) {
  centre_mm += world(0, 0) - world(dx, dy);
}

void SliceView::resize(int new_width, int new_height) {
  if (width == new_width && height == new_height) return;
  mm_per_pixel *= std::min(width, height) / static_cast<double>(std::max(1, std::min(new_width, new_height)));
  width = std::max(1, new_width);
  height = std::max(1, new_height);
}

std::array<std::string, 4> edge_letters(const SliceView& view) {
  const auto [right, down] = view.axes();
  const auto towards = [](Vec3 d) {
    constexpr const char* kSides[3] = {"RL", "AP", "FH"};
    constexpr double kNear = 0.35;  // a direction 70 degrees off is not told
    std::array<std::size_t, 3> order{0, 1, 2};
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return std::abs(d[a]) > std::abs(d[b]); });
    std::string letters;
    for (const std::size_t a : order) {
      if (std::abs(d[a]) > kNear) letters += kSides[a][d[a] > 0 ? 1 : 0];
    }
    return letters;
  };
  return {towards(right * -1), towards(right), towards(down * -1), towards(down)};
}

std::string place_text(Vec3 p) {
  char text[96];
  std::snprintf(text, sizeof text, "%c %.1f  %c %.1f  %c %.1f", p.x >= 0 ? 'L' : 'R', std::abs(p.x),
                p.y >= 0 ? 'P' : 'A', std::abs(p.y), p.z >= 0 ? 'H' : 'F', std::abs(p.z));
  return text;
}

double HuWindow::grey(double hu) const {
  return std::clamp((hu - level + width / 2) * 255 / std::max(1.0, width), 0.0, 255.0);
}

void HuWindow::drag(double dx, double dy) {
  constexpr double kHuPerPixel = 4;
  width = std::clamp(width + dx * kHuPerPixel, 1.0, 10000.0);
  level = std::clamp(level - dy * kHuPerPixel, -2000.0, 8000.0);
}

std::span<const GreyPreset> grey_presets() {
  static constexpr GreyPreset kPresets[] = {
      {"Bone", {1000, 400}}, {"Soft tissue", {350, 40}}, {"Temporal bone", {4000, 700}}};
  return kPresets;
}

double grey_of_hu(double hu) {
  return std::clamp((hu + 200) / 1700 * 255, 0.0, 255.0);
}

Picture draw_slice(const SliceView& view, const GreyAt& grey, const LabelAt& label,
                   const std::vector<Structure>& structures) {
  Picture picture{view.width, view.height, {}};
  picture.rgb.resize(static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height) * 3);
  std::array<std::array<double, 3>, 256> tints{};
  for (std::size_t v = 1; v < tints.size(); ++v) tints[v] = kTints[(v - 1) % kTints.size()];
  for (const Structure& s : structures) {
    for (std::size_t c = 0; c < 3; ++c) tints[s.value][c] = s.rgb[c];
  }
  const double strength = structures.empty() ? 0.4 : 0.75;
  std::size_t at = 0;
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      const Vec3 p = view.world(x, y);
      const double g = grey ? grey(p) : 0;
      std::array<double, 3> rgb{g, g, g};
      if (const int l = label ? label(p) : 0; l > 0) {
        const auto& tint = tints[static_cast<std::size_t>(l) & 255];
        for (std::size_t c = 0; c < 3; ++c) rgb[c] = (1 - strength) * rgb[c] + strength * tint[c];
      }
      for (const double c : rgb) picture.rgb[at++] = static_cast<std::uint8_t>(std::lround(std::clamp(c, 0.0, 255.0)));
    }
  }
  return picture;
}

void paste(Picture& onto, const Picture& from, int x, int y) {
  for (int row = 0; row < from.height; ++row) {
    if (y + row < 0 || y + row >= onto.height) continue;
    const int columns = std::min(from.width, onto.width - x);
    std::copy_n(from.rgb.begin() + static_cast<std::ptrdiff_t>(row) * from.width * 3, columns * 3,
                onto.rgb.begin() + (static_cast<std::ptrdiff_t>(y + row) * onto.width + x) * 3);
  }
}

void write_text(Picture& onto, std::string_view text, int x, int y, int size, std::array<int, 3> rgb) {
  vtkTextRenderer* const renderer = vtkTextRenderer::GetInstance();
  if (renderer == nullptr || text.empty()) return;
  vtkNew<vtkTextProperty> property;
  property->SetFontFamilyToArial();
  property->SetFontSize(size);
  property->SetColor(1, 1, 1);
  vtkNew<vtkImageData> image;
  int dims[2] = {0, 0};
  if (!renderer->RenderString(property, vtkStdString(std::string(text)), image.Get(), dims, 72)) return;
  const int* const extent = image->GetExtent();
  for (int j = extent[2]; j <= extent[3]; ++j) {
    for (int i = extent[0]; i <= extent[1]; ++i) {
      const auto* const p = static_cast<const unsigned char*>(image->GetScalarPointer(i, j, 0));
      const int px = x + i - extent[0], py = y - (j - extent[2]);
      if (p[3] == 0 || px < 0 || py < 0 || px >= onto.width || py >= onto.height) continue;
      const double alpha = p[3] / 255.0;
      std::uint8_t* const out =
          onto.rgb.data() +
          (static_cast<std::size_t>(py) * static_cast<std::size_t>(onto.width) + static_cast<std::size_t>(px)) * 3;
      for (std::size_t c = 0; c < 3; ++c)
        out[c] = static_cast<std::uint8_t>(std::lround(out[c] * (1 - alpha) + rgb[c] * alpha));
    }
  }
}

void write_directions(Picture& onto, const SliceView& view, int x, int y) {
  const std::array<std::string, 4> letters = edge_letters(view);
  write_text(onto, letters[0], x + 6, y + view.height / 2, 16);
  write_text(onto, letters[1], x + view.width - 18, y + view.height / 2, 16);
  write_text(onto, letters[2], x + view.width / 2, y + 22, 16);
  write_text(onto, letters[3], x + view.width / 2, y + view.height - 8, 16);
}

}  // namespace osteo::inline display
