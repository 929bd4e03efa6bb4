// Private to libs/geometry/tets.
#pragma once
#include <cstdint>
#include <vector>

#include "osteo/core/data/tet_mesh.h"

namespace osteo::inline geometry {

/// The tetrahedra of each point, in their order: those of point p are tets[first[p]] to before tets[first[p + 1]].
struct PointTets {
  std::vector<std::uint32_t> first, tets;

  explicit PointTets(const TetMesh& mesh) : first(mesh.points_mm.size() + 1, 0), tets(mesh.tets.size() * 4) {
    for (const auto& t : mesh.tets) {
      for (const auto v : t) ++first[v + 1];
    }
    for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
    std::vector<std::uint32_t> fill(first.begin(), first.end() - 1);
    for (std::uint32_t t = 0; t < mesh.tets.size(); ++t) {
      for (const auto v : mesh.tets[t]) tets[fill[v]++] = t;
    }
  }
};

}  // namespace osteo::inline geometry
