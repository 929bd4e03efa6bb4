#include "osteo/core/data/tri_mesh.h"

#include <algorithm>

#include "osteo/core/base/union_find.h"

namespace osteo {
namespace {

Vec3 point(const TriMesh& mesh, std::uint32_t i) {
  const auto& p = mesh.points_mm[i];
  return {p[0], p[1], p[2]};
}

// Counts the fans of triangles around each point: walks from triangle to triangle across shared edges by union-find.
std::uint64_t count_nonmanifold_points(const TriMesh& mesh) {
  const std::size_t n = mesh.points_mm.size();
  std::vector<std::uint32_t> first(n + 1, 0);
  for (const auto& t : mesh.triangles) {
    for (const auto v : t) ++first[v + 1];
  }
  for (std::size_t i = 0; i < n; ++i) first[i + 1] += first[i];
  std::vector<std::uint32_t> incident(mesh.triangles.size() * 3);
  std::vector<std::uint32_t> fill(first.begin(), first.end() - 1);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const auto v : mesh.triangles[t]) incident[fill[v]++] = t;
  }
  std::uint64_t bad = 0;
  std::vector<std::uint32_t> parent;
  for (std::uint32_t v = 0; v < n; ++v) {
    const std::uint32_t begin = first[v], count = first[v + 1] - begin;
    if (count < 2) continue;
    parent.resize(count);
    for (std::uint32_t i = 0; i < count; ++i) parent[i] = i;
    std::uint32_t fans = count;
    for (std::uint32_t i = 0; i < count; ++i) {
      for (std::uint32_t j = i + 1; j < count; ++j) {
        int shared = 0;
        for (const auto a : mesh.triangles[incident[begin + i]]) {
          for (const auto b : mesh.triangles[incident[begin + j]]) shared += a == b ? 1 : 0;
        }
        if (shared >= 2 && join_sets(parent, i, j)) --fans;
      }
    }
    if (fans > 1) ++bad;
  }
  return bad;
}

}  // namespace

MeshCheck check(const TriMesh& mesh) {
  MeshCheck result;
  struct Edge {
    std::uint32_t lo, hi;
    bool forward;
    bool operator<(const Edge& o) const { return lo != o.lo ? lo < o.lo : hi < o.hi; }
  };
  std::vector<Edge> edges;
  edges.reserve(mesh.triangles.size() * 3);
  for (const auto& t : mesh.triangles) {
    if (t[0] == t[1] || t[1] == t[2] || t[0] == t[2]) {
      ++result.degenerate;
      continue;
    }
    for (std::size_t e = 0; e < 3; ++e) {
      const auto a = t[e], b = t[(e + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), a < b});
    }
  }
  std::sort(edges.begin(), edges.end());
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t j = i;
    int forward = 0;
    while (j < edges.size() && edges[j].lo == edges[i].lo && edges[j].hi == edges[i].hi)
      forward += edges[j++].forward ? 1 : 0;
    const std::size_t uses = j - i;
    if (uses == 1) ++result.open_edges;
    if (uses > 2) ++result.nonmanifold_edges;
    if (uses >= 2 && static_cast<std::size_t>(forward) * 2 != uses) ++result.misoriented_edges;
    i = j;
  }
  result.nonmanifold_points = count_nonmanifold_points(mesh);
  return result;
}

double enclosed_volume_mm3(const TriMesh& mesh) {
  double six_volumes = 0;
  for (const auto& t : mesh.triangles) {
    six_volumes += dot(point(mesh, t[0]), cross(point(mesh, t[1]), point(mesh, t[2])));
  }
  return six_volumes / 6;
}

double area_mm2(const TriMesh& mesh) {
  double twice = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3 a = point(mesh, t[0]);
    twice += length(cross(point(mesh, t[1]) - a, point(mesh, t[2]) - a));
  }
  return twice / 2;
}

}  // namespace osteo
