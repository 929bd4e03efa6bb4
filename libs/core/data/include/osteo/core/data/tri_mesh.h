// An indexed triangle surface in LPS millimetres.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "osteo/core/data/vec.h"

namespace osteo {

struct TriMesh {
  std::vector<std::array<float, 3>> points_mm;
  std::vector<std::array<float, 3>> normals;            ///< unit, outward; empty or one a point
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise seen from outside
};
using Surface = std::shared_ptr<const TriMesh>;

/// What a closed surface must satisfy, counted.
struct MeshCheck {
  std::uint64_t open_edges = 0;          ///< edges used by one triangle
  std::uint64_t nonmanifold_edges = 0;   ///< edges used by more than two
  std::uint64_t misoriented_edges = 0;   ///< edges that two triangles use in the same direction
  std::uint64_t nonmanifold_points = 0;  ///< points whose triangles form more than one fan
  std::uint64_t degenerate = 0;          ///< triangles that name a point twice
  [[nodiscard]] bool watertight() const { return open_edges == 0 && misoriented_edges == 0 && degenerate == 0; }
  [[nodiscard]] bool manifold() const { return nonmanifold_edges == 0 && nonmanifold_points == 0; }
};
/// O(n log n).
[[nodiscard]] MeshCheck check(const TriMesh& mesh);

/// Signed volume by the divergence theorem; positive when closed and oriented outward.
[[nodiscard]] double enclosed_volume_mm3(const TriMesh& mesh);
[[nodiscard]] double area_mm2(const TriMesh& mesh);

}  // namespace osteo
