// What one sees through: before bone it is seen, behind bone it is not, whatever was drawn first.
#include <gtest/gtest.h>
#include <vtkActor.h>
#include <vtkCellArray.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

#include <cmath>
#include <cstdio>

#include "osteo/display/view/actors.h"
#include "osteo/display/view/detail/bone_view.h"
#include "osteo/display/view/detail/dust_view.h"
#include "osteo/display/view/offscreen.h"
#include "osteo/simulation/bone/live_surface.h"
#include "solid.h"

namespace osteo {
namespace {

// A square of blue glass across z, at y.
vtkSmartPointer<vtkActor> glass(double y, double half_mm = 4) {
  vtkNew<vtkPoints> points;
  for (const auto& [a, b] : {std::pair{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}})
    points->InsertNextPoint(a * half_mm, y, b * half_mm);
  vtkNew<vtkCellArray> cells;
  const vtkIdType quad[4] = {0, 1, 2, 3};
  cells->InsertNextCell(4, quad);
  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  data->SetPolys(cells);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(data);
  auto actor = make_late_actor(Late::all);
  actor->SetMapper(mapper);
  actor->GetProperty()->SetColor(0.2, 0.4, 1);
  actor->GetProperty()->SetOpacity(0.4);
  actor->GetProperty()->LightingOff();
  return actor;
}

struct LateActors : testing::TestWithParam<bool> {
  LateActors() {
    window.window()->AddRenderer(renderer);
    set_up_scene(renderer);
    look_at(renderer, {0, 0, 0}, 12, {0, -1, 0});
  }
  // How much bluer than red, in the middle.
  double blue() {
    set_depth(renderer, {GetParam(), 1});
    renderer->ResetCameraClippingRange();
    const Picture p = window.render();
    double sum = 0;
    for (int y = 140; y < 160; ++y)
      for (int x = 140; x < 160; ++x) {
        const auto i = 3 * (static_cast<std::size_t>(y) * 300 + static_cast<std::size_t>(x));
        sum += (p.rgb[i + 2] - p.rgb[i]) / 400.0;
      }
    return sum;
  }
  OffscreenWindow window{300, 300};
  vtkNew<vtkRenderer> renderer;
};

TEST_P(LateActors, GlassIsSeenBeforeBoneAndNotBehind) {
  const auto bone = test::solid(
      0.5, 8, [](Vec3 p) { return length(p) < 5; }, {}, 2);
  LiveSurface surface(bone, {});
  BoneView view(renderer);
  const auto before = glass(-7), behind = glass(7);
  renderer->AddActor(behind);  // added before the bone
  view.show(surface);
  const double bone_alone = blue();
  renderer->RemoveActor(behind);
  EXPECT_NEAR(blue(), bone_alone, 0.5);
  renderer->AddActor(before);
  const double one = blue();
  EXPECT_GT(one, bone_alone + 30);
  // Two of them, whichever is drawn first: the far one through the near one, and none of it lost.
  const auto nearer = glass(-9);
  renderer->AddActor(nearer);
  const double far_first = blue();
  renderer->RemoveActor(before);
  renderer->AddActor(before);
  EXPECT_NEAR(blue(), far_first, 0.5);
  EXPECT_GT(far_first, one + 15);
}

TEST_P(LateActors, GlassIsSeenBeforeWater) {
  const auto bone = test::solid(
      0.5, 12,
      [](Vec3 p) {
        return length(p) < 11 && p.y > -4 && !(length(p - Vec3{0, -5, 0}) < 9);
      },
      {}, 2);
  LiveSurface surface(bone, {});
  BoneView view(renderer);
  view.show(surface);
  Dust dust(bone);
  for (int s = 0; s < 300; ++s) dust.irrigate({0, -3, 0}, {}, 10, 1), dust.step();
  DustView water(renderer, 0.5);
  water.update(dust);
  const double water_alone = blue();
  const auto before = glass(-8), behind = glass(11);
  renderer->AddActor(before);
  EXPECT_GT(blue(), water_alone + 30);
  renderer->RemoveActor(before);
  renderer->AddActor(behind);
  EXPECT_NEAR(blue(), water_alone, 0.5);
}

INSTANTIATE_TEST_SUITE_P(WithAndWithoutEffects, LateActors, testing::Bool());

}  // namespace
}  // namespace osteo
