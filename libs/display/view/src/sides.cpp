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

#include "osteo/core/base/param.h"
#include "osteo/display/view/actors.h"
#include "osteo/display/view/offscreen.h"
#include "osteo/display/view/slices.h"
#include "osteo/imaging/io/vtk_data.h"

namespace osteo::inline display {

namespace {

// Fewer triangles on the same points, where there are far more than a picture of this size can show. Software draws a
// million in half a second.
TriMesh coarse_enough(const TriMesh& mesh, std::size_t pictures) {
  constexpr std::size_t kTriangles = 800'000;
  if (pictures < 2 || mesh.triangles.size() <= kTriangles) return mesh;
  TriMesh coarse;
  coarse.points_mm = mesh.points_mm;
  coarse.normals = mesh.normals;
  coarse.triangles.resize(mesh.triangles.size());
  const std::size_t kept = meshopt_simplifySloppy(
      coarse.triangles.front().data(), mesh.triangles.front().data(), 3 * mesh.triangles.size(),
      mesh.points_mm.front().data(), mesh.points_mm.size(), sizeof(mesh.points_mm.front()), 3 * kTriangles, 0.01F);
  coarse.triangles.resize(kept / 3);
  return coarse;
}

}  // namespace

std::vector<Picture> draw_sides(const TriMesh& mesh, std::span<const ViewFrom> sides, Vec3 centre, double mm_per_pixel,
                                int width, int height, std::span<const std::array<std::uint8_t, 3>> rgb) {
  std::vector<Picture> pictures;
  const auto data = to_vtk(coarse_enough(mesh, sides.size()));
  if (rgb.size() == mesh.points_mm.size() && !rgb.empty()) {
    vtkNew<vtkUnsignedCharArray> colours;
    colours->SetName("colour");
    colours->SetNumberOfComponents(3);
    colours->SetNumberOfTuples(static_cast<vtkIdType>(rgb.size()));
    for (std::size_t p = 0; p < rgb.size(); ++p) colours->SetTypedTuple(static_cast<vtkIdType>(p), rgb[p].data());
    data->GetPointData()->SetScalars(colours);
  }
  OffscreenWindow window(width, height);
  vtkNew<vtkRenderer> renderer;
  window.window()->AddRenderer(renderer);
  set_up_scene(renderer);
  renderer->GradientBackgroundOff();
  renderer->SetBackground(1, 1, 1);
  const auto bone = make_bone_actor(data);
  if (!rgb.empty()) bone->GetMapper()->ScalarVisibilityOn();
  renderer->AddActor(bone);
  for (const ViewFrom side : sides) {
    look_at(renderer, centre, 0.5 * height * mm_per_pixel, eye_direction(side));
    renderer->GetActiveCamera()->SetParallelProjection(1);
    renderer->GetActiveCamera()->SetParallelScale(0.5 * height * mm_per_pixel);
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
