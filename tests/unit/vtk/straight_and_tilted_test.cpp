// One skull, scanned straight and with a tilted gantry: after both are placed by position they are the same shape.
#include <gtest/gtest.h>
#include <vtkCellLocator.h>
#include <vtkIterativeClosestPointTransform.h>
#include <vtkLandmarkTransform.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkTransform.h>
#include <vtkTransformPolyDataFilter.h>

#include <cmath>
#include <cstdio>

#include "folders.h"
#include "osteo/core/base/files.h"
#include "osteo/geometry/grid/resample.h"
#include "osteo/geometry/mesh/bone_surface.h"
#include "osteo/imaging/bone_import/import_bone.h"
#include "osteo/imaging/dicom/import.h"
#include "osteo/imaging/image/threshold.h"
#include "osteo/imaging/io/vtk_data.h"

namespace osteo {
namespace {

vtkSmartPointer<vtkPolyData> surface_of(const SparseGrid& bone) {
  return to_vtk(surface_nets(to_bricks(bone), 0.5F, {}).mesh);
}

// In steps: the way of 'prepare'.
SparseGrid bone_in_steps(const fs::path& source) {
  const Image ct = import_ct(source, {}).image;
  ThresholdParams t;
  t.lower = 300;
  t.keep_largest = 1;
  return resample_bone(ct, threshold(ct, t), {}).density;
}

SparseGrid bone_straight(const fs::path& source) {
  ImportBoneParams p;
  p.keep_largest = 1;
  return import_bone(source, p).density;
}

// Mean distance of every 20th point of `a`, moved by `m`, that lies well inside the slab that both scans cover, to `b`.
struct Fit {
  double mean = 0, p95 = 0;
  std::size_t points = 0;
};
Fit distance(vtkPolyData* a, vtkMatrix4x4* m, vtkPolyData* b, vtkCellLocator* locator) {
  double box[6];
  b->GetBounds(box);
  std::vector<double> d;
  for (vtkIdType p = 0; p < a->GetNumberOfPoints(); p += 20) {
    double x[4] = {0, 0, 0, 1}, y[4];
    a->GetPoint(p, x);
    m->MultiplyPoint(x, y);
    if (y[2] < box[4] + 15 || y[2] > box[5] - 15) continue;
    double closest[3], d2 = 0;
    vtkIdType cell = 0;
    int sub = 0;
    locator->FindClosestPoint(y, closest, cell, sub, d2);
    // Where one scan ends, its cut face has no partner in the other.
    if (d2 < 25) d.push_back(std::sqrt(d2));
  }
  std::sort(d.begin(), d.end());
  Fit f;
  f.points = d.size();
  for (const double v : d) f.mean += v / static_cast<double>(d.size());
  f.p95 = d.empty() ? 0 : d[d.size() * 95 / 100];
  return f;
}

Fit register_and_compare(vtkPolyData* tilted, vtkPolyData* straight) {
  vtkNew<vtkCellLocator> locator;
  locator->SetDataSet(straight);
  locator->BuildLocator();
  vtkNew<vtkMatrix4x4> total;
  // First the middles, then rigid steps over ever nearer pairs (trimmed, so that what only one scan covers does not
  // pull).
  double ca[3], cb[3];
  tilted->GetCenter(ca);
  straight->GetCenter(cb);
  for (int i = 0; i < 3; ++i) total->SetElement(i, 3, cb[i] - ca[i]);
  for (const double reach : {40.0, 15.0, 6.0, 3.0, 2.0, 2.0}) {
    for (int n = 0; n < 12; ++n) {
      vtkNew<vtkPoints> from, to;
      for (vtkIdType p = 0; p < tilted->GetNumberOfPoints(); p += 700) {
        double x[4] = {0, 0, 0, 1}, y[4], closest[3], d2 = 0;
        tilted->GetPoint(p, x);
        total->MultiplyPoint(x, y);
        vtkIdType cell = 0;
        int sub = 0;
        locator->FindClosestPoint(y, closest, cell, sub, d2);
        if (d2 > reach * reach) continue;
        from->InsertNextPoint(y);
        to->InsertNextPoint(closest);
      }
      vtkNew<vtkLandmarkTransform> step;
      step->SetModeToRigidBody();
      step->SetSourceLandmarks(from);
      step->SetTargetLandmarks(to);
      step->Update();
      vtkNew<vtkMatrix4x4> next;
      vtkMatrix4x4::Multiply4x4(step->GetMatrix(), total, next);
      total->DeepCopy(next);
    }
  }
  return distance(tilted, total, straight, locator);
}

class StraightAndTilted : public testing::TestWithParam<SparseGrid (*)(const fs::path&)> {};

TEST_P(StraightAndTilted, AreTheSameShape) {
  const fs::path data = shared_data() / "dicom_ct_skull_phantom";
  if (!fs::exists(data)) GTEST_SKIP() << "no " << data;
  const auto straight = surface_of(GetParam()(data / "S21570" / "S2030")),
             tilted = surface_of(GetParam()(data / "S21610" / "S2010"));
  const Fit f = register_and_compare(tilted, straight);
  std::printf("tilted to straight: mean %.3f mm, 95 %% below %.3f mm, %zu points\n", f.mean, f.p95, f.points);
  EXPECT_GT(f.points, 5000u);
  EXPECT_LT(f.mean, 0.4);
}

INSTANTIATE_TEST_SUITE_P(Way, StraightAndTilted, testing::Values(&bone_in_steps, &bone_straight));

}  // namespace
}  // namespace osteo
