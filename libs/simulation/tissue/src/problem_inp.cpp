#include "problem_inp.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>

#include "osteo/core/base/error.h"
#include "osteo/imaging/io/inp_io.h"
#include "tet_faces.h"

namespace osteo::inline simulation {
namespace tissue {
namespace {

class Reader {
 public:
  Reader(std::string_view text, const TetMesh& mesh) : file_(parse_inp(text, "the tissue problem")) {
    if (file_.mesh.points_mm.size() != mesh.points_mm.size() || file_.mesh.tets.size() != mesh.tets.size())
      throw Error(ExitCode::usage,
                  "the problem's .inp has " + std::to_string(file_.mesh.tets.size()) + " tetrahedra, the mesh " +
                      std::to_string(mesh.tets.size()),
                  "give the same .inp file as mesh and as problem");
  }

  TissueProblem run(bool needs_loads, Weight weight) {
    Material* open = nullptr;
    bool in_step = false, large = false;
    const auto held_before = [&] {
      TissueLoad load;
      load.fixed = problem_.fixed;
      load.sliders = problem_.sliders;
      return load;
    };
    for (const InpCard& card : file_.cards) {
      if (card.name == "MATERIAL") {
        open = &materials_[option(card, "NAME")];
        *open = {0, 0};
      } else if (card.name == "ELASTIC") {
        if (open == nullptr) throw fail(card, "it belongs to no *MATERIAL");
        if (card.options.contains("TYPE") && card.options.at("TYPE") != "ISO" && card.options.at("TYPE") != "ISOTROPIC")
          throw fail(card, "only isotropic elasticity is read");
        open->young_mpa = number(card, 0, 0);
        open->poisson = number(card, 0, 1);
        law(card, ElasticLaw::linear);
      } else if (card.name == "DENSITY") {
        if (open == nullptr) throw fail(card, "it belongs to no *MATERIAL");
        open->density_kg_m3 = number(card, 0, 0) / kTonnesPerMm3;
        if (!(open->density_kg_m3 > 0)) throw fail(card, "a density is above 0 (tonnes/mm3)");
      } else if (card.name == "HYPERELASTIC") {
        if (open == nullptr) throw fail(card, "it belongs to no *MATERIAL");
        if (!card.options.contains("NEO HOOKE")) throw fail(card, "of hyperelastic laws only NEO HOOKE is read");
        const double mu = 2 * number(card, 0, 0), d1 = number(card, 0, 1);
        if (!(d1 > 0)) throw fail(card, "D1 must be above 0: a solid that cannot change its volume is not read");
        const double bulk = 2 / d1;
        open->young_mpa = 9 * bulk * mu / (3 * bulk + mu);
        open->poisson = (3 * bulk - 2 * mu) / (2 * (3 * bulk + mu));
        law(card, ElasticLaw::neo_hooke_split);
      } else if (card.name == "SOLID SECTION") {
        sections_.push_back({option(card, "ELSET"), option(card, "MATERIAL"), &card});
      } else if (card.name == "BOUNDARY") {
        if (in_step) {
          if (card.options.contains("OP")) throw fail(card, "OP= is not read: each step stands for itself");
          boundary_of_step(card, problem_.loads.back());
        } else {
          boundary(card);
        }
      } else if (card.name == "STEP") {
        in_step = true;
        large = large || (card.options.contains("NLGEOM") && card.options.at("NLGEOM") != "NO");
        settle_boundary();
        problem_.loads.push_back(held_before());
        problem_.load_names.push_back("step " + std::to_string(problem_.loads.size()));
      } else if (card.name == "CLOAD" || card.name == "DLOAD") {
        if (!in_step) throw fail(card, "it stands outside a *STEP");
        card.name == "CLOAD" ? cload(card, problem_.loads.back()) : dload(card, problem_.loads.back());
      } else if (card.name != "STATIC" && card.name != "END STEP" && !card.name.ends_with("PRINT") &&
                 !card.name.ends_with("FILE") && !card.name.ends_with("OUTPUT") && card.name != "CONTROLS" &&
                 card.name != "PREPRINT" && card.name != "RESTART" && card.name != "ASSEMBLY" &&
                 card.name != "END ASSEMBLY") {
        throw fail(card, "this card is not read, and might change the answer", "docs/validation/tissue.md lists what is");
      }
    }
    settle_boundary();
    if (needs_loads && problem_.loads.empty())
      throw Error(ExitCode::usage, "the tissue problem, loads: there is no *STEP");
    materials();
    if (weight == Weight::apart && !pulls_.empty())
      throw fail(*pulls_.front().card,
                 "gravity of an .inp weighs by its own *DENSITY, and cannot be kept apart; give the problem in JSON");
    for (const Pull& p : pulls_) pull(p);
    problem_.order = file_.quadratic ? TetOrder::t10 : TetOrder::t4;
    if (problem_.law == ElasticLaw::linear && large) problem_.law = ElasticLaw::stvk;
    return std::move(problem_);
  }

 private:
  // Gravity, which needs the materials, that may come later.
  struct Pull {
    std::size_t load;
    std::vector<long> elements;
    Vec3 mm_s2;
    const InpCard* card;
  };
  struct Section {
    std::string set, material;
    const InpCard* card;
  };

  [[nodiscard]] static Error fail(const InpCard& card, const std::string& what, const std::string& advice = {}) {
    return {ExitCode::usage, "the tissue problem, line " + std::to_string(card.line) + ", *" + card.name + ": " + what,
            advice};
  }
  [[nodiscard]] static std::string option(const InpCard& card, const std::string& name) {
    const auto found = card.options.find(name);
    if (found == card.options.end()) throw fail(card, name + "= is missing");
    return found->second;
  }
  [[nodiscard]] static double number_of(const InpCard& card, const std::string& field) {
    if (const auto v = inp_number(field)) return *v;
    throw fail(card, "'" + field + "' is no number");
  }
  [[nodiscard]] static double number(const InpCard& card, std::size_t row, std::size_t column) {
    if (card.rows.size() <= row || card.rows[row].size() <= column) throw fail(card, "it has too few numbers");
    return number_of(card, card.rows[row][column]);
  }
  void law(const InpCard& card, ElasticLaw l) {
    if (problem_.law && *problem_.law != l) throw fail(card, "materials of different laws are mixed");
    problem_.law = l;
  }
  // Members of a set, or the one number.
  [[nodiscard]] static std::vector<long> members(const InpCard& card,
                                                 const std::map<std::string, std::vector<long>>& sets,
                                                 const std::string& field) {
    if (const auto s = sets.find(field); s != sets.end()) return s->second;
    if (field.empty() || field.find_first_not_of("0123456789") != std::string::npos)
      throw fail(card, "there is no set " + field);
    return {static_cast<long>(number_of(card, field))};
  }

  void boundary(const InpCard& card) {
    // Abaqus' names; turning, which points do not, is left out.
    static const std::map<std::string, std::array<double, 2>> kNamed{
        {"ENCASTRE", {1, 3}}, {"PINNED", {1, 3}}, {"XSYMM", {1, 1}}, {"YSYMM", {2, 2}}, {"ZSYMM", {3, 3}}};
    for (const auto& row : card.rows) {
      if (row.size() < 2) throw fail(card, "a line holds less than a node and an axis");
      const auto named = kNamed.find(row[1]);
      const double first = named != kNamed.end() ? named->second[0] : number_of(card, row[1]),
                   last = named != kNamed.end()               ? named->second[1]
                          : row.size() > 2 && !row[2].empty() ? number_of(card, row[2])
                                                              : first;
      if (row.size() > 3 && number_of(card, row[3]) != 0)
        throw fail(card, "points that are moved outside a *STEP are not read", "put them into the *STEP");
      if (!(first >= 1 && last <= 3 && first <= last)) throw fail(card, "axes go from 1 to 3, not " + row[1]);
      for (const long node : members(card, file_.node_sets, row[0])) {
        std::uint8_t& axes = held_[node];
        for (int a = static_cast<int>(first); a <= static_cast<int>(last); ++a)
          axes = static_cast<std::uint8_t>(axes | 1 << (a - 1));
        last_boundary_ = &card;
      }
    }
  }
  // Points that a step moves, or holds besides.
  void boundary_of_step(const InpCard& card, TissueLoad& load) {
    std::map<long, std::pair<std::uint8_t, Vec3>> moved;
    for (const auto& row : card.rows) {
      if (row.size() < 2) throw fail(card, "a line holds less than a node and an axis");
      const double first = number_of(card, row[1]),
                   last = row.size() > 2 && !row[2].empty() ? number_of(card, row[2]) : first,
                   by = row.size() > 3 ? number_of(card, row[3]) : 0;
      if (!(first >= 1 && last <= 3 && first <= last)) throw fail(card, "axes go from 1 to 3, not " + row[1]);
      for (const long node : members(card, file_.node_sets, row[0])) {
        auto& [axes, v] = moved[node];
        for (int a = static_cast<int>(first); a <= static_cast<int>(last); ++a) {
          axes = static_cast<std::uint8_t>(axes | 1 << (a - 1));
          v[static_cast<std::size_t>(a) - 1] = by;
        }
      }
    }
    std::map<std::uint32_t, std::pair<std::uint8_t, Vec3>> of_point;
    for (const auto& [node, how] : moved) {
      if (const auto p = file_.point_of.find(node); p != file_.point_of.end()) of_point[p->second] = how;
    }
    for (const auto& [node, how] : moved) {
      const auto middle = file_.middle_of.find(node);
      if (file_.point_of.contains(node) || middle == file_.middle_of.end()) continue;
      Vec3 mean{};
      bool both = true;
      for (const std::uint32_t end : middle->second) {
        const auto found = of_point.find(end);
        both = both && found != of_point.end() && found->second.first == how.first;
        if (found != of_point.end()) mean += found->second.second / 2;
      }
      if (!both || length(mean - how.second) > 1e-6 * (length(how.second) + 1e-9))
        throw fail(card, "node " + std::to_string(node) + " in the middle of an edge moves otherwise than its ends");
    }
    for (const auto& [p, how] : of_point) load.moved.push_back({p, how.first, how.second});
  }
  // Nodes in the middle of edges follow from their ends.
  void settle_boundary() {
    if (settled_) return;
    settled_ = true;
    std::map<std::uint32_t, std::uint8_t> of_point;
    for (const auto& [node, axes] : held_) {
      if (const auto p = file_.point_of.find(node); p != file_.point_of.end()) of_point[p->second] = axes;
    }
    for (const auto& [node, axes] : held_) {
      if (file_.point_of.contains(node)) continue;
      const auto middle = file_.middle_of.find(node);
      if (middle == file_.middle_of.end()) continue;  // a node that no element has
      const auto both = static_cast<std::uint8_t>(of_point[middle->second[0]] & of_point[middle->second[1]]);
      if (both != axes)
        throw fail(*last_boundary_,
                   "node " + std::to_string(node) + " in the middle of an edge is held otherwise than both its ends");
    }
    for (const auto& [p, axes] : of_point) {
      if (axes == 7) problem_.fixed.push_back(p);
      if (axes != 0 && axes != 7) problem_.sliders.push_back({p, axes});
    }
  }
  void cload(const InpCard& card, TissueLoad& load) {
    for (const auto& row : card.rows) {
      if (row.size() < 3) throw fail(card, "a line holds less than a node, an axis and a force");
      const double axis = number_of(card, row[1]);
      if (axis != 1 && axis != 2 && axis != 3) throw fail(card, "axes go from 1 to 3, not " + row[1]);
      Vec3 force{};
      force[static_cast<std::size_t>(axis) - 1] = number_of(card, row[2]);
      for (const long node : members(card, file_.node_sets, row[0])) {
        if (const auto p = file_.point_of.find(node); p != file_.point_of.end()) {
          load.forces_n.push_back({p->second, force});
        } else if (const auto m = file_.middle_of.find(node); m != file_.middle_of.end()) {
          load.edge_forces_n.push_back({m->second, force});
          for (const std::uint32_t end : m->second) load.forces_n.push_back({end, force * 0.5});
        } else {
          throw fail(card, "no element has node " + std::to_string(node));
        }
      }
    }
  }
  void dload(const InpCard& card, TissueLoad& load) {
    for (const auto& row : card.rows) {
      if (row.size() >= 6 && row[1] == "GRAV") {
        const Vec3 along{number_of(card, row[3]), number_of(card, row[4]), number_of(card, row[5])};
        pulls_.push_back({problem_.loads.size() - 1, members(card, file_.element_sets, row[0]),
                          along * number_of(card, row[2]), &card});
        continue;
      }
      if (row.size() < 3 || row[1].size() != 2 || row[1][0] != 'P' || row[1][1] < '1' || row[1][1] > '4')
        throw fail(card, "only pressures P1 to P4 on faces and GRAV with its size and direction are read");
      const double pressure = number_of(card, row[2]);
      for (const long element : members(card, file_.element_sets, row[0])) {
        const auto found = file_.corners_of.find(element);
        if (found == file_.corners_of.end()) throw fail(card, "there is no element " + std::to_string(element));
        std::array<std::uint32_t, 3> face{};
        const auto& own = kTetFaces[row[1][1] - '1'];
        for (std::size_t i = 0; i < 3; ++i) face[i] = found->second[own[i]];
        const auto at = [&](std::uint32_t p) { return from_floats(file_.mesh.points_mm[p]); };
        Vec3 area = cross(at(face[1]) - at(face[0]), at(face[2]) - at(face[0])) * 0.5, middle{};
        for (const std::uint32_t p : found->second) middle += at(p) / 4;
        if (dot(area, middle - at(face[0])) < 0) area = area * -1;  // inwards
        load.add_on_face(face, area * pressure);
      }
    }
  }
  void pull(const Pull& p) {
    TissueLoad& load = problem_.loads[p.load];
    for (const long element : p.elements) {
      const auto found = file_.corners_of.find(element);
      if (found == file_.corners_of.end()) throw fail(*p.card, "there is no element " + std::to_string(element));
      const auto at = [&](std::size_t i) { return from_floats(file_.mesh.points_mm[found->second[i]]); };
      const double volume = std::abs(dot(cross(at(1) - at(0), at(2) - at(0)), at(3) - at(0))) / 6,
                   density =
                       problem_.materials[problem_.materials.size() == 1 ? 0 : file_.tet_of.at(element)].density_kg_m3;
      if (!(density > 0))
        throw fail(*p.card, "the material of element " + std::to_string(element) + " has no *DENSITY");
      load.add_in_tet(found->second, p.mm_s2 * (density * kTonnesPerMm3 * volume));
    }
  }
  void materials() {
    if (sections_.empty()) throw Error(ExitCode::usage, "the tissue problem, materials: there is no *SOLID SECTION");
    problem_.materials.assign(file_.mesh.tets.size(), {0, 0});
    for (const Section& s : sections_) {
      const auto m = materials_.find(s.material);
      if (m == materials_.end() || !(m->second.young_mpa > 0))
        throw fail(*s.card, "there is no elastic *MATERIAL " + s.material);
      const auto set = file_.element_sets.find(s.set);
      if (set == file_.element_sets.end()) throw fail(*s.card, "there is no set " + s.set);
      for (const long e : set->second) {
        const auto t = file_.tet_of.find(e);
        if (t == file_.tet_of.end()) throw fail(*s.card, "there is no element " + std::to_string(e));
        problem_.materials[t->second] = m->second;
      }
    }
    for (std::size_t t = 0; t < problem_.materials.size(); ++t) {
      if (!(problem_.materials[t].young_mpa > 0))
        throw Error(ExitCode::usage, "the tissue problem, materials: tetrahedron " + std::to_string(t) + " has none");
    }
    problem_.general = problem_.materials[0];
    const auto same = [&](const Material& m) {
      const Material& first = problem_.materials[0];
      return m.young_mpa == first.young_mpa && m.poisson == first.poisson && m.density_kg_m3 == first.density_kg_m3;
    };
    if (std::all_of(problem_.materials.begin(), problem_.materials.end(), same)) problem_.materials.resize(1);
  }

  InpFile file_;
  TissueProblem problem_;
  std::map<std::string, Material> materials_;
  std::vector<Section> sections_;
  std::vector<Pull> pulls_;
  std::map<long, std::uint8_t> held_;
  const InpCard* last_boundary_ = nullptr;
  bool settled_ = false;
};

}  // namespace

TissueProblem problem_of_inp(std::string_view text, const TetMesh& mesh, bool needs_loads, Weight weight) {
  return Reader(text, mesh).run(needs_loads, weight);
}

}  // namespace tissue

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
  std::map<std::array<std::uint32_t, 3>, std::pair<std::size_t, std::size_t>> faces;  // element, face; those of two go
  for (std::size_t e = 0; e < body.tet_count(); ++e) {
    for (std::size_t f = 0; f < 4; ++f) {
      std::array<std::uint32_t, 3> face{body.nodes(e)[kTetFaces[f][0]], body.nodes(e)[kTetFaces[f][1]],
                                        body.nodes(e)[kTetFaces[f][2]]};
      std::sort(face.begin(), face.end());
      if (!faces.try_emplace(face, e, f).second) faces.erase(face);
    }
  }
  std::string t = "*SURFACE, NAME=BODY, TYPE=ELEMENT\n";
  for (const auto& [face, where] : faces)
    t += std::to_string(where.first + 1) + ", S" + std::to_string(where.second + 1) + "\n";
  // Points over area of the faces that look at a thing (within 45 degrees); of all where none does.
  const auto points_per_mm2 = [&](const auto& towards) {
    for (const double least : {std::sqrt(0.5), -2.0}) {
      double area = 0;
      std::vector<std::array<std::uint32_t, 2>> points;  // corners twice the same, middles by their ends
      for (const auto& [face, where] : faces) {
        const auto& own = kTetFaces[where.second];
        const auto at = [&](std::size_t i) { return body.rest()[body.nodes(where.first)[own[i]]]; };
        const auto others = 6 - own[0] - own[1] - own[2];
        Vec3 out = cross(at(1) - at(0), at(2) - at(0)) * 0.5;
        if (dot(out, at(0) - body.rest()[body.nodes(where.first)[others]]) < 0) out = out * -1;
        if (dot(out, towards((at(0) + at(1) + at(2)) / 3)) < least * length(out)) continue;
        area += length(out);
        for (std::size_t i = 0; i < 3; ++i) {
          points.push_back({face[i], face[i]});
          if (body.order() == TetOrder::t10)
            points.push_back({std::min(face[i], face[(i + 1) % 3]), std::max(face[i], face[(i + 1) % 3])});
        }
      }
      std::sort(points.begin(), points.end());
      points.erase(std::unique(points.begin(), points.end()), points.end());
      if (area > 0) return static_cast<double>(points.size()) / area;
    }
    return 1.0;
  };
  std::size_t node = body.point_count(), element = body.tet_count();
  int number = 0;
  for (const RigidContact& c : contacts) {
    const auto* const plane = dynamic_cast<const PlaneShape*>(c.shape.get());
    const auto* const ball = dynamic_cast<const BallShape*>(c.shape.get());
    if (plane == nullptr && ball == nullptr)
      throw Error(ExitCode::usage, "only planes and balls are written to .inp as rigid things",
                  "choose a load without other contacts");
    const Rigid r = plane != nullptr ? rigid_plane(*plane, body.rest()) : rigid_ball(ball->bounds());
    const double density = points_per_mm2(
        [&](Vec3 at) { return plane != nullptr ? plane->normal() * -1 : normalized(ball->bounds().centre_mm - at); });
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
  std::map<std::uint32_t, Vec3> forces;  // some points have several, which a later line would replace
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
