#include "problem_inp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <vector>

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
        for (const auto& [name, value] : card.options) {
          if (name == "OP" && value != "MOD") throw fail(card, "OP= is not read: what earlier cards hold stays held");
          // DISPLACEMENT is what a card without TYPE= means.
          if (name != "OP" && (name != "TYPE" || value != "DISPLACEMENT"))
            throw fail(card, name + " is not read, and might change the answer");
        }
        in_step ? boundary_of_step(card) : boundary(card);
      } else if (card.name == "STEP") {
        // Without NLGEOM a step keeps to what the one before it had.
        const auto nlgeom = card.options.find("NLGEOM");
        const bool now = nlgeom != card.options.end() ? nlgeom->second != "NO" : large;
        if (in_step && (now != large || card.options.contains("PERTURBATION")))
          throw fail(card, "steps of different laws are not read", "give each a file of its own");
        in_step = true;
        large = now;
        // A step goes on from the one before: what acted there still acts.
        steps_.push_back(steps_.empty() ? Step{} : steps_.back());
        now_ = {};
      } else if (card.name == "CLOAD" || card.name == "DLOAD") {
        if (!in_step) throw fail(card, "it stands outside a *STEP");
        for (const auto& [name, value] : card.options) {
          if (name != "OP" || (value != "NEW" && value != "MOD"))
            throw fail(card, name + " is not read, and might change the answer");
        }
        const bool anew = card.options.contains("OP") && card.options.at("OP") == "NEW";
        card.name == "CLOAD" ? cload(card, anew) : dload(card, anew);
      } else if (card.name != "STATIC" && card.name != "END STEP" && !card.name.ends_with("PRINT") &&
                 !card.name.ends_with("FILE") && !card.name.ends_with("OUTPUT") && card.name != "CONTROLS" &&
                 card.name != "PREPRINT" && card.name != "RESTART" && card.name != "ASSEMBLY" &&
                 card.name != "END ASSEMBLY") {
        throw fail(card, "this card is not read, and might change the answer",
                   "docs/validation/tissue.md lists what is");
      }
    }
    hold();
    if (needs_loads && steps_.empty()) throw Error(ExitCode::usage, "the tissue problem, loads: there is no *STEP");
    materials();
    if (!file_.quadratic) through_ = edges_through_body();
    const bool follows = large || problem_.law == ElasticLaw::neo_hooke_split;
    for (const Step& step : steps_) {
      if (!step.pulls.empty() && weight == Weight::apart)
        throw fail(*step.pulls.front().card,
                   "gravity of an .inp weighs by its own *DENSITY, and cannot be kept apart; give the problem in JSON");
      if (!step.pressures.empty() && follows)
        throw fail(
            *step.pressures.begin()->second.card,
            "pressures follow the body where displacements are large (NLGEOM, *HYPERELASTIC), which is not read",
            "write the pressure's forces as *CLOAD, or give the problem in JSON: both act as on the shape at rest");
      problem_.loads.push_back(load_of(step));
      problem_.load_names.push_back("step " + std::to_string(problem_.loads.size()));
    }
    problem_.order = file_.quadratic ? TetOrder::t10 : TetOrder::t4;
    if (problem_.law == ElasticLaw::linear && large) problem_.law = ElasticLaw::stvk;
    return std::move(problem_);
  }

 private:
  // Gravity, which needs the materials, that may come later.
  struct Pull {
    std::string set;
    Vec3 along;  // of length 1
    double mm_s2;
    const InpCard* card;
  };
  struct Pressure {
    double mpa = 0;
    const InpCard* card = nullptr;
  };
  struct Movement {
    std::uint8_t axes = 0;
    Vec3 by_mm{};
  };
  // What acts in a step, by node and axis, by element and face.
  struct Step {
    std::map<std::pair<long, std::size_t>, double> forces;
    std::map<std::pair<long, std::size_t>, Pressure> pressures;
    std::vector<Pull> pulls;
    std::map<long, Movement> moved;
    const InpCard* moving = nullptr;
  };
  // What the step itself has named: that replaces what acted before, and adds to what it has named already.
  struct Named {
    std::set<std::pair<long, std::size_t>> forces, pressures;
    std::size_t pulls = 0;  // of the step's, the last so many
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
  void boundary_of_step(const InpCard& card) {
    Step& step = steps_.back();
    step.moving = &card;
    for (const auto& row : card.rows) {
      if (row.size() < 2) throw fail(card, "a line holds less than a node and an axis");
      const double first = number_of(card, row[1]),
                   last = row.size() > 2 && !row[2].empty() ? number_of(card, row[2]) : first,
                   by = row.size() > 3 ? number_of(card, row[3]) : 0;
      if (!(first >= 1 && last <= 3 && first <= last)) throw fail(card, "axes go from 1 to 3, not " + row[1]);
      for (const long node : members(card, file_.node_sets, row[0])) {
        Movement& m = step.moved[node];
        for (int a = static_cast<int>(first); a <= static_cast<int>(last); ++a) {
          m.axes = static_cast<std::uint8_t>(m.axes | 1 << (a - 1));
          m.by_mm[static_cast<std::size_t>(a) - 1] = by;
        }
      }
    }
  }
  // How a node is held and moved in a step.
  [[nodiscard]] Movement holding(const Step& step, long node) const {
    Movement all;
    if (const auto h = held_.find(node); h != held_.end()) all.axes = h->second;
    if (const auto m = step.moved.find(node); m != step.moved.end()) {
      all.axes = static_cast<std::uint8_t>(all.axes | m->second.axes);
      for (std::size_t a = 0; a < 3; ++a) all.by_mm[a] = (m->second.axes >> a & 1) != 0 ? m->second.by_mm[a] : 0;
    }
    return all;
  }
  // A node in the middle of an edge moves with its ends, or is free where they are held.
  void middles(const Step& step, TissueLoad& load) const {
    std::vector<Movement> of_point(file_.mesh.points_mm.size());
    for (const auto& [node, p] : file_.point_of) of_point[p] = holding(step, node);
    for (const auto& [node, ends] : file_.middle_of) {
      if (file_.point_of.contains(node)) continue;
      const Movement own = holding(step, node), &a = of_point[ends[0]], &b = of_point[ends[1]];
      const auto both = static_cast<std::uint8_t>(a.axes & b.axes);
      if ((own.axes & ~both) != 0)
        throw fail(step.moved.contains(node) ? *step.moving : *last_boundary_,
                   "node " + std::to_string(node) + " in the middle of an edge is held otherwise than both its ends");
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double mean = (a.by_mm[axis] + b.by_mm[axis]) / 2;
        if ((own.axes >> axis & 1) != 0 && std::abs(mean - own.by_mm[axis]) > 1e-6 * (std::abs(own.by_mm[axis]) + 1e-9))
          throw fail(*step.moving,
                     "node " + std::to_string(node) + " in the middle of an edge moves otherwise than its ends");
      }
      if (own.axes != both) load.edges_held.push_back({ends, own.axes});
    }
    for (const auto& edge : through_) {
      if ((of_point[edge[0]].axes & of_point[edge[1]].axes) != 0) load.edges_held.push_back({edge, 0});
    }
    // By place, not by how the map keeps them.
    std::sort(load.edges_held.begin(), load.edges_held.end(),
              [](const auto& x, const auto& y) { return x.edge < y.edge; });
  }
  // Linear elements name no middles, which --order t10 adds. An edge that goes through the body from surface to surface
  // joins two faces that are held each by itself, and its middle is free. Where a corner inside the body is held, a
  // volume is, and the middle with it.
  [[nodiscard]] std::vector<std::array<std::uint32_t, 2>> edges_through_body() const {
    const auto& tets = file_.mesh.tets;
    std::vector<std::array<std::uint32_t, 3>> faces;
    std::vector<std::array<std::uint32_t, 2>> edges, on_surface, through;
    const auto add_edges = [](const auto& corners, auto& to) {
      for (std::size_t i = 0; i < corners.size(); ++i) {
        for (std::size_t j = i + 1; j < corners.size(); ++j)
          to.push_back({std::min(corners[i], corners[j]), std::max(corners[i], corners[j])});
      }
    };
    for (const auto& t : tets) {
      for (const auto& f : kTetFaces) {
        faces.push_back({t[f[0]], t[f[1]], t[f[2]]});
        std::sort(faces.back().begin(), faces.back().end());
      }
      add_edges(t, edges);
    }
    std::sort(faces.begin(), faces.end());
    std::vector<bool> surface_point(file_.mesh.points_mm.size());
    for (std::size_t i = 0; i < faces.size();) {
      std::size_t next = i + 1;
      while (next < faces.size() && faces[next] == faces[i]) ++next;
      if (next == i + 1) {
        for (const std::uint32_t p : faces[i]) surface_point[p] = true;
        add_edges(faces[i], on_surface);
      }
      i = next;
    }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    std::sort(on_surface.begin(), on_surface.end());
    std::set_difference(edges.begin(), edges.end(), on_surface.begin(), on_surface.end(), std::back_inserter(through));
    std::erase_if(through, [&](const auto& e) { return !surface_point[e[0]] || !surface_point[e[1]]; });
    return through;
  }
  // What holds points in all steps.
  void hold() {
    std::map<std::uint32_t, std::uint8_t> of_point;
    for (const auto& [node, axes] : held_) {
      if (const auto p = file_.point_of.find(node); p != file_.point_of.end()) of_point[p->second] = axes;
    }
    for (const auto& [p, axes] : of_point) {
      if (axes == 7) problem_.fixed.push_back(p);
      if (axes != 0 && axes != 7) problem_.sliders.push_back({p, axes});
    }
  }
  void cload(const InpCard& card, bool anew) {
    Step& step = steps_.back();
    if (anew) step.forces.clear();
    for (const auto& row : card.rows) {
      if (row.size() < 3) throw fail(card, "a line holds less than a node, an axis and a force");
      const double axis = number_of(card, row[1]), force = number_of(card, row[2]);
      if (axis != 1 && axis != 2 && axis != 3) throw fail(card, "axes go from 1 to 3, not " + row[1]);
      for (const long node : members(card, file_.node_sets, row[0])) {
        if (!file_.point_of.contains(node) && !file_.middle_of.contains(node))
          throw fail(card, "no element has node " + std::to_string(node));
        const std::pair key{node, static_cast<std::size_t>(axis) - 1};
        double& all = step.forces[key];
        all = now_.forces.insert(key).second ? force : all + force;
      }
    }
  }
  void dload(const InpCard& card, bool anew) {
    Step& step = steps_.back();
    if (anew) {
      step.pressures.clear();
      step.pulls.clear();
      now_.pulls = 0;
    }
    for (const auto& row : card.rows) {
      if (row.size() >= 6 && row[1] == "GRAV") {
        const Vec3 along{number_of(card, row[3]), number_of(card, row[4]), number_of(card, row[5])};
        if (!(length(along) > 0)) throw fail(card, "gravity has no direction");
        const Pull made{row[0], normalized(along), number_of(card, row[2]), &card};
        const auto before = step.pulls.end() - static_cast<std::ptrdiff_t>(now_.pulls);
        // An equal pull may stand there several times: all of them are replaced, as CalculiX does.
        const auto kept = std::remove_if(step.pulls.begin(), before, [&](const Pull& p) {
          return p.set == made.set && length(p.along - made.along) < 1e-9;
        });
        step.pulls.erase(kept, before);
        step.pulls.push_back(made);
        ++now_.pulls;
        continue;
      }
      if (row.size() < 3 || row[1].size() != 2 || row[1][0] != 'P' || row[1][1] < '1' || row[1][1] > '4')
        throw fail(card, "only pressures P1 to P4 on faces and GRAV with its size and direction are read");
      const double mpa = number_of(card, row[2]);
      for (const long element : members(card, file_.element_sets, row[0])) {
        if (!file_.corners_of.contains(element)) throw fail(card, "there is no element " + std::to_string(element));
        const std::pair key{element, static_cast<std::size_t>(row[1][1] - '1')};
        Pressure& all = step.pressures[key];
        all = {now_.pressures.insert(key).second ? mpa : all.mpa + mpa, &card};
      }
    }
  }
  [[nodiscard]] TissueLoad load_of(const Step& step) const {
    TissueLoad load;
    load.fixed = problem_.fixed;
    load.sliders = problem_.sliders;
    for (const auto& [node, m] : step.moved) {
      if (const auto p = file_.point_of.find(node); p != file_.point_of.end())
        load.moved.push_back({p->second, m.axes, m.by_mm});
    }
    middles(step, load);
    for (const auto& [key, newton] : step.forces) {
      Vec3 force{};
      force[key.second] = newton;
      if (const auto p = file_.point_of.find(key.first); p != file_.point_of.end()) {
        load.forces_n.push_back({p->second, force});
      } else {
        const auto& ends = file_.middle_of.at(key.first);
        load.edge_forces_n.push_back({ends, force});
        for (const std::uint32_t end : ends) load.forces_n.push_back({end, force * 0.5});
      }
    }
    const auto at = [&](std::uint32_t p) { return from_floats(file_.mesh.points_mm[p]); };
    for (const auto& [key, pressure] : step.pressures) {
      const auto& corners = file_.corners_of.at(key.first);
      std::array<std::uint32_t, 3> face{};
      for (std::size_t i = 0; i < 3; ++i) face[i] = corners[kTetFaces[key.second][i]];
      Vec3 area = cross(at(face[1]) - at(face[0]), at(face[2]) - at(face[0])) * 0.5, middle{};
      for (const std::uint32_t p : corners) middle += at(p) / 4;
      if (dot(area, middle - at(face[0])) < 0) area = area * -1;  // inwards
      load.add_on_face(face, area * pressure.mpa);
    }
    for (const Pull& p : step.pulls) pull(p, load);
    return load;
  }
  void pull(const Pull& p, TissueLoad& load) const {
    for (const long element : members(*p.card, file_.element_sets, p.set)) {
      const auto found = file_.corners_of.find(element);
      if (found == file_.corners_of.end()) throw fail(*p.card, "there is no element " + std::to_string(element));
      const auto at = [&](std::size_t i) { return from_floats(file_.mesh.points_mm[found->second[i]]); };
      const double volume = std::abs(dot(cross(at(1) - at(0), at(2) - at(0)), at(3) - at(0))) / 6,
                   density =
                       problem_.materials[problem_.materials.size() == 1 ? 0 : file_.tet_of.at(element)].density_kg_m3;
      if (!(density > 0))
        throw fail(*p.card, "the material of element " + std::to_string(element) + " has no *DENSITY");
      load.add_in_tet(found->second, p.along * (p.mm_s2 * density * kTonnesPerMm3 * volume));
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
  std::vector<Step> steps_;
  Named now_;
  std::map<long, std::uint8_t> held_;
  const InpCard* last_boundary_ = nullptr;
  std::vector<std::array<std::uint32_t, 2>> through_;  // edges_through_body(), of linear elements
};

}  // namespace

TissueProblem problem_of_inp(std::string_view text, const TetMesh& mesh, bool needs_loads, Weight weight) {
  return Reader(text, mesh).run(needs_loads, weight);
}

}  // namespace tissue

}  // namespace osteo::inline simulation
