#include "osteo/geometry/mesh/mesh_info.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <unordered_map>

#include "osteo/core/base/error.h"
#include "osteo/core/base/union_find.h"

namespace osteo::inline geometry {
namespace {

bool finite(const std::array<float, 3>& p) {
  return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]);
}

// The triangles that can be worked with.
TriangleSoup sound_part(const TriMesh& mesh, std::uint64_t& bad_indices, std::uint64_t& non_finite) {
  TriangleSoup soup;
  std::vector<std::uint8_t> good(mesh.points_mm.size());
  for (std::size_t i = 0; i < good.size(); ++i) {
    const auto& p = mesh.points_mm[i];
    good[i] = finite(p) ? 1 : 0;
    non_finite += good[i] == 0 ? 1 : 0;
    soup.points_mm.push_back(good[i] != 0 ? Vec3{p[0], p[1], p[2]} : Vec3{});
  }
  for (const auto& t : mesh.triangles) {
    bool there = true, sound = true;
    for (const auto v : t) {
      there &= v < good.size();
      sound &= v < good.size() && good[v] != 0;
    }
    bad_indices += there ? 0 : 1;
    if (sound) soup.triangles.push_back(t);
  }
  return soup;
}

// For each triangle the number of its body, counted from 0 in order of first triangle.
std::vector<std::uint32_t> bodies_of(const TriangleSoup& soup, std::uint32_t& count) {
  std::vector<std::uint32_t> parent(soup.points_mm.size());
  std::iota(parent.begin(), parent.end(), 0U);
  for (const auto& t : soup.triangles) {
    for (std::size_t e = 1; e < 3; ++e) join_sets(parent, t[0], t[e]);
  }
  std::vector<std::uint32_t> number(parent.size(), 0xffffffffU), body;
  count = 0;
  for (const auto& t : soup.triangles) {
    std::uint32_t& n = number[root_of(parent, t[0])];
    if (n == 0xffffffffU) n = count++;
    body.push_back(n);
  }
  return body;
}

double signed_volume(const TriangleSoup& soup, const std::array<std::uint32_t, 3>& t, Vec3 about) {
  return dot(soup.points_mm[t[0]] - about, cross(soup.points_mm[t[1]] - about, soup.points_mm[t[2]] - about)) / 6;
}

std::uint64_t unused_points(const TriMesh& mesh) {
  std::vector<std::uint8_t> used(mesh.points_mm.size(), 0);
  for (const auto& t : mesh.triangles) {
    for (const auto v : t) {
      if (v < used.size()) used[v] = 1;
    }
  }
  return static_cast<std::uint64_t>(std::count(used.begin(), used.end(), 0));
}

// Of a part whose equal points are one, as the file orients its triangles: edges are judged before neighbours are made
// to agree.
TriMesh welded_as_given(const TriangleSoup& sound, const Ordered& o) {
  TriMesh welded;
  welded.points_mm.resize(o.soup.points_mm.size());
  for (std::size_t i = 0; i < o.source.size(); ++i) {
    // The welded corners in the order of the source triangle.
    auto t = o.soup.triangles[i];
    const auto& from = sound.triangles[o.source[i]];
    const auto same = [&](std::uint32_t a, std::uint32_t b) { return sound.points_mm[a] == sound.points_mm[b]; };
    if (!same(t[1], from[1])) std::swap(t[1], t[2]);
    welded.triangles.push_back(t);
  }
  return welded;
}

// How many triangles have each edge, by its two points.
using Edges = std::unordered_map<std::uint64_t, int>;

// Edges and angles of all triangles.
Edges measure_triangles(const std::vector<Vec3>& points, const std::vector<std::array<std::uint32_t, 3>>& triangles,
                        MeshSummary& s) {
  Edges edges;
  edges.reserve(triangles.size() * 2);
  s.min_edge_mm = triangles.empty() ? 0 : 1e300;
  double edge_sum = 0;
  for (const auto& t : triangles) {
    Vec3 p[3];
    double l[3];
    for (std::size_t i = 0; i < 3; ++i) p[i] = points[t[i]];
    for (std::size_t i = 0; i < 3; ++i) {
      l[i] = length(p[(i + 1) % 3] - p[i]);
      const std::uint32_t u = t[i], v = t[(i + 1) % 3];
      if (++edges[static_cast<std::uint64_t>(std::min(u, v)) << 32 | std::max(u, v)] == 1) {
        s.min_edge_mm = std::min(s.min_edge_mm, l[i]);
        s.max_edge_mm = std::max(s.max_edge_mm, l[i]);
        edge_sum += l[i];
      }
    }
    const double twice = length(cross(p[1] - p[0], p[2] - p[0])), longest = std::max({l[0], l[1], l[2]});
    s.area_mm2 += twice / 2;
    double smallest = 180, largest = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 a = p[(i + 1) % 3] - p[i], b = p[(i + 2) % 3] - p[i];
      const double angle = std::atan2(length(cross(a, b)), dot(a, b)) * 180 / std::numbers::pi;
      smallest = std::min(smallest, angle);
      largest = std::max(largest, angle);
    }
    if (twice <= 2e-12 * longest * longest) ++s.zero_area;
    if (largest > 179) {
      ++s.caps;
    } else if (smallest < 1) {
      ++s.needles;
    }
    ++s.min_angle_histogram[static_cast<std::size_t>(std::clamp(smallest / 5, 0.0, 11.0))];
  }
  if (!edges.empty()) s.mean_edge_mm = edge_sum / static_cast<double>(edges.size());
  return edges;
}

// Connected sets of edges that one triangle has.
std::uint64_t holes_of(const Edges& edges) {
  std::map<std::uint32_t, std::uint32_t> parent;
  for (const auto& [key, n] : edges) {
    if (n != 1) continue;
    const auto u = static_cast<std::uint32_t>(key >> 32), v = static_cast<std::uint32_t>(key);
    parent.try_emplace(u, u);
    parent.try_emplace(v, v);
    join_sets(parent, u, v);
  }
  std::uint64_t holes = 0;
  for (const auto& [v, p] : parent) holes += v == p ? 1 : 0;
  return holes;
}

void measure_bodies(const TriangleSoup& soup, MeshSummary& s) {
  std::uint32_t count = 0;
  const std::vector<std::uint32_t> body = bodies_of(soup, count);
  s.bodies = count;
  std::vector<double> volume(count, 0);
  for (std::size_t t = 0; t < body.size(); ++t)
    volume[body[t]] += signed_volume(soup, soup.triangles[t], (s.lo_mm + s.hi_mm) * 0.5);
  if (!s.watertight) return;
  for (const double v : volume) {
    s.volume_mm3 += v;
    s.inward_bodies += v < 0 ? 1 : 0;
  }
}

}  // namespace

MeshSummary summarize(const TriMesh& mesh, const Context& context) {
  MeshSummary s;
  s.points = mesh.points_mm.size();
  s.triangles = mesh.triangles.size();
  const TriangleSoup sound = sound_part(mesh, s.bad_indices, s.non_finite_points);
  s.unused_points = unused_points(mesh);
  context.progress(0.2);
  const Ordered o = ordered(sound, context);
  s.equal_points = o.welded_points;
  s.degenerate = o.degenerate;
  s.duplicates = o.duplicates;
  const TriMesh welded = welded_as_given(sound, o);
  const MeshCheck c = check(welded);
  s.open_edges = c.open_edges;
  s.nonmanifold_edges = c.nonmanifold_edges;
  s.nonmanifold_points = c.nonmanifold_points;
  s.disagreeing_edges = c.misoriented_edges;
  s.watertight = c.watertight() && !welded.triangles.empty();
  s.manifold = c.manifold();
  context.progress(0.6);
  const TriangleSoup as_given{o.soup.points_mm, welded.triangles};
  const auto [lo, hi] = bounds_of(as_given);
  s.lo_mm = lo;
  s.hi_mm = hi;
  const Edges edges = measure_triangles(as_given.points_mm, as_given.triangles, s);
  std::vector<std::uint8_t> corner(as_given.points_mm.size(), 0);
  for (const auto& t : as_given.triangles) {
    for (const auto v : t) corner[v] = 1;
  }
  s.euler = std::count(corner.begin(), corner.end(), 1) - static_cast<std::int64_t>(edges.size()) +
            static_cast<std::int64_t>(as_given.triangles.size());
  s.holes = holes_of(edges);
  measure_bodies(as_given, s);
  if (welded.triangles.empty()) s.lo_mm = s.hi_mm = {};
  context.progress(1.0);
  return s;
}

TriangleSoup repaired(const TriMesh& mesh, const RepairOptions& options, RepairReport& report, const Context& context) {
  std::uint64_t bad = 0, non_finite = 0;
  TriangleSoup soup = sound_part(mesh, bad, non_finite);
  report.unsound = mesh.triangles.size() - soup.triangles.size();
  if (report.unsound > 0 && !options.drop_unsound) (void)soup_of(mesh);  // throws, naming it
  if (options.weld_mm > 0) {
    // Cells of the weld distance; a point joins the first earlier one within reach, in its own or a neighbouring cell.
    struct Hash {
      std::size_t operator()(const std::array<std::int64_t, 3>& c) const {
        return static_cast<std::size_t>((c[0] * 73856093) ^ (c[1] * 19349663) ^ (c[2] * 83492791));
      }
    };
    std::unordered_map<std::array<std::int64_t, 3>, std::vector<std::uint32_t>, Hash> cells;
    std::vector<std::uint32_t> to(soup.points_mm.size());
    for (std::uint32_t i = 0; i < to.size(); ++i) {
      const Vec3 p = soup.points_mm[i];
      std::array<std::int64_t, 3> cell{};
      for (std::size_t a = 0; a < 3; ++a)
        cell[a] = static_cast<std::int64_t>(std::floor(std::clamp(p[a] / options.weld_mm, -4e18, 4e18)));
      to[i] = i;
      for (int n = 0; n < 27 && to[i] == i; ++n) {
        const auto found = cells.find({cell[0] + n % 3 - 1, cell[1] + n / 3 % 3 - 1, cell[2] + n / 9 - 1});
        if (found == cells.end()) continue;
        for (const std::uint32_t j : found->second) {
          if (length(soup.points_mm[j] - p) <= options.weld_mm) {
            to[i] = j;
            ++report.welded;
            break;
          }
        }
      }
      if (to[i] == i) cells[cell].push_back(i);
    }
    for (auto& t : soup.triangles) {
      for (auto& v : t) v = to[v];
    }
  }
  context.progress(0.4);
  Ordered o = ordered(soup, context);
  report.welded += o.welded_points;
  report.degenerate = o.degenerate;
  report.duplicates = o.duplicates;
  report.flipped = o.flipped;
  std::uint32_t count = 0;
  const std::vector<std::uint32_t> body = bodies_of(o.soup, count);
  std::vector<double> area(count, 0), volume(count, 0);
  std::vector<BoxMm> box(count);
  for (std::size_t t = 0; t < body.size(); ++t) {
    const auto& v = o.soup.triangles[t];
    area[body[t]] += length(cross(o.soup.points_mm[v[1]] - o.soup.points_mm[v[0]],
                                  o.soup.points_mm[v[2]] - o.soup.points_mm[v[0]])) /
                     2;
    volume[body[t]] += signed_volume(o.soup, v, o.soup.points_mm[o.soup.triangles[0][0]]);
    for (const auto i : v) box[body[t]].include(o.soup.points_mm[i]);
  }
  std::vector<std::uint8_t> open(count, 0);
  std::vector<std::uint32_t> body_of_point(o.soup.points_mm.size(), 0);
  for (std::size_t t = 0; t < body.size(); ++t) {
    for (const auto i : o.soup.triangles[t]) body_of_point[i] = body[t];
  }
  for (const OpenEdge& e : o.open) open[body_of_point[e.from]] = 1;
  std::uint32_t largest = 0;
  for (std::uint32_t b = 1; b < count; ++b) {
    if (area[b] > area[largest]) largest = b;
  }
  std::vector<std::uint8_t> keep(count, 1), turn(count, 0);
  for (std::uint32_t b = 0; b < count; ++b) {
    if ((options.keep_largest && b != largest) || area[b] < options.min_body_area_mm2) {
      keep[b] = 0;
      ++report.dropped_bodies;
      continue;
    }
    if (!options.turn_bodies || open[b] != 0 || volume[b] >= 0) continue;
    // Facing inward is right for a cavity: inside the box of a larger body that faces outward.
    bool cavity = false;
    for (std::uint32_t other = 0; other < count && !cavity; ++other) {
      if (other == b || volume[other] <= -volume[b] || open[other] != 0) continue;
      bool within = true;
      for (std::size_t a = 0; a < 3; ++a)
        within &= box[other].lo[a] <= box[b].lo[a] && box[b].hi[a] <= box[other].hi[a];
      cavity = within;
    }
    if (!cavity) {
      turn[b] = 1;
      ++report.turned_bodies;
    }
  }
  TriangleSoup result;
  result.points_mm = std::move(o.soup.points_mm);
  for (std::size_t t = 0; t < body.size(); ++t) {
    if (keep[body[t]] == 0) continue;
    auto v = o.soup.triangles[t];
    if (turn[body[t]] != 0) std::swap(v[1], v[2]);
    result.triangles.push_back(v);
  }
  if (result.triangles.empty()) throw Error(ExitCode::failed, "no triangle of the surface is left after repair");
  context.progress(1.0);
  return result;
}

}  // namespace osteo::inline geometry
