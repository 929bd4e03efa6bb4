#include "osteo/display/view/detail/bone_view.h"

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
#include <numbers>
#include <numeric>
#include <set>
#include <tuple>

#include "osteo/core/base/parallel.h"
#include "osteo/display/view/actors.h"

namespace osteo::inline display {
namespace {

// Of a temporal bone chunks of 32 voxels: an edit renews about 5,000 triangles. A head would have too many of them: 48
// voxels, 500 chunks.
constexpr int kChunkBricks = 4, kLargeChunkBricks = 6;
constexpr std::size_t kLargeFromBricks = 12'000;

// Chosen to be seen on ivory and by the colour-blind; below where nothing happens to bone, at the end what coagulates
// at once.
constexpr double kSeenFromC = 42, kRedFromC = 57;
constexpr std::uint8_t kMaxSteps = static_cast<std::uint8_t>(kRedFromC - kSeenFromC);

Rgb glowing(Rgb colour, std::uint8_t steps) {
  const double share = static_cast<double>(steps) / kMaxSteps, cover = 0.35 + 0.45 * share;
  const Vec3 heat = Vec3{236, 170, 40} * (1 - share) + Vec3{200, 40, 20} * share;
  const double lit = static_cast<double>(std::max({colour[0], colour[1], colour[2]})) / 242;  // creases stay dark
  for (std::size_t c = 0; c < 3; ++c)
    colour[c] =
        static_cast<std::uint8_t>(std::lround((1 - cover) * static_cast<double>(colour[c]) + cover * lit * heat[c]));
  return colour;
}

Vec3 middle_mm(const BrickGrid& bone, std::uint32_t brick) {
  const Ijk o = bone.brick_coordinate(brick);
  return bone.frame().world_from_index({o.i * 8 + 3.5, o.j * 8 + 3.5, o.k * 8 + 3.5});
}

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
    const auto [it, fresh] =
        index.try_emplace({o.k / edge, o.j / edge, o.i / edge}, static_cast<std::uint32_t>(chunks_.size()));
    if (fresh) chunks_.emplace_back();
    chunks_[it->second].bricks.push_back(b);
    chunk_of_brick_[b] = it->second;
  }
  voxel_mm_ = surface.bone().frame().spacing_mm.x;
  paint_ = std::make_unique<BonePaint>(surface.bone(), structures_, hardness_);
  colours_.assign(surface.bone().brick_count(), {});
  wet_.assign(surface.bone().brick_count(), {});
  warm_.assign(surface.bone().brick_count(), {});
  shines_.assign(surface.bone().brick_count(), {});
  is_updated_.assign(surface.bone().brick_count(), false);
  updated_.clear();
  std::vector<std::uint32_t> all(surface.bone().brick_count());
  std::iota(all.begin(), all.end(), 0U);
  paint(surface, all, false);
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
  paint(surface, bricks, true);
  std::set<std::uint32_t> touched;
  for (const std::uint32_t b : bricks) {
    touched.insert(chunk_of_brick_[b]);
    if (is_updated_[b]) continue;
    is_updated_[b] = true;
    updated_.push_back(b);
    for (BoneView* const other : others_) other->updated_beside_mm_.push_back(middle_mm(surface.bone(), b));
  }
  for (const std::uint32_t c : touched) rebuild(chunks_[c], surface);
}

void BoneView::paint(const LiveSurface& surface, std::span<const std::uint32_t> bricks, bool by_memo) {
  // By threads only where it is worth waking them.
  parallel_for(bricks.size(), bricks.size() > 200 ? 32 : bricks.size() + 1, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      paint_->paint(surface.bone(), surface.patch(bricks[n]), colours_[bricks[n]],
                    by_memo ? &shines_[bricks[n]] : nullptr);
      wet_brick(surface, bricks[n]);
    }
  });
}

void BoneView::shade_with(const std::vector<BoneView*>& others) {
  others_ = others;
  std::vector<std::shared_ptr<const Openness>> open;
  for (const BoneView* const other : others) open.push_back(other->paint_->openness());
  paint_->shade_with(std::move(open));
  all_updated_ = true;
}

void BoneView::refresh(const LiveSurface& surface) {
  if (updated_.empty() && updated_beside_mm_.empty() && !all_updated_) return;
  const BrickGrid& bone = surface.bone();
  const double brick_mm = 8 * bone.frame().spacing_mm.x;
  const int reach = 1 + static_cast<int>(std::ceil(Openness::kReachMm / brick_mm));
  std::set<std::uint32_t> near, touched;
  const auto add = [&](Ijk o, int bricks) {
    for (int k = o.k - bricks; k <= o.k + bricks; ++k)
      for (int j = o.j - bricks; j <= o.j + bricks; ++j)
        for (int i = o.i - bricks; i <= o.i + bricks; ++i)
          if (const std::uint32_t n = bone.find_brick(i, j, k);
              n != BrickGrid::kNone && !surface.patch(n).vertices.empty())
            near.insert(n);
  };
  if (all_updated_) {
    for (std::uint32_t b = 0; b < bone.brick_count(); ++b) {
      if (!surface.patch(b).vertices.empty()) near.insert(b);
    }
  } else {
    for (const std::uint32_t b : updated_) add(bone.brick_coordinate(b), reach);
    // A brick of those may be wider than one of these: half of it more.
    std::set<std::tuple<int, int, int>> places;
    for (const Vec3 at : updated_beside_mm_) {
      const Vec3 x = bone.frame().index_from_world(at);
      places.insert({static_cast<int>(std::floor(x.x / 8)), static_cast<int>(std::floor(x.y / 8)),
                     static_cast<int>(std::floor(x.z / 8))});
    }
    double widest_mm = 0;
    for (const BoneView* const other : others_) widest_mm = std::max(widest_mm, 8 * other->voxel_mm_);
    const int farther = 1 + static_cast<int>(std::ceil((Openness::kReachMm + widest_mm / 2) / brick_mm));
    for (const auto& [i, j, k] : places) add({i, j, k}, farther);
  }
  for (const std::uint32_t b : updated_) is_updated_[b] = false;
  updated_.clear();
  updated_beside_mm_.clear();
  all_updated_ = false;
  paint(surface, std::vector<std::uint32_t>(near.begin(), near.end()), false);
  for (const std::uint32_t b : near) touched.insert(chunk_of_brick_[b]);
  for (const std::uint32_t c : touched) recolour(chunks_[c]);
}

// How wet a brick's vertices are now. True: otherwise than before.
bool BoneView::wet_brick(const LiveSurface& surface, std::uint32_t brick) {
  std::vector<std::uint8_t>& wet = wet_[brick];
  if (film_ == nullptr || (film_->dry() && wet.empty())) return false;
  const SurfacePatch& patch = surface.patch(brick);
  const Frame& frame = surface.bone().frame();
  std::vector<std::uint8_t> now;
  for (std::size_t n = 0; n < patch.vertices.size(); ++n) {
    // A quarter of a voxel out of the bone: in the cell that the film lies in.
    const auto& v = patch.vertices[n];
    const double share =
        film_->at(placed_(frame.world_from_index(from_floats(v.index) + from_floats(v.normal) * 0.25)));
    if (share > 0 && now.empty()) now.assign(patch.vertices.size(), 0);
    if (!now.empty()) now[n] = static_cast<std::uint8_t>(std::lround(255 * std::min(1.0, share)));
  }
  if (now == wet) return false;
  wet = std::move(now);
  return true;
}

void BoneView::wet(const LiveSurface& surface) {
  if (film_ == nullptr) return;
  const bool moved = placed_.rotation != wetted_at_.rotation || placed_.shift_mm != wetted_at_.shift_mm;
  wetted_at_ = placed_;
  std::set<std::uint32_t> touched;
  for (std::uint32_t b = 0; b < wet_.size(); ++b) {
    if (surface.patch(b).vertices.empty()) continue;
    if ((moved || film_->changed_near(placed_(middle_mm(surface.bone(), b)))) && wet_brick(surface, b))
      touched.insert(chunk_of_brick_[b]);
  }
  for (const std::uint32_t c : touched) recolour(chunks_[c]);
}

bool BoneView::warm_brick(const LiveSurface& surface, std::uint32_t brick,
                          const std::function<double(Vec3)>& celsius_at) {
  const SurfacePatch& patch = surface.patch(brick);
  const Frame& frame = surface.bone().frame();
  std::vector<std::uint8_t> now;
  for (std::size_t n = 0; n < patch.vertices.size(); ++n) {
    const double over = celsius_at(placed_(frame.world_from_index(from_floats(patch.vertices[n].index)))) - kSeenFromC;
    if (!(over >= 0.5)) continue;
    if (now.empty()) now.assign(patch.vertices.size(), 0);
    now[n] = static_cast<std::uint8_t>(std::lround(std::min(over, static_cast<double>(kMaxSteps))));
  }
  if (now == warm_[brick]) return false;
  warm_[brick] = std::move(now);
  return true;
}

void BoneView::warm(const LiveSurface& surface, std::span<const std::pair<Vec3, double>> near,
                    const std::function<double(Vec3)>& celsius_at) {
  const double radius_mm = 4 * std::numbers::sqrt3 * voxel_mm_;
  std::set<std::uint32_t> touched;
  for (std::uint32_t b = 0; b < warm_.size(); ++b) {
    if (surface.patch(b).vertices.empty() && warm_[b].empty()) continue;
    const auto touches = [&, at = placed_(middle_mm(surface.bone(), b))](const auto& ball) {
      const Vec3 d = at - ball.first;
      return dot(d, d) <= (radius_mm + ball.second) * (radius_mm + ball.second);
    };
    const bool look = !warm_[b].empty() || std::any_of(near.begin(), near.end(), touches);
    if (look && warm_brick(surface, b, celsius_at)) touched.insert(chunk_of_brick_[b]);
  }
  for (const std::uint32_t c : touched) recolour(chunks_[c]);
}

// Of a wet chunk the fourth byte says how dry a vertex is: what VTK takes for opacity, of which the shader makes
// another use.
void BoneView::set_colours(Chunk& chunk) {
  const bool wet =
      std::any_of(chunk.bricks.begin(), chunk.bricks.end(), [&](std::uint32_t b) { return !wet_[b].empty(); });
  std::size_t points = 0;
  for (const std::uint32_t b : chunk.bricks) points += colours_[b].size();
  vtkNew<vtkUnsignedCharArray> colours;
  colours->SetNumberOfComponents(wet ? 4 : 3);
  colours->SetNumberOfTuples(static_cast<vtkIdType>(points));
  unsigned char* to = colours->GetPointer(0);
  for (const std::uint32_t b : chunk.bricks) {
    for (std::size_t n = 0; n < colours_[b].size(); ++n) {
      // Between two looks at heat a brick may have got other vertices.
      const std::uint8_t steps = n < warm_[b].size() ? warm_[b][n] : 0;
      const Rgb colour = steps > 0 ? glowing(colours_[b][n], steps) : colours_[b][n];
      to = std::copy(colour.begin(), colour.end(), to);
      if (wet) *to++ = static_cast<unsigned char>(wet_[b].empty() ? 255 : 255 - wet_[b][n]);
    }
  }
  chunk.data->GetPointData()->SetScalars(colours);
  if (wet != chunk.wet) set_bone_wet(chunk.actor, wet);
  chunk.wet = wet;
}

void BoneView::recolour(Chunk& chunk) {
  set_colours(chunk);
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
  int base = 0;
  for (const std::uint32_t b : chunk.bricks) {
    const SurfacePatch& patch = surface.patch(b);
    for (const auto& v : patch.vertices) {
      const Vec3 w = frame.world_from_index(
          {static_cast<double>(v.index[0]), static_cast<double>(v.index[1]), static_cast<double>(v.index[2])});
      const Vec3 d = frame.direction * Vec3{static_cast<double>(v.normal[0]), static_cast<double>(v.normal[1]),
                                            static_cast<double>(v.normal[2])};
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
  set_colours(chunk);
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
  std::transform(triangles.begin(), triangles.end(), array->GetPointer(0),
                 [](std::uint32_t v) { return static_cast<int>(v); });
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
  if (chunk.complete.version != version) return;
  // What is drawn so already stays untouched: nobody draws it again for that.
  if (chunk.drawn == Drawn::visible &&
      std::equal(triangles.begin(), triangles.end(), chunk.visible.begin(), chunk.visible.end()))
    return;
  chunk.visible.assign(triangles.begin(), triangles.end());
  draw(chunk, array_of(triangles), Drawn::visible);
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

std::vector<std::uint32_t> coarse_triangles(std::span<const float> points_mm, std::span<const int> triangles,
                                            double error_mm) {
  if (triangles.empty()) return {};
  const std::size_t points = points_mm.size() / 3;
  std::vector<std::uint32_t> whole(triangles.begin(), triangles.end()), joined(whole.size()), coarse(whole.size());
  // Bricks have points of their own along their common face.
  meshopt_generateShadowIndexBuffer(joined.data(), whole.data(), whole.size(), points_mm.data(), points,
                                    3 * sizeof(float), 3 * sizeof(float));
  const float scale = meshopt_simplifyScale(points_mm.data(), points, 3 * sizeof(float));
  const std::size_t kept = meshopt_simplify(
      coarse.data(), joined.data(), joined.size(), points_mm.data(), points, 3 * sizeof(float), whole.size() / 12 * 3,
      static_cast<float>(error_mm) / std::max(scale, 1e-6F), meshopt_SimplifyLockBorder, nullptr);
  coarse.resize(kept);
  std::vector<std::uint32_t> order(kept);
  meshopt_optimizeVertexCache(order.data(), coarse.data(), kept, points);
  return order;
}

}  // namespace osteo::inline display
