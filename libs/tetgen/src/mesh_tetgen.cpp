#include "osteo/tetgen/mesh_tetgen.h"

#define TETLIBRARY
#include <tetgen.h>

#include <string>

#include "osteo/base/error.h"
#include "osteo/base/param.h"

namespace osteo {

TetMesh tets_by_tetgen(const TriangleSoup& surface, const TetgenOptions& options, const Context& context) {
  const Ordered used = ordered(surface, context);
  const std::string advice = "try 'osteo mesh-repair' first, or the method grid-conforming, which takes any surface";
  if (!used.open.empty()) {
    throw Error(ExitCode::failed, "TetGen needs a closed surface; " + std::to_string(used.open.size()) + " edges of this one are open",
                advice);
  }
  tetgenio in, out;
  in.firstnumber = 0;
  in.numberofpoints = static_cast<int>(used.soup.points_mm.size());
  in.pointlist = new REAL[used.soup.points_mm.size() * 3];
  for (std::size_t i = 0; i < used.soup.points_mm.size(); ++i) {
    for (std::size_t a = 0; a < 3; ++a) in.pointlist[3 * i + a] = used.soup.points_mm[i][a];
  }
  in.numberoffacets = static_cast<int>(used.soup.triangles.size());
  in.facetlist = new tetgenio::facet[used.soup.triangles.size()];
  for (std::size_t i = 0; i < used.soup.triangles.size(); ++i) {
    tetgenio::facet& f = in.facetlist[i];
    tetgenio::init(&f);
    f.numberofpolygons = 1;
    f.polygonlist = new tetgenio::polygon[1];
    tetgenio::init(&f.polygonlist[0]);
    f.polygonlist[0].numberofvertices = 3;
    f.polygonlist[0].vertexlist = new int[3];
    for (std::size_t k = 0; k < 3; ++k) f.polygonlist[0].vertexlist[k] = static_cast<int>(used.soup.triangles[i][k]);
  }
  context.progress(0.1, "looking for triangles that cross");
  try {
    // First, since TetGen 1.5.0 ends the program when it meets them while meshing.
    tetgenio crossing;
    char detect[] = "dQ";
    tetrahedralize(detect, &in, &crossing);
    if (crossing.numberoftrifaces > 0)
      throw Error(ExitCode::failed,
                  "TetGen needs a surface that does not intersect itself; " + std::to_string(crossing.numberoftrifaces) +
                      " triangles of this one do",
                  advice);
  } catch (const int code) {
    throw Error(ExitCode::failed, "TetGen cannot tell whether the surface intersects itself (its code " + std::to_string(code) + ")",
                advice);
  }
  std::string switches = "pQq" + format_number(options.radius_edge_ratio);
  if (options.min_dihedral_deg > 0) switches += "/" + format_number(options.min_dihedral_deg);
  if (options.max_volume_mm3 > 0) switches += "a" + format_number(options.max_volume_mm3);
  context.progress(0.2, "meshing");
  try {
    tetrahedralize(switches.data(), &in, &out);
  } catch (const int code) {
    const char* const reason = code == 1    ? "it ran out of memory"
                               : code == 3  ? "the surface intersects itself"
                               : code == 4  ? "features are smaller than its precision"
                               : code == 5  ? "two triangles are nearly coplanar"
                               : code == 10 ? "an input error"
                                            : "an internal error";
    throw Error(ExitCode::failed, std::string("TetGen failed: ") + reason + " (its code " + std::to_string(code) + ")", advice);
  }
  TetMesh mesh;
  for (int i = 0; i < out.numberofpoints; ++i) {
    mesh.points_mm.push_back({static_cast<float>(out.pointlist[3 * i]), static_cast<float>(out.pointlist[3 * i + 1]),
                              static_cast<float>(out.pointlist[3 * i + 2])});
  }
  for (int i = 0; i < out.numberoftetrahedra; ++i) {
    const int* v = out.tetrahedronlist + static_cast<std::ptrdiff_t>(i) * out.numberofcorners;
    std::array<std::uint32_t, 4> t{static_cast<std::uint32_t>(v[0]), static_cast<std::uint32_t>(v[1]), static_cast<std::uint32_t>(v[2]),
                                   static_cast<std::uint32_t>(v[3])};
    const auto p = [&](std::size_t k) { return Vec3{mesh.points_mm[t[k]][0], mesh.points_mm[t[k]][1], mesh.points_mm[t[k]][2]}; };
    if (dot(cross(p(1) - p(0), p(2) - p(0)), p(3) - p(0)) < 0) std::swap(t[2], t[3]);
    mesh.tets.push_back(t);
  }
  if (mesh.tets.empty()) throw Error(ExitCode::failed, "TetGen made no tetrahedra", advice);
  context.progress(1.0);
  return mesh;
}

}  // namespace osteo
