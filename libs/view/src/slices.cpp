#include "osteo/view/slices.h"

#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkStdString.h>
#include <vtkTextProperty.h>
#include <vtkTextRenderer.h>

#include <algorithm>
#include <cmath>

namespace osteo {
namespace {

struct Axes {
  Vec3 right, down;
};
Axes axes_of(Plane plane) {
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

// Distinct tints for the first labels; later ones repeat.
constexpr std::array<std::array<double, 3>, 8> kTints{
    {{235, 120, 60}, {90, 200, 120}, {90, 150, 255}, {240, 220, 80}, {220, 90, 200}, {80, 220, 220}, {255, 150, 150}, {180, 180, 90}}};

}  // namespace

Vec3 SliceView::world(double px, double py) const {
  const Axes a = axes_of(plane);
  const Vec3 normal = cross(a.right, a.down);
  const Vec3 base = centre_mm + normal * dot(through_mm - centre_mm, normal);
  return base + a.right * ((px + 0.5 - width / 2.0) * mm_per_pixel) + a.down * ((py + 0.5 - height / 2.0) * mm_per_pixel);
}

std::array<double, 2> SliceView::pixel(Vec3 world_mm) const {
  const Axes a = axes_of(plane);
  const Vec3 d = world_mm - centre_mm;
  return {dot(d, a.right) / mm_per_pixel + width / 2.0 - 0.5, dot(d, a.down) / mm_per_pixel + height / 2.0 - 0.5};
}

double grey_of_hu(double hu) {
  return std::clamp((hu + 200) / 1700 * 255, 0.0, 255.0);
}

Picture draw_slice(const SliceView& view, const GreyAt& grey, const LabelAt& label, const std::vector<Structure>& structures) {
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
          onto.rgb.data() + (static_cast<std::size_t>(py) * static_cast<std::size_t>(onto.width) + static_cast<std::size_t>(px)) * 3;
      for (std::size_t c = 0; c < 3; ++c) out[c] = static_cast<std::uint8_t>(std::lround(out[c] * (1 - alpha) + rgb[c] * alpha));
    }
  }
}

void write_directions(Picture& onto, const SliceView& view, int x, int y) {
  const char* letters = view.plane == Plane::axial ? "RLAP" : view.plane == Plane::coronal ? "RLHF" : "APHF";  // left right top bottom
  const auto letter = [&](int i) { return std::string_view(letters + i, 1); };
  write_text(onto, letter(0), x + 6, y + view.height / 2, 16);
  write_text(onto, letter(1), x + view.width - 18, y + view.height / 2, 16);
  write_text(onto, letter(2), x + view.width / 2, y + 22, 16);
  write_text(onto, letter(3), x + view.width / 2, y + view.height - 8, 16);
}

}  // namespace osteo
