// A tetrahedron goes into a file and comes back; its volume is a sixth of the cube's.
#include <cmath>
#include <cstdio>

#include "osteo/core/data/tri_mesh.h"
#include "osteo/imaging/io/surface_io.h"

int main() {
  osteo::TriMesh mesh;
  mesh.points_mm = {{0, 0, 0}, {6, 0, 0}, {0, 6, 0}, {0, 0, 6}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  osteo::save_surface(mesh, "tetrahedron.ply");
  const osteo::Surface back = osteo::load_surface("tetrahedron.ply");
  const double volume = osteo::enclosed_volume_mm3(*back);
  std::printf("%zu triangles, watertight: %s, %.3f mm3\n", back->triangles.size(),
              osteo::check(*back).watertight() ? "yes" : "no", volume);
  return std::abs(volume - 36) < 1e-6 ? 0 : 1;
}
