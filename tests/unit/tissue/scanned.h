// What a scanner would make of a body that finite elements have moved.
#pragma once
#include <cmath>
#include <functional>
#include <random>
#include <string>

#include "block.h"
#include "osteo/simulation/tissue/measured.h"

namespace osteo::test {

struct Scan {
  std::size_t points = 2000;
  double noise_mm = 0;     ///< in each coordinate
  double stray_share = 0;  ///< of the points: anywhere in the body's box, enlarged by a fifth to all sides
  std::function<bool(Vec3 outwards)> sees = [](Vec3) { return true; };  ///< a triangle of the body at rest
  unsigned seed = 1;
};

// Points at random on what is seen of the moved boundary, as many as its area has.
inline MeasuredPoints scanned(const std::string& name, const Block& b, std::span<const Vec3> moved, const Scan& scan) {
  TetMesh mesh;
  for (const Vec3& p : b.points) mesh.points_mm.push_back(to_floats(p));
  for (const auto& t : b.tets) mesh.tets.push_back(t);
  std::vector<std::uint32_t> of;
  const TriMesh skin = boundary_of(mesh, &of);
  std::vector<std::array<Vec3, 3>> faces;
  std::vector<double> area;
  Vec3 lo{1e300, 1e300, 1e300}, hi = lo * -1;
  for (const auto& t : skin.triangles) {
    const Vec3 a = b.points[of[t[0]]], out = cross(b.points[of[t[1]]] - a, b.points[of[t[2]]] - a);
    if (!scan.sees(normalized(out))) continue;
    faces.push_back({moved[of[t[0]]], moved[of[t[1]]], moved[of[t[2]]]});
    area.push_back(length(cross(faces.back()[1] - faces.back()[0], faces.back()[2] - faces.back()[0])) +
                   (area.empty() ? 0 : area.back()));
    for (const Vec3& p : faces.back())
      for (std::size_t k = 0; k < 3; ++k) {
        lo[k] = std::min(lo[k], p[k]);
        hi[k] = std::max(hi[k], p[k]);
      }
  }
  std::mt19937 random(scan.seed);
  std::uniform_real_distribution<double> u(0, 1);
  std::normal_distribution<double> g;
  MeasuredPoints m;
  m.name = name;
  for (std::size_t n = 0; n < scan.points; ++n) {
    if (static_cast<double>(n) < scan.stray_share * static_cast<double>(scan.points)) {
      Vec3 p;
      for (std::size_t a = 0; a < 3; ++a) p[a] = lo[a] + (hi[a] - lo[a]) * (1.4 * u(random) - 0.2);
      m.points_mm.push_back(p);
      continue;
    }
    const auto face = static_cast<std::size_t>(std::lower_bound(area.begin(), area.end() - 1, u(random) * area.back()) -
                                               area.begin());
    double s = u(random), t = u(random);
    if (s + t > 1) {
      s = 1 - s;
      t = 1 - t;
    }
    const auto& f = faces[face];
    m.points_mm.push_back(f[0] + (f[1] - f[0]) * s + (f[2] - f[0]) * t +
                          Vec3{g(random), g(random), g(random)} * scan.noise_mm);
  }
  return m;
}

// Markers on the corners of the boundary, every so-many-th.
inline MeasuredPoints marked(const std::string& name, const Block& b, std::span<const Vec3> moved, std::size_t every,
                             double noise_mm, unsigned seed) {
  TetMesh mesh;
  for (const Vec3& p : b.points) mesh.points_mm.push_back(to_floats(p));
  for (const auto& t : b.tets) mesh.tets.push_back(t);
  std::vector<std::uint32_t> of;
  static_cast<void>(boundary_of(mesh, &of));
  std::mt19937 random(seed);
  std::normal_distribution<double> g;
  MeasuredPoints m;
  m.name = name;
  for (std::size_t k = 0; k < of.size(); k += every) {
    m.rest_mm.push_back(b.points[of[k]]);
    m.points_mm.push_back(moved[of[k]] + Vec3{g(random), g(random), g(random)} * noise_mm);
  }
  return m;
}

}  // namespace osteo::test
