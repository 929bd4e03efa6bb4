#include "osteo/core/data/tet_mesh.h"

#include <algorithm>

namespace osteo {

TriMesh boundary_of(const TetMesh& mesh, std::vector<std::uint32_t>* point_of) {
  // Faces by their smallest point, then compared within that point's few.
  struct Face {
    std::uint32_t b, c;  // b < c, both above the smallest point
    std::uint32_t id;    // 4 * tet + the corner opposite
  };
  std::vector<std::uint32_t> first(mesh.points_mm.size() + 1, 0);
  const auto corners = [&](std::uint32_t id) {
    const auto& t = mesh.tets[id / 4];
    switch (id % 4) {  // facing out
      case 0:
        return std::array{t[1], t[2], t[3]};
      case 1:
        return std::array{t[0], t[3], t[2]};
      case 2:
        return std::array{t[0], t[1], t[3]};
      default:
        return std::array{t[0], t[2], t[1]};
    }
  };
  const auto count = static_cast<std::uint32_t>(mesh.tets.size() * 4);
  for (std::uint32_t id = 0; id < count; ++id) {
    const auto f = corners(id);
    ++first[std::min({f[0], f[1], f[2]}) + 1];
  }
  for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
  std::vector<Face> faces(count);
  std::vector<std::uint32_t> fill(first.begin(), first.end() - 1);
  for (std::uint32_t id = 0; id < count; ++id) {
    auto f = corners(id);
    std::sort(f.begin(), f.end());
    faces[fill[f[0]]++] = {f[1], f[2], id};
  }
  std::vector<std::uint32_t> once;
  for (std::size_t p = 0; p + 1 < first.size(); ++p) {
    const auto begin = faces.begin() + first[p], end = faces.begin() + first[p + 1];
    std::sort(begin, end, [](const Face& x, const Face& y) {
      return x.b != y.b ? x.b < y.b : x.c != y.c ? x.c < y.c : x.id < y.id;
    });
    for (auto f = begin; f != end;) {
      auto g = f + 1;
      while (g != end && g->b == f->b && g->c == f->c) ++g;
      if (g - f == 1) once.push_back(f->id);
      f = g;
    }
  }
  std::sort(once.begin(), once.end());
  constexpr std::uint32_t kUnused = 0xffffffffU;
  std::vector<std::uint32_t> place(mesh.points_mm.size(), kUnused);
  TriMesh surface;
  if (point_of != nullptr) point_of->clear();
  for (const std::uint32_t id : once) {
    auto f = corners(id);
    for (auto& v : f) {
      if (place[v] == kUnused) {
        place[v] = static_cast<std::uint32_t>(surface.points_mm.size());
        surface.points_mm.push_back(mesh.points_mm[v]);
        if (point_of != nullptr) point_of->push_back(v);
      }
      v = place[v];
    }
    surface.triangles.push_back(f);
  }
  return surface;
}

double volume_mm3(const TetMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.tets) {
    const auto p = [&](std::size_t i) {
      const auto& q = mesh.points_mm[t[i]];
      return Vec3{q[0], q[1], q[2]};
    };
    sum += dot(cross(p(1) - p(0), p(2) - p(0)), p(3) - p(0)) / 6;
  }
  return sum;
}

}  // namespace osteo
