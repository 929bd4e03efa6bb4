// How good a tetrahedral mesh is.
#pragma once
#include <array>
#include <cstdint>
#include <string>

#include "osteo/core/base/context.h"
#include "osteo/core/data/tet_mesh.h"

namespace osteo::inline geometry {

struct TetQuality {
  std::uint64_t points = 0, tets = 0;
  std::uint64_t unused_points = 0;
  std::uint64_t inverted = 0;  ///< volume <= 0
  double volume_mm3 = 0;
  double min_volume_mm3 = 0, max_volume_mm3 = 0;
  double min_dihedral_deg = 0, max_dihedral_deg = 0;
  std::array<std::uint64_t, 18> dihedral_histogram{};  ///< of all six angles, 10 degrees each
  double min_aspect = 0, mean_aspect = 0;              ///< 3 * inscribed / circumscribed radius: 1 regular, 0 flat
  std::uint64_t faces_of_three_or_more = 0;            ///< 0 in a conforming mesh
  std::uint64_t boundary_triangles = 0;
  bool boundary_closed = false, boundary_manifold = false;
  std::uint64_t buried_triangles =
      0;  ///< boundary triangles with other tetrahedra right before them (of up to 50,000 tried)
  [[nodiscard]] bool conforming() const { return faces_of_three_or_more == 0 && buried_triangles == 0; }
  double min_edge_mm = 0, max_edge_mm = 0;
};

/// O(tets log).
[[nodiscard]] TetQuality tet_quality(const TetMesh& mesh, const Context& context = {});
/// For provenance and --json.
void report_quality(const TetQuality& q, const Context& context);

/// Smallest and largest of the six dihedral angles, in degrees.
struct Dihedrals {
  double min_deg, max_deg;
};
[[nodiscard]] Dihedrals dihedral_angles(Vec3 a, Vec3 b, Vec3 c, Vec3 d, double* all_deg = nullptr);

}  // namespace osteo::inline geometry
