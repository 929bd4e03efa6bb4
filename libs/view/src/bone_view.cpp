#include "osteo/view/bone_view.h"

#include <vtkActor.h>
#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkMapper.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkTypeInt32Array.h>
#include <vtkUnsignedCharArray.h>

#include <cmath>
#include <set>
#include <tuple>

#include "osteo/view/actors.h"

namespace osteo {
namespace {

constexpr int kChunkBricks = 6;  // 48 voxels: an edit renews about 15,000 triangles, a head has about 500 chunks
constexpr double kBone[3] = {0.93, 0.88, 0.77};
constexpr double kFadeMm = 0.8;  // bone this thick lets a third of the colour below through (a guess: what drilled bone looks like)

// Bone, or what lies a little below it.
void colour_at(const StructureMap& structures, Vec3 p, Vec3 outwards, unsigned char* rgb) {
  double share = 0;
  std::array<double, 3> below{};
  if (const auto near = structures.at(p); near.structure != 0 && near.distance_mm < BoneView::kShownThroughMm) {
    for (double t = 0; t <= BoneView::kShownThroughMm; t += 0.25) {
      const auto there = structures.at(p - outwards * t);
      if (there.structure == 0 || there.distance_mm > 0) continue;
      share = std::exp(-t / kFadeMm);
      below = structures.colour_of(there.structure);
      break;
    }
  }
  for (std::size_t c = 0; c < 3; ++c) rgb[c] = static_cast<unsigned char>(std::lround(255 * (kBone[c] * (1 - share) + below[c] * share)));
}

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
    if (structures_ != nullptr) c.actor->GetMapper()->ScalarVisibilityOn();
    if (matrix_) c.actor->SetUserMatrix(matrix_);
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
  vtkNew<vtkUnsignedCharArray> colours;
  colours->SetNumberOfComponents(3);
  colours->SetNumberOfTuples(structures_ != nullptr ? static_cast<vtkIdType>(points) : 0);
  unsigned char* rgb = colours->GetPointer(0);
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
      if (structures_ != nullptr) {
        colour_at(*structures_, w, d, rgb);
        rgb += 3;
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
  if (structures_ != nullptr) chunk.data->GetPointData()->SetScalars(colours);
  chunk.data->Modified();
  chunk.complete = {xyz.Get(), connectivity.Get(), chunk.complete.version + 1};
  chunk.partly = false;
  chunk.actor->GetMapper()->Update();
  chunk.actor->SetVisibility(triangles > 0 ? 1 : 0);
}

namespace {

void set_triangles(vtkPolyData* data, vtkTypeInt32Array* connectivity) {
  const vtkIdType triangles = connectivity->GetNumberOfValues() / 3;
  vtkNew<vtkTypeInt32Array> offsets;
  offsets->SetNumberOfValues(triangles + 1);
  for (vtkIdType t = 0; t <= triangles; ++t) offsets->SetValue(t, static_cast<int>(3 * t));
  vtkNew<vtkCellArray> cells;
  cells->SetData(offsets, connectivity);
  data->SetPolys(cells);
  data->Modified();
}

}  // namespace

void BoneView::draw_only(std::size_t n, std::uint64_t version, std::span<const std::uint32_t> triangles) {
  Chunk& chunk = chunks_[n];
  if (chunk.complete.version != version) return;
  vtkNew<vtkTypeInt32Array> some;
  some->SetNumberOfValues(static_cast<vtkIdType>(triangles.size()));
  for (std::size_t i = 0; i < triangles.size(); ++i) some->SetValue(static_cast<vtkIdType>(i), static_cast<int>(triangles[i]));
  set_triangles(chunk.data, some);
  chunk.actor->GetMapper()->Update();
  chunk.actor->SetVisibility(triangles.empty() ? 0 : 1);
  chunk.partly = true;
}

void BoneView::draw_all() {
  for (Chunk& chunk : chunks_) {
    if (!chunk.partly) continue;
    set_triangles(chunk.data, chunk.complete.triangles);
    chunk.actor->GetMapper()->Update();
    chunk.actor->SetVisibility(chunk.complete.triangles->GetNumberOfValues() > 0 ? 1 : 0);
    chunk.partly = false;
  }
}

void BoneView::place(const RigidTransform& t) {
  placed_ = t;
  if (!matrix_) {
    if (t.rotation == Mat3{} && t.shift_mm == Vec3{}) return;
    matrix_ = vtkSmartPointer<vtkMatrix4x4>::New();
    for (const Chunk& c : chunks_) c.actor->SetUserMatrix(matrix_);
  }
  set_matrix(matrix_, t);
}

void BoneView::highlight(bool on) {
  for (const Chunk& c : chunks_) c.actor->GetProperty()->SetAmbient(on ? 0.3 : 0.08);
}

std::size_t BoneView::triangles() const {
  std::size_t total = 0;
  for (const Chunk& c : chunks_) total += static_cast<std::size_t>(c.complete.triangles->GetNumberOfValues() / 3);
  return total;
}

}  // namespace osteo
