#include "osteo/display/view/pictures.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkMapper.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkUnsignedCharArray.h>

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "osteo/core/base/param.h"
#include "osteo/display/view/actors.h"
#include "osteo/display/view/offscreen.h"
#include "osteo/display/view/slices.h"
#include "osteo/imaging/io/vtk_data.h"

namespace osteo::inline display {

PictureMesh mesh_for_pictures(const TriMesh& mesh) {
  constexpr std::size_t kTriangles = 800'000;
  PictureMesh made;
  const std::size_t points = mesh.points_mm.size();
  if (mesh.triangles.size() <= kTriangles) {
    made.mesh = mesh;
    made.point.resize(points);
    std::iota(made.point.begin(), made.point.end(), 0U);
    return made;
  }
  std::vector<std::array<std::uint32_t, 3>> kept(mesh.triangles.size());
  kept.resize(meshopt_simplifySloppy(kept.front().data(), mesh.triangles.front().data(), 3 * mesh.triangles.size(),
                                     mesh.points_mm.front().data(), points, sizeof(mesh.points_mm.front()),
                                     3 * kTriangles, 0.01F) /
              3);
  constexpr std::uint32_t kNone = ~0U;
  std::vector<std::uint32_t> now(points, kNone);
  for (const auto& t : kept)
    for (const std::uint32_t p : t) now[p] = 0;
  // In their old order: those of a part of the bone stay together.
  for (std::uint32_t p = 0; p < points; ++p) {
    if (now[p] == kNone) continue;
    now[p] = static_cast<std::uint32_t>(made.point.size());
    made.point.push_back(p);
    made.mesh.points_mm.push_back(mesh.points_mm[p]);
    if (mesh.normals.size() == points) made.mesh.normals.push_back(mesh.normals[p]);
  }
  for (auto& t : kept)
    for (std::uint32_t& p : t) p = now[p];
  made.mesh.triangles = std::move(kept);
  return made;
}

std::vector<Picture> draw_sides(const TriMesh& mesh, std::span<const SideView> sides, Vec3 centre, int pixels,
                                std::span<const std::array<std::uint8_t, 3>> rgb) {
  std::vector<Picture> pictures;
  const auto data = to_vtk(mesh);
  const bool colours_known = rgb.size() == mesh.points_mm.size() && !rgb.empty();
  if (colours_known) {
    vtkNew<vtkUnsignedCharArray> colours;
    colours->SetName("colour");
    colours->SetNumberOfComponents(3);
    colours->SetNumberOfTuples(static_cast<vtkIdType>(rgb.size()));
    for (std::size_t p = 0; p < rgb.size(); ++p) colours->SetTypedTuple(static_cast<vtkIdType>(p), rgb[p].data());
    data->GetPointData()->SetScalars(colours);
  }
  OffscreenWindow window(pixels, pixels);
  vtkNew<vtkRenderer> renderer;
  window.window()->AddRenderer(renderer);
  set_up_scene(renderer);
  renderer->GradientBackgroundOff();
  renderer->SetBackground(1, 1, 1);
  const auto bone = make_bone_actor(data);
  renderer->AddActor(bone);
  for (const SideView& side : sides) {
    bone->GetMapper()->SetScalarVisibility(side.coloured && colours_known ? 1 : 0);
    const double half_mm = 0.5 * pixels * side.mm_per_pixel;
    look_at(renderer, centre, half_mm, eye_direction(side.from));
    renderer->GetActiveCamera()->SetParallelProjection(1);
    renderer->GetActiveCamera()->SetParallelScale(half_mm);
    renderer->ResetCameraClippingRange();
    set_depth(renderer, {true, 1});
    pictures.push_back(window.render());
  }
  return pictures;
}

std::string_view sides_of(ViewFrom from) {
  switch (from) {
    case ViewFrom::front:
    case ViewFrom::below:
      return "RL";
    case ViewFrom::back:
    case ViewFrom::above:
      return "LR";
    case ViewFrom::left:
      return "AP";
    case ViewFrom::right:
      return "PA";
    case ViewFrom::left_front:
      break;
  }
  return "";
}

void write_scale_bar(Picture& onto, double mm_per_pixel, int ink) {
  double length_mm = 1;
  for (const double wish : {2.0, 5.0, 10.0, 20.0, 50.0, 100.0}) {
    if (wish / mm_per_pixel < 0.34 * onto.width) length_mm = wish;
  }
  const int pixels = static_cast<int>(std::lround(length_mm / mm_per_pixel)), x = onto.width / 30 + 4,
            y = onto.height - onto.height / 30 - 6;
  const int thick = std::max(3, onto.height / 130);
  for (int row = y; row < std::min(y + thick, onto.height); ++row) {
    for (int column = x; column < std::min(x + pixels, onto.width); ++column) {
      const auto at =
          3 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(onto.width) + static_cast<std::size_t>(column));
      std::fill_n(onto.rgb.begin() + static_cast<std::ptrdiff_t>(at), 3, static_cast<std::uint8_t>(ink));
    }
  }
  write_text(onto, format_number(length_mm) + " mm", x, y - thick, std::max(14, onto.height / 19), {ink, ink, ink});
}

}  // namespace osteo::inline display
