#include "osteo/display/view/detail/dust_view.h"

#include <vtkActor.h>
#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPointGaussianMapper.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkShaderProperty.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "chance.h"
#include "liquid_surface.h"
#include "osteo/display/view/actors.h"

namespace osteo::inline display {
namespace {

// Balls, drawn as discs that face the eye: round, darker at the rim, and solid.
struct Balls {
  vtkNew<vtkPolyData> data;
  vtkNew<vtkPoints> points;
  vtkNew<vtkFloatArray> radius;
  vtkNew<vtkUnsignedCharArray> rgb;
  vtkNew<vtkPointGaussianMapper> mapper;
  vtkNew<vtkActor> actor;

  Balls() {
    radius->SetName("radius");
    rgb->SetName("rgb");
    rgb->SetNumberOfComponents(3);
    data->SetPoints(points);
    data->GetPointData()->AddArray(radius);
    data->GetPointData()->SetScalars(rgb);
    mapper->SetInputData(data);
    mapper->SetScaleArray("radius");
    mapper->SetScaleFactor(1);
    mapper->EmissiveOff();
    mapper->SetTriangleScale(2.1F);
    mapper->SetSplatShaderCode(
        "//VTK::Color::Impl\n"
        "float away = dot(offsetVCVSOutput.xy, offsetVCVSOutput.xy);\n"
        "if (away > 1.0) discard;\n"
        "float lit = 0.55 + 0.45 * clamp(sqrt(1.0 - away) * 0.8 + offsetVCVSOutput.y * 0.35, 0.0, 1.0);\n"
        "ambientColor *= lit;\n"
        "diffuseColor *= lit;\n");
    actor->SetMapper(mapper);
    actor->ForceOpaqueOn();
    actor->PickableOff();
  }
  void clear() {
    points->Reset();
    radius->Reset();
    rgb->Reset();
  }
  void add(const Vec3& p, float r, float red, float green, float blue) {
    const auto byte = [](float v) { return static_cast<unsigned char>(std::lround(255 * std::clamp(v, 0.0F, 1.0F))); };
    points->InsertNextPoint(p.x, p.y, p.z);
    radius->InsertNextValue(r);
    rgb->InsertNextTuple3(byte(red), byte(green), byte(blue));
  }
  void changed() {
    points->Modified();
    radius->Modified();
    rgb->Modified();
    data->Modified();
    actor->SetVisibility(points->GetNumberOfPoints() > 0);
  }
};

}  // namespace

struct DustView::Impl {
  Balls grains, drops;
  vtkNew<vtkPolyData> water_data;
  vtkNew<vtkPolyDataMapper> water_mapper;
  vtkSmartPointer<vtkActor> water = make_late_actor(Late::nearest);  // in one layer
  vtkRenderer* renderer = nullptr;
  double cell_mm = 0.5;
  const Dust* of = nullptr;
  std::optional<std::uint64_t> version;

  void show_grains(const Dust& dust) {
    grains.clear();
    const Frame& frame = dust.bone().frame();
    std::size_t cells = 0;
    dust.visit([&](Vec3, double full) { cells += full >= 0.02 ? 1 : 0; });
    // A haze nobody would see is left out; of too many, every so many-th cell stands for its neighbours.
    const int each = 3 * cells <= kMaxGrains ? 3 : 2 * cells <= kMaxGrains ? 2 : 1;
    const float kept = cells <= kMaxGrains ? 1.0F : static_cast<float>(kMaxGrains) / static_cast<float>(cells);
    dust.visit([&](Vec3 p, double full) {
      if (full < 0.02) return;
      const Vec3 x = frame.index_from_world(p);
      const Ijk cell{static_cast<int>(std::lround(x.x)), static_cast<int>(std::lround(x.y)),
                     static_cast<int>(std::lround(x.z))};
      Chance chance(cell.i, cell.j, cell.k);
      if (kept < 1 && chance.next() > kept) return;
      if (!is_drawn(dust, cell, cell_mm)) return;
      const int count = std::clamp(static_cast<int>(full * each + static_cast<double>(chance.next())), 1, each);
      const auto mean =
          static_cast<float>(0.5 * cell_mm * std::cbrt(std::min(full, 1.5) / count / static_cast<double>(kept)));
      for (int g = 0; g < count; ++g) {
        // Even over the cell's own width: sums over all cells are even too.
        const auto aside = [&] { return static_cast<double>(chance.next()) - 0.5; };
        const Vec3 at = frame.world_from_index(x + Vec3{aside(), aside(), aside()});
        const float size = 0.55F + 0.75F * chance.next() * chance.next() + 0.2F * chance.next(),
                    shade = 0.86F + 0.2F * chance.next();
        grains.add(at, mean * size, 0.90F * shade, 0.84F * shade, (0.70F + 0.06F * chance.next()) * shade);
      }
    });
    grains.changed();
  }

  void show_water(const Dust& dust) {
    const LiquidSurface s = liquid_surface(dust);
    vtkNew<vtkPoints> points;
    vtkNew<vtkFloatArray> normals;
    normals->SetNumberOfComponents(3);
    vtkNew<vtkUnsignedCharArray> rgba;
    rgba->SetNumberOfComponents(4);
    for (std::size_t p = 0; p < s.points_mm.size(); ++p) {
      points->InsertNextPoint(s.points_mm[p].data());
      normals->InsertNextTuple(s.normals[p].data());
      rgba->InsertNextTypedTuple(s.rgba[p].data());
    }
    vtkNew<vtkCellArray> cells;
    for (const auto& t : s.triangles) {
      const vtkIdType corners[3] = {t[0], t[1], t[2]};
      cells->InsertNextCell(3, corners);
    }
    water_data->SetPoints(points);
    water_data->SetPolys(cells);
    water_data->GetPointData()->SetNormals(normals);
    water_data->GetPointData()->SetScalars(rgba);
    water_data->Modified();
    water->SetVisibility(s.triangles.empty() ? 0 : 1);
    drops.clear();
    for (const auto& d : s.drops) {
      const auto mix = [&](float clear, float bone) { return clear + (bone - clear) * d.thick; };
      drops.add(from_floats(d.middle_mm), d.radius_mm, mix(0.62F, 0.84F), mix(0.68F, 0.74F), mix(0.74F, 0.62F));
    }
    drops.changed();
  }
};

DustView::DustView(vtkRenderer* renderer, double cell_mm) : impl_(std::make_unique<Impl>()) {
  Impl& m = *impl_;
  m.renderer = renderer;
  m.cell_mm = cell_mm;
  m.water_mapper->SetInputData(m.water_data);
  m.water->SetMapper(m.water_mapper);
  vtkProperty* const p = m.water->GetProperty();
  p->BackfaceCullingOn();
  p->SetAmbient(0.1);
  p->SetDiffuse(0.85);
  p->SetSpecular(0.8);
  p->SetSpecularPower(60);
  // Where light is mirrored, the water is what one sees.
  m.water->GetShaderProperty()->AddFragmentShaderReplacement(
      "//VTK::Light::Impl", true,
      "//VTK::Light::Impl\n"
      "  fragOutput0.a = clamp(fragOutput0.a + 1.2 * max(0.0, dot(fragOutput0.rgb, vec3(0.333)) - 0.85), 0.0, 1.0);\n",
      false);
  m.water->VisibilityOff();
  for (vtkActor* const a : {m.grains.actor.Get(), m.drops.actor.Get(), m.water.Get()}) renderer->AddActor(a);
  m.grains.actor->VisibilityOff();
  m.drops.actor->VisibilityOff();
}

DustView::~DustView() {
  for (vtkActor* const a : {impl_->grains.actor.Get(), impl_->drops.actor.Get(), impl_->water.Get()})
    impl_->renderer->RemoveActor(a);
}

void DustView::update(const Dust& dust) {
  Impl& m = *impl_;
  if (m.of == &dust && m.version == dust.version()) return;
  m.of = &dust;
  m.version = dust.version();
  m.show_grains(dust);
  m.show_water(dust);
}

}  // namespace osteo::inline display
