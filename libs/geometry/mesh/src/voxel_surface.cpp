// The thesis' surface: voxels are vertices, neighbouring triples are triangles.
#include <algorithm>
#include <array>
#include <cmath>

#include "index_rows.h"
#include "osteo/core/base/parallel.h"
#include "osteo/geometry/grid/brick_places.h"
#include "osteo/geometry/mesh/bone_surface.h"

namespace osteo::inline geometry {

namespace {

constexpr std::array<int, 3> corner(int c) {
  return {c & 1, c >> 1 & 1, c >> 2};
}

struct Candidate {
  std::array<std::uint8_t, 3> c;      // corners, ascending
  std::array<float, 3> normal;        // right-hand rule, not unit
  std::uint8_t above = 0, below = 0;  // corners of the cell strictly on either side
  int face = -1;                      // the cell face that holds all three, or -1
};

// All 56 triples of a cell's corners. Those on a face keep only one of the two ways to split it, so that no two
// triangles overlap.
std::vector<Candidate> make_candidates() {
  std::vector<Candidate> out;
  for (int a = 0; a < 8; ++a) {
    for (int b = a + 1; b < 8; ++b) {
      for (int c = b + 1; c < 8; ++c) {
        Candidate t{
            {static_cast<std::uint8_t>(a), static_cast<std::uint8_t>(b), static_cast<std::uint8_t>(c)}, {}, 0, 0, -1};
        const auto p = corner(a), q = corner(b), r = corner(c);
        std::array<int, 3> u{}, v{};
        for (std::size_t x = 0; x < 3; ++x) {
          u[x] = q[x] - p[x];
          v[x] = r[x] - p[x];
        }
        const std::array<int, 3> n{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
        for (std::size_t x = 0; x < 3; ++x) t.normal[x] = static_cast<float>(n[x]);
        for (int d = 0; d < 8; ++d) {
          const auto s = corner(d);
          int side = 0;
          for (std::size_t x = 0; x < 3; ++x) side += n[x] * (s[x] - p[x]);
          if (side > 0) t.above |= static_cast<std::uint8_t>(1U << d);
          if (side < 0) t.below |= static_cast<std::uint8_t>(1U << d);
        }
        for (int f = 0; f < 6; ++f) {
          const auto axis = static_cast<std::size_t>(f / 2);
          if (p[axis] == (f & 1) && q[axis] == (f & 1) && r[axis] == (f & 1)) t.face = f;
        }
        out.push_back(t);
      }
    }
  }
  return out;
}

// The voxels of a brick and of two layers around it.
class Surroundings {
 public:
  Surroundings(const BrickGrid& bone, float iso) : bone_(bone), iso_(iso) {}
  void load(std::uint32_t brick) {
    origin_ = bone_.brick_coordinate(brick);
    bone_.read_block({origin_.i * 8 - kPad, origin_.j * 8 - kPad, origin_.k * 8 - kPad}, {kN, kN, kN}, values_.data());
  }
  // Places count from the brick's first voxel.
  [[nodiscard]] float at(int i, int j, int k) const {
    return values_[static_cast<std::size_t>(((k + kPad) * kN + j + kPad) * kN + i + kPad)];
  }
  [[nodiscard]] VoxelKey key(int i, int j, int k) const {
    return bone_.find(origin_.i * 8 + i, origin_.j * 8 + j, origin_.k * 8 + k);
  }
  [[nodiscard]] bool on_surface(int i, int j, int k) const {
    if (at(i, j, k) < iso_) return false;
    for (int n = 0; n < 27; ++n) {
      if (at(i + n % 3 - 1, j + n / 3 % 3 - 1, k + n / 9 - 1) < iso_) return true;
    }
    return false;
  }
  // Against the gradient, over the 26 neighbours: smooth enough to shade voxels with.
  [[nodiscard]] std::array<float, 3> outward(int i, int j, int k) const {
    std::array<float, 3> g{0, 0, 0};
    for (int m = 0; m < 27; ++m) {
      const int di = m % 3 - 1, dj = m / 3 % 3 - 1, dk = m / 9 - 1;
      const float value = at(i + di, j + dj, k + dk);
      g[0] -= static_cast<float>(di) * value;
      g[1] -= static_cast<float>(dj) * value;
      g[2] -= static_cast<float>(dk) * value;
    }
    return g;
  }
  // A bit for each corner of a cell that is bone.
  [[nodiscard]] unsigned corners_within(int i, int j, int k) const {
    unsigned mask = 0;
    for (int c = 0; c < 8; ++c)
      mask |= static_cast<unsigned>(at(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)) >= iso_) << c;
    return mask;
  }

 private:
  static constexpr int kPad = 2, kN = BrickGrid::kEdge + 2 * kPad;
  const BrickGrid& bone_;
  float iso_;
  Ijk origin_{};
  std::array<float, static_cast<std::size_t>(kN* kN* kN)> values_;
};

// Calls `take(brick, block)` for each brick; in threads, each brick in one.
template <typename Take>
void each_brick(const BrickGrid& bone, float iso, const Context& context, const Take& take) {
  parallel_for(bone.brick_count(), 64, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    Surroundings block(bone, iso);
    for (std::size_t n = begin; n < end; ++n) {
      block.load(static_cast<std::uint32_t>(n));
      take(n, block);
    }
  });
}

// The voxels on the surface, in key order; each becomes a vertex. Returns which, by key.
std::vector<std::uint32_t> add_vertices(const BrickGrid& bone, float iso, const Context& context, BoneSurface& result) {
  std::vector<std::vector<std::pair<VoxelKey, std::array<float, 3>>>> found(bone.brick_count());
  each_brick(bone, iso, context, [&](std::size_t n, const Surroundings& block) {
    for (std::uint32_t v = 0; v < BrickGrid::kVoxels; ++v) {
      const int i = static_cast<int>(v & 7), j = static_cast<int>(v >> 3 & 7), k = static_cast<int>(v >> 6);
      if (block.on_surface(i, j, k))
        found[n].push_back({static_cast<VoxelKey>(n) * BrickGrid::kVoxels + v, block.outward(i, j, k)});
    }
  });
  std::vector<std::uint32_t> vertex_of(bone.brick_count() * BrickGrid::kVoxels, BrickGrid::kNone);
  for (const auto& list : found) {
    for (const auto& [key, g] : list) {
      vertex_of[key] = static_cast<std::uint32_t>(result.voxels.size());
      result.voxels.push_back(key);
      const Vec3 p = place_of_voxel_mm(bone, key);
      const Vec3 n = normalized(bone.frame().direction *
                                Vec3{static_cast<double>(g[0]), static_cast<double>(g[1]), static_cast<double>(g[2])});
      result.mesh.points_mm.push_back({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
      result.mesh.normals.push_back({static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)});
    }
  }
  return vertex_of;
}

// Which corners hide a triple of corners from either side; both not 0 where it is not seen, or another cell's.
struct Hidden {
  unsigned above, below;
};

// A triple on a face of the cell is judged, on its outer side, by the corners of the cell beyond, and belongs to the
// cell that has it on its low side.
Hidden hidden_on_face(const Surroundings& block, const Candidate& t, unsigned mask, int i, int j, int k) {
  constexpr Hidden kNot{1, 1};
  if ((t.face & 1) != 0) return kNot;  // the cell beyond has it on its low face
  const int axis = t.face / 2;
  const unsigned beyond =
      block.corners_within(i - (axis == 0 ? 1 : 0), j - (axis == 1 ? 1 : 0), k - (axis == 2 ? 1 : 0));
  // Of the cell beyond, the corners off the shared face are those at its low side.
  unsigned low_side = 0;
  for (int c = 0; c < 8; ++c) low_side |= static_cast<unsigned>(corner(c)[static_cast<std::size_t>(axis)] == 0) << c;
  Hidden h{t.above & mask, t.below & mask};
  (t.above != 0 ? h.below : h.above) = beyond & low_side;
  // A full square has two ways to be split: keep the one along its first corner.
  const std::array<unsigned, 3> squares{1U << 0 | 1U << 2 | 1U << 4 | 1U << 6, 1U << 0 | 1U << 1 | 1U << 4 | 1U << 5,
                                        1U << 0 | 1U << 1 | 1U << 2 | 1U << 3};
  const unsigned square = squares[static_cast<std::size_t>(axis)];
  const unsigned last = axis == 0 ? 6U : axis == 1 ? 5U : 3U;
  if ((mask & square) == square && (t.c[0] != 0 || t.c[2] != last)) return kNot;
  return h;
}

// Of a sheet one voxel thin: it faces the way the densities fall.
bool faces_up(const Surroundings& block, const Candidate& t, int i, int j, int k) {
  float along = 0;
  for (int c = 0; c < 8; ++c) {
    const auto p = corner(c);
    const float value = block.at(i + p[0], j + p[1], k + p[2]);
    if ((t.above >> c & 1) != 0) along -= value;
    if ((t.below >> c & 1) != 0) along += value;
  }
  return along >= 0;
}

using Triangle = std::array<std::uint32_t, 3>;

// Those of a cell, which has bone at the corners of `mask`. A triple is seen from a side when every corner of the cell
// on that side is empty.
void add_triangles_of_cell(const Surroundings& block, unsigned mask, const std::array<int, 3>& cell,
                           const std::vector<std::uint32_t>& vertex_of, bool mirrored, std::vector<Triangle>& out) {
  static const std::vector<Candidate> candidates = make_candidates();
  const auto [i, j, k] = cell;
  for (const Candidate& t : candidates) {
    if ((mask >> t.c[0] & 1) == 0 || (mask >> t.c[1] & 1) == 0 || (mask >> t.c[2] & 1) == 0) continue;
    const auto first = corner(t.c[0]);
    const std::array<int, 3> owner{i + first[0], j + first[1], k + first[2]};
    if (std::any_of(owner.begin(), owner.end(), [](int x) { return x < 0 || x > 7; })) continue;
    const Hidden hidden =
        t.face >= 0 ? hidden_on_face(block, t, mask, i, j, k) : Hidden{t.above & mask, t.below & mask};
    const bool seen_above = hidden.above == 0, seen_below = hidden.below == 0;
    if (!seen_above && !seen_below) continue;
    Triangle tri{};
    bool complete = true;
    for (std::size_t x = 0; x < 3; ++x) {
      const auto p = corner(t.c[x]);
      const VoxelKey key = block.key(i + p[0], j + p[1], k + p[2]);
      complete = complete && key != BrickGrid::kNone && vertex_of[key] != BrickGrid::kNone;
      if (!complete) break;
      tri[x] = vertex_of[key];
    }
    if (!complete) continue;
    const bool up = seen_above && seen_below ? faces_up(block, t, i, j, k) : seen_above;
    if (up == mirrored) std::swap(tri[1], tri[2]);
    out.push_back(tri);
  }
}

void add_triangles(const BrickGrid& bone, float iso, const std::vector<std::uint32_t>& vertex_of,
                   const Context& context, BoneSurface& result) {
  const bool mirrored = determinant(bone.frame().direction) < 0;
  std::vector<std::vector<Triangle>> triangles(bone.brick_count());
  each_brick(bone, iso, context, [&](std::size_t n, const Surroundings& block) {
    // Each triple is emitted by the brick of its first corner (ascending corner order is ascending z, y, x).
    for (int k = -1; k < 8; ++k) {
      for (int j = -1; j < 8; ++j) {
        for (int i = -1; i < 8; ++i) {
          const unsigned mask = block.corners_within(i, j, k);
          if (mask == 0 || (mask & (mask - 1)) == 0) continue;
          add_triangles_of_cell(block, mask, {i, j, k}, vertex_of, mirrored, triangles[n]);
        }
      }
    }
  });
  for (const auto& list : triangles)
    result.mesh.triangles.insert(result.mesh.triangles.end(), list.begin(), list.end());
}

}  // namespace

BoneSurface voxel_surface(const BrickGrid& bone, float iso, const Context& context) {
  BoneSurface result;
  const std::vector<std::uint32_t> vertex_of = add_vertices(bone, iso, context, result);
  context.progress(0.4, "triangles");
  add_triangles(bone, iso, vertex_of, context, result);
  result.vertices_of_voxel.first.resize(result.voxels.size() + 1);
  result.vertices_of_voxel.items.resize(result.voxels.size());
  for (std::uint32_t v = 0; v < result.voxels.size(); ++v) {
    result.vertices_of_voxel.first[v + 1] = v + 1;
    result.vertices_of_voxel.items[v] = v;
  }
  result.triangles_of_vertex = triangles_of_vertices(result.mesh);
  return result;
}

}  // namespace osteo::inline geometry
