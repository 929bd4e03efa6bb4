// Blocks of voxels as tetrahedral meshes.
#pragma once
#include <cmath>
#include <functional>
#include <map>

#include "osteo/geometry/tets/lattice_tets.h"
#include "osteo/simulation/tissue/fem.h"

namespace osteo::test {

/// The voxels of nx x ny x nz (edge h mm, the first corner at the origin) whose middle f accepts, as grid_tets() makes
/// them.
struct Block {
  std::vector<Vec3> points;
  std::vector<std::array<std::uint32_t, 4>> tets;
};
inline Block block(
    int nx, int ny, int nz, double h, const std::function<bool(Vec3)>& f = [](Vec3) { return true; }) {
  Block b;
  std::map<std::array<int, 3>, std::uint32_t> index;
  const auto point = [&](int i, int j, int k) {
    const auto [it, fresh] = index.try_emplace({k, j, i}, static_cast<std::uint32_t>(b.points.size()));
    if (fresh) b.points.push_back({i * h, j * h, k * h});
    return it->second;
  };
  constexpr int kSplit[2][5][4] = {{{0, 3, 5, 6}, {1, 0, 3, 5}, {2, 3, 0, 6}, {4, 5, 6, 0}, {7, 6, 5, 3}},
                                   {{1, 2, 4, 7}, {0, 1, 2, 4}, {3, 2, 1, 7}, {5, 4, 7, 1}, {6, 7, 4, 2}}};
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) {
        if (!f({(i + 0.5) * h, (j + 0.5) * h, (k + 0.5) * h})) continue;
        for (const auto& t : kSplit[(i + j + k) & 1]) {
          std::array<std::uint32_t, 4> tet{};
          Vec3 x[4];
          for (std::size_t c = 0; c < 4; ++c) {
            tet[c] = point(i + (t[c] & 1), j + (t[c] >> 1 & 1), k + (t[c] >> 2));
            x[c] = b.points[tet[c]];
          }
          if (dot(x[1] - x[0], cross(x[2] - x[0], x[3] - x[0])) < 0) std::swap(tet[2], tet[3]);
          b.tets.push_back(tet);
        }
      }
  return b;
}

}  // namespace osteo::test
