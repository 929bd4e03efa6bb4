// Surfaces whose every property is known, and what can be done to spoil them.
#pragma once
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <string>

#include "folders.h"
#include "osteo/geometry/mesh/soup.h"
#include "osteo/imaging/io/surface_io.h"

namespace osteo::test {

/// An icosahedron divided `levels` times, on a sphere: 20 * 4^levels triangles facing out.
inline TriangleSoup sphere(double radius, int levels, Vec3 centre = {}) {
  const double g = std::numbers::phi;
  TriangleSoup s;
  s.points_mm = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                 {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  s.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                 {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                 {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int l = 0; l < levels; ++l) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middle;
    const auto mid = [&](std::uint32_t a, std::uint32_t b) {
      const auto [it, made] =
          middle.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<std::uint32_t>(s.points_mm.size()));
      if (made) s.points_mm.push_back((s.points_mm[a] + s.points_mm[b]) * 0.5);
      return it->second;
    };
    std::vector<std::array<std::uint32_t, 3>> next;
    for (const auto& t : s.triangles) {
      const auto a = mid(t[0], t[1]), b = mid(t[1], t[2]), c = mid(t[2], t[0]);
      next.insert(next.end(), {{t[0], a, c}, {a, t[1], b}, {c, b, t[2]}, {a, b, c}});
    }
    s.triangles = std::move(next);
    for (auto& p : s.points_mm) p = normalized(p);
  }
  for (auto& p : s.points_mm) p = normalized(p) * radius + centre;
  return s;
}

/// An axis-aligned box of 12 triangles facing out.
inline TriangleSoup box(Vec3 lo, Vec3 hi) {
  TriangleSoup s;
  for (int c = 0; c < 8; ++c)
    s.points_mm.push_back({(c & 1) != 0 ? hi.x : lo.x, (c & 2) != 0 ? hi.y : lo.y, (c & 4) != 0 ? hi.z : lo.z});
  s.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                 {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return s;
}

inline TriangleSoup joined(TriangleSoup a, const TriangleSoup& b) {
  const auto n = static_cast<std::uint32_t>(a.points_mm.size());
  a.points_mm.insert(a.points_mm.end(), b.points_mm.begin(), b.points_mm.end());
  for (const auto& t : b.triangles) a.triangles.push_back({t[0] + n, t[1] + n, t[2] + n});
  return a;
}
inline TriangleSoup turned(TriangleSoup s) {
  for (auto& t : s.triangles) std::swap(t[1], t[2]);
  return s;
}
inline TriangleSoup moved(TriangleSoup s, double scale, Vec3 by) {
  for (auto& p : s.points_mm) p = p * scale + by;
  return s;
}
/// Every triangle with points of its own.
inline TriangleSoup unwelded(const TriangleSoup& s) {
  TriangleSoup r;
  for (const auto& t : s.triangles) {
    const auto n = static_cast<std::uint32_t>(r.points_mm.size());
    for (const auto v : t) r.points_mm.push_back(s.points_mm[v]);
    r.triangles.push_back({n, n + 1, n + 2});
  }
  return r;
}

/// The real meshes that are at hand.
inline std::vector<std::filesystem::path> real_meshes() {
  std::vector<std::filesystem::path> paths;
  for (const char* folder : {"meshes", "meshes_hard", "meshes_bone"}) {
    const std::filesystem::path f = shared_data() / folder;
    if (!std::filesystem::exists(f)) continue;
    for (const auto& e : std::filesystem::directory_iterator(f)) {
      if (is_surface_file(e.path())) paths.push_back(e.path());
    }
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

}  // namespace osteo::test
