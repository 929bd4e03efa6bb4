// Blocks of voxels bent into other shapes, held and loaded by where they come from.
#pragma once
#include <functional>

#include "block.h"
#include "osteo/simulation/tissue/detail/equilibrium.h"

namespace osteo::test {

// Hexahedra in rows, mapped from the unit cube; sliders and faces by the place they come from.
struct Mapped {
  Block b;
  std::vector<Vec3> from;  // in the unit cube
};
inline Mapped mapped(int nx, int ny, int nz, const std::function<Vec3(Vec3)>& map) {
  Mapped m{block(nx, ny, nz, 1.0), {}};
  for (Vec3& p : m.b.points) {
    m.from.push_back({p.x / nx, p.y / ny, p.z / nz});
    p = map(m.from.back());
  }
  return m;
}
inline TissueLoad held(const Mapped& m, const std::function<int(Vec3)>& axes) {
  TissueLoad load;
  for (std::uint32_t p = 0; p < m.from.size(); ++p) {
    const int h = axes(m.from[p]);
    if (h == 7) load.fixed.push_back(p);
    if (h != 0 && h != 7) load.sliders.push_back({p, static_cast<std::uint8_t>(h)});
  }
  return load;
}
// Force over area, as a function of place, on the boundary where `in` is true of all three corners.
inline void load_faces(const Mapped& m, const std::function<bool(Vec3)>& in,
                       const std::function<Vec3(Vec3 area_outwards)>& force, TissueLoad& load) {
  TetMesh mesh;
  for (const Vec3& p : m.b.points) mesh.points_mm.push_back(to_floats(p));
  for (const auto& t : m.b.tets) mesh.tets.push_back(t);
  std::vector<std::uint32_t> point_of;
  const TriMesh skin = boundary_of(mesh, &point_of);
  for (const auto& t : skin.triangles) {
    const std::array<std::uint32_t, 3> face{point_of[t[0]], point_of[t[1]], point_of[t[2]]};
    if (!in(m.from[face[0]]) || !in(m.from[face[1]]) || !in(m.from[face[2]])) continue;
    const auto at = [&](std::size_t i) { return m.b.points[face[i]]; };
    load.add_on_face(face, force(cross(at(1) - at(0), at(2) - at(0)) * 0.5));
  }
}

}  // namespace osteo::test
