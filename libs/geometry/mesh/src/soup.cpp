#include "osteo/geometry/mesh/soup.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <string>

#include "osteo/core/base/error.h"

namespace osteo::inline geometry {

void require_sound(const TriangleSoup& soup) {
  for (std::size_t i = 0; i < soup.points_mm.size(); ++i) {
    const Vec3 p = soup.points_mm[i];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
      throw Error(ExitCode::corrupt,
                  "point " + std::to_string(i) + " of the surface has a coordinate that is no finite number",
                  "'osteo mesh-repair' takes such points out");
    }
  }
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    for (const auto v : soup.triangles[t]) {
      if (v >= soup.points_mm.size()) {
        throw Error(ExitCode::corrupt, "triangle " + std::to_string(t) + " of the surface names point " +
                                           std::to_string(v) + ", but there are only " +
                                           std::to_string(soup.points_mm.size()) + " points");
      }
    }
  }
}

TriangleSoup soup_of(const TriMesh& mesh) {
  TriangleSoup soup;
  soup.points_mm.reserve(mesh.points_mm.size());
  for (const auto& p : mesh.points_mm) soup.points_mm.push_back({p[0], p[1], p[2]});
  soup.triangles = mesh.triangles;
  require_sound(soup);
  return soup;
}

BoxMm bounds_of(const TriangleSoup& soup) {
  BoxMm box;
  for (const auto& t : soup.triangles) {
    for (const auto v : t) box.include(soup.points_mm[v]);
  }
  return box;
}

TriangleSoup compacted(const TriangleSoup& soup) {
  constexpr std::uint32_t kUnused = 0xffffffffU;
  std::vector<std::uint32_t> place(soup.points_mm.size(), kUnused);
  TriangleSoup result;
  for (auto t : soup.triangles) {
    for (auto& v : t) {
      if (place[v] == kUnused) {
        place[v] = static_cast<std::uint32_t>(result.points_mm.size());
        result.points_mm.push_back(soup.points_mm[v]);
      }
      v = place[v];
    }
    result.triangles.push_back(t);
  }
  return result;
}

TriMesh mesh_of(const TriangleSoup& soup) {
  TriangleSoup used = compacted(soup);
  TriMesh mesh;
  mesh.points_mm.reserve(used.points_mm.size());
  for (const Vec3 p : used.points_mm) mesh.points_mm.push_back(to_floats(p));
  mesh.triangles = std::move(used.triangles);
  return mesh;
}

namespace {

// Each point's representative: the first with the same coordinates.
std::vector<std::uint32_t> representatives(const std::vector<Vec3>& points, std::uint64_t& welded) {
  std::size_t slots = std::bit_ceil(std::max<std::size_t>(16, points.size() * 2));
  std::vector<std::uint32_t> table(slots, 0xffffffffU);
  std::vector<std::uint32_t> first(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const Vec3 p = points[i];
    std::uint64_t h = 0;
    for (std::size_t a = 0; a < 3; ++a)
      h = (h ^ std::bit_cast<std::uint64_t>(p[a] + 0.0)) * 0x9e3779b97f4a7c15ULL, h ^= h >> 29;
    std::size_t s = h & (slots - 1);
    while (table[s] != 0xffffffffU && !(points[table[s]] == p)) s = (s + 1) & (slots - 1);
    if (table[s] == 0xffffffffU) {
      table[s] = i;
    } else {
      ++welded;
    }
    first[i] = table[s];
  }
  return first;
}

struct HalfEdge {
  std::uint32_t a, b;  // a < b
  std::uint32_t triangle;
  bool forward;  // the triangle goes from a to b
};

std::vector<HalfEdge> half_edges(const TriangleSoup& soup) {
  std::vector<HalfEdge> edges;
  edges.reserve(soup.triangles.size() * 3);
  for (std::uint32_t t = 0; t < soup.triangles.size(); ++t) {
    for (std::size_t e = 0; e < 3; ++e) {
      const std::uint32_t u = soup.triangles[t][e], v = soup.triangles[t][(e + 1) % 3];
      edges.push_back({std::min(u, v), std::max(u, v), t, u < v});
    }
  }
  // By first point (counting), then within its few edges by second point and triangle.
  std::vector<std::uint32_t> first(soup.points_mm.size() + 1, 0);
  for (const HalfEdge& e : edges) ++first[e.a + 1];
  for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
  std::vector<HalfEdge> sorted(edges.size());
  std::vector<std::uint32_t> fill(first.begin(), first.end() - 1);
  for (const HalfEdge& e : edges) sorted[fill[e.a]++] = e;
  for (std::size_t i = 0; i + 1 < first.size(); ++i) {
    // A point has few edges; insertion keeps the order of triangles. Only a hub with thousands is worth more.
    const auto begin = sorted.begin() + first[i], end = sorted.begin() + first[i + 1];
    const auto before = [](const HalfEdge& x, const HalfEdge& y) { return x.b < y.b; };
    if (end - begin > 64) {
      std::stable_sort(begin, end, before);
    } else {
      for (auto e = begin; e != end; ++e) {
        const HalfEdge moved = *e;
        auto at = e;
        for (; at != begin && before(moved, *(at - 1)); --at) *at = *(at - 1);
        *at = moved;
      }
    }
  }
  return sorted;
}

template <class Visit>
void for_each_edge(const std::vector<HalfEdge>& edges, Visit visit) {
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t j = i + 1;
    while (j < edges.size() && edges[j].a == edges[i].a && edges[j].b == edges[i].b) ++j;
    visit(std::span<const HalfEdge>(edges.data() + i, j - i));
    i = j;
  }
}

// Turns triangles round until neighbours across edges of two agree.
std::uint64_t orient(TriangleSoup& soup, const std::vector<HalfEdge>& edges) {
  bool any_disagree = false;
  for_each_edge(edges,
                [&](std::span<const HalfEdge> e) { any_disagree |= e.size() == 2 && e[0].forward == e[1].forward; });
  if (!any_disagree) return 0;
  struct Neighbour {
    std::uint32_t triangle;
    bool disagrees;
  };
  const std::size_t n = soup.triangles.size();
  std::vector<std::array<Neighbour, 3>> neighbours(n);
  std::vector<std::uint8_t> count(n, 0);
  for_each_edge(edges, [&](std::span<const HalfEdge> e) {
    if (e.size() != 2) return;
    const bool disagrees = e[0].forward == e[1].forward;
    neighbours[e[0].triangle][count[e[0].triangle]++] = {e[1].triangle, disagrees};
    neighbours[e[1].triangle][count[e[1].triangle]++] = {e[0].triangle, disagrees};
  });
  std::vector<std::int8_t> turn(n, -1);  // relative to the patch's first triangle
  std::vector<std::uint32_t> patch;
  std::uint64_t flipped = 0;
  for (std::uint32_t seed = 0; seed < n; ++seed) {
    if (turn[seed] >= 0) continue;
    patch.assign(1, seed);
    turn[seed] = 0;
    double area[2] = {0, 0};
    for (std::size_t i = 0; i < patch.size(); ++i) {
      const std::uint32_t t = patch[i];
      const auto& v = soup.triangles[t];
      const Vec3 a = soup.points_mm[v[0]];
      area[turn[t]] += length(cross(soup.points_mm[v[1]] - a, soup.points_mm[v[2]] - a));
      for (int k = 0; k < count[t]; ++k) {
        const Neighbour next = neighbours[t][static_cast<std::size_t>(k)];
        if (turn[next.triangle] >= 0) continue;
        turn[next.triangle] = static_cast<std::int8_t>(next.disagrees ? 1 - turn[t] : turn[t]);
        patch.push_back(next.triangle);
      }
    }
    const int wrong = area[1] > area[0] ? 0 : 1;
    for (const std::uint32_t t : patch) {
      if (turn[t] != wrong) continue;
      std::swap(soup.triangles[t][1], soup.triangles[t][2]);
      ++flipped;
    }
  }
  return flipped;
}

}  // namespace

bool is_closed(const TriangleSoup& soup) {
  // The sum over all edges of a random number for the edge, negative when used backwards. SplitMix64's mixing.
  std::uint64_t sum = 0;
  for (const auto& t : soup.triangles) {
    for (std::size_t e = 0; e < 3; ++e) {
      const std::uint32_t u = t[e], v = t[e == 2 ? 0 : e + 1];
      std::uint64_t h = (static_cast<std::uint64_t>(std::min(u, v)) << 32 | std::max(u, v)) + 0x9e3779b97f4a7c15ULL;
      h = (h ^ h >> 30) * 0xbf58476d1ce4e5b9ULL;
      h = (h ^ h >> 27) * 0x94d049bb133111ebULL;
      h ^= h >> 31;
      sum += u < v ? h : u == v ? 0 : 0 - h;
    }
  }
  return sum == 0;
}

TriangleSoup welded(const TriangleSoup& soup) {
  std::uint64_t count = 0;
  const std::vector<std::uint32_t> first = representatives(soup.points_mm, count);
  TriangleSoup result = soup;
  for (auto& t : result.triangles) {
    for (auto& v : t) v = first[v];
  }
  return result;
}

Ordered ordered(const TriangleSoup& input, const Context& context) {
  Ordered result;
  const std::vector<std::uint32_t> first = representatives(input.points_mm, result.welded_points);
  result.soup.points_mm = input.points_mm;
  // Duplicates by sorted corners in a hash table.
  const auto sorted = [](std::array<std::uint32_t, 3> t) {
    std::sort(t.begin(), t.end());
    return t;
  };
  const std::size_t slots = std::bit_ceil(std::max<std::size_t>(16, input.triangles.size() * 2));
  std::vector<std::uint32_t> table(slots, 0xffffffffU);
  result.soup.triangles.reserve(input.triangles.size());
  for (std::uint32_t i = 0; i < input.triangles.size(); ++i) {
    std::array<std::uint32_t, 3> t = input.triangles[i];
    for (auto& v : t) v = first[v];
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) {
      ++result.degenerate;
      continue;
    }
    const auto key = sorted(t);
    std::uint64_t h = 0;
    for (const auto v : key) h = (h ^ v) * 0x9e3779b97f4a7c15ULL, h ^= h >> 31;
    std::size_t s = h & (slots - 1);
    while (table[s] != 0xffffffffU && sorted(result.soup.triangles[table[s]]) != key) s = (s + 1) & (slots - 1);
    if (table[s] != 0xffffffffU) {
      ++result.duplicates;
      continue;
    }
    table[s] = static_cast<std::uint32_t>(result.soup.triangles.size());
    result.soup.triangles.push_back(t);
    result.source.push_back(i);
  }
  context.check_cancelled();
  std::vector<HalfEdge> edges = half_edges(result.soup);
  result.flipped = orient(result.soup, edges);
  if (result.flipped > 0) edges = half_edges(result.soup);
  for_each_edge(edges, [&](std::span<const HalfEdge> e) {
    int net = 0;
    for (const HalfEdge& h : e) net += h.forward ? 1 : -1;
    if (net > 0) result.open.push_back({e[0].a, e[0].b, net});
    if (net < 0) result.open.push_back({e[0].b, e[0].a, -net});
  });
  return result;
}

}  // namespace osteo::inline geometry
