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

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>
#include <utility>

#include "osteo/core/base/param.h"
#include "osteo/display/view/actors.h"
#include "osteo/display/view/offscreen.h"
#include "osteo/display/view/slices.h"
#include "osteo/imaging/io/vtk_data.h"

namespace osteo::inline display {

namespace {

// Of the triangles around, where the mesh has none: they tell the sides of a thin wall apart.
std::vector<std::array<float, 3>> normals_of(const TriMesh& mesh) {
  if (mesh.normals.size() == mesh.points_mm.size()) return mesh.normals;
  std::vector<Vec3> sum(mesh.points_mm.size());
  for (const auto& t : mesh.triangles) {
    const Vec3 a = from_floats(mesh.points_mm[t[0]]);
    const Vec3 n = cross(from_floats(mesh.points_mm[t[1]]) - a, from_floats(mesh.points_mm[t[2]]) - a);
    for (const std::uint32_t p : t) sum[p] += n;
  }
  std::vector<std::array<float, 3>> normals;
  normals.reserve(sum.size());
  for (const Vec3& n : sum) normals.push_back(to_floats(length(n) > 0 ? normalized(n) : n));
  return normals;
}

// Number of a cell for each point: those in one cube of this edge that face the same way. Sides of a thin wall or a
// wire face other ways, so they stay apart however large the cube is, where common simplifications lose them.
std::vector<std::uint32_t> cells_of(const TriMesh& mesh, std::span<const std::array<float, 3>> normals, double edge_mm,
                                    std::size_t& count) {
  std::unordered_map<std::uint64_t, std::uint32_t> cells;
  cells.reserve(mesh.points_mm.size() / 3);
  std::vector<std::uint32_t> cell(mesh.points_mm.size());
  for (std::size_t p = 0; p < cell.size(); ++p) {
    std::uint64_t key = 0, faces = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      constexpr double kFar = 1e9;  // cells: a stray point far off is in one with others
      const auto at = static_cast<std::int64_t>(
          std::clamp(std::floor(static_cast<double>(mesh.points_mm[p][a]) / edge_mm), -kFar, kFar));
      key = key << 20 | static_cast<std::uint64_t>(at & 0xfffff);
      if (normals[p][a] < 0) faces |= std::uint64_t{1} << a;
    }
    cell[p] = cells.try_emplace(key << 3 | faces, static_cast<std::uint32_t>(cells.size())).first->second;
  }
  count = cells.size();
  return cell;
}

}  // namespace

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
  // Of cubes as large as a smooth surface needs for so many triangles: about four for each of a cube's faces.
  const std::vector<std::array<float, 3>> normals = normals_of(mesh);
  std::size_t count = 0;
  const std::vector<std::uint32_t> cell =
      cells_of(mesh, normals, std::max(1e-6, std::sqrt(4 * area_mm2(mesh) / static_cast<double>(kTriangles))), count);
  // Of each its point that is nearest to the middle of all.
  std::vector<Vec3> middle(count);
  std::vector<double> members(count);
  for (std::size_t p = 0; p < points; ++p) {
    middle[cell[p]] += from_floats(mesh.points_mm[p]);
    ++members[cell[p]];
  }
  for (std::size_t c = 0; c < count; ++c) middle[c] = middle[c] / members[c];
  std::vector<std::pair<double, std::uint32_t>> nearest(count, {1e30, 0});
  for (std::uint32_t p = 0; p < points; ++p) {
    const Vec3 off = from_floats(mesh.points_mm[p]) - middle[cell[p]];
    nearest[cell[p]] = std::min(nearest[cell[p]], {dot(off, off), p});
  }
  for (const auto& [off, p] : nearest) {
    made.point.push_back(p);
    made.mesh.points_mm.push_back(mesh.points_mm[p]);
    made.mesh.normals.push_back(normals[p]);
  }
  for (const auto& t : mesh.triangles) {
    const std::uint32_t a = cell[t[0]], b = cell[t[1]], c = cell[t[2]];
    if (a == b || b == c || c == a) continue;
    made.mesh.triangles.push_back({a, b, c});
    // One that came to lie with its back outside would be lit as the other side: a dark speck.
    const auto at = [&](std::uint32_t n) { return from_floats(made.mesh.points_mm[n]); };
    const auto out = [&](std::uint32_t n) { return from_floats(made.mesh.normals[n]); };
    if (dot(cross(at(b) - at(a), at(c) - at(a)), out(a) + out(b) + out(c)) < 0)
      std::swap(made.mesh.triangles.back()[1], made.mesh.triangles.back()[2]);
  }
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
