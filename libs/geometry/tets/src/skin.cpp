#include "osteo/geometry/tets/skin.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/geometry/distance/triangle_tree.h"

namespace osteo::inline geometry {
namespace {

Vec3 vec(const std::array<float, 3>& p) {
  return {p[0], p[1], p[2]};
}

// Cells of a uniform grid with the items that touch them, in order of items.
class Cells {
 public:
  Cells(Vec3 lo, Vec3 hi, std::size_t items) : lo_(lo) {
    const Vec3 extent = hi - lo;
    const double largest = std::max({extent.x, extent.y, extent.z, 1e-30});
    const double volume =
        std::max(extent.x, 1e-3 * largest) * std::max(extent.y, 1e-3 * largest) * std::max(extent.z, 1e-3 * largest);
    size_ = std::cbrt(volume / static_cast<double>(std::max<std::size_t>(1, items)));
    for (std::size_t a = 0; a < 3; ++a) n_[a] = std::clamp(static_cast<int>(extent[a] / size_) + 1, 1, 1024);
    first_.assign(
        static_cast<std::size_t>(n_[0]) * static_cast<std::size_t>(n_[1]) * static_cast<std::size_t>(n_[2]) + 1, 0);
  }
  [[nodiscard]] std::array<int, 3> cell(Vec3 p) const {
    std::array<int, 3> c{};
    for (std::size_t a = 0; a < 3; ++a) c[a] = static_cast<int>(std::clamp((p[a] - lo_[a]) / size_, 0.0, n_[a] - 1.0));
    return c;
  }
  template <class Box>  // box(item) -> {lo, hi}
  void fill(std::size_t items, const Box& box) {
    const auto visit = [&](auto&& each) {
      for (std::size_t i = 0; i < items; ++i) {
        const auto [lo, hi] = box(i);
        const auto a = cell(lo), b = cell(hi);
        for (int z = a[2]; z <= b[2]; ++z) {
          for (int y = a[1]; y <= b[1]; ++y) {
            for (int x = a[0]; x <= b[0]; ++x) each(at(x, y, z), static_cast<std::uint32_t>(i));
          }
        }
      }
    };
    visit([&](std::size_t c, std::uint32_t) { ++first_[c + 1]; });
    for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
    items_.resize(first_.back());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    visit([&](std::size_t c, std::uint32_t i) { items_[next[c]++] = i; });
  }
  [[nodiscard]] std::span<const std::uint32_t> items(int x, int y, int z) const {
    const std::size_t c = at(x, y, z);
    return {items_.data() + first_[c], first_[c + 1] - first_[c]};
  }
  [[nodiscard]] const std::array<int, 3>& n() const { return n_; }
  [[nodiscard]] double size() const { return size_; }

 private:
  [[nodiscard]] std::size_t at(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(n_[1]) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(n_[0]) +
           static_cast<std::size_t>(x);
  }
  Vec3 lo_;
  double size_ = 1;
  std::array<int, 3> n_{};
  std::vector<std::uint32_t> first_, items_;
};

template <class Points>
std::pair<Vec3, Vec3> bounds(const Points& points) {
  Vec3 lo{1e300, 1e300, 1e300}, hi{-1e300, -1e300, -1e300};
  for (const auto& p : points) {
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], static_cast<double>(p[a]));
      hi[a] = std::max(hi[a], static_cast<double>(p[a]));
    }
  }
  return {lo, hi};
}

// Barycentric coordinates; false when the tetrahedron has no volume.
bool barycentric(const TetMesh& mesh, std::uint32_t tet, Vec3 p, double w[4]) {
  const auto& t = mesh.tets[tet];
  const Vec3 a = vec(mesh.points_mm[t[0]]), b = vec(mesh.points_mm[t[1]]) - a, c = vec(mesh.points_mm[t[2]]) - a,
             d = vec(mesh.points_mm[t[3]]) - a, q = p - a;
  const double volume = dot(cross(b, c), d);
  if (!(volume > 0)) return false;
  w[1] = dot(cross(q, c), d) / volume;
  w[2] = dot(cross(b, q), d) / volume;
  w[3] = dot(cross(b, c), q) / volume;
  w[0] = 1 - w[1] - w[2] - w[3];
  return true;
}

Vec3 normal_of(std::span<const std::array<float, 3>> points, const std::array<std::uint32_t, 3>& t) {
  const Vec3 a = vec(points[t[0]]);
  return normalized(cross(vec(points[t[1]]) - a, vec(points[t[2]]) - a));
}

}  // namespace

Skin::Skin(const TriMesh& surface, const TetMesh& rest, const SkinOptions& options, const Context& context)
    : count_(surface.points_mm.size()), mesh_points_(rest.points_mm.size()) {
  if (rest.tets.empty()) throw Error(ExitCode::failed, "the mesh has no tetrahedra to bind a surface to");
  if (options.method == SkinMethod::embedded) {
    embed(surface, rest, context);
  } else {
    frame(surface, rest, std::clamp(options.neighbours, 1, 16));
  }
}

void Skin::embed(const TriMesh& surface, const TetMesh& rest, const Context& context) {
  const auto [lo, hi] = bounds(rest.points_mm);
  Cells cells(lo, hi, rest.tets.size());
  cells.fill(rest.tets.size(), [&](std::size_t i) {
    Vec3 a{1e300, 1e300, 1e300}, b{-1e300, -1e300, -1e300};
    for (const auto v : rest.tets[i]) {
      for (std::size_t k = 0; k < 3; ++k) {
        a[k] = std::min(a[k], static_cast<double>(rest.points_mm[v][k]));
        b[k] = std::max(b[k], static_cast<double>(rest.points_mm[v][k]));
      }
    }
    return std::pair{a, b};
  });
  embeddings_.resize(count_);
  std::vector<std::uint8_t> inside(count_, 0);
  const auto bind = [&](std::size_t i, std::uint32_t tet, const double* w) {
    embeddings_[i].v = rest.tets[tet];
    for (std::size_t k = 0; k < 4; ++k) embeddings_[i].w[k] = static_cast<float>(w[k]);
  };
  parallel_for(count_, 1024, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    std::uint32_t last = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 p = vec(surface.points_mm[i]);
      double best = -1e-6, best_w[4] = {0, 0, 0, 0};
      std::uint32_t best_tet = 0;
      const auto offer = [&](std::uint32_t tet) {
        double w[4];
        if (!barycentric(rest, tet, p, w)) return false;
        const double least = std::min({w[0], w[1], w[2], w[3]});
        if (least > best) {
          best = least;
          best_tet = tet;
          std::copy(w, w + 4, best_w);
        }
        return least > 0;
      };
      bool found =
          begin != i && inside[i - 1] != 0 && offer(last);  // neighbours in the list are often neighbours in space
      if (!found) {
        const auto c = cells.cell(p);
        for (const std::uint32_t tet : cells.items(c[0], c[1], c[2])) {
          if (offer(tet)) break;
        }
      }
      if (best > -1e-6) {
        inside[i] = 1;
        last = best_tet;
        bind(i, best_tet, best_w);
      }
    }
  });
  outside_ = static_cast<std::size_t>(std::count(inside.begin(), inside.end(), 0));
  if (outside_ == 0) return;
  // Outside: continued linearly from a tetrahedron at the nearest boundary triangle. Of those that touch it the one
  // whose shares stay smallest: a flat or tiny one would multiply every rounding of its corners.
  std::vector<std::uint32_t> point_of;
  const TriMesh boundary = boundary_of(rest, &point_of);
  std::vector<std::uint32_t> first(rest.points_mm.size() + 1, 0);
  for (const auto& t : rest.tets) {
    for (const auto v : t) ++first[v + 1];
  }
  for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
  std::vector<std::uint32_t> around(rest.tets.size() * 4), next(first.begin(), first.end() - 1);
  for (std::uint32_t t = 0; t < rest.tets.size(); ++t) {
    for (const auto v : rest.tets[t]) around[next[v]++] = t;
  }
  const TriangleTree tree(soup_of(boundary), context);
  parallel_for(count_, 1024, context.threads, [&](std::size_t begin, std::size_t end) {
    std::uint32_t hint = ClosestPoint::kNone;
    for (std::size_t i = begin; i < end; ++i) {
      if (inside[i] != 0) continue;
      const Vec3 p = vec(surface.points_mm[i]);
      const ClosestPoint c = tree.closest(p, hint);
      hint = c.triangle;
      const auto& f = boundary.triangles[c.triangle];
      double least = std::numeric_limits<double>::infinity();
      for (const std::uint32_t corner : f) {
        const std::uint32_t u = point_of[corner];
        for (std::uint32_t k = first[u]; k < first[u + 1]; ++k) {
          double weights[4] = {0, 0, 0, 0};
          if (!barycentric(rest, around[k], p, weights)) continue;
          double most = 0;
          for (const double x : weights) most = std::max(most, std::abs(x));
          if (!(most < least)) continue;
          least = most;
          bind(i, around[k], weights);
        }
      }
      const double one[4] = {1, 0, 0, 0};
      if (!(least < std::numeric_limits<double>::infinity())) bind(i, around[first[point_of[f[0]]]], one);
    }
  });
}

// x: the surface normal; y: the part of the first surface edge at right angles to it; z: x cross y.
std::array<Vec3, 3> Skin::axes(const FrameOf& f, std::span<const std::array<float, 3>> points) const {
  Vec3 n;
  for (std::uint32_t k = f.first; k < f.first + f.count; ++k) n += normal_of(points, fan_[k]);
  n = normalized(n);
  const Vec3 e = vec(points[f.edge_to]) - vec(points[f.point]);
  Vec3 y = normalized(e - n * dot(e, n));
  if (!(dot(y, y) > 0)) y = any_perpendicular(n);
  return {n, y, cross(n, y)};
}

void Skin::frame(const TriMesh& surface, const TetMesh& rest, int neighbours) {
  std::vector<std::uint32_t> point_of;
  const TriMesh boundary = boundary_of(rest, &point_of);
  const std::size_t n = boundary.points_mm.size();
  neighbours_ = static_cast<int>(std::min<std::size_t>(static_cast<std::size_t>(neighbours), n));
  std::vector<std::vector<std::uint32_t>> triangles(n);
  for (std::uint32_t t = 0; t < boundary.triangles.size(); ++t) {
    for (const auto v : boundary.triangles[t]) triangles[v].push_back(t);
  }
  const std::span<const std::array<float, 3>> points(rest.points_mm.data(), rest.points_mm.size());
  std::vector<std::array<Vec3, 3>> axes_of;
  for (std::uint32_t v = 0; v < n; ++v) {
    FrameOf f{point_of[v], point_of[v], static_cast<std::uint32_t>(fan_.size()),
              static_cast<std::uint32_t>(triangles[v].size())};
    Vec3 sum;
    for (const std::uint32_t t : triangles[v]) {
      const auto& c = boundary.triangles[t];
      fan_.push_back({point_of[c[0]], point_of[c[1]], point_of[c[2]]});
      sum += normal_of(points, fan_.back());
    }
    // Where parts of the surface meet in a point or an edge, their normals may cancel: then one triangle's counts.
    if (length(sum) < 0.1) {
      f.count = 1;
      fan_.resize(f.first + 1);
      sum = normal_of(points, fan_.back());
    }
    // The edge that is most at right angles to the normal: one along it gives no second axis.
    const Vec3 up = normalized(sum);
    double widest = -1;
    for (const std::uint32_t t : triangles[v]) {
      for (const auto w : boundary.triangles[t]) {
        const Vec3 e = normalized(vec(points[point_of[w]]) - vec(points[f.point]));
        const double wide = w == v ? -1 : length(cross(e, up));
        if (wide > widest + 1e-9) widest = wide, f.edge_to = point_of[w];
      }
    }
    frames_.push_back(f);
    axes_of.push_back(axes(f, points));
  }
  const auto [lo, hi] = bounds(boundary.points_mm);
  Cells cells(lo, hi, n);
  cells.fill(n, [&](std::size_t i) { return std::pair{vec(boundary.points_mm[i]), vec(boundary.points_mm[i])}; });
  std::vector<std::pair<double, std::uint32_t>> near;
  for (const auto& q : surface.points_mm) {
    const Vec3 p = vec(q);
    // Rings of cells, until the next ring cannot hold anything nearer.
    const auto c = cells.cell(p);
    const int most = std::max({cells.n()[0], cells.n()[1], cells.n()[2]});
    double outside = 0;
    for (std::size_t a = 0; a < 3; ++a) outside = std::max({outside, lo[a] - p[a], p[a] - hi[a]});
    near.clear();
    for (int ring = 0; ring <= most; ++ring) {
      for (int z = std::max(0, c[2] - ring); z <= std::min(cells.n()[2] - 1, c[2] + ring); ++z) {
        for (int y = std::max(0, c[1] - ring); y <= std::min(cells.n()[1] - 1, c[1] + ring); ++y) {
          const bool edge = std::abs(z - c[2]) == ring || std::abs(y - c[1]) == ring;
          for (int x = c[0] - ring; x <= c[0] + ring; x += edge || ring == 0 ? 1 : 2 * ring) {
            if (x < 0 || x >= cells.n()[0]) continue;
            for (const std::uint32_t i : cells.items(x, y, z)) {
              const Vec3 d = vec(boundary.points_mm[i]) - p;
              near.emplace_back(dot(d, d), i);
            }
          }
        }
      }
      if (static_cast<int>(near.size()) < neighbours_) continue;
      std::nth_element(near.begin(), near.begin() + neighbours_ - 1, near.end());
      const double reach = ring * cells.size() - outside;
      if (ring == most || (reach > 0 && near[static_cast<std::size_t>(neighbours_ - 1)].first <= reach * reach)) break;
    }
    std::sort(near.begin(), near.end());
    double total = 0;
    const double least = near[0].first * 1e-12 + 1e-30;  // on a point of the mesh: that one alone
    for (int k = 0; k < neighbours_; ++k) total += 1 / std::max(near[static_cast<std::size_t>(k)].first, least);
    for (int k = 0; k < neighbours_; ++k) {
      const auto [d2, i] = near[static_cast<std::size_t>(k)];
      const Vec3 offset = p - vec(boundary.points_mm[i]);
      const auto& e = axes_of[i];
      votes_.push_back({i,
                        static_cast<float>(1 / std::max(d2, least) / total),
                        {static_cast<float>(dot(e[0], offset)), static_cast<float>(dot(e[1], offset)),
                         static_cast<float>(dot(e[2], offset))}});
    }
  }
}

void Skin::apply(std::span<const std::array<float, 3>> points, std::span<std::array<float, 3>> out) const {
  if (points.size() != mesh_points_ || out.size() != count_) {
    throw Error(ExitCode::usage, "the moved mesh has " + std::to_string(points.size()) + " points; at rest it had " +
                                     std::to_string(mesh_points_));
  }
  for (std::size_t i = 0; i < embeddings_.size(); ++i) {
    // From one corner on: shares are rounded, and what they do not add up to is of an edge's length then, not of the
    // distance to the origin.
    const Embedding& e = embeddings_[i];
    const Vec3 a = vec(points[e.v[0]]);
    Vec3 p = a;
    for (std::size_t k = 1; k < 4; ++k) p += (vec(points[e.v[k]]) - a) * static_cast<double>(e.w[k]);
    out[i] = to_floats(p);
  }
  if (frames_.empty()) return;
  std::vector<std::array<Vec3, 3>> now(frames_.size());
  for (std::size_t f = 0; f < frames_.size(); ++f) now[f] = axes(frames_[f], points);
  for (std::size_t i = 0; i < count_; ++i) {
    Vec3 p;
    for (int k = 0; k < neighbours_; ++k) {
      const Vote& v = votes_[i * static_cast<std::size_t>(neighbours_) + static_cast<std::size_t>(k)];
      const auto& e = now[v.frame];
      const Vec3 at = vec(points[frames_[v.frame].point]) + e[0] * static_cast<double>(v.offset[0]) +
                      e[1] * static_cast<double>(v.offset[1]) + e[2] * static_cast<double>(v.offset[2]);
      p += at * static_cast<double>(v.weight);
    }
    out[i] = {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
  }
}

}  // namespace osteo::inline geometry
