// One heavy source file: CGAL Mesh_3 (3 GiB, two minutes to compile).
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polyhedral_mesh_domain_3.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/make_mesh_3.h>

#include <cstring>

#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"
#include "osteo/geometry/cgal/mesh_cgal.h"
#include "osteo/geometry/distance/solid.h"
#include "osteo/geometry/distance/triangle_tree.h"

namespace osteo::inline geometry {
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

const char* const kAdvice =
    "try 'osteo mesh-repair' first (--clean does), or the method grid-conforming, which takes any surface";

// Points and tetrahedra as bytes: counts, then both.
std::string refined(const Mesh& mesh, const TriangleSoup& surface, const CgalMeshOptions& options,
                    const Context& context) {
  try {
    CGAL::get_default_random() = CGAL::Random(static_cast<unsigned>(context.seed));
    const Domain domain(mesh, &CGAL::get_default_random());
    const double distance = options.facet_distance_mm > 0 ? options.facet_distance_mm : options.cell_mm / 10;
    using namespace CGAL::parameters;
    C3t3 c3t3;
    const auto make = [&](const auto& size) {
      const Criteria criteria(facet_angle = 25, facet_size = size, facet_distance = distance,
                              cell_radius_edge_ratio = 3, cell_size = size);
      c3t3 = CGAL::make_mesh_3<C3t3>(domain, criteria, no_perturb(), no_exude());
    };
    if (options.surface_cell_mm > 0 && options.surface_cell_mm < options.cell_mm) {
      const TriangleTree tree(surface, Context());
      make(Graded{&tree, options.surface_cell_mm, options.cell_mm});
    } else {
      make(options.cell_mm);
    }
    if (options.optimise) {
      CGAL::perturb_mesh_3(c3t3, domain, time_limit = 60);
      CGAL::exude_mesh_3(c3t3, time_limit = 60);
    }
    std::vector<std::array<float, 3>> points;
    std::vector<std::array<std::uint32_t, 4>> tets;
    std::unordered_map<Tr::Vertex_handle, std::uint32_t, boost::hash<Tr::Vertex_handle>> place;
    for (auto c = c3t3.cells_in_complex_begin(); c != c3t3.cells_in_complex_end(); ++c) {
      std::array<std::uint32_t, 4> t{};
      for (int i = 0; i < 4; ++i) {
        const auto v = c->vertex(i);
        const auto [it, made] = place.try_emplace(v, static_cast<std::uint32_t>(points.size()));
        if (made) {
          const auto& p = v->point();
          points.push_back({static_cast<float>(CGAL::to_double(p.x())), static_cast<float>(CGAL::to_double(p.y())),
                            static_cast<float>(CGAL::to_double(p.z()))});
        }
        t[static_cast<std::size_t>(i)] = it->second;
      }
      tets.push_back(t);
    }
    const std::uint64_t counts[2] = {points.size(), tets.size()};
    std::string bytes(reinterpret_cast<const char*>(counts), sizeof counts);
    bytes.append(reinterpret_cast<const char*>(points.data()), points.size() * sizeof points[0]);
    bytes.append(reinterpret_cast<const char*>(tets.data()), tets.size() * sizeof tets[0]);
    return bytes;
  } catch (const CGAL::Failure_exception& e) {
    throw Error(ExitCode::failed, std::string("CGAL failed: ") + e.what(), kAdvice);
  }
}

}  // namespace

TetMesh tets_by_cgal(const TriangleSoup& surface, const CgalMeshOptions& options, const Context& context) {
  if (!(options.cell_mm > 0)) throw Error(ExitCode::usage, "CGAL needs a size of tetrahedra above 0");
  const Ordered order = ordered(surface, context);
  if (const TriangleSoup whole = welded(surface); !is_closed(whole) && !order.open.empty())
    throw Error(ExitCode::failed, "CGAL needs a closed surface; this one has openings", kAdvice);
  // Before anything is left out: of surfaces that cross no patch lies wholly inside or outside.
  if (!self_intersections(surface, context).empty())
    throw Error(ExitCode::failed, "CGAL needs a surface that does not intersect itself; this one does", kAdvice);
  const TriangleSoup solid = compacted(solid_surface(surface, context).soup);
  if (const std::uint64_t touching = check(mesh_of(solid)).nonmanifold_points; touching > 0)
    context.warn("the surface touches itself at " + std::to_string(touching) +
                 " points; towards such a point CGAL may make ever smaller tetrahedra, until its time is over: "
                 "grid-conforming takes it");
  std::vector<K::Point_3> points;
  for (const Vec3 p : solid.points_mm) points.emplace_back(p.x, p.y, p.z);
  std::vector<std::array<std::size_t, 3>> triangles;
  for (const auto& t : solid.triangles) triangles.push_back({t[0], t[1], t[2]});
  PMP::orient_polygon_soup(points, triangles);
  Mesh mesh;
  PMP::polygon_soup_to_polygon_mesh(points, triangles, mesh);
  if (!CGAL::is_closed(mesh))
    throw Error(ExitCode::failed, "CGAL needs a closed surface; this one has openings", kAdvice);
  // A regular tetrahedron of circumradius r has a volume of 0.51 r^3.
  const double expected =
      inside_volume_mm3(solid, context) / (0.51 * options.cell_mm * options.cell_mm * options.cell_mm);
  if (!(expected < options.most_tets))
    throw Error(ExitCode::resources,
                "CGAL would make over " + format_number(expected) + " tetrahedra of at most " +
                    format_number(options.cell_mm) + " mm, more than the " + format_number(options.most_tets) +
                    " that are allowed",
                "choose a larger spacing");
  context.progress(0.2, "refining");
  const std::string bytes = run_guarded(
      "CGAL", kAdvice, options.limits, [&] { return refined(mesh, surface, options, context); }, context);
  std::uint64_t counts[2] = {0, 0};
  std::memcpy(counts, bytes.data(), sizeof counts);
  TetMesh result;
  result.points_mm.resize(counts[0]);
  result.tets.resize(counts[1]);
  if (result.tets.empty()) throw Error(ExitCode::failed, "CGAL made no tetrahedra", "choose a smaller spacing");
  std::memcpy(static_cast<void*>(result.points_mm.data()), bytes.data() + sizeof counts, counts[0] * 12);
  std::memcpy(static_cast<void*>(result.tets.data()), bytes.data() + sizeof counts + counts[0] * 12, counts[1] * 16);
  context.progress(1.0);
  return result;
}

}  // namespace osteo::inline geometry
