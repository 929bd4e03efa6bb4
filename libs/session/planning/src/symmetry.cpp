#include "osteo/session/planning/detail/symmetry.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/core/base/param.h"
#include "osteo/core/base/translate.h"
#include "osteo/core/data/rigid_transform.h"
#include "osteo/geometry/distance/triangle_tree.h"
#include "solve.h"

namespace osteo::inline session {
namespace {

constexpr std::size_t kCoarsePoints = 600, kFinePoints = 3000;
constexpr int kCoarseRounds = 15, kFineRounds = 40;
constexpr double kKept = 2.0 / 3, kTurnDeg = 15, kOtherDeg = 15, kAlike = 1.1, kAlikeMm = 0.05;

struct Place {
  Vec3 at, normal;
};

// Spread evenly over the area, in the order of the triangles.
std::vector<Place> places_on(const TriangleSoup& s, std::size_t count) {
  std::vector<double> until;
  double sum = 0;
  for (const auto& t : s.triangles) {
    const Vec3 a = s.points_mm[t[0]];
    until.push_back(sum += length(cross(s.points_mm[t[1]] - a, s.points_mm[t[2]] - a)) / 2);
  }
  std::vector<Place> places;
  std::size_t t = 0;
  for (std::size_t n = 0; n < count && sum > 0; ++n) {
    const double wanted = sum * (static_cast<double>(n) + 0.5) / static_cast<double>(count);
    while (until[t] < wanted) ++t;
    const auto& c = s.triangles[t];
    const Vec3 a = s.points_mm[c[0]], b = s.points_mm[c[1]], d = s.points_mm[c[2]];
    places.push_back({(a + b + d) / 3, normalized(cross(b - a, d - a))});
  }
  return places;
}

Vec3 reflected(Vec3 v, Vec3 normal) {
  return v - normal * (2 * dot(v, normal));
}

struct Pair {
  double along = 0, apart = 0;
  std::array<double, 3> slope{};
};

class Search {
 public:
  Search(const TriangleSoup& bone, const Context& context) : bone_(bone), context_(context), tree_(bone, context) {}

  // All places, in their order: how far the mirror image is off.
  std::vector<Pair> pairs(const SymmetryPlane& plane, const std::vector<Place>& places, Vec3 u, Vec3 v) const {
    std::vector<Pair> out(places.size());
    parallel_for(places.size(), 64, context_.threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) {
        const Vec3 p = plane.mirrored(places[n].at), facing = reflected(places[n].normal, plane.normal);
        const ClosestPoint c = tree_.closest(p);
        const auto& t = bone_.triangles[c.triangle];
        const Vec3 a = bone_.points_mm[t[0]];
        const Vec3 m = normalized(cross(bone_.points_mm[t[1]] - a, bone_.points_mm[t[2]] - a));
        // The other face of a thin wall is not the image.
        out[n].apart = dot(m, facing) > 0.3 ? c.distance_mm : c.distance_mm + 10;
        out[n].along = dot(m, p - c.point_mm);
        const Vec3 r = places[n].at - plane.at_mm;
        const double h = dot(r, plane.normal);
        // p' = p - 2 h n; n moves by u and v, the plane along n.
        out[n].slope = {2 * dot(m, plane.normal), -2 * (dot(r, u) * dot(m, plane.normal) + h * dot(m, u)),
                        -2 * (dot(r, v) * dot(m, plane.normal) + h * dot(m, v))};
      }
    });
    return out;
  }

  void refine(SymmetryPlane& plane, const std::vector<Place>& places, int rounds) const {
    for (int round = 0; round < rounds; ++round) {
      context_.check_cancelled();
      const Vec3 u = any_perpendicular(plane.normal), v = cross(plane.normal, u);
      const std::vector<Pair> all = pairs(plane, places, u, v);
      std::vector<double> apart;
      for (const Pair& p : all) apart.push_back(p.apart);
      const auto nth = apart.begin() + static_cast<std::ptrdiff_t>(kKept * static_cast<double>(apart.size()));
      std::nth_element(apart.begin(), nth, apart.end());
      Mat3 normal_matrix{{Vec3{}, Vec3{}, Vec3{}}};
      Vec3 right;
      double squares = 0;
      int kept = 0;
      for (const Pair& p : all) {
        if (p.apart > *nth) continue;
        for (std::size_t a = 0; a < 3; ++a) {
          right[a] -= p.slope[a] * p.along;
          for (std::size_t b = 0; b < 3; ++b) normal_matrix.column[b][a] += p.slope[a] * p.slope[b];
        }
        squares += p.along * p.along;
        ++kept;
      }
      plane.residual_mm = std::sqrt(squares / std::max(kept, 1));
      // A surface that is the same all about an axis leaves a turn open; it then stays.
      const double ridge = 1e-9 * (normal_matrix.column[0].x + normal_matrix.column[1].y + normal_matrix.column[2].z);
      for (std::size_t a = 0; a < 3; ++a) normal_matrix.column[a][a] += ridge + 1e-12;
      const Vec3 step = inverse(normal_matrix) * right;
      const Vec3 turn = u * step.y + v * step.z;
      const double most = std::max(1.0, length(turn) / 0.2);
      plane.at_mm += plane.normal * (step.x / most);
      plane.normal = normalized(plane.normal + turn / most);
      if (std::abs(step.x) < 1e-7 && length(turn) < 1e-9) break;
    }
  }

 private:
  const TriangleSoup& bone_;
  const Context& context_;
  TriangleTree tree_;
};

}  // namespace

SymmetryPlane find_symmetry_plane(const TriangleSoup& bone, const Context& context) {
  require_sound(bone);
  const Search search(bone, context);
  const std::vector<Place> coarse = places_on(bone, kCoarsePoints), fine = places_on(bone, kFinePoints);
  if (coarse.empty()) throw Error(ExitCode::failed, "the surface has no area", "give a surface of bone");
  Vec3 middle;
  for (const Place& p : coarse) middle += p.at;
  middle = middle / static_cast<double>(coarse.size());
  std::array<std::array<double, 3>, 3> spread{};
  for (const Place& p : coarse) {
    const Vec3 d = p.at - middle;
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = 0; b < 3; ++b) spread[a][b] += d[a] * d[b];
    }
  }
  const Mat3 axes = planning::principal_axes(spread);
  std::vector<SymmetryPlane> found;
  for (std::size_t a = 0; a < 3; ++a) {
    for (int turn = 0; turn < 5; ++turn) {
      Vec3 n = axes.column[a];
      if (turn > 0) {
        const Vec3 about = axes.column[(a + (turn < 3 ? 1 : 2)) % 3];
        n = rotation_about({}, about, (turn % 2 == 0 ? 1 : -1) * kTurnDeg * std::numbers::pi / 180)(n);
      }
      SymmetryPlane plane{middle, n, 0, 0};
      search.refine(plane, coarse, kCoarseRounds);
      found.push_back(plane);
    }
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const SymmetryPlane& a, const SymmetryPlane& b) { return a.residual_mm < b.residual_mm; });
  SymmetryPlane best = found.front();
  search.refine(best, fine, kFineRounds);
  const double other = std::cos(kOtherDeg * std::numbers::pi / 180);
  for (const SymmetryPlane& p : found) {
    if (std::abs(dot(p.normal, found.front().normal)) > other) continue;
    if (p.residual_mm > 2 * kAlike * found.front().residual_mm + 2 * kAlikeMm) break;
    SymmetryPlane rival = p;
    search.refine(rival, fine, kFineRounds);
    if (std::abs(dot(rival.normal, best.normal)) < other && rival.residual_mm < kAlike * best.residual_mm + kAlikeMm)
      throw Error(ExitCode::failed, tr_later("the surface is as nearly symmetric about another plane"),
                  "give a surface that shows left and right, such as the whole mandible");
    break;
  }
  const Vec3 u = any_perpendicular(best.normal);
  std::size_t near = 0;
  const auto last = search.pairs(best, fine, u, cross(best.normal, u));
  for (const Pair& p : last) near += p.apart <= 1 ? 1 : 0;
  best.within_1_mm = static_cast<double>(near) / static_cast<double>(last.size());
  if (best.within_1_mm < 0.5)
    throw Error(ExitCode::failed,
                "no plane of symmetry: " + format_number(std::round(100 * best.within_1_mm)) +
                    " % of the surface lies within 1 mm of its mirror image, fewer than half",
                "give a bone that shows both sides, or take the bone itself as the target");
  if (best.normal.x < 0) best.normal = -best.normal;
  return best;
}

TriangleSoup mirrored(const TriangleSoup& bone, const SymmetryPlane& plane) {
  TriangleSoup out = bone;
  for (Vec3& p : out.points_mm) p = plane.mirrored(p);
  for (auto& t : out.triangles) std::swap(t[1], t[2]);
  return out;
}

}  // namespace osteo::inline session
