// Triangles in double precision, however imperfect, and what it takes to make sense of them.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/tri_mesh.h"

namespace osteo::inline geometry {

/// May be open, self-intersecting, degenerate, wrongly oriented, in several bodies.
struct TriangleSoup {
  std::vector<Vec3> points_mm;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Error corrupt when a coordinate is not finite or an index has no point; the message names the first.
void require_sound(const TriangleSoup& soup);
/// Errors as require_sound.
[[nodiscard]] TriangleSoup soup_of(const TriMesh& mesh);
/// A box by its lowest and highest corner; lowest > highest when it holds nothing.
struct BoxMm {
  Vec3 lo{1e300, 1e300, 1e300}, hi{-1e300, -1e300, -1e300};
  void include(Vec3 p) {
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = p[a] < lo[a] ? p[a] : lo[a];
      hi[a] = p[a] > hi[a] ? p[a] : hi[a];
    }
  }
};
/// Of the points that triangles use.
[[nodiscard]] BoxMm bounds_of(const TriangleSoup& soup);

/// Without the points that no triangle uses; the others in order of first use.
[[nodiscard]] TriangleSoup compacted(const TriangleSoup& soup);
/// Rounds coordinates to float; unused points are left out.
[[nodiscard]] TriMesh mesh_of(const TriangleSoup& soup);

/// A directed edge that the triangles use `count` times more often in this direction than in the other.
struct OpenEdge {
  std::uint32_t from = 0, to = 0;
  int count = 1;
};

/// Every edge is used as often one way as the other, by index (equal points with two indices count as two).
/// O(triangles): compares fingerprints of 64 bits, so a surface that is not closed passes with probability 2^-64.
[[nodiscard]] bool is_closed(const TriangleSoup& soup);

/// The same triangles over points of which no two are equal; the others stay, unused. O(points).
[[nodiscard]] TriangleSoup welded(const TriangleSoup& soup);

/// The same surface with its topology made as good as it can be without moving a point.
struct Ordered {
  TriangleSoup soup;
  std::vector<std::uint32_t> source;  ///< triangle -> triangle of the input
  std::uint64_t welded_points = 0;    ///< points that had the coordinates of another
  std::uint64_t degenerate = 0;       ///< triangles left out: two corners at one point
  std::uint64_t duplicates = 0;       ///< triangles left out: the same three points as another, either way round
  std::uint64_t flipped = 0;          ///< triangles turned round to agree with their neighbours
  std::vector<OpenEdge> open;         ///< empty: closed, the winding number is whole everywhere
};
/// Welds points with equal coordinates, drops degenerate and duplicate triangles, turns triangles round so that
/// neighbours across edges of two agree (each patch keeps the direction that most of its area had). O(n log n); same
/// result whatever the threads.
[[nodiscard]] Ordered ordered(const TriangleSoup& soup, const Context& context = {});

}  // namespace osteo::inline geometry
