#include "index_rows.h"

namespace osteo {

IndexRows rows_from_pairs(std::size_t rows, const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs) {
  IndexRows result;
  result.first.assign(rows + 1, 0);
  for (const auto& p : pairs) ++result.first[p.first + 1];
  for (std::size_t r = 0; r < rows; ++r) result.first[r + 1] += result.first[r];
  result.items.resize(pairs.size());
  std::vector<std::uint32_t> fill(result.first.begin(), result.first.end() - 1);
  for (const auto& p : pairs) result.items[fill[p.first]++] = p.second;
  return result;
}

IndexRows triangles_of_vertices(const TriMesh& mesh) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  pairs.reserve(mesh.triangles.size() * 3);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const auto v : mesh.triangles[t]) pairs.emplace_back(v, t);
  }
  return rows_from_pairs(mesh.points_mm.size(), pairs);
}

}  // namespace osteo
