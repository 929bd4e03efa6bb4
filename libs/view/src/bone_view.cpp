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

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <tuple>

#include "osteo/base/parallel.h"
#include "osteo/view/actors.h"

namespace osteo {
namespace {

// Of a temporal bone chunks of 32 voxels: an edit renews about 5,000 triangles. A head would have too many of them: 48 voxels, 500 chunks.
constexpr int kChunkBricks = 4, kLargeChunkBricks = 6;
constexpr std::size_t kLargeFromBricks = 12'000;

}  // namespace

BoneView::~BoneView() {
  for (const Chunk& c : chunks_) renderer_->RemoveActor(c.actor);
}

void BoneView::show(const LiveSurface& surface) {
  for (const Chunk& c : chunks_) renderer_->RemoveActor(c.actor);
  chunks_.clear();
  const int edge = surface.bone().brick_count() < kLargeFromBricks ? kChunkBricks : kLargeChunkBricks;
  std::map<std::tuple<int, int, int>, std::uint32_t> index;
  chunk_of_brick_.resize(surface.bone().brick_count());
  for (std::uint32_t b = 0; b < chunk_of_brick_.size(); ++b) {
    const Ijk o = surface.bone().brick_coordinate(b);
    const auto [it, fresh] = index.try_emplace({o.k / edge, o.j / edge, o.i / edge}, static_cast<std::uint32_t>(chunks_.size()));
    if (fresh) chunks_.emplace_back();
    chunks_[it->second].bricks.push_back(b);
    chunk_of_brick_[b] = it->second;
  }
  voxel_mm_ = surface.bone().frame().spacing_mm.x;
  paint_ = std::make_unique<BonePaint>(surface.bone(), structures_, hardness_);
  colours_.assign(surface.bone().brick_count(), {});
  is_updated_.assign(surface.bone().brick_count(), false);
  updated_.clear();
  std::vector<std::uint32_t> all(surface.bone().brick_count());
  std::iota(all.begin(), all.end(), 0U);
  paint(surface, all);
  for (Chunk& c : chunks_) {
    c.data = vtkSmartPointer<vtkPolyData>::New();
    c.actor = make_bone_actor(c.data);
    c.actor->GetProperty()->BackfaceCullingOn();
    c.actor->GetMapper()->ScalarVisibilityOn();
    if (matrix_) c.actor->SetUserMatrix(matrix_);
    rebuild(c, surface);
    renderer_->AddActor(c.actor);
  }
}

void BoneView::update(const LiveSurface& surface, std::span<const std::uint32_t> bricks) {
  if (bricks.empty()) return;
  paint_->renew(surface.bone(), bricks);
  paint(surface, bricks);
  std::set<std::uint32_t> touched;
  for (const std::uint32_t b : bricks) {
    touched.insert(chunk_of_brick_[b]);
    if (is_updated_[b]) continue;
    is_updated_[b] = true;
    updated_.push_back(b);
  }
  for (const std::uint32_t c : touched) rebuild(chunks_[c], surface);
}

void BoneView::paint(const LiveSurface& surface, std::span<const std::uint32_t> bricks) {
  // By threads only where it is worth waking them.
  parallel_for(bricks.size(), bricks.size() > 200 ? 32 : bricks.size() + 1, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) paint_->paint(surface.bone(), surface.patch(bricks[n]), colours_[bricks[n]]);
  });
}

void BoneView::refresh(const LiveSurface& surface) {
  if (updated_.empty()) return;
  const BrickGrid& bone = surface.bone();
  const int reach = 1 + static_cast<int>(std::ceil(Openness::kReachMm / (8 * bone.frame().spacing_mm.x)));
  std::set<std::uint32_t> near, touched;
  for (const std::uint32_t b : updated_) {
    is_updated_[b] = false;
    const Ijk o = bone.brick_coordinate(b);
    for (int k = o.k - reach; k <= o.k + reach; ++k)
      for (int j = o.j - reach; j <= o.j + reach; ++j)
        for (int i = o.i - reach; i <= o.i + reach; ++i)
          if (const std::uint32_t n = bone.find_brick(i, j, k); n != BrickGrid::kNone && !surface.patch(n).vertices.empty()) near.insert(n);
  }
  updated_.clear();
  paint(surface, std::vector<std::uint32_t>(near.begin(), near.end()));
  for (const std::uint32_t b : near) touched.insert(chunk_of_brick_[b]);
  for (const std::uint32_t c : touched) recolour(chunks_[c]);
}

void BoneView::recolour(Chunk& chunk) {
  vtkNew<vtkUnsignedCharArray> colours;
  colours->SetNumberOfComponents(3);
  colours->SetNumberOfTuples(chunk.data->GetNumberOfPoints());
  unsigned char* to = colours->GetPointer(0);
  for (const std::uint32_t b : chunk.bricks) {
    for (const Rgb& c : colours_[b]) to = std::copy(c.begin(), c.end(), to);
  }
  chunk.data->GetPointData()->SetScalars(colours);
  chunk.data->Modified();
  chunk.actor->GetMapper()->Update();
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
  colours->SetNumberOfTuples(static_cast<vtkIdType>(points));
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
    }
    for (const Rgb& each : colours_[b]) rgb = std::copy(each.begin(), each.end(), rgb);
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
  chunk.data->GetPointData()->SetScalars(colours);
  chunk.data->Modified();
  chunk.complete = {xyz.Get(), connectivity.Get(), chunk.complete.version + 1};
  chunk.drawn = Drawn::complete;
  chunk.drawn_triangles = triangles;
  ++version_;
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

vtkSmartPointer<vtkTypeInt32Array> array_of(std::span<const std::uint32_t> triangles) {
  auto array = vtkSmartPointer<vtkTypeInt32Array>::New();
  array->SetNumberOfValues(static_cast<vtkIdType>(triangles.size()));
  std::transform(triangles.begin(), triangles.end(), array->GetPointer(0), [](std::uint32_t v) { return static_cast<int>(v); });
  return array;
}

}  // namespace

void BoneView::draw(Chunk& chunk, vtkTypeInt32Array* triangles, Drawn drawn) {
  set_triangles(chunk.data, triangles);
  chunk.actor->GetMapper()->Update();
  chunk.drawn = drawn;
  chunk.drawn_triangles = static_cast<std::size_t>(triangles->GetNumberOfValues()) / 3;
  chunk.actor->SetVisibility(chunk.drawn_triangles > 0 ? 1 : 0);
}

void BoneView::draw_only(std::size_t n, std::uint64_t version, std::span<const std::uint32_t> triangles) {
  Chunk& chunk = chunks_[n];
  if (chunk.complete.version == version) draw(chunk, array_of(triangles), Drawn::visible);
}

void BoneView::keep_coarse(std::size_t n, std::uint64_t version, std::vector<std::uint32_t> triangles) {
  Chunk& chunk = chunks_[n];
  if (chunk.complete.version != version) return;
  chunk.coarse = std::move(triangles);
  chunk.coarse_version = version;
}

void BoneView::draw_all(bool coarse) {
  for (std::size_t n = 0; n < chunks_.size(); ++n) {
    Chunk& chunk = chunks_[n];
    const Drawn wanted = coarse && has_coarse(n) ? Drawn::coarse : Drawn::complete;
    if (chunk.drawn == wanted) continue;
    if (wanted == Drawn::coarse) {
      draw(chunk, array_of(chunk.coarse), Drawn::coarse);
    } else {
      draw(chunk, chunk.complete.triangles, Drawn::complete);
    }
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
  for (const Chunk& c : chunks_) c.actor->GetProperty()->SetAmbient(on ? kBoneAmbient + 0.2 : kBoneAmbient);
}

void BoneView::set_wetness(double share) {
  for (const Chunk& c : chunks_) set_bone_wetness(c.actor->GetProperty(), share);
}

std::size_t BoneView::triangles() const {
  std::size_t total = 0;
  for (const Chunk& c : chunks_) total += static_cast<std::size_t>(c.complete.triangles->GetNumberOfValues() / 3);
  return total;
}

std::size_t BoneView::drawn_triangles() const {
  std::size_t total = 0;
  for (const Chunk& c : chunks_) total += c.drawn_triangles;
  return total;
}

std::vector<std::uint32_t> coarse_triangles(std::span<const float> points_mm, std::span<const int> triangles, double error_mm) {
  if (triangles.empty()) return {};
  const std::size_t points = points_mm.size() / 3;
  std::vector<std::uint32_t> whole(triangles.begin(), triangles.end()), joined(whole.size()), coarse(whole.size());
  // Bricks have points of their own along their common face.
  meshopt_generateShadowIndexBuffer(joined.data(), whole.data(), whole.size(), points_mm.data(), points, 3 * sizeof(float),
                                    3 * sizeof(float));
  const float scale = meshopt_simplifyScale(points_mm.data(), points, 3 * sizeof(float));
  const std::size_t kept =
      meshopt_simplify(coarse.data(), joined.data(), joined.size(), points_mm.data(), points, 3 * sizeof(float), whole.size() / 12 * 3,
                       static_cast<float>(error_mm) / std::max(scale, 1e-6F), meshopt_SimplifyLockBorder, nullptr);
  coarse.resize(kept);
  std::vector<std::uint32_t> order(kept);
  meshopt_optimizeVertexCache(order.data(), coarse.data(), kept, points);
  return order;
}

}  // namespace osteo
