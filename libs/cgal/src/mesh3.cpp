// One heavy source file: CGAL Mesh_3 (3 GiB, two minutes to compile).
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Polyhedral_mesh_domain_3.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/make_mesh_3.h>

#include "osteo/base/error.h"
#include "osteo/cgal/mesh_cgal.h"
#include "osteo/distance/triangle_tree.h"

namespace osteo {
namespace {

using K = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<K::Point_3>;
using Domain = CGAL::Polyhedral_mesh_domain_3<Mesh, K>;
using Tr = CGAL::Mesh_triangulation_3<Domain, CGAL::Default, CGAL::Sequential_tag>::type;
using C3t3 = CGAL::Mesh_complex_3_in_triangulation_3<Tr>;
using Criteria = CGAL::Mesh_criteria_3<Tr>;
namespace PMP = CGAL::Polygon_mesh_processing;

// Small at the surface, growing with the distance from it.
struct Graded {
  using FT = double;
  using Point_3 = Tr::Geom_traits::Point_3;
  using Index = Domain::Index;
  const TriangleTree* tree;
  double at_surface, inside;
  FT operator()(const Point_3& p, int, const Index&) const {
    return std::min(inside, at_surface + 0.5 * tree->closest({p.x(), p.y(), p.z()}).distance_mm);
  }
};

}  // namespace

TetMesh tets_by_cgal(const TriangleSoup& surface, const CgalMeshOptions& options, const Context& context) {
  const Ordered used = ordered(surface, context);
  std::vector<K::Point_3> points;
  for (const Vec3 p : used.soup.points_mm) points.emplace_back(p.x, p.y, p.z);
  std::vector<std::array<std::size_t, 3>> triangles;
  for (const auto& t : used.soup.triangles) triangles.push_back({t[0], t[1], t[2]});
  PMP::orient_polygon_soup(points, triangles);
  Mesh mesh;
  PMP::polygon_soup_to_polygon_mesh(points, triangles, mesh);
  const std::string advice = "try 'osteo mesh-repair' first, or the method grid-conforming, which takes any surface";
  if (!CGAL::is_closed(mesh)) throw Error(ExitCode::failed, "CGAL needs a closed surface; this one has openings", advice);
  if (PMP::does_self_intersect(mesh))
    throw Error(ExitCode::failed, "CGAL needs a surface that does not intersect itself; this one does", advice);
  context.progress(0.2, "refining");
  try {
    CGAL::get_default_random() = CGAL::Random(static_cast<unsigned>(context.seed));
    const Domain domain(mesh, &CGAL::get_default_random());
    const double distance = options.facet_distance_mm > 0 ? options.facet_distance_mm : options.cell_mm / 10;
    using namespace CGAL::parameters;
    C3t3 c3t3;
    const auto make = [&](const auto& size) {
      const Criteria criteria(facet_angle = 25, facet_size = size, facet_distance = distance, cell_radius_edge_ratio = 3, cell_size = size);
      c3t3 = CGAL::make_mesh_3<C3t3>(domain, criteria, no_perturb(), no_exude());
    };
    if (options.surface_cell_mm > 0 && options.surface_cell_mm < options.cell_mm) {
      const TriangleTree tree(surface, context);
      make(Graded{&tree, options.surface_cell_mm, options.cell_mm});
    } else {
      make(options.cell_mm);
    }
    context.progress(0.6, "improving");
    if (options.optimise) {
      CGAL::perturb_mesh_3(c3t3, domain, time_limit = 60);
      CGAL::exude_mesh_3(c3t3, time_limit = 60);
    }
    TetMesh result;
    std::unordered_map<Tr::Vertex_handle, std::uint32_t, boost::hash<Tr::Vertex_handle>> place;
    for (auto c = c3t3.cells_in_complex_begin(); c != c3t3.cells_in_complex_end(); ++c) {
      std::array<std::uint32_t, 4> t{};
      for (int i = 0; i < 4; ++i) {
        const auto v = c->vertex(i);
        const auto [it, made] = place.try_emplace(v, static_cast<std::uint32_t>(result.points_mm.size()));
        if (made) {
          const auto& p = v->point();
          result.points_mm.push_back({static_cast<float>(CGAL::to_double(p.x())), static_cast<float>(CGAL::to_double(p.y())),
                                      static_cast<float>(CGAL::to_double(p.z()))});
        }
        t[static_cast<std::size_t>(i)] = it->second;
      }
      result.tets.push_back(t);
    }
    if (result.tets.empty()) throw Error(ExitCode::failed, "CGAL made no tetrahedra", "choose a smaller spacing");
    context.progress(1.0);
    return result;
  } catch (const CGAL::Failure_exception& e) {
    throw Error(ExitCode::failed, std::string("CGAL failed: ") + e.what(), advice);
  }
}

}  // namespace osteo
