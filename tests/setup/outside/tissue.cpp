// Component tissue: a bar is stretched by an eighth; the work that takes is known: modulus x strain^2 / 2 x volume.
#include <cmath>
#include <cstdio>

#include "osteo/geometry/tets/lattice_tets.h"
#include "osteo/simulation/tissue/fem.h"

int main() {
  osteo::VoxelBits bar(osteo::Frame{.dims = {4, 4, 8}});  // cubes of 1 mm
  for (int k = 0; k < 8; ++k)
    for (int j = 0; j < 4; ++j) bar.words[bar.row(j, k)] = 0b1111;
  const osteo::TetMesh mesh = osteo::grid_tets(bar);
  const auto points = osteo::points_of(mesh);
  const osteo::FemBody body(points, osteo::tets_of(mesh), {{.young_mpa = 0.1, .poisson = 0}}, osteo::ElasticLaw::linear,
                            osteo::TetOrder::t4);
  osteo::TissueLoad load;
  for (std::uint32_t p = 0; p < points.size(); ++p) {
    if (points[p].z < 0) load.fixed.push_back(p);
    if (points[p].z > 7) load.moved.push_back({.point = p, .held = 0b111, .by_mm = {0, 0, 1}});
  }
  const double work_mj = osteo::statics(body, load).energy_mj;
  std::printf("%.6f mJ\n", work_mj);
  return std::abs(work_mj - 0.1 / 64 / 2 * 128) < 1e-9 ? 0 : 1;
}
