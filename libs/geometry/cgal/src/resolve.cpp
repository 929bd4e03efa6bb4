// Self-intersections resolved exactly: triangles are cut along each other, then the pieces that bound the inside are
// kept.
#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Constrained_triangulation_plus_2.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/intersections.h>
#include <CGAL/version.h>

#include <algorithm>
#include <map>
#include <variant>

#include "osteo/core/base/error.h"
#include "osteo/geometry/cgal/mesh_cgal.h"
#include "osteo/geometry/distance/solid.h"

namespace osteo::inline geometry {
namespace {

using E = CGAL::Exact_predicates_exact_constructions_kernel;
// Keeps whole constraints beside their parts: where two cross is computed from their own ends. From the parts' ends,
// which are crossings themselves, exact numbers would grow with every further crossing, without end.
using Cut = CGAL::Constrained_triangulation_plus_2<
    CGAL::Constrained_Delaunay_triangulation_2<E, CGAL::Default, CGAL::Exact_intersections_tag>>;
using Triangle = std::array<std::uint32_t, 3>;

// Where two triangles meet: a point, a segment, or an outline; its points in their order.
using Meeting = std::vector<E::Point_3>;

struct PointsOf {
  Meeting operator()(const E::Point_3& p) const { return {p}; }
  Meeting operator()(const E::Segment_3& s) const { return {s.source(), s.target()}; }
  Meeting operator()(const E::Triangle_3& t) const { return {t[0], t[1], t[2]}; }
  Meeting operator()(const std::vector<E::Point_3>& polygon) const { return polygon; }
};

class Arrangement {
 public:
  Arrangement(const TriangleSoup& soup, const Context& context) : soup_(soup), context_(context) {
    for (const Vec3 p : soup.points_mm) {
      exact_.emplace_back(p.x, p.y, p.z);
      numbers_.emplace(exact_.back(), static_cast<std::uint32_t>(exact_.size() - 1));
    }
  }

  // The same surface, cut. Triangles with the same corners are cut alike.
  TriangleSoup run() {
    std::map<Triangle, std::vector<Triangle>> alike;
    for (const Triangle& t : soup_.triangles) {
      Triangle key = t;
      std::sort(key.begin(), key.end());
      if (key[0] == key[1] || key[1] == key[2] || CGAL::collinear(exact_[t[0]], exact_[t[1]], exact_[t[2]])) continue;
      alike[key].push_back(t);
    }
    TriangleSoup first;
    first.points_mm = soup_.points_mm;
    std::vector<const std::vector<Triangle>*> all;
    for (const auto& [key, list] : alike) {
      first.triangles.push_back(list.front());
      all.push_back(&list);
    }
    std::vector<std::vector<Meeting>> met(first.triangles.size());
    std::size_t done = 0;
    const auto pairs = self_intersections(first, context_);
    for (const auto& [s, t] : pairs) {
      if ((++done & 0xff) == 0) context_.check_cancelled();
      const auto found = CGAL::intersection(triangle(first.triangles[s]), triangle(first.triangles[t]));
      if (!found) continue;
#if CGAL_VERSION_NR >= 1060000000
      const Meeting m = std::visit(PointsOf(), *found);
#else
      const Meeting m = boost::apply_visitor(PointsOf(), *found);
#endif
      met[s].push_back(m);
      met[t].push_back(m);
    }
    TriangleSoup result;
    for (std::size_t t = 0; t < first.triangles.size(); ++t) {
      std::vector<Triangle> pieces{first.triangles[t]};
      if (!met[t].empty()) pieces = cut(first.triangles[t], met[t]);
      for (const Triangle& own : *all[t]) {
        const auto& front = all[t]->front();
        const auto at = static_cast<std::size_t>(std::find(own.begin(), own.end(), front[0]) - own.begin());
        const bool same = own[(at + 1) % 3] == front[1];
        for (Triangle p : pieces) {
          if (!same) std::swap(p[1], p[2]);
          result.triangles.push_back(p);
        }
      }
    }
    // As surfaces are kept and written: what is counted afterwards is what a reader of the file finds.
    const auto kept = [](const E::FT& x) { return double{static_cast<float>(CGAL::to_double(CGAL::exact(x)))}; };
    for (const E::Point_3& p : exact_) result.points_mm.push_back({kept(p.x()), kept(p.y()), kept(p.z())});
    // What was a point of the surface stays where it was, to the bit.
    std::copy(soup_.points_mm.begin(), soup_.points_mm.end(), result.points_mm.begin());
    return result;
  }

 private:
  [[nodiscard]] E::Triangle_3 triangle(const Triangle& t) const {
    return {exact_[t[0]], exact_[t[1]], exact_[t[2]]};
  }

  std::uint32_t number(const E::Point_3& p) {
    const auto [at, made] = numbers_.try_emplace(p, static_cast<std::uint32_t>(exact_.size()));
    if (made) exact_.push_back(p);
    return at->second;
  }

  std::vector<Triangle> cut(const Triangle& t, const std::vector<Meeting>& met) {
    context_.check_cancelled();
    // In the two axes that see most of it.
    const E::Vector_3 normal = CGAL::cross_product(exact_[t[1]] - exact_[t[0]], exact_[t[2]] - exact_[t[0]]);
    int c = 0;
    for (int a = 1; a < 3; ++a) {
      if (CGAL::abs(normal[a]) > CGAL::abs(normal[c])) c = a;
    }
    const int a = (c + 1) % 3, b = (c + 2) % 3;
    const auto flat = [&](const E::Point_3& p) { return E::Point_2(p[a], p[b]); };
    const E::Point_3 o = exact_[t[0]];
    const auto lifted = [&](const E::Point_2& p) {
      E::FT x[3];
      x[a] = p.x();
      x[b] = p.y();
      x[c] = o[c] - (normal[a] * (p.x() - o[a]) + normal[b] * (p.y() - o[b])) / normal[c];
      return E::Point_3(x[0], x[1], x[2]);
    };
    Cut plane;
    for (std::size_t i = 0; i < 3; ++i) plane.insert_constraint(flat(exact_[t[i]]), flat(exact_[t[(i + 1) % 3]]));
    for (const Meeting& m : met) {
      if (m.size() == 1) plane.insert(flat(m[0]));
      for (std::size_t i = 0; i < m.size() && m.size() > 1; ++i) {
        if (m.size() == 2 && i == 1) break;
        plane.insert_constraint(flat(m[i]), flat(m[(i + 1) % m.size()]));
      }
    }
    std::vector<Triangle> pieces;
    for (auto f = plane.finite_faces_begin(); f != plane.finite_faces_end(); ++f) {
      Triangle piece{};
      for (int i = 0; i < 3; ++i) piece[static_cast<std::size_t>(i)] = number(lifted(f->vertex(i)->point()));
      if (CGAL::sign(normal[c]) == CGAL::NEGATIVE) std::swap(piece[1], piece[2]);
      pieces.push_back(piece);
    }
    return pieces;
  }

  const TriangleSoup& soup_;
  const Context& context_;
  std::vector<E::Point_3> exact_;
  std::map<E::Point_3, std::uint32_t> numbers_;
};

}  // namespace

TriangleSoup intersections_resolved(const TriangleSoup& surface, CgalRepairReport& report, const Context& context) {
  report.self_intersections_before = report.self_intersections_after =
      self_intersections(surface, context.sub(0, 0.2)).size();
  if (report.self_intersections_before == 0) return surface;
  try {
    const TriangleSoup whole = compacted(welded(surface));
    TriangleSoup result = compacted(solid_surface(Arrangement(whole, context.sub(0.2, 0.7)).run(), context).soup);
    report.self_intersections_after = self_intersections(result, context.sub(0.7, 0.8)).size();
    // What rounding left is resolved again, as long as it gets less.
    for (std::uint64_t last = report.self_intersections_before;
         report.self_intersections_after > 0 && report.self_intersections_after < last;) {
      last = report.self_intersections_after;
      TriangleSoup next = compacted(solid_surface(Arrangement(result, context).run(), context).soup);
      const std::uint64_t left = self_intersections(next, context).size();
      if (left >= last) break;
      report.self_intersections_after = left;
      result = std::move(next);
    }
    return result;
  } catch (const CGAL::Failure_exception& e) {
    throw Error(ExitCode::failed, std::string("CGAL failed: ") + e.what());
  }
}

}  // namespace osteo::inline geometry
