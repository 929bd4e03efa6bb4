// The geometry stages between VTK's own filters.
#include <gtest/gtest.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkSphereSource.h>
#include <vtkUnstructuredGrid.h>

#include "distance.h"
#include "osteo/app/stages/mesh.h"
#include "osteo/app/vtk/vtkOsteoDataObject.h"
#include "osteo/app/vtk/vtkOsteoStage.h"
#include "osteo/geometry/tets/skin.h"

namespace osteo {
namespace {

const Registry& geometry() {
  static const Registry value = [] {
    Registry r;
    r.add<TetrahedralizeStage>();
    r.add<EmbedSurfaceStage>();
    r.add<VoxelizeStage>();
    r.add<DistanceStage>();
    return r;
  }();
  return value;
}

TEST(VtkGeometry, SphereToTetrahedraToSkin) {
  vtkNew<vtkSphereSource> sphere;
  sphere->SetRadius(10);
  sphere->SetThetaResolution(40);
  sphere->SetPhiResolution(30);
  vtkNew<vtkOsteoStage> tets, skin, voxels, distance;
  ASSERT_TRUE(tets->SetStage(geometry(), "tetrahedralize"));
  ASSERT_TRUE(tets->SetParameter("spacing_mm", "2"));
  tets->SetInputConnection(sphere->GetOutputPort());
  tets->Update();
  auto* const grid = vtkUnstructuredGrid::SafeDownCast(tets->GetOutputDataObject(0));
  ASSERT_NE(grid, nullptr);
  EXPECT_GT(grid->GetNumberOfCells(), 1000);
  ASSERT_TRUE(skin->SetStage(geometry(), "embed-surface"));
  skin->SetInputConnection(skin->GetInputPortIndex("surface"), sphere->GetOutputPort());
  skin->SetInputConnection(skin->GetInputPortIndex("rest"), tets->GetOutputPort());
  skin->SetInputConnection(skin->GetInputPortIndex("deformed"), tets->GetOutputPort());
  skin->Update();
  auto* const moved = vtkPolyData::SafeDownCast(skin->GetOutputDataObject(0));
  ASSERT_NE(moved, nullptr);
  for (vtkIdType i = 0; i < moved->GetNumberOfPoints(); ++i) {
    double a[3], b[3];
    moved->GetPoint(i, a);
    sphere->GetOutput()->GetPoint(i, b);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(a[k], b[k], 1e-4);
  }
  ASSERT_TRUE(voxels->SetStage(geometry(), "voxelize"));
  ASSERT_TRUE(voxels->SetParameter("resolution", "20"));
  voxels->SetInputConnection(sphere->GetOutputPort());
  voxels->Update();
  EXPECT_EQ(voxels->GetErrorCode(), 0UL);
  EXPECT_GT(vtkImageData::SafeDownCast(voxels->GetOutputDataObject(0))->GetScalarRange()[1], 1);
  sphere->SetRadius(12);  // a change upstream arrives, with another extent
  voxels->SetParameter("spacing_mm", "1");
  voxels->Update();
  EXPECT_EQ(voxels->GetErrorCode(), 0UL);
  auto* const image = vtkImageData::SafeDownCast(voxels->GetOutputDataObject(0));
  ASSERT_NE(image, nullptr);
  EXPECT_GT(image->GetNumberOfPoints(), 8000);
  ASSERT_TRUE(distance->SetStage(geometry(), "distance"));
  distance->SetInputConnection(sphere->GetOutputPort());
  distance->Update();
  auto* const map = vtkOsteoDataObject::SafeDownCast(distance->GetOutputDataObject(0));
  ASSERT_NE(map, nullptr);
  EXPECT_GT(std::get<SparseGrid>(map->GetValue()).active_voxels, 1000U);
}

}  // namespace
}  // namespace osteo
