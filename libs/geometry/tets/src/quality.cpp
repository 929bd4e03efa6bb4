#include "osteo/geometry/tets/quality.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "osteo/core/base/parallel.h"
#include "osteo/geometry/distance/distance_map.h"

namespace osteo::inline geometry {

Dihedrals dihedral_angles(Vec3 a, Vec3 b, Vec3 c, Vec3 d, double* all_deg) {
  // Outward normals of the faces opposite a, b, c, d; the angle along the edge of two faces is pi less that of the
  // normals.
  const Vec3 n[4] = {cross(c - b, d - b), cross(d - a, c - a), cross(b - a, d - a), cross(c - a, b - a)};
  Dihedrals r{180, 0};
  int at = 0;
  for (int i = 0; i < 4; ++i) {
    for (int j = i + 1; j < 4; ++j) {
      const double angle = 180 - std::atan2(length(cross(n[i], n[j])), dot(n[i], n[j])) * 180 / std::numbers::pi;
      r.min_deg = std::min(r.min_deg, angle);
      r.max_deg = std::max(r.max_deg, angle);
      if (all_deg != nullptr) all_deg[at++] = angle;
    }
  }
  return r;
}

namespace {

// So that minima and maxima can be taken.
TetQuality nothing_yet() {
  TetQuality q;
  q.min_dihedral_deg = 180;
  q.min_volume_mm3 = q.min_edge_mm = 1e300;
  q.max_volume_mm3 = -1e300;
  q.min_aspect = 1;
  return q;
}

// Of some tetrahedra, and of all.
struct Part {
  TetQuality q = nothing_yet();
  double aspect_sum = 0;

  void add_tet(const std::array<Vec3, 4>& p);
  void add(const Part& other);
};

void Part::add_tet(const std::array<Vec3, 4>& p) {
  const double volume = dot(cross(p[1] - p[0], p[2] - p[0]), p[3] - p[0]) / 6;
  q.volume_mm3 += volume;
  q.min_volume_mm3 = std::min(q.min_volume_mm3, volume);
  q.max_volume_mm3 = std::max(q.max_volume_mm3, volume);
  if (volume <= 0) ++q.inverted;
  double angles[6];
  const Dihedrals d = dihedral_angles(p[0], p[1], p[2], p[3], angles);
  q.min_dihedral_deg = std::min(q.min_dihedral_deg, d.min_deg);
  q.max_dihedral_deg = std::max(q.max_dihedral_deg, d.max_deg);
  for (const double a : angles) ++q.dihedral_histogram[static_cast<std::size_t>(std::clamp(a / 10, 0.0, 17.0))];
  double area = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3 a = p[(i + 1) % 4], b = p[(i + 2) % 4], c = p[(i + 3) % 4];
    area += length(cross(b - a, c - a)) / 2;
    for (std::size_t j = i + 1; j < 4; ++j) {
      const double l = length(p[i] - p[j]);
      q.min_edge_mm = std::min(q.min_edge_mm, l);
      q.max_edge_mm = std::max(q.max_edge_mm, l);
    }
  }
  // Circumradius from the circumcentre relative to p[0].
  const Vec3 u = p[1] - p[0], v = p[2] - p[0], w = p[3] - p[0];
  const Vec3 o = cross(v, w) * dot(u, u) + cross(w, u) * dot(v, v) + cross(u, v) * dot(w, w);
  const double circum = length(o) / (12 * std::abs(volume)), in = 3 * std::abs(volume) / area;
  const double aspect = volume > 0 && std::isfinite(circum) ? 3 * in / circum : 0;
  q.min_aspect = std::min(q.min_aspect, aspect);
  aspect_sum += aspect;
}

void Part::add(const Part& other) {
  const TetQuality& o = other.q;
  q.inverted += o.inverted;
  q.volume_mm3 += o.volume_mm3;
  q.min_volume_mm3 = std::min(q.min_volume_mm3, o.min_volume_mm3);
  q.max_volume_mm3 = std::max(q.max_volume_mm3, o.max_volume_mm3);
  q.min_dihedral_deg = std::min(q.min_dihedral_deg, o.min_dihedral_deg);
  q.max_dihedral_deg = std::max(q.max_dihedral_deg, o.max_dihedral_deg);
  q.min_aspect = std::min(q.min_aspect, o.min_aspect);
  q.min_edge_mm = std::min(q.min_edge_mm, o.min_edge_mm);
  q.max_edge_mm = std::max(q.max_edge_mm, o.max_edge_mm);
  for (std::size_t i = 0; i < 18; ++i) q.dihedral_histogram[i] += o.dihedral_histogram[i];
  aspect_sum += other.aspect_sum;
}

// Shapes alone: of a mesh of at least one tetrahedron.
TetQuality shapes_of(const TetMesh& mesh, const Context& context) {
  constexpr std::size_t kGrain = 16384;
  std::vector<Part> parts((mesh.tets.size() + kGrain - 1) / kGrain);
  parallel_for(mesh.tets.size(), kGrain, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    for (std::size_t t = begin; t < end; ++t) {
      std::array<Vec3, 4> p;
      for (std::size_t i = 0; i < 4; ++i) {
        const auto& v = mesh.points_mm[mesh.tets[t][i]];
        p[i] = {v[0], v[1], v[2]};
      }
      parts[begin / kGrain].add_tet(p);
    }
  });
  Part total;
  for (const Part& part : parts) total.add(part);
  total.q.mean_aspect = total.aspect_sum / static_cast<double>(mesh.tets.size());
  return total.q;
}

std::uint64_t unused_points(const TetMesh& mesh) {
  std::vector<std::uint8_t> used(mesh.points_mm.size(), 0);
  for (const auto& t : mesh.tets) {
    for (const auto v : t) used[v] = 1;
  }
  return static_cast<std::uint64_t>(std::count(used.begin(), used.end(), 0));
}

// Faces used more than twice: sort triples.
std::uint64_t faces_of_three_or_more(const TetMesh& mesh) {
  std::vector<std::array<std::uint32_t, 3>> faces;
  faces.reserve(mesh.tets.size() * 4);
  for (const auto& t : mesh.tets) {
    for (std::size_t i = 0; i < 4; ++i) {
      std::array<std::uint32_t, 3> f{t[(i + 1) & 3], t[(i + 2) & 3], t[(i + 3) & 3]};
      std::sort(f.begin(), f.end());
      faces.push_back(f);
    }
  }
  std::sort(faces.begin(), faces.end());
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < faces.size();) {
    std::size_t j = i + 1;
    while (j < faces.size() && faces[j] == faces[i]) ++j;
    if (j - i > 2) ++count;
    i = j;
  }
  return count;
}

// A point just before each boundary triangle must lie outside: crossed diagonals and overlaps show here.
std::uint64_t buried_triangles(const TriMesh& boundary, const Context& context) {
  const SignedDistance solid(soup_of(boundary), context);
  const std::size_t step = std::max<std::size_t>(1, boundary.triangles.size() / 50000);
  const std::size_t samples = (boundary.triangles.size() + step - 1) / step;
  std::vector<std::uint8_t> buried(samples, 0);
  parallel_for(samples, 256, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    for (std::size_t i = begin; i < end; ++i) {
      Vec3 p[3];
      for (std::size_t k = 0; k < 3; ++k) {
        const auto& v = boundary.points_mm[boundary.triangles[i * step][k]];
        p[k] = {v[0], v[1], v[2]};
      }
      const Vec3 n = cross(p[1] - p[0], p[2] - p[0]);
      // Off the centroid, where diagonals of neighbours would pass.
      const Vec3 middle = p[0] * 0.37 + p[1] * 0.33 + p[2] * 0.30;
      buried[i] = solid.inside(middle + normalized(n) * (1e-3 * std::sqrt(length(n)))) ? 1 : 0;
    }
  });
  return static_cast<std::uint64_t>(std::count(buried.begin(), buried.end(), 1));
}

}  // namespace

TetQuality tet_quality(const TetMesh& mesh, const Context& context) {
  if (mesh.tets.empty()) return TetQuality{.points = mesh.points_mm.size()};
  TetQuality total = shapes_of(mesh, context);
  total.points = mesh.points_mm.size();
  total.tets = mesh.tets.size();
  total.unused_points = unused_points(mesh);
  context.progress(0.4, "checking faces");
  total.faces_of_three_or_more = faces_of_three_or_more(mesh);
  const TriMesh boundary = boundary_of(mesh);
  const MeshCheck c = check(boundary);
  total.boundary_triangles = boundary.triangles.size();
  total.boundary_closed = c.watertight() || (c.open_edges == 0 && c.degenerate == 0);
  total.boundary_manifold = c.manifold();
  if (!boundary.triangles.empty()) total.buried_triangles = buried_triangles(boundary, context);
  return total;
}

void report_quality(const TetQuality& q, const Context& context) {
  const auto whole = [](std::uint64_t v) { return static_cast<std::int64_t>(v); };
  context.report("points", whole(q.points));
  context.report("tets", whole(q.tets));
  context.report("inverted", whole(q.inverted));
  context.report("conforming", q.conforming());
  context.report("volume_mm3", q.volume_mm3);
  context.report("min_dihedral_deg", q.min_dihedral_deg);
  context.report("max_dihedral_deg", q.max_dihedral_deg);
  std::string histogram;
  for (std::size_t i = 0; i < 18; ++i) {
    histogram += (i > 0 ? " " : "") + std::to_string(q.dihedral_histogram[i]);
  }
  context.report("dihedrals_by_10_deg", histogram);
  context.report("min_aspect", q.min_aspect);
  context.report("mean_aspect", q.mean_aspect);
  context.report("min_volume_mm3", q.min_volume_mm3);
  context.report("max_volume_mm3", q.max_volume_mm3);
  context.report("min_edge_mm", q.min_edge_mm);
  context.report("max_edge_mm", q.max_edge_mm);
  context.report("boundary_triangles", whole(q.boundary_triangles));
  context.report("boundary_closed", q.boundary_closed);
  context.report("boundary_manifold", q.boundary_manifold);
  context.report("unused_points", whole(q.unused_points));
}

}  // namespace osteo::inline geometry
