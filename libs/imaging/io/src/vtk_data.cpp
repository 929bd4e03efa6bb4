#include "osteo/imaging/io/vtk_data.h"

#include <vtkCellArray.h>
#include <vtkCellArrayIterator.h>
#include <vtkErrorCode.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationObjectBaseKey.h>
#include <vtkLogger.h>
#include <vtkMatrix3x3.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolygon.h>
#include <vtkShortArray.h>
#include <vtkUnsignedCharArray.h>

#include <atomic>
#include <mutex>

#include "osteo/core/base/error.h"
#include "raw_volume.h"
#include "vtk_volume.h"

namespace osteo::inline imaging {
namespace {

// Keeps our voxels alive as long as the VTK array that shows them.
class VoxelOwner : public vtkObjectBase {
 public:
  vtkBaseTypeMacro(VoxelOwner, vtkObjectBase);
  static VoxelOwner* New() {
    auto* owner = new VoxelOwner;
    owner->InitializeObjectBase();
    return owner;
  }
  std::shared_ptr<const void> voxels;
};

vtkInformationObjectBaseKey* owner_key() {
  static vtkInformationObjectBaseKey* const key =
      vtkInformationObjectBaseKey::MakeKey("VOXEL_OWNER", "osteo", "VoxelOwner");
  return key;
}

template <class Array, class T>
vtkSmartPointer<vtkImageData> wrap(const Volume<T>& volume, const char* name) {
  auto image = vtkSmartPointer<vtkImageData>::New();
  io::set_frame(image, volume.frame);
  vtkNew<Array> array;
  array->SetName(name);
  array->SetArray(const_cast<T*>(volume.voxels.get()), static_cast<vtkIdType>(volume.frame.voxel_count()), 1);
  vtkNew<VoxelOwner> owner;
  owner->voxels = std::shared_ptr<const void>(volume.voxels, volume.voxels.get());
  array->GetInformation()->Set(owner_key(), owner);
  image->GetPointData()->SetScalars(array);
  return image;
}

// QuietVtks nest: only the outermost lets VTK's logger speak again.
std::atomic<int> g_quiet_depth{0};

// Collects text instead of showing it.
class Collector : public vtkOutputWindow {
 public:
  vtkTypeMacro(Collector, vtkOutputWindow);
  static Collector* New();
  void DisplayText(const char* text) override {
    const std::lock_guard lock(mutex);
    if (first.empty() && text != nullptr) first = text;
  }
  std::mutex mutex;
  std::string first;
};
vtkStandardNewMacro(Collector);

}  // namespace

Error vtk_write_error(const std::filesystem::path& path, unsigned long vtk_error_code) {
  const bool full = vtk_error_code == vtkErrorCode::OutOfDiskSpaceError;
  return {ExitCode::cannot_write, "cannot write '" + path.string() + "'" + (full ? ": No space left on device" : ""),
          "see that the disk has room and the folder may be written"};
}

vtkSmartPointer<vtkImageData> to_vtk(const Image& image) {
  return wrap<vtkShortArray>(image, "HU");
}
vtkSmartPointer<vtkImageData> to_vtk(const Labels& labels) {
  return wrap<vtkUnsignedCharArray>(labels, "labels");
}

Image image_from_vtk(vtkImageData* data) {
  return io::image_from(io::raw_from_vtk(data), {});
}
Labels labels_from_vtk(vtkImageData* data) {
  return io::labels_from(io::raw_from_vtk(data));
}

vtkSmartPointer<vtkPolyData> to_vtk(const TriMesh& mesh) {
  auto poly = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkFloatArray> xyz;
  xyz->SetNumberOfComponents(3);
  xyz->SetNumberOfTuples(static_cast<vtkIdType>(mesh.points_mm.size()));
  std::copy_n(reinterpret_cast<const float*>(mesh.points_mm.data()), mesh.points_mm.size() * 3, xyz->GetPointer(0));
  vtkNew<vtkPoints> points;
  points->SetData(xyz);
  poly->SetPoints(points);
  vtkNew<vtkTypeInt32Array> offsets, connectivity;
  offsets->SetNumberOfValues(static_cast<vtkIdType>(mesh.triangles.size() + 1));
  connectivity->SetNumberOfValues(static_cast<vtkIdType>(mesh.triangles.size() * 3));
  for (std::size_t t = 0; t <= mesh.triangles.size(); ++t)
    offsets->SetValue(static_cast<vtkIdType>(t), static_cast<int>(3 * t));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t c = 0; c < 3; ++c) {
      connectivity->SetValue(static_cast<vtkIdType>(3 * t + c), static_cast<int>(mesh.triangles[t][c]));
    }
  }
  vtkNew<vtkCellArray> cells;
  cells->SetData(offsets, connectivity);
  poly->SetPolys(cells);
  if (mesh.normals.size() == mesh.points_mm.size() && !mesh.normals.empty()) {
    vtkNew<vtkFloatArray> normals;
    normals->SetName("Normals");
    normals->SetNumberOfComponents(3);
    normals->SetNumberOfTuples(static_cast<vtkIdType>(mesh.normals.size()));
    std::copy_n(reinterpret_cast<const float*>(mesh.normals.data()), mesh.normals.size() * 3, normals->GetPointer(0));
    poly->GetPointData()->SetNormals(normals);
  }
  return poly;
}

TriMesh mesh_from_vtk(vtkPolyData* data) {
  TriMesh mesh;
  mesh.points_mm.resize(static_cast<std::size_t>(data->GetNumberOfPoints()));
  for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i) {
    double p[3];
    data->GetPoint(i, p);
    mesh.points_mm[static_cast<std::size_t>(i)] = {static_cast<float>(p[0]), static_cast<float>(p[1]),
                                                   static_cast<float>(p[2])};
  }
  const auto it = vtk::TakeSmartPointer(data->GetPolys()->NewIterator());
  for (it->GoToFirstCell(); !it->IsDoneWithTraversal(); it->GoToNextCell()) {
    vtkIdType n = 0;
    const vtkIdType* ids = nullptr;
    it->GetCurrentCell(n, ids);
    for (vtkIdType k = 0; k < n; ++k) {
      if (ids[k] < 0 || ids[k] >= data->GetNumberOfPoints()) {
        throw Error(ExitCode::corrupt, "polygon " + std::to_string(it->GetCurrentCellId()) + " names point " +
                                           std::to_string(ids[k]) + ", but there are only " +
                                           std::to_string(data->GetNumberOfPoints()) + " points");
      }
    }
    if (n < 3) continue;
    if (n > 3) {
      // Ears; a polygon so twisted that this fails becomes a fan.
      vtkNew<vtkPolygon> polygon;
      polygon->Initialize(static_cast<int>(n), ids, data->GetPoints());
      vtkNew<vtkIdList> corners;
      if (polygon->Triangulate(corners) == 0) {
        corners->Reset();
        for (vtkIdType k = 1; k + 1 < n; ++k) {
          for (const vtkIdType c : {vtkIdType{0}, k, k + 1}) corners->InsertNextId(c);
        }
      }
      for (vtkIdType k = 0; k + 2 < corners->GetNumberOfIds(); k += 3) {
        const auto corner = [&](vtkIdType c) { return static_cast<std::uint32_t>(ids[corners->GetId(k + c)]); };
        mesh.triangles.push_back({corner(0), corner(1), corner(2)});
      }
      continue;
    }
    mesh.triangles.push_back(
        {static_cast<std::uint32_t>(ids[0]), static_cast<std::uint32_t>(ids[1]), static_cast<std::uint32_t>(ids[2])});
  }
  return mesh;
}

struct QuietVtk::Impl {
  vtkSmartPointer<vtkOutputWindow> before;
  vtkNew<Collector> collector;
};

QuietVtk::QuietVtk() : impl_(std::make_unique<Impl>()) {
  if (g_quiet_depth++ == 0) vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
  impl_->before = vtkOutputWindow::GetInstance();
  vtkOutputWindow::SetInstance(impl_->collector);
}
QuietVtk::~QuietVtk() {
  vtkOutputWindow::SetInstance(impl_->before);
  if (--g_quiet_depth == 0) vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_WARNING);
}

std::string QuietVtk::first_message() const {
  const std::lock_guard lock(impl_->collector->mutex);
  std::string text = impl_->collector->first;
  if (const auto colon = text.find("): "); colon != std::string::npos) text = text.substr(colon + 3);
  text = text.substr(0, text.find('\n'));
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

}  // namespace osteo::inline imaging
