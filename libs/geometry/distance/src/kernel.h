// The inner loops over triangles and boxes, compiled for several instruction sets. Private to libs/geometry/distance.
//
// Everything in single precision only decides what may be left out, with a margin for its own rounding; what is kept is
// measured by `measure` in double precision, whose operations are the same in every instruction set. So results are
// equal. Lengths are in units of the tree (mm times a power of two), relative to the tree's centre.
#pragma once
#include <cstdint>

namespace osteo::inline geometry::distance {

/// A triangle for culling: corner A (opposite the longest edge), unit edges u = AB, v = AC, their lengths and that of
/// BC. `face` = 1/(1 - (u.v)^2), or NaN when the triangle is too thin for a face in single precision. `slack` bounds by
/// how much single precision may overestimate the distance.
struct alignas(64) TriangleRecord {
  float ax, ay, az, ux, uy, uz, vx, vy, vz, u_length, v_length, w_length, inverse_w, cosine, face, slack;
};

/// A triangle for measuring: corners, unit normal (NaN when it has none), 1/length^2 of AB, AC, BC (0 when without
/// length).
struct alignas(128) ExactTriangle {
  double a[3], b[3], c[3], n[3], inverse_ab, inverse_ac, inverse_bc;
  double turned;  ///< 0, 1, 2: A is the first, second, third corner as given
};

/// Sixteen boxes, rounded outward.
struct alignas(64) BoxGroup {
  float lo[3][16], hi[3][16];
};

/// The tree as the loops see it. Triangle t is in pack t / 16; pack p has box p % 16 of boxes[0][p / 16]; group g of a
/// level has box g % 16 of group g / 16 of the next. The last level is one group. Records are padded to whole packs.
struct TreeView {
  static constexpr int kMaxLevels = 8;
  const TriangleRecord* records;
  const ExactTriangle* exact;
  const BoxGroup* boxes[kMaxLevels];
  int levels;
  std::uint32_t triangles;
  float margin;  ///< rounding of any single-precision distance within 128 units of the centre, besides each triangle's
                 ///< slack
};

/// What is nearest to `centre`, and so bounds the distance of all points near it: distance and unit direction from
/// there to it.
struct Pivot {
  float distance;
  float direction[3];
};

struct FilterTask {
  const TriangleRecord* records;
  const std::uint32_t* ids;  ///< readable up to the next multiple of 16
  int count;
  float centre[8][3];
  unsigned wanted;  ///< bit k: child k
  float half[3];    ///< half extents of a child's points
  float margin;
  float reach;            ///< points farther than this from everything do not matter
  float* scratch;         ///< 20 * (count rounded up to 16) floats
  std::uint32_t* out[8];  ///< room for count rounded up to 16
  int out_count[8];
  float lowest[8];  ///< lower bound on the distance at the child's centre
};

/// (d2, triangle), the smaller; ties go to the smaller triangle.
struct Nearest {
  double d2;
  std::uint32_t triangle;
};

struct Kernel {
  /// For each wanted child keeps the triangles that can be nearest to any of its points.
  void (*filter)(FilterTask&);
  /// d2[i] of voxel i to triangle ids[i]. A voxel is x + 16 y + 256 z; its centre is origin + step * (x, y, z).
  /// Readable and writable up to the next multiple of 8.
  void (*measure_voxels)(const ExactTriangle*, const std::uint32_t* ids, const std::uint32_t* voxels, int count,
                         const double origin[3], const double step[3], double* d2);
  /// Points to all of a list of triangles: `best` is brought down where a triangle is nearer.
  void (*measure_block)(const ExactTriangle*, const std::uint32_t* ids, int count, const double* px, const double* py,
                        const double* pz, int points, double* best_d2, std::uint32_t* best_id);
  /// The triangle nearest to a point. `hint` is any triangle; a near one makes it fast. Only triangles nearer than
  /// sqrt(limit_d2); else triangle = 0xffffffff. Allocates nothing.
  Nearest (*closest)(const TreeView&, const double point[3], std::uint32_t hint, double limit_d2);
  /// Packs that may hold the nearest triangle of some point of the box centre +- half, given a pivot.
  /// Points farther than `reach` from everything do not matter. `margin`: rounding there.
  int (*collect)(const TreeView&, const float centre[3], const float half[3], const Pivot&, float reach, float margin,
                 std::uint32_t* packs);
};

extern const Kernel kScalar;
#if defined(__x86_64__)
extern const Kernel kAvx2;
extern const Kernel kAvx512;
#endif

/// The one for simd().
const Kernel& kernel();

}  // namespace osteo::inline geometry::distance
