// What a surface is like: counts, closedness, bodies, shapes of triangles.
#pragma once
#include <array>
#include <cstdint>

#include "osteo/core/base/context.h"
#include "osteo/geometry/mesh/soup.h"

namespace osteo::inline geometry {

struct MeshSummary {
  std::uint64_t points = 0, triangles = 0;
  std::uint64_t non_finite_points = 0, unused_points = 0,
                equal_points = 0;       ///< equal: points that have another's coordinates
  std::uint64_t bad_indices = 0;        ///< triangles that name a point that is not there
  std::uint64_t degenerate = 0;         ///< two corners at one point
  std::uint64_t duplicates = 0;         ///< the same three points as an earlier one
  std::uint64_t zero_area = 0;          ///< area below 1e-12 of the longest edge squared, degenerate ones not counted
  std::uint64_t needles = 0, caps = 0;  ///< smallest angle below 1 degree; largest above 179
  std::uint64_t open_edges = 0, nonmanifold_edges = 0, nonmanifold_points = 0, disagreeing_edges = 0;
  std::uint64_t holes = 0;          ///< closed runs of open edges
  std::uint64_t bodies = 0;         ///< connected by shared points
  std::uint64_t inward_bodies = 0;  ///< closed ones with negative volume: cavities, or inside out
  std::int64_t euler = 0;           ///< points - edges + triangles, after welding equal points
  bool watertight = false, manifold = false;
  double area_mm2 = 0, volume_mm3 = 0;  ///< volume: only when watertight
  Vec3 lo_mm, hi_mm;
  double min_edge_mm = 0, max_edge_mm = 0, mean_edge_mm = 0;
  std::array<std::uint64_t, 12> min_angle_histogram{};  ///< triangles by smallest angle, 5 degrees each
};
/// Never throws for a bad surface: that is what it is for. Counts are after welding points with equal coordinates. O(n
/// log n).
[[nodiscard]] MeshSummary summarize(const TriMesh& mesh, const Context& context = {});

struct RepairOptions {
  double weld_mm = 0;            ///< points nearer than this become one; 0: equal coordinates only
  bool drop_unsound = true;      ///< points that are not finite and what names them
  double min_body_area_mm2 = 0;  ///< smaller bodies are dropped
  bool keep_largest = false;     ///< only the body of most area
  bool turn_bodies = true;       ///< closed bodies that face inward and are no cavities are turned round
};
struct RepairReport {
  std::uint64_t unsound = 0, welded = 0, degenerate = 0, duplicates = 0, flipped = 0, turned_bodies = 0,
                dropped_bodies = 0;
};
/// What can be mended without new triangles: unsound, degenerate and duplicate triangles out, points welded, neighbours
/// made to agree; closed bodies face outward, those inside another inward when they did. Errors: failed when nothing is
/// left.
[[nodiscard]] TriangleSoup repaired(const TriMesh& mesh, const RepairOptions& options, RepairReport& report,
                                    const Context& context = {});

}  // namespace osteo::inline geometry
