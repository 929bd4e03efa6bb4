#include "osteo/geometry/tetgen/mesh_tetgen.h"

#define TETLIBRARY
#include <tetgen.h>

#include <cmath>
#include <cstring>
#include <map>
#include <string>

#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"
#include "osteo/geometry/distance/solid.h"
#include "osteo/geometry/distance/voxelize.h"

namespace osteo::inline geometry {
namespace {

const char* const kAdvice =
    "try 'osteo mesh-repair' first (--clean does), or the method grid-conforming, which takes any surface";

// What TetGen makes: the child's answer, as bytes.
struct Made {
  std::vector<Vec3> points;
  std::vector<std::array<std::uint32_t, 4>> tets;
  std::vector<double> region;  // of each tetrahedron
};

template <class T>
void put(std::string& bytes, const std::vector<T>& list) {
  const std::uint64_t n = list.size();
  bytes.append(reinterpret_cast<const char*>(&n), sizeof n);
  bytes.append(reinterpret_cast<const char*>(list.data()), n * sizeof(T));
}
template <class T>
void get(const std::string& bytes, std::size_t& at, std::vector<T>& list) {
  std::uint64_t n = 0;
  std::memcpy(&n, bytes.data() + at, sizeof n);
  at += sizeof n;
  list.resize(n);
  std::memcpy(static_cast<void*>(list.data()), bytes.data() + at, n * sizeof(T));
  at += n * sizeof(T);
}

void fill(tetgenio& in, const TriangleSoup& soup) {
  in.firstnumber = 0;
  in.numberofpoints = static_cast<int>(soup.points_mm.size());
  in.pointlist = new REAL[soup.points_mm.size() * 3];
  for (std::size_t i = 0; i < soup.points_mm.size(); ++i) {
    for (std::size_t a = 0; a < 3; ++a) in.pointlist[3 * i + a] = soup.points_mm[i][a];
  }
  in.numberoffacets = static_cast<int>(soup.triangles.size());
  in.facetlist = new tetgenio::facet[soup.triangles.size()];
  for (std::size_t i = 0; i < soup.triangles.size(); ++i) {
    tetgenio::facet& f = in.facetlist[i];
    tetgenio::init(&f);
    f.numberofpolygons = 1;
    f.polygonlist = new tetgenio::polygon[1];
    tetgenio::init(&f.polygonlist[0]);
    f.polygonlist[0].numberofvertices = 3;
    f.polygonlist[0].vertexlist = new int[3];
    for (std::size_t k = 0; k < 3; ++k) f.polygonlist[0].vertexlist[k] = static_cast<int>(soup.triangles[i][k]);
  }
}

// First, since TetGen 1.5.0 ends the program, or fills anything, when it meets them while meshing.
std::string crossings(const TriangleSoup& soup) {
  tetgenio in, crossing;
  fill(in, soup);
  try {
    char detect[] = "dQ";
    tetrahedralize(detect, &in, &crossing);
  } catch (const int code) {
    throw Error(ExitCode::failed,
                "TetGen cannot tell whether the surface intersects itself (its code " + std::to_string(code) + ")",
                kAdvice);
  }
  if (crossing.numberoftrifaces > 0)
    throw Error(ExitCode::failed,
                "TetGen needs a surface that does not intersect itself; " + std::to_string(crossing.numberoftrifaces) +
                    " triangles of this one do",
                kAdvice);
  return {};
}

std::string mesh(const TriangleSoup& soup, const TetgenOptions& options) {
  tetgenio in, out;
  fill(in, soup);
  std::string switches = "pAQq" + format_number(options.radius_edge_ratio);
  if (options.min_dihedral_deg > 0) switches += "/" + format_number(options.min_dihedral_deg);
  if (options.max_volume_mm3 > 0) switches += "a" + format_number(options.max_volume_mm3);
  try {
    tetrahedralize(switches.data(), &in, &out);
  } catch (const int code) {
    const char* const reason = code == 1    ? "it ran out of memory"
                               : code == 3  ? "the surface intersects itself"
                               : code == 4  ? "features are smaller than its precision"
                               : code == 5  ? "two triangles are nearly coplanar"
                               : code == 10 ? "an input error"
                                            : "an internal error";
    throw Error(code == 1 ? ExitCode::resources : ExitCode::failed,
                std::string("TetGen failed: ") + reason + " (its code " + std::to_string(code) + ")", kAdvice);
  }
  Made made;
  for (int i = 0; i < out.numberofpoints; ++i)
    made.points.push_back({out.pointlist[3 * i], out.pointlist[3 * i + 1], out.pointlist[3 * i + 2]});
  for (int i = 0; i < out.numberoftetrahedra; ++i) {
    const int* v = out.tetrahedronlist + static_cast<std::ptrdiff_t>(i) * out.numberofcorners;
    made.tets.push_back({static_cast<std::uint32_t>(v[0]), static_cast<std::uint32_t>(v[1]),
                         static_cast<std::uint32_t>(v[2]), static_cast<std::uint32_t>(v[3])});
    made.region.push_back(
        out.numberoftetrahedronattributes > 0
            ? out.tetrahedronattributelist[static_cast<std::ptrdiff_t>(i) * out.numberoftetrahedronattributes]
            : 0);
  }
  std::string bytes;
  put(bytes, made.points);
  put(bytes, made.tets);
  put(bytes, made.region);
  return bytes;
}

double volume_of(const Made& m, const std::array<std::uint32_t, 4>& t) {
  const Vec3 o = m.points[t[0]];
  return dot(cross(m.points[t[1]] - o, m.points[t[2]] - o), m.points[t[3]] - o) / 6;
}

}  // namespace

TetMesh tets_by_tetgen(const TriangleSoup& surface, const TetgenOptions& options, const Context& context) {
  const Ordered order = ordered(surface, context);
  if (const TriangleSoup whole = welded(surface); !is_closed(whole) && !order.open.empty()) {
    throw Error(ExitCode::failed,
                "TetGen needs a closed surface; " + std::to_string(order.open.size()) + " edges of this one are open",
                kAdvice);
  }
  // Before anything is left out: of surfaces that cross no patch lies wholly inside or outside.
  context.progress(0.1, "looking for triangles that cross");
  const TriangleSoup together = compacted(order.soup);
  static_cast<void>(run_guarded(
      "TetGen", kAdvice, options.limits, [&] { return crossings(together); }, context));
  const TriangleSoup solid = compacted(solid_surface(surface, context).soup);
  const double volume = inside_volume_mm3(solid, context);
  if (options.max_volume_mm3 > 0) {
    const double expected = volume / options.max_volume_mm3;
    if (!(expected < options.most_tets))
      throw Error(ExitCode::resources,
                  "TetGen would make over " + format_number(expected) + " tetrahedra of at most " +
                      format_number(options.max_volume_mm3) + " mm3, more than the " +
                      format_number(options.most_tets) + " that are allowed",
                  "choose a larger spacing, or larger --max-volume-mm3");
  }
  context.progress(0.2, "meshing");
  const std::string bytes = run_guarded(
      "TetGen", kAdvice, options.limits, [&] { return mesh(solid, options); }, context);
  Made made;
  std::size_t at = 0;
  get(bytes, at, made.points);
  get(bytes, at, made.tets);
  get(bytes, at, made.region);
  // TetGen fills all that is enclosed. A region of it is bounded by the surface, so one place in it tells whether it is
  // inside.
  std::map<double, std::pair<std::size_t, double>> largest;
  for (std::size_t t = 0; t < made.tets.size(); ++t) {
    const double v = std::abs(volume_of(made, made.tets[t]));
    const auto [found, fresh] = largest.try_emplace(made.region[t], t, v);
    if (!fresh && v > found->second.second) found->second = {t, v};
  }
  std::map<double, bool> inside;
  for (const auto& [region, found] : largest) {
    Vec3 middle{};
    for (const std::uint32_t p : made.tets[found.first]) middle += made.points[p] / 4;
    inside[region] = std::abs(winding_number(solid, middle)) > 0.5;
  }
  constexpr std::uint32_t kUnused = 0xffffffffU;
  std::vector<std::uint32_t> place(made.points.size(), kUnused);
  TetMesh result;
  double filled = 0;
  for (std::size_t t = 0; t < made.tets.size(); ++t) {
    if (!inside[made.region[t]]) continue;
    std::array<std::uint32_t, 4> v = made.tets[t];
    const double own = volume_of(made, v);
    if (own < 0) std::swap(v[2], v[3]);
    filled += std::abs(own);
    for (std::uint32_t& p : v) {
      if (place[p] == kUnused) {
        place[p] = static_cast<std::uint32_t>(result.points_mm.size());
        result.points_mm.push_back(to_floats(made.points[p]));
      }
      p = place[p];
    }
    result.tets.push_back(v);
  }
  if (result.tets.empty()) throw Error(ExitCode::failed, "TetGen made no tetrahedra", kAdvice);
  // It keeps the surface, so the volume is the surface's, or something went wrong without a word.
  if (!(std::abs(filled - volume) <= 0.001 * volume))
    throw Error(ExitCode::failed,
                "TetGen's tetrahedra fill " + format_number(filled) + " mm3 of a surface that holds " +
                    format_number(volume) + " mm3",
                kAdvice);
  context.progress(1.0);
  return result;
}

}  // namespace osteo::inline geometry
