#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/box_intersection_d.h>

#include <algorithm>

#include "osteo/core/base/error.h"
#include "osteo/geometry/cgal/mesh_cgal.h"

namespace osteo::inline geometry {
namespace {

using K = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<K::Point_3>;
using Face = Mesh::Face_index;
namespace PMP = CGAL::Polygon_mesh_processing;

}  // namespace

std::vector<std::pair<std::uint32_t, std::uint32_t>> self_intersections(const TriangleSoup& surface,
                                                                        const Context& context) {
  const Ordered used = ordered(surface, context);
  std::vector<K::Point_3> points;
  for (const Vec3 p : used.soup.points_mm) points.emplace_back(p.x, p.y, p.z);
  // Boxes first, then exactly. As each triangle's points are known by index, sharing is a matter of indices.
  using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, std::uint32_t>;
  std::vector<Box> boxes;
  const auto& triangles = used.soup.triangles;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    boxes.emplace_back(points[triangles[t][0]].bbox() + points[triangles[t][1]].bbox() + points[triangles[t][2]].bbox(),
                       t);
  }
  std::vector<std::pair<std::uint32_t, std::uint32_t>> found;
  const auto test = [&](const Box& x, const Box& y) {
    const std::uint32_t s = std::min(x.info(), y.info()), t = std::max(x.info(), y.info());
    const auto &u = triangles[s], &v = triangles[t];
    std::vector<std::uint32_t> shared;
    for (const auto a : u) {
      if (std::find(v.begin(), v.end(), a) != v.end()) shared.push_back(a);
    }
    const auto triangle = [&](const std::array<std::uint32_t, 3>& w) {
      return K::Triangle_3(points[w[0]], points[w[1]], points[w[2]]);
    };
    const auto other = [&](const std::array<std::uint32_t, 3>& w, std::size_t skip) {
      std::vector<std::uint32_t> rest;
      for (const auto a : w) {
        if (std::find(shared.begin(), shared.begin() + static_cast<std::ptrdiff_t>(skip), a) ==
            shared.begin() + static_cast<std::ptrdiff_t>(skip))
          rest.push_back(a);
      }
      return rest;
    };
    bool hit = false;
    if (shared.empty()) {
      hit = CGAL::do_intersect(triangle(u), triangle(v));
    } else if (shared.size() == 1) {
      // Beyond the shared point: the opposite edge of one meets the other.
      const auto a = other(u, 1), b = other(v, 1);
      hit = CGAL::do_intersect(K::Segment_3(points[a[0]], points[a[1]]), triangle(v)) ||
            CGAL::do_intersect(K::Segment_3(points[b[0]], points[b[1]]), triangle(u));
    } else {
      // Folded onto each other: coplanar, and the two opposite corners on one side of the shared edge.
      const auto a = other(u, 2), b = other(v, 2);
      const auto &p = points[shared[0]], &q = points[shared[1]];
      hit = CGAL::coplanar(p, q, points[a[0]], points[b[0]]) && !CGAL::collinear(p, q, points[a[0]]) &&
            !CGAL::collinear(p, q, points[b[0]]) &&
            CGAL::coplanar_orientation(p, q, points[a[0]], points[b[0]]) == CGAL::POSITIVE;
    }
    if (hit) found.emplace_back(used.source[s], used.source[t]);
  };
  std::size_t calls = 0;
  CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const Box& x, const Box& y) {
    if ((++calls & 0xffffU) == 0) context.check_cancelled();
    test(x, y);
  });
  std::sort(found.begin(), found.end());
  return found;
}

TriangleSoup holes_closed(const TriangleSoup& surface, int max_hole_edges, CgalRepairReport& report,
                          const Context& context) {
  report.holes_filled = report.holes_left = 0;
  const Ordered used = ordered(surface, context);
  std::vector<K::Point_3> points;
  for (const Vec3 p : used.soup.points_mm) points.emplace_back(p.x, p.y, p.z);
  std::vector<std::array<std::size_t, 3>> triangles;
  for (const auto& t : used.soup.triangles) triangles.push_back({t[0], t[1], t[2]});
  PMP::orient_polygon_soup(points, triangles);  // doubles points where the surface is not manifold
  Mesh mesh;
  PMP::polygon_soup_to_polygon_mesh(points, triangles, mesh);
  try {
    std::vector<Mesh::Halfedge_index> borders;
    PMP::extract_boundary_cycles(mesh, std::back_inserter(borders));
    for (const auto h : borders) {
      context.check_cancelled();
      int edges = 0;
      for (auto e = h;; ++edges) {
        e = mesh.next(e);
        if (e == h) break;
      }
      std::vector<Face> faces;
      if (edges + 1 <= max_hole_edges) PMP::triangulate_hole(mesh, h, std::back_inserter(faces));
      if (faces.empty()) {
        ++report.holes_left;
      } else {
        ++report.holes_filled;
      }
    }
  } catch (const CGAL::Failure_exception& e) {
    throw Error(ExitCode::failed, std::string("CGAL failed: ") + e.what());
  }
  TriangleSoup result;
  for (const auto v : mesh.vertices()) {
    const auto& p = mesh.point(v);
    while (result.points_mm.size() < v.idx()) result.points_mm.push_back({});
    result.points_mm.push_back({p.x(), p.y(), p.z()});
  }
  for (const auto f : mesh.faces()) {
    std::array<std::uint32_t, 3> t{};
    std::size_t i = 0;
    for (const auto v : CGAL::vertices_around_face(mesh.halfedge(f), mesh)) {
      if (i < 3) t[i] = static_cast<std::uint32_t>(v.idx());
      ++i;
    }
    result.triangles.push_back(t);
  }
  if (result.triangles.empty()) throw Error(ExitCode::failed, "no triangle of the surface is left after repair");
  return result;
}

}  // namespace osteo::inline geometry
