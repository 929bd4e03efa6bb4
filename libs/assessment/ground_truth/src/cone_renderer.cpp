// A proxy as the libraries of 2006 had it: it runs towards the device until triangles stop it, along one, then along
// the edge of two, into the corner of three (C. Zilles, J. Salisbury, IROS 1995), kept off each by a fixed small
// distance; friction by a cone about the normal (W. Harwin, N. Melder, EuroHaptics 2002). It knows triangles only where
// the way crosses them. Written from the papers, as a baseline.
#include <algorithm>
#include <chrono>
#include <cmath>

#include "osteo/assessment/ground_truth/point_renderer.h"
#include "osteo/geometry/distance/triangle_tree.h"

namespace osteo::inline assessment::truth {
namespace {

// Triangles by the cells of a grid that their boxes meet.
class SegmentFinder {
 public:
  explicit SegmentFinder(const TriangleSoup& soup) : soup_(soup), box_(bounds_of(soup)) {
    const Vec3 size = box_.hi - box_.lo;
    const double most = std::max({size.x, size.y, size.z});
    cell_ = most / std::clamp(std::sqrt(static_cast<double>(soup.triangles.size()) / 3), 4.0, 128.0);
    for (std::size_t a = 0; a < 3; ++a) n_[a] = static_cast<int>(size[a] / cell_) + 1;
    first_.assign(
        static_cast<std::size_t>(n_[0]) * static_cast<std::size_t>(n_[1]) * static_cast<std::size_t>(n_[2]) + 1, 0);
    for (const bool filling : {false, true}) {
      for (std::uint32_t t = 0; t < soup.triangles.size(); ++t) {
        BoxMm b;
        for (const std::uint32_t c : soup.triangles[t]) b.include(soup.points_mm[c]);
        each_cell(b.lo, b.hi, [&](std::size_t cell) {
          if (filling)
            items_[fill_[cell]++] = t;
          else
            ++first_[cell + 1];
        });
      }
      if (filling) break;
      for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
      items_.resize(first_.back());
      fill_.assign(first_.begin(), first_.end() - 1);
    }
    fill_ = {};
    seen_.assign(soup.triangles.size(), 0);
    for (const auto& t : soup.triangles) {
      const Vec3 a = soup.points_mm[t[0]];
      normal_.push_back(normalized(cross(soup.points_mm[t[1]] - a, soup.points_mm[t[2]] - a)));
    }
  }

  struct Found {
    std::uint32_t triangle = ClosestPoint::kNone;
    double share = 2;  // of the way
    double u = 0, v = 0;
  };
  /// The first triangle that the way from `a` to `b` crosses from its outside.
  Found first(Vec3 a, Vec3 b, int& tests) {
    Found found;
    BoxMm box;
    box.include(a);
    box.include(b);
    ++round_;
    const Vec3 way = b - a;
    each_cell(box.lo, box.hi, [&](std::size_t cell) {
      for (std::uint32_t i = first_[cell]; i < first_[cell + 1]; ++i) {
        const std::uint32_t t = items_[i];
        if (seen_[t] == round_) continue;
        seen_[t] = round_;
        ++tests;
        if (dot(way, normal_[t]) >= 0) continue;
        // T. Moeller, B. Trumbore 1997.
        const auto& c = soup_.triangles[t];
        const Vec3 p = soup_.points_mm[c[0]], e1 = soup_.points_mm[c[1]] - p, e2 = soup_.points_mm[c[2]] - p,
                   h = cross(way, e2);
        const double det = dot(e1, h);
        if (det == 0) continue;
        const Vec3 from = a - p, q = cross(from, e1);
        const double u = dot(from, h) / det, v = dot(way, q) / det, s = dot(e2, q) / det;
        if (u < 0 || v < 0 || u + v > 1 || s < 0 || s > 1 || s >= found.share) continue;
        found = {t, s, u, v};
      }
    });
    return found;
  }
  [[nodiscard]] Vec3 normal(std::uint32_t t) const { return normal_[t]; }
  [[nodiscard]] std::size_t memory_bytes() const {
    return items_.size() * 4 + first_.size() * 4 + seen_.size() * 4 + normal_.size() * sizeof(Vec3) +
           soup_.triangles.size() * 12 + soup_.points_mm.size() * sizeof(Vec3);
  }

 private:
  template <class Visit>
  void each_cell(Vec3 lo, Vec3 hi, Visit visit) const {
    std::array<int, 3> from{}, to{};
    for (std::size_t a = 0; a < 3; ++a) {
      from[a] = std::max(0, static_cast<int>(std::floor((lo[a] - box_.lo[a]) / cell_)));
      to[a] = std::min(n_[a] - 1, static_cast<int>(std::floor((hi[a] - box_.lo[a]) / cell_)));
    }
    for (int k = from[2]; k <= to[2]; ++k)
      for (int j = from[1]; j <= to[1]; ++j)
        for (int i = from[0]; i <= to[0]; ++i)
          visit((static_cast<std::size_t>(k) * static_cast<std::size_t>(n_[1]) + static_cast<std::size_t>(j)) *
                    static_cast<std::size_t>(n_[0]) +
                static_cast<std::size_t>(i));
  }
  TriangleSoup soup_;
  BoxMm box_;
  double cell_ = 1;
  std::array<int, 3> n_{};
  std::vector<std::uint32_t> first_, items_, fill_, seen_;
  std::uint32_t round_ = 0;
  std::vector<Vec3> normal_;
};

class ConeRenderer final : public PointRenderer {
 public:
  ConeRenderer(const TriangleSoup& mesh, bool shaded, const RenderSettings& s)
      : begin_(std::chrono::steady_clock::now()),
        finder_(mesh),
        mesh_(mesh),
        shaded_(shaded),
        friction_(s.friction),
        stiffness_(s.stiffness_n_per_mm / s.unit),
        off_(1e-3 * s.unit) {
    corner_.resize(mesh.points_mm.size());
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
      for (const std::uint32_t c : mesh.triangles[t]) corner_[c] += finder_.normal(t);
    for (Vec3& v : corner_) v = normalized(v);
    setup_s_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
    memory_bytes_ = finder_.memory_bytes() + corner_.size() * sizeof(Vec3);
    const BoxMm box = bounds_of(mesh);
    grain_mm_ = length(box.hi - box.lo) / std::sqrt(static_cast<double>(mesh.triangles.size())) / s.unit;
  }
  void place(Vec3 device) override { proxy_ = device; }
  Rendered render(Vec3 device) override {
    Rendered r{{}, device, false, 0};
    Vec3 goal = device, at = proxy_, face{};
    SegmentFinder::Found touched;
    int stopped = 0;
    while (stopped < 3) {
      const auto hit = finder_.first(at, goal, r.operations);
      if (hit.triangle == ClosestPoint::kNone) {
        at = goal;
        break;
      }
      const Vec3 n = finder_.normal(hit.triangle);
      at = at + (goal - at) * hit.share + n * off_;
      if (stopped == 0) {
        face = n;
        touched = hit;
      }
      ++stopped;
      if (stopped == 1) {
        // Along the plane of the first; with friction only as far as the edge of the cone.
        const double depth = dot(at - device, face);
        goal = device + face * depth;
        const Vec3 slide = goal - at;
        const double way = length(slide), held = friction_ * std::max(0.0, depth);
        if (way <= held) break;
        goal = at + slide * ((way - held) / way);
      } else if (stopped == 2) {
        const Vec3 edge = normalized(cross(face, n));
        goal = at + edge * dot(goal - at, edge);
      }
    }
    proxy_ = at;
    r.contact = stopped > 0;
    if (r.contact) {
      Vec3 spring = at - device;
      if (shaded_ && stopped < 3) {
        // Force shading (H. Morgenbesser, M. Srinivasan 1996): as hard as the triangle pushes, along the normal between
        // its corners'. Where the proxy slid on, that of where it is now.
        const auto here = finder_.first(at + face * off_, at - face * (3 * off_), r.operations);
        const auto& where = here.triangle != ClosestPoint::kNone ? here : touched;
        const double depth = dot(spring, face);
        spring += (shaded_normal(where.triangle, where.u, where.v) - face) * depth;
      }
      r.force_n = spring * stiffness_;
      r.contact_mm = at;
    }
    return r;
  }

 private:
  [[nodiscard]] Vec3 shaded_normal(std::uint32_t t, double u, double v) const {
    const auto& c = mesh_.triangles[t];
    return normalized(corner_[c[0]] * (1 - u - v) + corner_[c[1]] * u + corner_[c[2]] * v);
  }
  std::chrono::steady_clock::time_point begin_;
  SegmentFinder finder_;
  TriangleSoup mesh_;
  std::vector<Vec3> corner_;
  bool shaded_;
  double friction_, stiffness_, off_;
  Vec3 proxy_;
};

}  // namespace

std::unique_ptr<PointRenderer> make_cone_renderer(const TriangleSoup& mesh, bool shaded,
                                                  const RenderSettings& settings) {
  return std::make_unique<ConeRenderer>(mesh, shaded, settings);
}

}  // namespace osteo::inline assessment::truth
