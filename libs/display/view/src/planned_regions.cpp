#include "osteo/display/view/planned_regions.h"

#include <vtkActor.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkShaderProperty.h>

#include <algorithm>
#include <cmath>

#include "osteo/core/base/parallel.h"
#include "osteo/display/view/actors.h"
#include "osteo/display/view/structures_view.h"
#include "osteo/geometry/mesh/bone_surface.h"
#include "osteo/imaging/io/vtk_data.h"

namespace osteo::inline display {

std::array<double, 3> region_colour(bool forbidden) {
  return forbidden ? std::array<double, 3>{0.98, 0.50, 0.10} : std::array<double, 3>{0.10, 0.85, 0.60};
}

TriMesh offset_surface(const StructureMap& map, std::size_t number, double within_mm, const Context& context) {
  const TriMesh& face = map.face(number);
  if (face.points_mm.empty()) return {};
  const double h = std::clamp(map.label_spacing_mm()[0], 0.25, 0.6), margin = within_mm + 3 * h;
  Vec3 lo = from_floats(face.points_mm.front()), hi = lo;
  for (const auto& p : face.points_mm) {
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], static_cast<double>(p[a]));
      hi[a] = std::max(hi[a], static_cast<double>(p[a]));
    }
  }
  Frame frame;
  frame.spacing_mm = {h, h, h};
  frame.origin_mm = lo - Vec3{margin, margin, margin};
  for (std::size_t a = 0; a < 3; ++a)
    frame.dims[a] = 8 * static_cast<int>(std::ceil((hi[a] - lo[a] + 2 * margin) / (8 * h)));
  BrickGrid field = BrickGrid::dense(frame);
  parallel_for(field.brick_count(), 16, 0, [&](std::size_t begin, std::size_t end) {
    std::vector<double> each(map.values().size());
    for (std::size_t b = begin; b < end; ++b) {
      for (std::uint32_t v = 0; v < BrickGrid::kVoxels; ++v) {
        const auto key = static_cast<VoxelKey>(b * BrickGrid::kVoxels + v);
        const Ijk c = field.coordinate(key);
        const Vec3 p = frame.world_from_index({double(c.i), double(c.j), double(c.k)});
        static_cast<void>(map.clearance({0, 0, 0, 0}, p, {0, 0, 1}, each));
        // As if it were density: half at the surface, falling by a quarter a voxel.
        const double d = each[number];
        if (d < map.reach_mm())
          field.set(key, static_cast<float>(std::clamp(0.5 + (within_mm - d) / (4 * h), 0.0, 1.0)));
      }
    }
  });
  return smooth_surface(surface_nets(field, 0.5F, context).mesh, h / 4);
}

RegionsView::RegionsView(vtkRenderer* renderer, const StructureMap& map, const std::vector<PlannedRegion>& regions,
                         const Context& context)
    : renderer_(renderer) {
  for (const PlannedRegion& r : regions) {
    const auto& values = map.values();
    const auto at =
        std::find_if(values.begin(), values.end(), [&](std::uint8_t v) { return map.name_of(v) == r.structure; });
    if (at == values.end()) {
      missing_.push_back(r.name);
      continue;
    }
    One one{r, nullptr, make_late_actor(Late::through_all)};
    const TriMesh surface = offset_surface(map, static_cast<std::size_t>(at - values.begin()), r.within_mm, context);
    one.surface = std::make_shared<const TriMesh>(surface);
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(to_vtk(surface));
    mapper->ScalarVisibilityOff();
    one.actor->SetMapper(mapper);
    vtkProperty* const p = one.actor->GetProperty();
    const auto c = region_colour(r.forbidden);
    p->SetColor(c[0], c[1], c[2]);
    p->SetAmbient(1);
    p->SetDiffuse(0);
    p->SetSpecular(0);
    p->BackfaceCullingOn();
    // Its rim, where one looks along it; of what faces the eye a breath.
    one.actor->GetShaderProperty()->AddFragmentShaderReplacement(
        "//VTK::Light::Impl", true,
        "//VTK::Light::Impl\n"
        "  fragOutput0.a = 0.05 + 0.85 * pow(1.0 - abs(normalVCVSOutput.z), 3.0);\n",
        false);
    renderer_->AddActor(one.actor);
    all_.push_back(std::move(one));
  }
}

RegionsView::~RegionsView() {
  for (const One& one : all_) renderer_->RemoveActor(one.actor);
}

void RegionsView::show(bool on) {
  shown_ = on;
  for (const One& one : all_) one.actor->SetVisibility(on ? 1 : 0);
}

}  // namespace osteo::inline display
