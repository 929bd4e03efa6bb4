// A problem as an input file of CalculiX or Abaqus.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>

#include "osteo/core/base/error.h"
#include "osteo/simulation/tissue/problem.h"
#include "outer_faces.h"

namespace osteo::inline simulation {
namespace {

// CalculiX reads 20 characters of a field and cuts the rest off, an exponent too.
std::string field(double v) {
  char text[40];
  for (int digits = 17;; --digits) {
    std::snprintf(text, sizeof text, "%.*g", digits, v);
    if (std::strlen(text) <= 20) return text;
  }
}

constexpr int kBallHalvings = 4;  // of an icosahedron: 5120 triangles, off by 0.1 % of the radius

// A rigid thing as tetrahedra that do not move, one behind each triangle of its surface; the first point is the common
// one inside.
struct Rigid {
  std::vector<Vec3> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;  // facing outwards
};

// One triangle, large enough for all that a body may do before it.
Rigid rigid_plane(const PlaneShape& plane, const std::vector<Vec3>& rest) {
  Vec3 lo = rest.front(), hi = lo;
  for (const Vec3& q : rest) {
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], q[a]);
      hi[a] = std::max(hi[a], q[a]);
    }
  }
  const double size = 2 * length(hi - lo);
  const Vec3 n = plane.normal(), middle = (lo + hi) / 2, foot = middle - n * dot(middle - plane.at_mm(), n);
  const Vec3 along = normalized(cross(n, std::abs(n.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0})),
             across = cross(n, along);
  return {{foot - n * size, foot + along * (2 * size), foot - along * size + across * (1.8 * size),
           foot - along * size - across * (1.8 * size)},
          {{1, 2, 3}}};
}

Rigid rigid_ball(const RigidShape::Ball& ball) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  std::vector<Vec3> x{{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                      {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  for (Vec3& v : x) v = normalized(v);
  std::vector<std::array<std::uint32_t, 3>> triangles{{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                                      {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                                      {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                                      {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int n = 0; n < kBallHalvings; ++n) {
    std::map<std::array<std::uint32_t, 2>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [it, fresh] =
          middles.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<std::uint32_t>(x.size()));
      if (fresh) x.push_back(normalized(x[a] + x[b]));
      return it->second;
    };
    std::vector<std::array<std::uint32_t, 3>> halved;
    for (const auto& [a, b, c] : triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      for (const auto& t :
           {std::array{a, ab, ca}, std::array{ab, b, bc}, std::array{ca, bc, c}, std::array{ab, bc, ca}})
        halved.push_back(t);
    }
    triangles = std::move(halved);
  }
  // As far outside at corners as inside in the middle of triangles.
  const auto& t = triangles.back();
  const double inside = length((x[t[0]] + x[t[1]] + x[t[2]]) / 3), out = 2 / (1 + inside);
  Rigid r{{ball.centre_mm}, {}};
  for (const Vec3& v : x) r.points.push_back(ball.centre_mm + v * (ball.radius_mm * out));
  for (const auto& [a, b, c] : triangles) r.triangles.push_back({a + 1, b + 1, c + 1});
  return r;
}

// Contact pairs. Here each point of the surface is pushed by itself; there pressure grows with depth, by as much over
// what looks at the thing.
std::string contacts_text(const FemBody& body, const std::vector<RigidContact>& contacts) {
  const std::vector<OuterFace> faces = outer_faces(body);
  std::string t = "*SURFACE, NAME=BODY, TYPE=ELEMENT\n";
  for (const OuterFace face : faces)
    t += std::to_string(face.element + 1) + ", S" + std::to_string(face.face + 1) + "\n";
  std::size_t node = body.point_count(), element = body.tet_count();
  int number = 0;
  for (const RigidContact& c : contacts) {
    const auto* const plane = dynamic_cast<const PlaneShape*>(c.shape.get());
    const auto* const ball = dynamic_cast<const BallShape*>(c.shape.get());
    if (plane == nullptr && ball == nullptr)
      throw Error(ExitCode::usage, "only planes and balls are written to .inp as rigid things",
                  "choose a load without other contacts");
    const Rigid r = plane != nullptr ? rigid_plane(*plane, body.rest()) : rigid_ball(ball->bounds());
    const double density = points_per_mm2(body, faces, *c.shape);
    const std::string name = std::to_string(++number);
    t += "*NODE, NSET=RIGID" + name + "\n";
    for (std::size_t p = 0; p < r.points.size(); ++p)
      t += std::to_string(node + p + 1) + ", " + field(r.points[p].x) + ", " + field(r.points[p].y) + ", " +
           field(r.points[p].z) + "\n";
    t += "*ELEMENT, TYPE=C3D4, ELSET=RIGID" + name + "\n";
    std::string surface = "*SURFACE, NAME=THING" + name + ", TYPE=ELEMENT\n";
    for (const auto& f : r.triangles) {
      // Seen from the fourth corner the first three turn clockwise.
      t += std::to_string(++element) + ", " + std::to_string(node + f[0] + 1) + ", " + std::to_string(node + f[2] + 1) +
           ", " + std::to_string(node + f[1] + 1) + ", " + std::to_string(node + 1) + "\n";
      surface += std::to_string(element) + ", S1\n";
    }
    node += r.points.size();
    t += surface;
    t += "*MATERIAL, NAME=RIGID" + name + "\n*ELASTIC\n1, 0\n*SOLID SECTION, ELSET=RIGID" + name + ", MATERIAL=RIGID" +
         name + "\n";
    t += "*BOUNDARY\nRIGID" + name + ", 1, 3\n";
    t += "** " + field(c.stiffness_n_per_mm) +
         " N/mm of each point that looks at it, spread over their area: MPa a mm of depth\n";
    t += "*SURFACE INTERACTION, NAME=PUSH" + name + "\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n" +
         field(c.stiffness_n_per_mm * density) + "\n";
    t += "*CONTACT PAIR, INTERACTION=PUSH" + name + ", TYPE=SURFACE TO SURFACE\nBODY, THING" + name + "\n";
  }
  return t;
}

}  // namespace

std::string inp_text(const FemBody& body, const TissueLoad& load) {
  if (body.law() == ElasticLaw::corotated)
    throw Error(ExitCode::usage, "the corotated law has no counterpart in CalculiX or Abaqus",
                "write linear, stvk or neo_hooke_split");
  if (body.order() == TetOrder::t4_mean)
    throw Error(ExitCode::usage,
                "tetrahedra with the mean change of volume of a patch have no counterpart in CalculiX or Abaqus",
                "write t4 or t10");
  if (body.law() == ElasticLaw::neo_hooke)
    throw Error(ExitCode::usage, "this neo-Hookean law has no counterpart in CalculiX or Abaqus",
                "write linear, stvk or neo_hooke_split");
  std::string t = "** written by osteotome: mm, N, MPa\n*NODE, NSET=ALL\n";
  char line[160];
  for (std::size_t p = 0; p < body.point_count(); ++p) {
    const Vec3 x = body.rest()[p];
    t += std::to_string(p + 1) + ", " + field(x.x) + ", " + field(x.y) + ", " + field(x.z) + "\n";
  }
  t += body.order() == TetOrder::t4 ? "*ELEMENT, TYPE=C3D4, ELSET=EALL\n" : "*ELEMENT, TYPE=C3D10, ELSET=EALL\n";
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    t += std::to_string(e + 1);
    for (const std::uint32_t n : body.nodes(e)) t += ", " + std::to_string(n + 1);
    t += "\n";
  }
  // Equal materials share a set.
  std::map<std::array<double, 3>, std::vector<std::size_t>> sets;
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    const Material& m = body.materials()[body.materials().size() == 1 ? 0 : e];
    sets[{m.young_mpa, m.poisson, m.density_kg_m3}].push_back(e + 1);
  }
  int number = 0;
  for (const auto& [material, elements] : sets) {
    ++number;
    const Material m{material[0], material[1], material[2]};
    const bool split = body.law() == ElasticLaw::neo_hooke_split;
    std::snprintf(line, sizeof line, "*MATERIAL, NAME=M%d\n*%s\n%s, %s\n", number,
                  split ? "HYPERELASTIC, NEO HOOKE" : "ELASTIC", field(split ? m.shear_mpa() / 2 : m.young_mpa).c_str(),
                  field(split ? 2 / m.bulk_mpa() : m.poisson).c_str());
    t += line;
    if (m.density_kg_m3 > 0) t += "*DENSITY\n" + field(m.density_kg_m3 * kTonnesPerMm3) + "\n";
    t += "*ELSET, ELSET=E" + std::to_string(number) + "\n";
    for (std::size_t i = 0; i < elements.size(); ++i)
      t += std::to_string(elements[i]) + (i % 12 == 11 || i + 1 == elements.size() ? "\n" : ", ");
    std::snprintf(line, sizeof line, "*SOLID SECTION, ELSET=E%d, MATERIAL=M%d\n", number, number);
    t += line;
  }
  if (!load.fixed.empty() || !load.sliders.empty()) t += "*BOUNDARY\n";
  for (const std::uint32_t p : load.fixed) t += std::to_string(p + 1) + ", 1, 3\n";
  for (const Slider& s : load.sliders) {
    for (int a = 0; a < 3; ++a) {
      if ((s.held >> a & 1) != 0) t += std::to_string(s.point + 1) + ", " + std::to_string(a + 1) + "\n";
    }
  }
  if (!load.contacts.empty()) t += contacts_text(body, load.contacts);
  // With contact CalculiX takes large displacements unless it is told not to.
  t += body.law() != ElasticLaw::linear ? "*STEP, NLGEOM, INC=1000\n*STATIC\n1, 1\n"
       : load.contacts.empty()          ? "*STEP\n*STATIC\n"
                                        : "*STEP, NLGEOM=NO, INC=1000\n*STATIC\n1, 1\n";
  if (!load.moved.empty()) t += "*BOUNDARY\n";
  for (const TissueLoad::Moved& m : load.moved) {
    for (std::size_t a = 0; a < 3; ++a) {
      if ((m.held >> a & 1) == 0) continue;
      const std::string axis = std::to_string(a + 1);
      t += std::to_string(m.point + 1) + ", " + axis + ", " + axis + ", " + field(m.by_mm[a]) + "\n";
    }
  }
  std::map<std::uint32_t, Vec3> forces;  // a point may have several; here their sum, as the lines of a step add up
  for (const auto& [p, f] : load.forces_n) forces[p] += f;
  if (!forces.empty()) t += "*CLOAD\n";
  for (const auto& [p, f] : forces) {
    for (std::size_t a = 0; a < 3; ++a) {
      if (f[a] == 0) continue;
      t += std::to_string(p + 1) + ", " + std::to_string(a + 1) + ", " + field(f[a]) + "\n";
    }
  }
  if (const double pull = length(load.gravity_m_s2); pull > 0) {
    if (std::any_of(body.materials().begin(), body.materials().end(),
                    [](const Material& m) { return !(m.density_kg_m3 > 0); }))
      throw Error(ExitCode::usage, "gravity needs a density for all of the body");
    const Vec3 along = load.gravity_m_s2 / pull;
    t += "*DLOAD\nEALL, GRAV, " + field(1000 * pull) + ", " + field(along.x) + ", " + field(along.y) + ", " +
         field(along.z) + "\n";
  }
  return t + "*NODE PRINT, NSET=ALL\nU\n*END STEP\n";
}

}  // namespace osteo::inline simulation
