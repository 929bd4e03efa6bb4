#include "scene_parts.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "osteo/geometry/mesh/bone_surface.h"
#include "osteo/simulation/bone/live_surface.h"
#include "osteo/simulation/bone/world_mesh.h"

namespace osteo::inline assessment::review {
namespace {

// Points that no triangle uses go.
TriMesh compacted(const TriMesh& mesh) {
  constexpr std::uint32_t kNone = 0xffffffffU;
  std::vector<std::uint32_t> now(mesh.points_mm.size(), kNone);
  TriMesh m;
  for (auto t : mesh.triangles) {
    for (std::uint32_t& p : t) {
      if (now[p] == kNone) {
        now[p] = static_cast<std::uint32_t>(m.points_mm.size());
        m.points_mm.push_back(mesh.points_mm[p]);
        if (!mesh.normals.empty()) m.normals.push_back(mesh.normals[p]);
      }
      p = now[p];
    }
    m.triangles.push_back(t);
  }
  return m;
}

void set_normals(TriMesh& m) {
  std::vector<Vec3> sum(m.points_mm.size());
  for (const auto& t : m.triangles) {
    const Vec3 a = from_floats(m.points_mm[t[0]]);
    const Vec3 n = cross(from_floats(m.points_mm[t[1]]) - a, from_floats(m.points_mm[t[2]]) - a);
    for (const std::uint32_t p : t) sum[p] += n;
  }
  m.normals.resize(sum.size());
  for (std::size_t p = 0; p < sum.size(); ++p)
    m.normals[p] = to_floats(length(sum[p]) > 0 ? normalized(sum[p]) : Vec3{0, 0, 1});
}

}  // namespace

TriMesh blob_of(const std::vector<VisibilityMetric::Voxel>& voxels, const World& begin, const Context& context) {
  TriMesh all;
  std::vector<bool> taken(voxels.size(), false);
  for (const PlacedBody& body : begin.bodies()) {
    const Frame& frame = body.body->bone.frame();
    const double mm3 = frame.voxel_volume_mm3();
    std::vector<Ijk> at;
    Ijk lo{1 << 30, 1 << 30, 1 << 30};
    for (std::size_t n = 0; n < voxels.size(); ++n) {
      if (taken[n] || std::abs(static_cast<double>(voxels[n].mm3) - mm3) > 0.01 * mm3) continue;
      taken[n] = true;
      const Vec3 x = frame.index_from_world(voxels[n].own_mm);
      at.push_back(
          {static_cast<int>(std::lround(x.x)), static_cast<int>(std::lround(x.y)), static_cast<int>(std::lround(x.z))});
      lo = {std::min(lo.i, at.back().i), std::min(lo.j, at.back().j), std::min(lo.k, at.back().k)};
    }
    if (at.empty()) continue;
    lo = {lo.i - 2, lo.j - 2, lo.k - 2};
    Frame own = frame;
    own.origin_mm = frame.world_from_index({double(lo.i), double(lo.j), double(lo.k)});
    Ijk hi{0, 0, 0};
    std::map<std::array<int, 3>, int> bricks;
    for (Ijk& p : at) {
      p = {p.i - lo.i, p.j - lo.j, p.k - lo.k};
      hi = {std::max(hi.i, p.i), std::max(hi.j, p.j), std::max(hi.k, p.k)};
      bricks[{p.i >> 3, p.j >> 3, p.k >> 3}] = 1;
    }
    own.dims = {hi.i + 3, hi.j + 3, hi.k + 3};
    std::vector<Ijk> wanted;
    for (const auto& [b, one] : bricks) wanted.push_back({b[0], b[1], b[2]});
    BrickGrid grid(own, wanted);
    for (const Ijk p : at) grid.set(grid.find(p.i, p.j, p.k), 1);
    append(all, surface_nets(grid, 0.5F, context).mesh);
  }
  if (!all.triangles.empty()) set_normals(all);
  return all;
}

TriMesh bone_at_rest(const World& world, const Context& context) {
  TriMesh all;
  for (const PlacedBody& b : world.bodies()) {
    LiveSurface surface(b.body->bone, context);
    surface.shade(context);
    append(all, surface.joined().mesh);
  }
  return all;
}

TriMesh within(const TriMesh& mesh, Vec3 centre_mm, double radius_mm) {
  TriMesh part;
  part.points_mm = mesh.points_mm;
  part.normals = mesh.normals;
  std::vector<bool> in(mesh.points_mm.size());
  for (std::size_t p = 0; p < in.size(); ++p) in[p] = length(from_floats(mesh.points_mm[p]) - centre_mm) <= radius_mm;
  for (const auto& t : mesh.triangles) {
    if (in[t[0]] || in[t[1]] || in[t[2]]) part.triangles.push_back(t);
  }
  return compacted(part);
}

TriMesh simplified(const TriMesh& mesh, std::size_t triangles, double error_mm) {
  if (mesh.triangles.empty()) return mesh;
  TriMesh coarse = mesh;
  const std::size_t points = mesh.points_mm.size();
  const float scale = meshopt_simplifyScale(mesh.points_mm.front().data(), points, sizeof(mesh.points_mm.front()));
  const auto reduce = [&](std::size_t to, double error) {
    const std::size_t kept =
        meshopt_simplify(coarse.triangles.front().data(), mesh.triangles.front().data(), 3 * mesh.triangles.size(),
                         mesh.points_mm.front().data(), points, sizeof(mesh.points_mm.front()), 3 * to,
                         scale > 0 ? static_cast<float>(error) / scale : 0.01F, 0, nullptr);
    coarse.triangles.resize(kept / 3);
  };
  // First what the eye will not miss; more only where it is still too much.
  reduce(0, error_mm);
  if (coarse.triangles.size() > triangles) {
    coarse.triangles.resize(mesh.triangles.size());
    reduce(triangles, 20 * error_mm);
  }
  coarse = compacted(coarse);
  if (coarse.normals.empty()) set_normals(coarse);
  return coarse;
}

TriMesh dots_at(const std::vector<Vec3>& places, double radius, std::size_t most) {
  // Rings of a sphere; the poles are rings without width.
  const std::uint32_t rings = radius < 0.6 ? 4 : 16, around = 2 * rings;
  TriMesh one;
  for (std::uint32_t a = 0; a <= rings; ++a) {
    for (std::uint32_t b = 0; b < around; ++b) {
      const double polar = std::numbers::pi * a / rings, turn = 2 * std::numbers::pi * b / around;
      one.normals.push_back(
          to_floats({std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn), std::cos(polar)}));
    }
  }
  for (std::uint32_t a = 0; a < rings; ++a) {
    for (std::uint32_t b = 0; b < around; ++b) {
      const std::uint32_t p = a * around + b, q = a * around + (b + 1) % around;
      if (a > 0) one.triangles.push_back({p, p + around, q});
      if (a + 1 < rings) one.triangles.push_back({q, p + around, q + around});
    }
  }
  TriMesh m;
  const std::size_t n = std::min(most, places.size());
  for (std::size_t d = 0; d < n; ++d) {
    const Vec3 at = places[d * places.size() / n];
    const auto first = static_cast<std::uint32_t>(m.points_mm.size());
    for (const auto& normal : one.normals) {
      m.points_mm.push_back(to_floats(at + from_floats(normal) * radius));
      m.normals.push_back(normal);
    }
    for (const auto& f : one.triangles) m.triangles.push_back({first + f[0], first + f[1], first + f[2]});
  }
  return m;
}

Ball around(const std::vector<Vec3>& places) {
  if (places.empty()) return {};
  Vec3 lo = places.front(), hi = lo;
  for (const Vec3 p : places) {
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], p[a]);
      hi[a] = std::max(hi[a], p[a]);
    }
  }
  Ball ball{(lo + hi) * 0.5, 0};
  for (const Vec3 p : places) ball.radius_mm = std::max(ball.radius_mm, length(p - ball.centre_mm));
  return ball;
}

Ball close_to(Vec3 at, const std::vector<Vec3>& places) {
  constexpr double kFarMm = 25;
  std::vector<double> off;
  for (const Vec3 p : places) {
    if (const double d = length(p - at); d <= kFarMm) off.push_back(d);
  }
  if (off.empty()) return {at, 5};
  std::sort(off.begin(), off.end());
  return {at, off[(off.size() - 1) * 9 / 10]};
}

Lookout look_at_places(const World& world, const std::vector<Vec3>& places, Vec3 wish) {
  constexpr int kDirections = 200;
  constexpr std::size_t kPlaces = 60;
  constexpr double kFarMm = 300;
  const BoneSight sight(world);
  const std::size_t n = std::min(kPlaces, places.size());
  Lookout best{wish, -1};
  double best_rank = -1e9;
  for (int d = -1; d < kDirections; ++d) {
    // A spiral of golden angles over the sphere.
    const double z = 1 - (2.0 * std::max(d, 0) + 1) / kDirections, r = std::sqrt(std::max(0.0, 1 - z * z));
    const double turn = std::numbers::pi * (3 - std::sqrt(5.0)) * d;
    const Vec3 eye = d < 0 ? wish : Vec3{r * std::cos(turn), r * std::sin(turn), z};
    const double like = dot(eye, wish);
    if (like < -0.2) continue;  // from behind nobody has looked
    std::size_t seen = 0;
    for (std::size_t p = 0; p < n; ++p) {
      // What is asked of lies in bone or at its face: one begins a little in front of it.
      const Vec3 at = places[p * places.size() / n] + eye * 1.0;
      if (!sight.blocked(at, at + eye * kFarMm)) ++seen;
    }
    const double share = n == 0 ? 0 : static_cast<double>(seen) / static_cast<double>(n), rank = share + 0.3 * like;
    if (rank > best_rank) {
      best_rank = rank;
      best = {eye, share};
    }
  }
  return best;
}

}  // namespace osteo::inline assessment::review
