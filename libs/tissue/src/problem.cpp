#include "osteo/tissue/problem.h"

#include <functional>
#include <nlohmann/json.hpp>

#include "osteo/base/error.h"
#include "osteo/base/json.h"
#include "osteo/tissue/calibrate.h"
#include "problem_inp.h"

namespace osteo {
namespace {

using nlohmann::ordered_json;

Vec3 vec(const ordered_json& j) {
  return {j.at(0).get<double>(), j.at(1).get<double>(), j.at(2).get<double>()};
}

std::function<bool(Vec3)> place(const ordered_json& j) {
  if (j.contains("box_mm")) {
    const Vec3 lo = vec(j.at("box_mm").at(0)), hi = vec(j.at("box_mm").at(1));
    return [=](Vec3 p) { return p.x >= lo.x && p.y >= lo.y && p.z >= lo.z && p.x <= hi.x && p.y <= hi.y && p.z <= hi.z; };
  }
  const Vec3 at = vec(j.at("at_mm"));
  const double r = j.at("radius_mm");
  return [=](Vec3 p) { return length(p - at) <= r; };
}

Material material(const ordered_json& j) {
  return {j.at("young_kpa").get<double>() / 1000, j.at("poisson").get<double>()};
}

// A key that is not known would be left out in silence.
void allow_known_keys(const JsonFile& file) {
  const auto each = [&](const JsonValue& object, const char* key, const std::string& where, auto&& f) {
    const JsonValue* const list = object.find(key);
    for (std::size_t n = 0; list != nullptr && n < list->items.size(); ++n) f(list->items[n], where + " " + std::to_string(n + 1));
  };
  using Keys = std::vector<std::string>;
  const auto at_a_place = [&](Keys keys) {
    return [&file, keys = std::move(keys)](const JsonValue& v, const std::string& where) mutable {
      Keys all{"name", "about", "box_mm", "at_mm", "radius_mm"};
      all.insert(all.end(), keys.begin(), keys.end());
      file.allow(v, where, all);
    };
  };
  const JsonValue& root = file.root();
  file.allow(root, "", Keys{"osteotome_tissue", "$schema", "about", "material", "regions", "fixed", "loads"});
  if (const JsonValue* const m = root.find("material")) file.allow(*m, "material", Keys{"young_kpa", "poisson"});
  each(root, "regions", "region", at_a_place({"young_kpa", "poisson"}));
  each(root, "fixed", "fixed", at_a_place({"axes"}));
  each(root, "loads", "load", [&](const JsonValue& l, const std::string& where) {
    file.allow(l, where, Keys{"name", "about", "forces", "surfaces"});
    each(l, "forces", where + ", force", at_a_place({"total_n"}));
    each(l, "surfaces", where + ", surface", at_a_place({"kpa"}));
  });
}

}  // namespace

TissueProblem parse_tissue_problem(std::string_view json, const TetMesh& mesh, bool needs_loads) {
  if (const std::size_t first = json.find_first_not_of(" \t\r\n"); first != std::string_view::npos && json[first] == '*')
    return tissue::problem_of_inp(json, mesh, needs_loads);
  TissueProblem problem;
  allow_known_keys(JsonFile(json, "tissue problem"));
  std::string where = "header";
  const auto refuse = [&](const std::string& what, const std::string& advice = {}) {
    return Error(ExitCode::usage, "the tissue problem, " + where + ": " + what, advice);
  };
  try {
    const auto j = ordered_json::parse(json, nullptr, true, true);
    if (j.at("osteotome_tissue") != 1) throw refuse("\"osteotome_tissue\" must be 1");
    where = "material";
    const Material general = problem.general = material(j.at("material"));
    const auto regions = j.value("regions", ordered_json::array());
    problem.materials.assign(regions.empty() ? 1 : mesh.tets.size(), general);
    int number = 0;
    for (const auto& r : regions) {
      where = "region " + std::to_string(++number);
      const auto in = place(r);
      const Material m = material(r);
      std::size_t hit = 0;
      for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
        Vec3 middle{};
        for (const std::uint32_t p : mesh.tets[t]) middle += from_floats(mesh.points_mm[p]) / 4;
        if (!in(middle)) continue;
        problem.materials[t] = m;
        ++hit;
      }
      if (hit == 0) throw refuse("no tetrahedron lies in it", "places are LPS mm; mesh-info tells where the mesh is");
    }
    std::vector<bool> fixed(mesh.points_mm.size());
    number = 0;
    for (const auto& f : j.at("fixed")) {
      where = "fixed " + std::to_string(++number);
      const auto in = place(f);
      std::uint8_t axes = 0;
      for (const char c : f.value("axes", std::string("xyz"))) {
        if (c < 'x' || c > 'z') throw refuse("\"axes\" are made of x, y and z, not '" + std::string(1, c) + "'");
        axes = static_cast<std::uint8_t>(axes | 1 << (c - 'x'));
      }
      std::size_t hit = 0;
      for (std::uint32_t p = 0; p < fixed.size(); ++p) {
        if (!in(from_floats(mesh.points_mm[p]))) continue;
        ++hit;
        if (axes != 7) {
          problem.sliders.push_back({p, axes});
          continue;
        }
        if (!fixed[p]) problem.fixed.push_back(p);
        fixed[p] = true;
      }
      if (hit == 0) throw refuse("no point lies in it", "places are LPS mm; mesh-info tells where the mesh is");
    }
    number = 0;
    TriMesh boundary;
    std::vector<std::uint32_t> point_of;
    for (const auto& l : needs_loads ? j.at("loads") : j.value("loads", ordered_json::array())) {
      where = "load " + std::to_string(++number);
      TissueLoad load;
      load.fixed = problem.fixed;
      load.sliders = problem.sliders;
      if (!l.contains("forces") && !l.contains("surfaces")) throw refuse("it has neither \"forces\" nor \"surfaces\"");
      for (const auto& f : l.value("surfaces", ordered_json::array())) {
        if (boundary.triangles.empty()) boundary = boundary_of(mesh, &point_of);
        const auto in = place(f);
        const auto& kpa = f.at("kpa");
        std::size_t hit = 0;
        for (const auto& t : boundary.triangles) {
          const Vec3 a = from_floats(boundary.points_mm[t[0]]), b = from_floats(boundary.points_mm[t[1]]),
                     c = from_floats(boundary.points_mm[t[2]]);
          if (!in((a + b + c) / 3)) continue;
          ++hit;
          const Vec3 area = cross(b - a, c - a) * 0.5;  // outwards
          load.add_on_face({point_of[t[0]], point_of[t[1]], point_of[t[2]]},
                           kpa.is_array() ? vec(kpa) * (length(area) / 1000) : area * (-kpa.get<double>() / 1000));
        }
        if (hit == 0) throw refuse("no part of the body's surface lies where it is loaded", "make its place larger");
      }
      for (const auto& f : l.value("forces", ordered_json::array())) {
        const auto in = place(f);
        const Vec3 total = vec(f.at("total_n"));
        std::vector<std::uint32_t> near;
        for (std::uint32_t p = 0; p < fixed.size(); ++p) {
          if (!fixed[p] && in(from_floats(mesh.points_mm[p]))) near.push_back(p);
        }
        if (near.empty()) throw refuse("no point that can move lies where a force acts", "make its place larger");
        for (const std::uint32_t p : near) load.forces_n.push_back({p, total / static_cast<double>(near.size())});
      }
      problem.load_names.push_back(l.value("name", "load " + std::to_string(number)));
      problem.loads.push_back(std::move(load));
    }
    where = "loads";
    if (needs_loads && problem.loads.empty()) throw refuse("there is none");
  } catch (const nlohmann::json::exception& e) {
    throw refuse(json_complaint(e), "docs/tissue.md describes the file");
  }
  return problem;
}

TissueModel model_of_problem(const TetMesh& mesh, const TissueProblem& problem, const std::optional<std::string>& constants_json) {
  const auto constants = [&]() -> std::optional<ordered_json> {
    if (!constants_json) return std::nullopt;
    try {
      auto j = ordered_json::parse(*constants_json);
      if (j.at("osteotome_tissue_constants") != 1) throw Error(ExitCode::usage, "these are no constants of calibrate");
      return j;
    } catch (const nlohmann::json::exception& e) {
      throw Error(ExitCode::usage, std::string("these are no constants of calibrate: ") + json_complaint(e));
    }
  }();
  // One material a voxel, from those of its tetrahedra.
  std::vector<Material> materials;
  const std::size_t step = problem.materials.size() == 1 ? 1 : 5;
  for (std::size_t t = 0; t < problem.materials.size(); t += step) materials.push_back(problem.materials[t]);
  if (constants && constants->contains("base")) materials.assign(1, material(constants->at("base")));
  TissueModel model = TissueModel::of_voxels(points_of(mesh), tets_of(mesh), materials);
  if (!constants) {
    model.scale({1, 1, 0, 1});
    return model;
  }
  try {
    return with_log_factors(model, constants->at("grid").get<std::array<int, 3>>(),
                            constants->at("log_factors").get<std::vector<double>>());
  } catch (const nlohmann::json::exception& e) {
    throw Error(ExitCode::usage, std::string("these are no constants of calibrate: ") + json_complaint(e));
  }
}

}  // namespace osteo
