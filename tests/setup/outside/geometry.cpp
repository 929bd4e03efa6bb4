// Component geometry: what lies near and inside a surface, and tetrahedra of it.
#include <cmath>
#include <cstdio>

#include "osteo/geometry/distance/triangle_tree.h"
#include "osteo/geometry/distance/voxelize.h"
#include "osteo/geometry/tets/lattice_tets.h"

int main() {
  osteo::TriangleSoup corner;  // of a cube of 6 mm, cut off: a sixth of it
  corner.points_mm = {{0, 0, 0}, {6, 0, 0}, {0, 6, 0}, {0, 0, 6}};
  corner.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  const double away_mm = osteo::TriangleTree(corner).closest({10, 10, 10}).distance_mm;
  const osteo::VoxelBits inside = osteo::voxels_inside(corner, osteo::frame_around_mm(corner, 0.1, 2));
  const double mm3 = static_cast<double>(inside.count()) * inside.frame.voxel_volume_mm3();
  const auto tets = osteo::grid_tets(inside).tets.size();
  std::printf("%.6f mm away, %.2f mm3, %zu tetrahedra\n", away_mm, mm3, tets);
  return std::abs(away_mm - 24 / std::sqrt(3.0)) < 1e-12 && std::abs(mm3 - 36) < 0.5 && tets == 5 * inside.count() ? 0
                                                                                                                   : 1;
}
