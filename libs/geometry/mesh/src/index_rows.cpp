#include "index_rows.h"

namespace osteo::inline geometry {

IndexRows triangles_of_vertices(const TriMesh& mesh) {
  IndexRows rows;
  rows.first.assign(mesh.points_mm.size() + 1, 0);
  for (const auto& t : mesh.triangles) {
    for (const auto v : t) ++rows.first[v + 1];
  }
  for (std::size_t r = 0; r < mesh.points_mm.size(); ++r) rows.first[r + 1] += rows.first[r];
  rows.items.resize(mesh.triangles.size() * 3);
  std::vector<std::uint32_t> fill(rows.first.begin(), rows.first.end() - 1);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const auto v : mesh.triangles[t]) rows.items[fill[v]++] = t;
  }
  return rows;
}

}  // namespace osteo::inline geometry
