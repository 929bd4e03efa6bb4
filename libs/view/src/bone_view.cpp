#include "osteo/view/bone_view.h"

#include <vtkActor.h>
#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkMapper.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkTypeInt32Array.h>

#include <set>
#include <tuple>

#include "osteo/view/actors.h"

namespace osteo {
namespace {

constexpr int kChunkBricks = 6;  // 48 voxels: an edit renews about 15,000 triangles, a head has about 500 chunks

}  // namespace

BoneView::~BoneView() {
  for (const Chunk& c : chunks_) renderer_->RemoveActor(c.actor);
}

void BoneView::show(const LiveSurface& surface) {
  for (const Chunk& c : chunks_) renderer_->RemoveActor(c.actor);
  chunks_.clear();
  std::map<std::tuple<int, int, int>, std::uint32_t> index;
  chunk_of_brick_.resize(surface.bone().brick_count());
  for (std::uint32_t b = 0; b < chunk_of_brick_.size(); ++b) {
    const Ijk o = surface.bone().brick_coordinate(b);
    const auto [it, fresh] =
        index.try_emplace({o.k / kChunkBricks, o.j / kChunkBricks, o.i / kChunkBricks}, static_cast<std::uint32_t>(chunks_.size()));
    if (fresh) chunks_.emplace_back();
    chunks_[it->second].bricks.push_back(b);
    chunk_of_brick_[b] = it->second;
  }
  for (Chunk& c : chunks_) {
    c.data = vtkSmartPointer<vtkPolyData>::New();
    c.actor = make_bone_actor(c.data);
    c.actor->GetProperty()->BackfaceCullingOn();
    rebuild(c, surface);
    renderer_->AddActor(c.actor);
  }
}

void BoneView::update(const LiveSurface& surface, std::span<const std::uint32_t> bricks) {
  std::set<std::uint32_t> touched;
  for (const std::uint32_t b : bricks) touched.insert(chunk_of_brick_[b]);
  for (const std::uint32_t c : touched) rebuild(chunks_[c], surface);
}

void BoneView::rebuild(Chunk& chunk, const LiveSurface& surface) {
  std::size_t points = 0, triangles = 0;
  for (const std::uint32_t b : chunk.bricks) {
    points += surface.patch(b).vertices.size();
    triangles += surface.patch(b).triangles.size();
  }
  const Frame& frame = surface.bone().frame();
  vtkNew<vtkFloatArray> xyz, normals;
  vtkNew<vtkTypeInt32Array> offsets, connectivity;
  xyz->SetNumberOfComponents(3);
  xyz->SetNumberOfTuples(static_cast<vtkIdType>(points));
  normals->SetNumberOfComponents(3);
  normals->SetNumberOfTuples(static_cast<vtkIdType>(points));
  offsets->SetNumberOfValues(static_cast<vtkIdType>(triangles + 1));
  connectivity->SetNumberOfValues(static_cast<vtkIdType>(triangles * 3));
  float* p = xyz->GetPointer(0);
  float* n = normals->GetPointer(0);
  int* c = connectivity->GetPointer(0);
  const bool mirrored = determinant(frame.direction) < 0;
  int base = 0;
  for (const std::uint32_t b : chunk.bricks) {
    const SurfacePatch& patch = surface.patch(b);
    for (const auto& v : patch.vertices) {
      const Vec3 w =
          frame.world_from_index({static_cast<double>(v.index[0]), static_cast<double>(v.index[1]), static_cast<double>(v.index[2])});
      const Vec3 d =
          frame.direction * Vec3{static_cast<double>(v.normal[0]), static_cast<double>(v.normal[1]), static_cast<double>(v.normal[2])};
      for (std::size_t a = 0; a < 3; ++a) {
        *p++ = static_cast<float>(w[a]);
        *n++ = static_cast<float>(d[a]);
      }
    }
    for (const auto& t : patch.triangles) {
      *c++ = base + static_cast<int>(t[0]);
      *c++ = base + static_cast<int>(t[mirrored ? 2 : 1]);
      *c++ = base + static_cast<int>(t[mirrored ? 1 : 2]);
    }
    base += static_cast<int>(patch.vertices.size());
  }
  for (std::size_t t = 0; t <= triangles; ++t) offsets->SetValue(static_cast<vtkIdType>(t), static_cast<int>(3 * t));
  vtkNew<vtkPoints> vtk_points;
  vtk_points->SetData(xyz);
  vtkNew<vtkCellArray> cells;
  cells->SetData(offsets, connectivity);
  chunk.data->Initialize();
  chunk.data->SetPoints(vtk_points);
  chunk.data->SetPolys(cells);
  chunk.data->GetPointData()->SetNormals(normals);
  chunk.data->Modified();
  chunk.actor->GetMapper()->Update();
  chunk.actor->SetVisibility(triangles > 0 ? 1 : 0);
}

std::size_t BoneView::triangles() const {
  std::size_t total = 0;
  for (const Chunk& c : chunks_) total += static_cast<std::size_t>(c.data->GetNumberOfCells());
  return total;
}

}  // namespace osteo
