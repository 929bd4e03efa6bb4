#include "osteo/core/data/tri_mesh.h"

#include <algorithm>
#include <array>
#include <span>

#include "osteo/core/base/union_find.h"

namespace osteo {
namespace {

Vec3 point(const TriMesh& mesh, std::uint32_t i) {
  const auto& p = mesh.points_mm[i];
  return {p[0], p[1], p[2]};
}

// True when one walk around the point, from a triangle to the one that goes on where it ends, meets all of its
// triangles: so it is nearly everywhere. False says nothing.
bool is_one_fan(const TriMesh& mesh, std::uint32_t v, std::span<const std::uint32_t> triangles) {
  constexpr std::size_t kMost = 32;
  if (triangles.size() > kMost) return false;
  std::array<std::uint32_t, kMost> from{}, to{};
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const auto& t = mesh.triangles[triangles[i]];
    const std::size_t at = t[0] == v ? 0 : t[1] == v ? 1 : 2;
    from[i] = t[(at + 1) % 3];
    to[i] = t[(at + 2) % 3];
    if (from[i] == v || to[i] == v || from[i] == to[i]) return false;
  }
  std::uint32_t met = 1;  // a bit for each
  for (std::size_t n = 1, at = 0; n < triangles.size(); ++n) {
    std::size_t next = 0;
    while (next < triangles.size() && ((met >> next & 1) != 0 || from[next] != to[at])) ++next;
    if (next == triangles.size()) return false;
    met |= std::uint32_t{1} << next;
    at = next;
  }
  return true;
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
    if (count < 2 || is_one_fan(mesh, v, {incident.data() + begin, count})) continue;
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
  // Edges by their lower point, counted out; then the few of each point by their other one.
  const auto is_degenerate = [](const auto& t) { return t[0] == t[1] || t[1] == t[2] || t[0] == t[2]; };
  std::uint32_t top = 0;
  for (const auto& t : mesh.triangles) top = std::max({top, t[0], t[1], t[2]});
  std::vector<std::uint64_t> first(mesh.triangles.empty() ? 1 : std::size_t{top} + 2, 0);
  for (const auto& t : mesh.triangles) {
    if (is_degenerate(t)) {
      ++result.degenerate;
      continue;
    }
    for (std::size_t e = 0; e < 3; ++e) ++first[std::size_t{std::min(t[e], t[(e + 1) % 3])} + 1];
  }
  for (std::size_t p = 1; p < first.size(); ++p) first[p] += first[p - 1];
  std::vector<std::uint64_t> other(first.back());  // the higher point, doubled, and 1 where the edge runs towards it
  {
    std::vector<std::uint64_t> fill(first.begin(), first.end() - 1);
    for (const auto& t : mesh.triangles) {
      if (is_degenerate(t)) continue;
      for (std::size_t e = 0; e < 3; ++e) {
        const std::uint32_t a = t[e], b = t[(e + 1) % 3];
        other[fill[std::min(a, b)]++] = std::uint64_t{std::max(a, b)} << 1 | (a < b ? 1 : 0);
      }
    }
  }
  for (std::size_t p = 0; p + 1 < first.size(); ++p) {
    const std::span<std::uint64_t> edges(other.data() + first[p], first[p + 1] - first[p]);
    std::sort(edges.begin(), edges.end());
    for (std::size_t i = 0; i < edges.size();) {
      std::size_t j = i, forward = 0;
      while (j < edges.size() && edges[j] >> 1 == edges[i] >> 1) forward += edges[j++] & 1;
      const std::size_t uses = j - i;
      if (uses == 1) ++result.open_edges;
      if (uses > 2) ++result.nonmanifold_edges;
      if (uses >= 2 && forward * 2 != uses) ++result.misoriented_edges;
      i = j;
    }
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
