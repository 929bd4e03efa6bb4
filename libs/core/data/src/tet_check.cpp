#include "osteo/core/data/tet_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"

namespace osteo {

void require_sound(const TetMesh& mesh) {
  const auto refuse = [](const std::string& what, const std::string& advice = {}) {
    return Error(ExitCode::failed, "the mesh is not written: " + what, advice);
  };
  double farthest = 0;
  for (std::size_t p = 0; p < mesh.points_mm.size(); ++p) {
    for (const float v : mesh.points_mm[p]) {
      if (!std::isfinite(v)) throw refuse("point " + std::to_string(p) + " has a coordinate that is no finite number");
      farthest = std::max(farthest, std::abs(static_cast<double>(v)));
    }
  }
  std::size_t bad = 0, first = 0;
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    const auto& c = mesh.tets[t];
    for (const std::uint32_t p : c) {
      if (p >= mesh.points_mm.size())
        throw refuse("tetrahedron " + std::to_string(t) + " names point " + std::to_string(p) + ", which is not there");
    }
    const Vec3 o = from_floats(mesh.points_mm[c[0]]), u = from_floats(mesh.points_mm[c[1]]) - o,
               v = from_floats(mesh.points_mm[c[2]]) - o, w = from_floats(mesh.points_mm[c[3]]) - o;
    if (dot(cross(u, v), w) > 0) continue;
    first = bad == 0 ? t : first;
    ++bad;
  }
  if (bad > 0)
    throw refuse(std::to_string(bad) + " of " + std::to_string(mesh.tets.size()) +
                     " tetrahedra are inside out or have no volume (the first: " + std::to_string(first) +
                     "); coordinates reach " + format_number(farthest) + " mm, where they are kept to " +
                     format_number(static_cast<double>(std::nextafter(static_cast<float>(farthest),
                                                                      std::numeric_limits<float>::infinity())) -
                                   static_cast<double>(static_cast<float>(farthest))) +
                     " mm",
                 "a smaller load, larger tetrahedra, or a body nearer to the origin");
}

}  // namespace osteo
