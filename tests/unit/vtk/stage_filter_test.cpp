#include <gtest/gtest.h>
#include <vtkCallbackCommand.h>
#include <vtkErrorCode.h>
#include <vtkExecutive.h>
#include <vtkImageData.h>
#include <vtkImageThreshold.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataNormals.h>

#include "bone.h"
#include "image.h"
#include "import.h"
#include "osteo/app/vtk/vtkOsteoDataObject.h"
#include "osteo/app/vtk/vtkOsteoStage.h"
#include "osteo/geometry/grid/resample.h"
#include "osteo/geometry/mesh/bone_surface.h"
#include "osteo/imaging/dicom/import.h"
#include "osteo/imaging/image/phantom.h"
#include "osteo/imaging/image/threshold.h"
#include "osteo/imaging/io/vtk_data.h"

namespace osteo {
namespace {

const Registry& registry() {
  static const Registry value = [] {
    Registry r;
    r.add<ImportStage>();
    r.add<PhantomStage>();
    r.add<ThresholdStage>();
    r.add<ResampleStage>();
    r.add<SurfaceStage>();
    return r;
  }();
  return value;
}

struct Chain {
  vtkNew<vtkOsteoStage> phantom, threshold, resample, surface;
  Chain() {
    EXPECT_TRUE(phantom->SetStage(registry(), "phantom"));
    EXPECT_TRUE(phantom->SetParameter("region", "temporal"));
    EXPECT_TRUE(phantom->SetParameter("spacing_mm", "2"));
    EXPECT_TRUE(threshold->SetStage(registry(), "threshold"));
    EXPECT_TRUE(threshold->SetParameter("lower", "500"));
    EXPECT_TRUE(resample->SetStage(registry(), "resample"));
    EXPECT_TRUE(resample->SetParameter("lower", "500"));
    EXPECT_TRUE(surface->SetStage(registry(), "surface"));
    threshold->SetInputConnection(phantom->GetOutputPort(0));
    resample->SetInputConnection(resample->GetInputPortIndex("image"), phantom->GetOutputPort(0));
    resample->SetInputConnection(resample->GetInputPortIndex("mask"), threshold->GetOutputPort(0));
    surface->SetInputConnection(resample->GetOutputPort(0));
  }
};

TEST(VtkStage, WholeChainEqualsTheFunctions) {
  Chain c;
  c.surface->Update();
  auto* const poly = vtkPolyData::SafeDownCast(c.surface->GetOutputDataObject(0));
  ASSERT_NE(poly, nullptr);
  PhantomParams pp;
  pp.region = PhantomRegion::temporal;
  pp.spacing_mm = 2;
  const Phantom phantom = make_phantom(pp);
  ThresholdParams tp;
  tp.lower = 500;
  ResampleParams rp;
  rp.lower = 500;
  const auto bone = resample_bone(phantom.ct, threshold(phantom.ct, tp), rp);
  const auto mesh = surface_nets(to_bricks(bone.density));
  EXPECT_EQ(poly->GetNumberOfCells(), static_cast<vtkIdType>(mesh.mesh.triangles.size()));
  EXPECT_EQ(poly->GetNumberOfPoints(), static_cast<vtkIdType>(mesh.mesh.points_mm.size()));
}

TEST(VtkStage, FeedsAndIsFedByVtksOwnFilters) {
  Chain c;
  vtkNew<vtkImageThreshold> vtk_threshold;  // VTK in place of ours
  vtk_threshold->SetInputConnection(c.phantom->GetOutputPort(0));
  vtk_threshold->ThresholdByUpper(500);
  vtk_threshold->SetInValue(1);
  vtk_threshold->SetOutValue(0);
  vtk_threshold->SetOutputScalarTypeToUnsignedChar();
  c.resample->SetInputConnection(1, vtk_threshold->GetOutputPort());
  vtkNew<vtkPolyDataNormals> normals;
  normals->SetInputConnection(c.surface->GetOutputPort(0));
  normals->Update();
  EXPECT_GT(normals->GetOutput()->GetNumberOfCells(), 1000);
}

TEST(VtkStage, SparseGridTravelsAsItsOwnDataObject) {
  Chain c;
  c.resample->Update();
  auto* const object = vtkOsteoDataObject::SafeDownCast(c.resample->GetOutputDataObject(0));
  ASSERT_NE(object, nullptr);
  EXPECT_GT(std::get<SparseGrid>(object->GetValue()).active_voxels, 1000u);
  EXPECT_GT(object->GetActualMemorySize(), 10u);
}

TEST(VtkStage, VoxelsAreNotCopied) {
  PhantomParams pp;
  pp.region = PhantomRegion::temporal;
  pp.spacing_mm = 4;
  const Image ct = make_phantom(pp).ct;
  const auto image = to_vtk(ct);
  EXPECT_EQ(image->GetScalarPointer(), static_cast<const void*>(ct.voxels.get()));
  const Image back = image_from_vtk(image);
  EXPECT_EQ(back.voxels.get(), ct.voxels.get());
  EXPECT_EQ(back.frame, ct.frame);
}

TEST(VtkStage, VoxelsOutliveTheirMaker) {
  vtkSmartPointer<vtkImageData> image;
  Image back;
  {
    PhantomParams pp;
    pp.region = PhantomRegion::temporal;
    pp.spacing_mm = 4;
    image = to_vtk(make_phantom(pp).ct);
  }
  back = image_from_vtk(image);
  image = nullptr;
  std::int64_t sum = 0;
  for (const auto v : back.span()) sum += v;
  EXPECT_NE(sum, 0);
}

TEST(VtkStage, EqualParameterDoesNotRunAgain) {
  Chain c;
  c.surface->Update();
  const auto before = c.surface->GetMTime();
  EXPECT_TRUE(c.surface->SetParameter("iso", "0.5"));
  EXPECT_EQ(c.surface->GetMTime(), before);
  EXPECT_TRUE(c.surface->SetParameter("iso", "0.4"));
  EXPECT_GT(c.surface->GetMTime(), before);
}

TEST(VtkStage, WrongNamesAndValuesAreRefused) {
  vtkNew<vtkOsteoStage> stage;
  EXPECT_FALSE(stage->SetStage(registry(), "treshold"));
  EXPECT_TRUE(stage->SetStage(registry(), "threshold"));
  EXPECT_FALSE(stage->SetParameter("lowr", "1"));
  EXPECT_FALSE(stage->SetParameter("lower", "many"));
  EXPECT_NE(stage->GetLastError().find("not a number"), std::string::npos);
}

TEST(VtkStage, FailureIsToldEachTimeAndTriedAgain) {
  const QuietVtk quiet;
  Chain c;
  c.threshold->SetParameter("lower", "5000");
  for (int n = 0; n < 3; ++n) {
    EXPECT_EQ(c.threshold->GetExecutive()->Update(0), 0) << n;
    EXPECT_NE(c.threshold->GetErrorCode(), static_cast<unsigned long>(vtkErrorCode::NoError)) << n;
  }
  EXPECT_NE(c.threshold->GetLastError().find("no voxel is left"), std::string::npos);
  c.threshold->SetParameter("lower", "500");
  EXPECT_NE(c.threshold->GetExecutive()->Update(0), 0);
  EXPECT_EQ(c.threshold->GetErrorCode(), static_cast<unsigned long>(vtkErrorCode::NoError));
}

TEST(VtkStage, ProgressRunsAndAbortStops) {
  const QuietVtk quiet;
  Chain c;
  int calls = 0;
  vtkNew<vtkCallbackCommand> observer;
  observer->SetClientData(&calls);
  observer->SetCallback([](vtkObject* caller, unsigned long, void* data, void*) {
    if (++*static_cast<int*>(data) == 2) static_cast<vtkAlgorithm*>(caller)->AbortExecuteOn();
  });
  c.resample->AddObserver(vtkCommand::ProgressEvent, observer);
  EXPECT_EQ(c.resample->GetExecutive()->Update(0), 0);
  EXPECT_EQ(c.resample->GetLastError(), "cancelled");
  EXPECT_GE(calls, 2);
}

TEST(VtkStage, ImportReadsASourcePath) {
  const QuietVtk quiet;
  vtkNew<vtkOsteoStage> import;
  ASSERT_TRUE(import->SetStage(registry(), "import"));
  import->SetSourcePath("/nonexistent/ct.nrrd");
  EXPECT_EQ(import->GetExecutive()->Update(0), 0);
  EXPECT_EQ(import->GetErrorCode(), static_cast<unsigned long>(vtkErrorCode::FileNotFoundError));
}

}  // namespace
}  // namespace osteo
