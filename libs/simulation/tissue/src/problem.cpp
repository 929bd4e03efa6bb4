#include "osteo/simulation/tissue/problem.h"

#include <algorithm>
#include <functional>

#include "osteo/core/base/error.h"
#include "osteo/core/base/json.h"
#include "osteo/simulation/tissue/calibrate.h"
#include "problem_inp.h"

namespace osteo::inline simulation {
namespace {

using Place = std::function<bool(Vec3)>;
using Names = std::vector<std::string>;

constexpr double kFarMm = 1e6;
constexpr const char* kWhere = "places are LPS mm; mesh-info shows where the mesh is";

Material material_of(const JsonFile& file, const JsonValue& at, const std::string& where) {
  // Finite elements bear any ratio between -1 and a half; the fast model asks for more and says so itself.
  return {file.number(file.need(at, where, "young_kpa"), where + ": \"young_kpa\"", 1e-6, 1e9) / 1000,
          file.number(file.need(at, where, "poisson"), where + ": \"poisson\" (Poisson's ratio)", -0.999, 0.49999)};
}

// Reads a problem onto a mesh, part by part; every value is checked with its line.
class ProblemReader {
 public:
  ProblemReader(std::string_view json, const TetMesh& mesh, Weight weight)
      : file_(json, "tissue problem"), mesh_(mesh), weight_(weight), held_(mesh.points_mm.size()) {}

  TissueProblem read(bool needs_loads) {
    const JsonValue& root = file_.root();
    file_.require_format("osteotome_tissue");
    allow(root, "",
          Names{"osteotome_tissue", "$schema", "about", "law", "order", "material", "regions", "fixed", "loads"});
    problem_.law = named<ElasticLaw>(root, "law", {"linear", "stvk", "neo_hooke", "neo_hooke_split", "corotated"});
    problem_.order = named<TetOrder>(root, "order", {"t4", "t10", "t4_mean"});
    const JsonValue& general = file_.need(root, "", "material");
    allow(general, "material", Names{"young_kpa", "poisson", "density_kg_m3", "about"});
    problem_.general = material_of(file_, general, "material");
    problem_.general.density_kg_m3 = density_of(general, "material").value_or(0);
    const auto& regions = items(root, "regions", false);
    problem_.materials.assign(regions.empty() ? 1 : mesh_.tets.size(), problem_.general);
    problem_.in_region.assign(regions.empty() ? 0 : mesh_.tets.size(), 0);
    each(regions, "region", [&](const JsonValue& r, const std::string& where) { read_region(r, where); });
    each(items(root, "fixed", true), "fixed",
         [&](const JsonValue& f, const std::string& where) { read_fixed(f, where); });
    const auto& loads = items(root, "loads", needs_loads);
    if (needs_loads && loads.empty()) throw file_.wrong(file_.need(root, "", "loads"), "\"loads\": there is none");
    each(loads, "load", [&](const JsonValue& l, const std::string& where) { read_load(l, where); });
    return std::move(problem_);
  }

 private:
  // These keys and no others; what is for people is text.
  void allow(const JsonValue& object, const std::string& where, const Names& keys) const {
    file_.allow(object, where, keys);
    for (const char* const key : {"name", "about"}) {
      if (const JsonValue* const found = object.find(key); found != nullptr)
        (void)file_.text(*found, (where.empty() ? "" : where + ": ") + ('"' + std::string(key) + '"'));
    }
  }
  // One of the names, in the order of the enum's values.
  template <class E>
  [[nodiscard]] std::optional<E> named(const JsonValue& object, const std::string& key, const Names& names) const {
    const JsonValue* const found = object.find(key);
    if (found == nullptr) return std::nullopt;
    const std::string& name = file_.text(*found, "\"" + key + "\"");
    std::string all;
    for (std::size_t n = 0; n < names.size(); ++n) {
      if (names[n] == name) return static_cast<E>(n);
      all += (n > 0 ? ", " : "") + names[n];
    }
    throw file_.wrong(*found, "\"" + key + "\" is one of " + all + ", not '" + name + "'");
  }
  [[nodiscard]] const std::vector<JsonValue>& items(const JsonValue& object, const std::string& key,
                                                    bool needed) const {
    static const std::vector<JsonValue> none;
    const JsonValue* const found = needed ? &file_.need(object, "", key) : object.find(key);
    return found == nullptr ? none : file_.list(*found, "\"" + key + "\"");
  }
  static void each(const std::vector<JsonValue>& list, const std::string& where, const auto& f) {
    for (std::size_t n = 0; n < list.size(); ++n) f(list[n], where + " " + std::to_string(n + 1));
  }

  [[nodiscard]] Vec3 triple(const JsonValue& v, const std::string& called, double most) const {
    const auto& c = file_.list(v, called, 3);
    return {file_.number(c[0], called, -most, most), file_.number(c[1], called, -most, most),
            file_.number(c[2], called, -most, most)};
  }

  // A box or a ball; beside it the keys `others`.
  [[nodiscard]] Place place(const JsonValue& v, const std::string& where, const Names& others) const {
    Names known{"name", "about", "box_mm", "at_mm", "radius_mm"};
    known.insert(known.end(), others.begin(), others.end());
    allow(v, where, known);
    const JsonValue *const box = v.find("box_mm"), *const at = v.find("at_mm"), *const radius = v.find("radius_mm");
    if ((box != nullptr) == (at != nullptr) || (at != nullptr) != (radius != nullptr))
      throw file_.wrong(v, where + ": it needs a place: \"box_mm\", or \"at_mm\" with \"radius_mm\"", kWhere);
    if (box != nullptr) {
      const auto& corners = file_.list(*box, where + ": \"box_mm\"", 2);
      const Vec3 lo = triple(corners[0], where + ": \"box_mm\"", kFarMm),
                 hi = triple(corners[1], where + ": \"box_mm\"", kFarMm);
      if (lo.x > hi.x || lo.y > hi.y || lo.z > hi.z)
        throw file_.wrong(*box, where + ": \"box_mm\" must be its lower corner, then its upper");
      return [=](Vec3 p) {
        return p.x >= lo.x && p.y >= lo.y && p.z >= lo.z && p.x <= hi.x && p.y <= hi.y && p.z <= hi.z;
      };
    }
    const Vec3 centre = triple(*at, where + ": \"at_mm\"", kFarMm);
    const double r = file_.number(*radius, where + ": \"radius_mm\"", 1e-6, kFarMm);
    return [=](Vec3 p) { return length(p - centre) <= r; };
  }

  void read_region(const JsonValue& r, const std::string& where) {
    const Place in = place(r, where, {"young_kpa", "poisson", "density_kg_m3"});
    Material m = material_of(file_, r, where);
    const std::optional<double> density = density_of(r, where);
    std::size_t hit = 0;
    for (std::size_t t = 0; t < mesh_.tets.size(); ++t) {
      Vec3 middle{};
      for (const std::uint32_t p : mesh_.tets[t]) middle += from_floats(mesh_.points_mm[p]) / 4;
      if (!in(middle)) continue;
      m.density_kg_m3 = density.value_or(problem_.materials[t].density_kg_m3);
      problem_.materials[t] = m;
      problem_.in_region[t] = 1;
      ++hit;
    }
    if (hit == 0) throw file_.wrong(r, where + ": no tetrahedron lies in it", kWhere);
  }

  [[nodiscard]] std::optional<double> density_of(const JsonValue& v, const std::string& where) const {
    const JsonValue* const given = v.find("density_kg_m3");
    if (given == nullptr) return std::nullopt;
    return file_.number(*given, where + ": \"density_kg_m3\"", 1, 30000);
  }

  [[nodiscard]] std::uint8_t axes_of(const JsonValue& f, const std::string& where) const {
    std::uint8_t axes = 7;
    if (const JsonValue* const given = f.find("axes"); given != nullptr) {
      axes = 0;
      for (const char c : file_.text(*given, where + ": \"axes\"")) {
        if (c < 'x' || c > 'z')
          throw file_.wrong(*given, where + ": \"axes\" are made of x, y and z, not '" + std::string(1, c) + "'");
        axes = static_cast<std::uint8_t>(axes | 1 << (c - 'x'));
      }
      if (axes == 0) throw file_.wrong(*given, where + ": \"axes\" names none", "leave it out to hold all three");
    }
    return axes;
  }

  void read_fixed(const JsonValue& f, const std::string& where) {
    const Place in = place(f, where, {"axes"});
    const std::uint8_t axes = axes_of(f, where);
    holding_.push_back({in, axes});
    std::size_t hit = 0;
    for (std::uint32_t p = 0; p < held_.size(); ++p) {
      if (!in(from_floats(mesh_.points_mm[p]))) continue;
      ++hit;
      if (axes != 7) {
        problem_.sliders.push_back({p, axes});
        continue;
      }
      if (!held_[p]) problem_.fixed.push_back(p);
      held_[p] = true;
    }
    if (hit == 0) throw file_.wrong(f, where + ": no point lies in it", kWhere);
  }

  void read_load(const JsonValue& l, const std::string& where) {
    const Names kinds{"forces", "surfaces", "volumes", "gravity_m_s2", "moved", "contacts"};
    Names known{"name", "about"};
    known.insert(known.end(), kinds.begin(), kinds.end());
    allow(l, where, known);
    if (std::none_of(kinds.begin(), kinds.end(), [&](const std::string& k) { return l.find(k) != nullptr; }))
      throw file_.wrong(
          l,
          where +
              ": it has none of \"forces\", \"surfaces\", \"volumes\", \"gravity_m_s2\", \"moved\" and \"contacts\"");
    TissueLoad load;
    load.fixed = problem_.fixed;
    load.sliders = problem_.sliders;
    each(items(l, "surfaces", false), where + ", surface",
         [&](const JsonValue& s, const std::string& at) { add_surface(load, s, at); });
    each(items(l, "forces", false), where + ", force",
         [&](const JsonValue& f, const std::string& at) { add_force(load, f, at); });
    each(items(l, "volumes", false), where + ", volume",
         [&](const JsonValue& v, const std::string& at) { add_volume(load, v, at); });
    if (const JsonValue* const g = l.find("gravity_m_s2"); g != nullptr) add_gravity(load, *g, where);
    const std::size_t fixing = holding_.size();
    each(items(l, "moved", false), where + ", moved",
         [&](const JsonValue& m, const std::string& at) { add_moved(load, m, at); });
    leave_middles(load);
    holding_.resize(fixing);
    each(items(l, "contacts", false), where + ", contact",
         [&](const JsonValue& c, const std::string& at) { add_contact(load, c, at); });
    const JsonValue* const name = l.find("name");
    problem_.load_names.push_back(name != nullptr ? file_.text(*name, where + ": \"name\"") : where);
    problem_.loads.push_back(std::move(load));
  }

  void add_surface(TissueLoad& load, const JsonValue& s, const std::string& where) {
    constexpr double kMaxKpa = 1e6;
    if (boundary_.triangles.empty()) boundary_ = boundary_of(mesh_, &point_of_);
    const Place in = place(s, where, {"kpa"});
    const JsonValue& kpa = file_.need(s, where, "kpa");
    const bool directed = kpa.kind == JsonValue::Kind::list;
    const Vec3 over_area = directed ? triple(kpa, where + ": \"kpa\"", kMaxKpa) : Vec3{};
    const double pressure = directed ? 0 : file_.number(kpa, where + ": \"kpa\"", -kMaxKpa, kMaxKpa);
    std::size_t hit = 0;
    for (const auto& t : boundary_.triangles) {
      const Vec3 a = from_floats(boundary_.points_mm[t[0]]), b = from_floats(boundary_.points_mm[t[1]]),
                 c = from_floats(boundary_.points_mm[t[2]]);
      if (!in((a + b + c) / 3)) continue;
      ++hit;
      const Vec3 area = cross(b - a, c - a) * 0.5;  // outwards
      load.add_on_face({point_of_[t[0]], point_of_[t[1]], point_of_[t[2]]},
                       directed ? over_area * (length(area) / 1000) : area * (-pressure / 1000));
    }
    if (hit == 0)
      throw file_.wrong(s, where + ": no part of the body's surface lies where it is loaded", "make its place larger");
  }

  void add_force(TissueLoad& load, const JsonValue& f, const std::string& where) {
    const Place in = place(f, where, {"total_n"});
    const Vec3 total = triple(file_.need(f, where, "total_n"), where + ": \"total_n\"", 1e6);
    std::vector<std::uint32_t> near;
    for (std::uint32_t p = 0; p < held_.size(); ++p) {
      if (!held_[p] && in(from_floats(mesh_.points_mm[p]))) near.push_back(p);
    }
    if (near.empty())
      throw file_.wrong(f, where + ": no point that can move lies where a force acts", "make its place larger");
    for (const std::uint32_t p : near) load.forces_n.push_back({p, total / static_cast<double>(near.size())});
  }

  [[nodiscard]] double volume_of(std::size_t t) const {
    const auto at = [&](std::size_t i) { return from_floats(mesh_.points_mm[mesh_.tets[t][i]]); };
    return dot(cross(at(1) - at(0), at(2) - at(0)), at(3) - at(0)) / 6;
  }

  void add_volume(TissueLoad& load, const JsonValue& v, const std::string& where) {
    const Place in = place(v, where, {"total_n"});
    const Vec3 total = triple(file_.need(v, where, "total_n"), where + ": \"total_n\"", 1e6);
    std::vector<std::size_t> within;
    double sum = 0;
    for (std::size_t t = 0; t < mesh_.tets.size(); ++t) {
      Vec3 middle{};
      for (const std::uint32_t p : mesh_.tets[t]) middle += from_floats(mesh_.points_mm[p]) / 4;
      if (!in(middle)) continue;
      within.push_back(t);
      sum += volume_of(t);
    }
    if (within.empty()) throw file_.wrong(v, where + ": no tetrahedron lies in it", kWhere);
    for (const std::size_t t : within) load.add_in_tet(mesh_.tets[t], total * (volume_of(t) / sum));
  }

  void add_gravity(TissueLoad& load, const JsonValue& g, const std::string& where) {
    const Vec3 pull = triple(g, where + ": \"gravity_m_s2\"", 1e4);
    if (weight_ == Weight::apart) {
      load.gravity_m_s2 = pull;
      return;
    }
    constexpr double kNewtonPerMm3 = 1e-9;  // of 1 kg/m3 at 1 m/s2
    for (std::size_t t = 0; t < mesh_.tets.size(); ++t) {
      const double density = problem_.materials[problem_.materials.size() == 1 ? 0 : t].density_kg_m3;
      if (density == 0)
        throw file_.wrong(g,
                          where + ": gravity needs a \"density_kg_m3\" for all of the body; tetrahedron " +
                              std::to_string(t) + " has none",
                          "give the material one; soft tissue has about 1050, bone 1900");
      load.add_in_tet(mesh_.tets[t], pull * (density * volume_of(t) * kNewtonPerMm3));
    }
  }

  void add_moved(TissueLoad& load, const JsonValue& m, const std::string& where) {
    const Place in = place(m, where, {"axes", "by_mm"});
    const std::uint8_t axes = axes_of(m, where);
    const Vec3 by = triple(file_.need(m, where, "by_mm"), where + ": \"by_mm\"", 1e4);
    for (std::size_t a = 0; a < 3; ++a) {
      if ((axes >> a & 1) == 0 && by[a] != 0)
        throw file_.wrong(m, where + ": \"by_mm\" moves along an axis that \"axes\" leaves free",
                          "give 0 there, or name the axis");
    }
    holding_.push_back({in, axes});
    std::size_t hit = 0;
    for (std::uint32_t p = 0; p < held_.size(); ++p) {
      if (!in(from_floats(mesh_.points_mm[p]))) continue;
      if (held_[p])
        throw file_.wrong(m, where + ": point " + std::to_string(p) + " is to move and is fixed",
                          "let the two places not overlap");
      load.moved.push_back({p, axes, by});
      ++hit;
    }
    if (hit == 0) throw file_.wrong(m, where + ": no point lies in it", kWhere);
  }

  // The middle of an edge is held by the places that it lies in: between two faces that are held, each by a place of
  // its own, it is free.
  void leave_middles(TissueLoad& load) const {
    if (holding_.size() < 2) return;
    std::vector<std::uint8_t> held(held_.size());
    for (const std::uint32_t p : load.fixed) held[p] = 7;
    for (const Slider& s : load.sliders) held[s.point] = static_cast<std::uint8_t>(held[s.point] | s.held);
    for (const TissueLoad::Moved& m : load.moved) held[m.point] = static_cast<std::uint8_t>(held[m.point] | m.held);
    std::vector<std::array<std::uint32_t, 2>> edges;
    for (const auto& t : mesh_.tets) {
      for (std::size_t i = 0; i < 4; ++i) {
        for (std::size_t j = i + 1; j < 4; ++j) {
          if ((held[t[i]] & held[t[j]]) != 0) edges.push_back({std::min(t[i], t[j]), std::max(t[i], t[j])});
        }
      }
    }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    for (const auto& edge : edges) {
      const Vec3 middle = (from_floats(mesh_.points_mm[edge[0]]) + from_floats(mesh_.points_mm[edge[1]])) * 0.5;
      std::uint8_t axes = 0;
      for (const auto& [in, along] : holding_) axes = static_cast<std::uint8_t>(axes | (in(middle) ? along : 0));
      const auto both = static_cast<std::uint8_t>(held[edge[0]] & held[edge[1]]);
      if ((both & ~axes) != 0) load.edges_held.push_back({edge, static_cast<std::uint8_t>(both & axes)});
    }
  }

  void add_contact(TissueLoad& load, const JsonValue& c, const std::string& where) {
    allow(c, where, Names{"name", "about", "at_mm", "normal", "radius_mm", "stiffness_n_per_mm"});
    const Vec3 at = triple(file_.need(c, where, "at_mm"), where + ": \"at_mm\"", kFarMm);
    const JsonValue *const normal = c.find("normal"), *const radius = c.find("radius_mm");
    if ((normal != nullptr) == (radius != nullptr))
      throw file_.wrong(c,
                        where + ": it needs \"normal\" (a plane that the body lies before) or \"radius_mm\" (a ball)");
    RigidContact contact;
    contact.stiffness_n_per_mm =
        file_.number(file_.need(c, where, "stiffness_n_per_mm"), where + ": \"stiffness_n_per_mm\"", 1e-9, 1e9);
    if (normal != nullptr) {
      const Vec3 out = triple(*normal, where + ": \"normal\"", 1e6);
      if (!(length(out) > 1e-9)) throw file_.wrong(*normal, where + ": \"normal\" has no length");
      contact.shape = std::make_shared<PlaneShape>(at, out);
    } else {
      contact.shape =
          std::make_shared<BallShape>(at, file_.number(*radius, where + ": \"radius_mm\"", 1e-6, kFarMm), false);
    }
    load.contacts.push_back(std::move(contact));
  }

  const JsonFile file_;
  const TetMesh& mesh_;
  const Weight weight_;
  TissueProblem problem_;
  std::vector<bool> held_;  // along all axes
  std::vector<std::pair<Place, std::uint8_t>>
      holding_;       // places that are fixed, or that the load moves, with their axes
  TriMesh boundary_;  // made when a surface is loaded
  std::vector<std::uint32_t> point_of_;
};

}  // namespace

TissueProblem parse_tissue_problem(std::string_view json, const TetMesh& mesh, bool needs_loads, Weight weight) {
  if (const std::size_t first = json.find_first_not_of(" \t\r\n");
      first != std::string_view::npos && json[first] == '*')
    return tissue::problem_of_inp(json, mesh, needs_loads, weight);
  return ProblemReader(json, mesh, weight).read(needs_loads);
}

TissueModel model_of_problem(const TetMesh& mesh, const TissueProblem& problem,
                             const std::optional<std::string>& constants_json) {
  std::optional<JsonFile> constants;
  if (constants_json) {
    constants.emplace(*constants_json, "constants of calibrate");
    constants->require_format("osteotome_tissue_constants");
  }
  // One material a voxel, from those of its tetrahedra.
  std::vector<Material> materials;
  const std::size_t step = problem.materials.size() == 1 ? 1 : 5;
  for (std::size_t t = 0; t < problem.materials.size(); t += step) materials.push_back(problem.materials[t]);
  if (constants) {
    if (const JsonValue* const base = constants->root().find("base"); base != nullptr)
      materials.assign(1, material_of(*constants, *base, "base"));
  }
  TissueModel model = TissueModel::of_voxels(points_of(mesh), tets_of(mesh), materials);
  if (!constants) {
    model.scale({1, 1, 0, 1});
    return model;
  }
  const JsonValue& root = constants->root();
  std::array<int, 3> grid{};
  const auto& sizes = constants->list(constants->need(root, "", "grid"), "\"grid\"", 3);
  for (std::size_t a = 0; a < 3; ++a) grid[a] = static_cast<int>(constants->number(sizes[a], "\"grid\"", 1, 1000));
  std::vector<double> log_factors;
  for (const JsonValue& f : constants->list(constants->need(root, "", "log_factors"), "\"log_factors\""))
    log_factors.push_back(constants->number(f, "\"log_factors\"", -100, 100));
  return with_log_factors(model, grid, log_factors);
}

}  // namespace osteo::inline simulation
