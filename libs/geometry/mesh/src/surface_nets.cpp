// Surface nets with one vertex for each sheet of surface in a cell.
//
// A cell is the cube between 8 voxels. Corner c of a cell has offset (c&1, c>>1&1, c>>2). A crossing edge joins a bone
// and an empty corner. On each face the crossing edges pair up to arcs; the arcs close to loops; a loop is one sheet
// and gets one vertex. A face with four crossings is ambiguous: by default its arcs go around the bone corners (bone is
// separate across a diagonal). When both cells at the face would have both arcs in one sheet, their vertices would
// share an edge of four quads; there, both cells pair the arcs around the empty corners instead.
#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "index_rows.h"
#include "osteo/core/base/parallel.h"
#include "osteo/core/base/portable_math.h"
#include "osteo/core/base/union_find.h"
#include "osteo/geometry/mesh/bone_surface.h"
#include "osteo/geometry/mesh/soup.h"

namespace osteo::inline geometry {
namespace {

// Edge e of a cell: axis e/4, from corner kEdgeFrom[e] along the axis.
struct EdgeEnds {
  int from, to;
};
constexpr std::array<EdgeEnds, 12> kEdges{
    {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3}, {4, 6}, {5, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}}};
// Face f: axis f/2, at the low (even) or high (odd) side; its corners in cyclic order.
constexpr std::array<std::array<int, 4>, 6> kFaces{
    {{0, 2, 6, 4}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 5, 7, 6}}};

constexpr int edge_between(int a, int b) {
  for (int e = 0; e < 12; ++e) {
    if ((kEdges[static_cast<std::size_t>(e)].from == a && kEdges[static_cast<std::size_t>(e)].to == b) ||
        (kEdges[static_cast<std::size_t>(e)].from == b && kEdges[static_cast<std::size_t>(e)].to == a))
      return e;
  }
  return -1;
}

// For each edge the smallest edge of its loop (its sheet's name), or 12 where it does not cross.
using Sheets = std::array<std::uint8_t, 12>;

constexpr Sheets sheets_of(unsigned mask, unsigned flipped_faces) {
  Sheets parent{};
  for (std::uint8_t e = 0; e < 12; ++e) {
    const bool a = mask >> kEdges[e].from & 1, b = mask >> kEdges[e].to & 1;
    parent[e] = a != b ? e : std::uint8_t{12};
  }
  const auto join = [&](int a, int b) {
    join_sets(parent, static_cast<std::uint8_t>(a), static_cast<std::uint8_t>(b));
  };
  for (unsigned f = 0; f < 6; ++f) {
    const auto& c = kFaces[f];
    std::array<int, 4> crossing{};
    int count = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const int e = edge_between(c[i], c[(i + 1) % 4]);
      if (parent[static_cast<std::size_t>(e)] != 12) crossing[static_cast<std::size_t>(count++)] = e;
    }
    if (count == 2) join(crossing[0], crossing[1]);
    if (count == 4) {
      // crossing[i] lies between corners i and i+1: pair the two edges at each bone corner (or empty corner, if
      // flipped).
      const bool first_is_centre = ((mask >> c[0] & 1) != 0) != ((flipped_faces >> f & 1) != 0);
      if (first_is_centre) {
        join(crossing[3], crossing[0]);
        join(crossing[1], crossing[2]);
      } else {
        join(crossing[0], crossing[1]);
        join(crossing[2], crossing[3]);
      }
    }
  }
  Sheets result{};
  for (std::uint8_t e = 0; e < 12; ++e) result[e] = parent[e] == 12 ? std::uint8_t{12} : root_of(parent, e);
  return result;
}

struct Tables {
  std::array<Sheets, 256> sheets{};
  std::array<std::uint8_t, 256> doubled{};  // faces whose two arcs lie in one sheet
};

const Tables& tables() {
  static const Tables value = [] {
    Tables t;
    for (unsigned mask = 0; mask < 256; ++mask) {
      t.sheets[mask] = sheets_of(mask, 0);
      for (unsigned f = 0; f < 6; ++f) {
        const auto& c = kFaces[f];
        bool ambiguous = true, one = true;
        for (std::size_t i = 0; i < 4; ++i) {
          const auto e = static_cast<std::size_t>(edge_between(c[i], c[(i + 1) % 4]));
          ambiguous = ambiguous && t.sheets[mask][e] != 12;
          one = one && t.sheets[mask][e] == t.sheets[mask][static_cast<std::size_t>(edge_between(c[0], c[1]))];
        }
        if (ambiguous && one) t.doubled[mask] |= static_cast<std::uint8_t>(1U << f);
      }
    }
    return t;
  }();
  return value;
}

// The voxels of a brick and 2 beyond it on each side.
constexpr int kPad = 2, kBlock = BrickGrid::kEdge + 2 * kPad;
// A crossing keeps this share of its edge away from both ends. Else a voxel of just the surface's density would draw
// the vertices of all cells around it together; so, no two vertices are nearer than two thirds of this, and single
// precision keeps them apart.
constexpr float kFromEnds = 0.01F;
constexpr int kCells = BrickGrid::kEdge + 1;  // cells -1 .. 7 along each axis can hold vertices of this brick

struct Block {
  std::array<float, static_cast<std::size_t>(kBlock* kBlock* kBlock)> v;
  [[nodiscard]] float at(int i, int j, int k) const {  // in-brick coordinates, -2 .. 9
    return v[static_cast<std::size_t>(((k + kPad) * kBlock + j + kPad) * kBlock + i + kPad)];
  }
};

unsigned cell_mask(const Block& b, int i, int j, int k, float iso) {
  unsigned mask = 0;
  for (int c = 0; c < 8; ++c)
    mask |= static_cast<unsigned>(b.at(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)) >= iso) << c;
  return mask;
}

struct CellSheets {
  Sheets sheets{};
  std::uint8_t mask = 0, flipped_faces = 0;
  bool ready = false;
};

class PatchBuilder {
 public:
  PatchBuilder(const BrickGrid& bone, std::uint32_t brick, float iso, SurfacePatch& patch) : iso_(iso), patch_(patch) {
    const Ijk b = bone.brick_coordinate(brick);
    base_ = {b.i * 8, b.j * 8, b.k * 8};
    bone.read_block({base_.i - kPad, base_.j - kPad, base_.k - kPad}, {kBlock, kBlock, kBlock}, block_.v.data());
    patch_.vertices.clear();
    patch_.triangles.clear();
    patch_.voxel_of_triangle.clear();
  }

  void run() {
    if (!has_boundary()) return;
    vertex_of_.fill(kNoVertex);
    for (int k = 0; k < 8; ++k) {
      for (int j = 0; j < 8; ++j) {
        for (int i = 0; i < 8; ++i) {
          if (block_.at(i, j, k) < iso_) continue;
          for (int axis = 0; axis < 3; ++axis) {
            for (int side = 0; side < 2; ++side) {
              const int d = side == 0 ? -1 : 1;
              if (block_.at(i + (axis == 0 ? d : 0), j + (axis == 1 ? d : 0), k + (axis == 2 ? d : 0)) >= iso_)
                continue;
              add_quad(i, j, k, axis, side);
            }
          }
        }
      }
    }
  }

 private:
  static constexpr std::uint32_t kNoVertex = 0xffffffffU;

  // Most bricks inside thick bone, or drilled empty, have no boundary: find that out in one pass.
  [[nodiscard]] bool has_boundary() const {
    bool bone = false, empty = false;
    for (int k = -1; k < 9; ++k) {
      for (int j = -1; j < 9; ++j) {
        for (int i = -1; i < 9; ++i) (block_.at(i, j, k) >= iso_ ? bone : empty) = true;
      }
    }
    return bone && empty;
  }

  const Sheets& sheets_at(int i, int j, int k) {
    CellSheets& cell = cells_[cell_index(i, j, k)];
    if (cell.ready) return cell.sheets;
    cell.ready = true;
    const unsigned mask = cell_mask(block_, i, j, k, iso_);
    cell.mask = static_cast<std::uint8_t>(mask);
    const unsigned doubled = tables().doubled[mask];
    unsigned flip = 0;
    for (unsigned f = 0; doubled != 0 && f < 6; ++f) {
      if ((doubled >> f & 1) == 0) continue;
      const int d = (f & 1) != 0 ? 1 : -1;
      const unsigned other =
          cell_mask(block_, i + (f / 2 == 0 ? d : 0), j + (f / 2 == 1 ? d : 0), k + (f / 2 == 2 ? d : 0), iso_);
      if ((tables().doubled[other] >> (f ^ 1U) & 1) != 0) flip |= 1U << f;
    }
    cell.flipped_faces = static_cast<std::uint8_t>(flip);
    cell.sheets = flip == 0 ? tables().sheets[mask] : sheets_of(mask, flip);
    return cell.sheets;
  }

  // The area vector of the polygon in which a sheet cuts the faces of its cell. It needs no neighbours, so both sides
  // of a wall one voxel thin get their own; density gradients would cancel there. False where that has no area.
  static bool sheet_normal(const CellSheets& cell, std::uint8_t sheet,
                           const std::array<std::array<float, 3>, 12>& crossing, std::array<float, 3>& area) {
    area = {0, 0, 0};
    for (unsigned f = 0; f < 6; ++f) {
      const auto& c = kFaces[f];
      std::array<std::size_t, 4> edge{};
      std::array<bool, 4> leaves_bone{};
      int count = 0;
      for (std::size_t n = 0; n < 4; ++n) {
        const bool here = (cell.mask >> c[n] & 1) != 0, next = (cell.mask >> c[(n + 1) % 4] & 1) != 0;
        if (here == next) continue;
        edge[static_cast<std::size_t>(count)] = static_cast<std::size_t>(edge_between(c[n], c[(n + 1) % 4]));
        leaves_bone[static_cast<std::size_t>(count++)] = here;
      }
      // Arcs as in sheets_of: a face with two crossings has one, an ambiguous face two.
      const auto add_arc = [&](std::size_t a, std::size_t b) {
        if (cell.sheets[edge[a]] != sheet) return;
        const bool counter_clockwise =
            ((f & 1) != 0) != (f / 2 == 1);  // the face's corners, seen from outside the cell
        const bool forward = leaves_bone[a] != counter_clockwise;
        const auto &p = crossing[edge[forward ? a : b]], &q = crossing[edge[forward ? b : a]];
        for (std::size_t x = 0; x < 3; ++x)
          area[x] += p[(x + 1) % 3] * q[(x + 2) % 3] - p[(x + 2) % 3] * q[(x + 1) % 3];
      };
      if (count == 2) add_arc(0, 1);
      if (count == 4) {
        const bool first_is_centre = ((cell.mask >> c[0] & 1) != 0) != ((cell.flipped_faces >> f & 1) != 0);
        add_arc(first_is_centre ? 3 : 0, first_is_centre ? 0 : 1);
        add_arc(first_is_centre ? 1 : 2, first_is_centre ? 2 : 3);
      }
    }
    const float n = std::sqrt(area[0] * area[0] + area[1] * area[1] + area[2] * area[2]);
    if (!(n > 1e-12F)) return false;
    for (float& x : area) x /= n;
    return true;
  }

  static std::size_t cell_index(int i, int j, int k) {
    return static_cast<std::size_t>(((k + 1) * kCells + j + 1) * kCells + i + 1);
  }

  std::uint32_t vertex_at(int i, int j, int k, int edge) {
    const Sheets& sheets = sheets_at(i, j, k);
    const std::uint8_t sheet = sheets[static_cast<std::size_t>(edge)];
    std::uint32_t& vertex = vertex_of_[cell_index(i, j, k) * 12 + sheet];
    if (vertex != kNoVertex) return vertex;
    std::array<std::array<float, 3>, 12> crossing;
    std::array<float, 3> at{0, 0, 0};
    float count = 0;
    for (std::size_t e = 0; e < 12; ++e) {
      if (sheets[e] != sheet) continue;
      const int a = kEdges[e].from, b = kEdges[e].to;
      const float va = block_.at(i + (a & 1), j + (a >> 1 & 1), k + (a >> 2));
      const float vb = block_.at(i + (b & 1), j + (b >> 1 & 1), k + (b >> 2));
      crossing[e] = {static_cast<float>(a & 1), static_cast<float>(a >> 1 & 1), static_cast<float>(a >> 2)};
      const float share = (iso_ - va) / (vb - va);  // edges begin at 0
      crossing[e][e / 4] = share;
      for (std::size_t x = 0; x < 3; ++x) at[x] += crossing[e][x];
      if (share < kFromEnds) at[e / 4] += kFromEnds - share;
      if (share > 1 - kFromEnds) at[e / 4] -= share - (1 - kFromEnds);
      count += 1;
    }
    for (float& x : at) x /= count;
    const CellSheets& of = cells_[cell_index(i, j, k)];
    std::array<float, 3> g;
    if (!sheet_normal(of, sheet, crossing, g)) {
      for (std::size_t e = 0; e < 12; ++e) {
        if (sheets[e] == sheet) crossing[e][e / 4] = std::clamp(crossing[e][e / 4], kFromEnds, 1 - kFromEnds);
      }
      if (!sheet_normal(of, sheet, crossing, g)) g = {0, 0, 1};
    }
    const Ijk cell{base_.i + i, base_.j + j, base_.k + k};
    const auto part = [](int x) { return static_cast<std::uint64_t>(x + 1); };
    const std::uint64_t key = ((part(cell.k) << 20 | part(cell.j)) << 20 | part(cell.i)) << 4 | sheet;
    vertex = static_cast<std::uint32_t>(patch_.vertices.size());
    patch_.vertices.push_back(
        {{static_cast<float>(cell.i) + at[0], static_cast<float>(cell.j) + at[1], static_cast<float>(cell.k) + at[2]},
         g,
         key});
    return vertex;
  }

  // The quad across the edge from bone voxel (i,j,k) to its empty neighbour at `side` of `axis`.
  void add_quad(int i, int j, int k, int axis, int side) {
    const std::array<int, 3> low{i - (axis == 0 && side == 0 ? 1 : 0), j - (axis == 1 && side == 0 ? 1 : 0),
                                 k - (axis == 2 && side == 0 ? 1 : 0)};
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    // Four cells around the edge, counter-clockwise seen from the high end of the axis.
    constexpr std::array<std::array<int, 2>, 4> kAround{{{-1, -1}, {0, -1}, {0, 0}, {-1, 0}}};
    std::array<std::uint32_t, 4> q{};
    for (std::size_t n = 0; n < 4; ++n) {
      std::array<int, 3> cell = low;
      cell[static_cast<std::size_t>(u)] += kAround[n][0];
      cell[static_cast<std::size_t>(v)] += kAround[n][1];
      // The edge as the cell sees it: its low end is the corner at (-du, -dv).
      int corner = 0;
      if (kAround[n][0] < 0) corner |= 1 << u;
      if (kAround[n][1] < 0) corner |= 1 << v;
      q[n] = vertex_at(cell[0], cell[1], cell[2], edge_between(corner, corner | 1 << axis));
    }
    if (side == 0) std::swap(q[1], q[3]);
    const auto distance2 = [&](std::uint32_t a, std::uint32_t b) {
      float sum = 0;
      for (std::size_t x = 0; x < 3; ++x) {
        const float d = patch_.vertices[a].index[x] - patch_.vertices[b].index[x];
        sum += d * d;
      }
      return sum;
    };
    // Split along the shorter diagonal: fewer slivers and folds.
    if (distance2(q[0], q[2]) <= distance2(q[1], q[3])) {
      patch_.triangles.push_back({q[0], q[1], q[2]});
      patch_.triangles.push_back({q[0], q[2], q[3]});
    } else {
      patch_.triangles.push_back({q[1], q[2], q[3]});
      patch_.triangles.push_back({q[1], q[3], q[0]});
    }
    const auto voxel = static_cast<std::uint16_t>(BrickGrid::offset_in_brick(i, j, k));
    patch_.voxel_of_triangle.insert(patch_.voxel_of_triangle.end(), 2, voxel);
  }

  float iso_;
  SurfacePatch& patch_;
  Ijk base_;
  Block block_{};
  std::array<CellSheets, static_cast<std::size_t>(kCells* kCells* kCells)> cells_{};
  std::array<std::uint32_t, static_cast<std::size_t>(kCells* kCells* kCells * 12)> vertex_of_;
};

}  // namespace

void extract_patch(const BrickGrid& bone, std::uint32_t brick, float iso, SurfacePatch& patch) {
  PatchBuilder(bone, brick, iso, patch).run();
}

SurfacePatch extract_patch(const BrickGrid& bone, std::uint32_t brick, float iso) {
  SurfacePatch patch;
  extract_patch(bone, brick, iso, patch);
  return patch;
}

BoneSurface join_patches(const BrickGrid& bone, std::span<const SurfacePatch> patches) {
  BoneSurface result;
  const Frame& frame = bone.frame();
  std::unordered_map<std::uint64_t, std::uint32_t> shared;  // vertices in cells on the border between bricks
  std::vector<std::uint32_t> global;
  std::vector<std::uint32_t> own;
  result.vertices_of_voxel.first.push_back(0);
  std::size_t vertices = 0, triangles = 0;
  for (const SurfacePatch& patch : patches) {
    vertices += patch.vertices.size();
    triangles += patch.triangles.size();
  }
  result.mesh.points_mm.reserve(vertices);
  result.mesh.normals.reserve(vertices);
  result.mesh.triangles.reserve(triangles);
  shared.reserve(vertices / 2);
  for (std::uint32_t b = 0; b < patches.size(); ++b) {
    const SurfacePatch& patch = patches[b];
    global.resize(patch.vertices.size());
    for (std::size_t v = 0; v < patch.vertices.size(); ++v) {
      const auto& vertex = patch.vertices[v];
      const auto fresh = static_cast<std::uint32_t>(result.mesh.points_mm.size());
      const std::uint64_t cell = vertex.key >> 4;  // holds i+1, j+1, k+1: 0 mod 8 is the border of a brick
      const bool border = (cell & 7) == 0 || (cell >> 20 & 7) == 0 || (cell >> 40 & 7) == 0;
      if (border) {
        const auto [it, inserted] = shared.try_emplace(vertex.key, fresh);
        global[v] = it->second;
        if (!inserted) continue;
      } else {
        global[v] = fresh;
      }
      const Vec3 p = frame.world_from_index({static_cast<double>(vertex.index[0]), static_cast<double>(vertex.index[1]),
                                             static_cast<double>(vertex.index[2])});
      const Vec3 n = normalized(frame.direction * Vec3{static_cast<double>(vertex.normal[0]),
                                                       static_cast<double>(vertex.normal[1]),
                                                       static_cast<double>(vertex.normal[2])});
      result.mesh.points_mm.push_back({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
      result.mesh.normals.push_back({static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)});
    }
    // A left-handed frame turns triangles over: turn them back.
    const bool mirrored = determinant(frame.direction) < 0;
    // A patch lists its triangles voxel by voxel: the vertices of a voxel are those of one run of triangles.
    for (std::size_t t = 0; t < patch.triangles.size();) {
      const std::uint16_t voxel = patch.voxel_of_triangle[t];
      own.clear();
      for (; t < patch.triangles.size() && patch.voxel_of_triangle[t] == voxel; ++t) {
        auto tri = patch.triangles[t];
        if (mirrored) std::swap(tri[1], tri[2]);
        result.mesh.triangles.push_back({global[tri[0]], global[tri[1]], global[tri[2]]});
        for (const auto v : tri) own.push_back(global[v]);
      }
      std::sort(own.begin(), own.end());
      own.erase(std::unique(own.begin(), own.end()), own.end());
      result.voxels.push_back(b * BrickGrid::kVoxels + voxel);
      result.vertices_of_voxel.items.insert(result.vertices_of_voxel.items.end(), own.begin(), own.end());
      result.vertices_of_voxel.first.push_back(static_cast<std::uint32_t>(result.vertices_of_voxel.items.size()));
    }
  }
  result.triangles_of_vertex = triangles_of_vertices(result.mesh);
  return result;
}

BoneSurface surface_nets(const BrickGrid& bone, float iso, const Context& context) {
  std::vector<SurfacePatch> patches(bone.brick_count());
  parallel_for(patches.size(), 64, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    for (std::size_t b = begin; b < end; ++b) extract_patch(bone, static_cast<std::uint32_t>(b), iso, patches[b]);
  });
  context.progress(0.6, "joining patches");
  return join_patches(bone, patches);
}

namespace {

// Volume and area of the surface at a density, in voxels; sums in the order of the bricks.
struct Extent {
  double volume = 0, area = 0;
};
Extent extent_at(const BrickGrid& bone, float iso, const Context& context) {
  std::vector<Extent> of_brick(bone.brick_count());
  parallel_for(of_brick.size(), 64, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    SurfacePatch patch;
    for (std::size_t b = begin; b < end; ++b) {
      extract_patch(bone, static_cast<std::uint32_t>(b), iso, patch);
      const auto at = [&](std::uint32_t v) { return from_floats(patch.vertices[v].index); };
      for (const auto& t : patch.triangles) {
        const Vec3 p = at(t[0]), q = at(t[1]), r = at(t[2]);
        of_brick[b].volume += dot(p, cross(q, r)) / 6;
        of_brick[b].area += length(cross(q - p, r - p)) / 2;
      }
    }
  });
  Extent sum;
  for (const Extent& e : of_brick) sum.volume += e.volume, sum.area += e.area;
  return sum;
}

}  // namespace

VolumeSurface surface_of_volume(const BrickGrid& bone, const Context& context) {
  constexpr double kEnough = 1e-4, kGood = 1e-3;  // of the volume
  constexpr float kHalf = 0.5F, kMin = 0.05F;
  const double wanted = bone.sum(), voxel_mm3 = bone.frame().voxel_volume_mm3(), h = portable::cbrt(voxel_mm3);
  float densest = 0;
  for (std::uint32_t b = 0; b < bone.brick_count(); ++b) {
    const float* const v = bone.values_of_brick(b);
    densest = std::max(densest, *std::max_element(v, v + BrickGrid::kVoxels));
  }
  VolumeSurface result;
  result.bone_mm3 = wanted * voxel_mm3;
  if (!(densest > 0)) return result;

  // Volume falls as density rises: from one half by the surface's own area, then between the nearest from above and
  // from below (the Illinois rule). Where it jumps, as at a new speck, the nearest that was met stands.
  struct Point {
    float iso;
    double off;
  };
  const float low = std::min(kMin, densest / 2), high = 1 - kMin;
  double best_off = 0, area_at_half = 0;
  const auto look = [&](float iso) -> Point {
    const Extent e = extent_at(bone, iso, context);
    if (iso == kHalf) area_at_half = e.area;
    const double off = e.volume - wanted;
    if (iso == kHalf || std::abs(off) < std::abs(best_off)) best_off = off, result.iso = iso;
    return {iso, off};
  };
  const Point half = look(kHalf);
  const double step = 1.5 * half.off / std::max(area_at_half, 1e-9);
  Point a = half, b = half;
  for (float reach = static_cast<float>(std::copysign(std::clamp(std::abs(step), 1e-4, 0.5), step));
       std::abs(half.off) > kEnough * wanted; reach *= 3) {
    b = look(std::clamp(kHalf + reach, low, high));
    if ((b.off > 0) != (half.off > 0) || b.iso == low || b.iso == high) break;
    a = b;
  }
  for (int n = 0; n < 12 && (a.off > 0) != (b.off > 0) && std::abs(best_off) > kEnough * wanted; ++n) {
    const Point c = look(static_cast<float>(a.iso + (b.iso - a.iso) * (a.off / (a.off - b.off))));
    if ((c.off > 0) == (b.off > 0)) {
      a.off /= 2;
    } else {
      a = b;
    }
    b = c;
  }
  result.mesh = surface_nets(bone, result.iso, context).mesh;

  // Crumbs of a few voxels have more in them than any such surface encloses: the rest by size.
  auto& points = result.mesh.points_mm;
  result.surface_mm3 = enclosed_volume_mm3(result.mesh);
  if (std::abs(result.surface_mm3 - result.bone_mm3) > kGood * result.bone_mm3 && result.surface_mm3 > 0) {
    BoxMm box;
    for (const auto& p : points) box.include(from_floats(p));
    const Vec3 centre = (box.lo + box.hi) * 0.5;
    const double scale = portable::cbrt(result.bone_mm3 / result.surface_mm3);
    double farthest = 0;
    for (const auto& p : points) farthest = std::max(farthest, length(from_floats(p) - centre));
    if (std::abs(scale - 1) * farthest <= 0.5 * h) {
      for (auto& p : points) p = to_floats(centre + (from_floats(p) - centre) * scale);
      result.scale = scale;
      result.surface_mm3 = enclosed_volume_mm3(result.mesh);
    }
  }
  const double area = area_mm2(result.mesh);
  result.moved_mm = area > 0 ? (result.surface_mm3 - (half.off + wanted) * voxel_mm3) / area : 0;
  return result;
}

}  // namespace osteo::inline geometry
