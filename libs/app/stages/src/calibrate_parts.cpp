#include "calibrate_parts.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "tissue_parts.h"

namespace osteo::inline app::tissue {
namespace {

bool is_edge(const TissueModel::Constraint& c) {
  return c.kind == TissueClass::axis_edge || c.kind == TissueClass::diagonal_edge;
}

}  // namespace

std::vector<double> stiffness_kpa(const TissueModel& model, const TissueModel& uniform, const Material& of_uniform) {
  std::vector<double> all;
  for (std::size_t c = 0; c < model.constraints().size(); ++c)
    all.push_back(1000 * of_uniform.young_mpa * model.constraints()[c].stiffness / uniform.base_stiffness(c));
  return all;
}

Tets stiffness_map(const TetMesh& mesh, const TissueModel& model, std::span<const double> kpa) {
  TetMesh map;
  map.points_mm = mesh.points_mm;
  map.tets = mesh.tets;
  map.values_name = "stiffness_kpa";
  std::vector<double> sum(mesh.points_mm.size()), count(sum.size());
  for (std::size_t c = 0; c < kpa.size(); ++c) {
    if (!is_edge(model.constraints()[c])) continue;
    for (const std::uint32_t p : model.nodes(c)) {
      sum[p] += std::log(kpa[c]);
      count[p] += 1;
    }
  }
  for (std::size_t p = 0; p < sum.size(); ++p)
    map.values.push_back(static_cast<float>(count[p] > 0 ? std::exp(sum[p] / count[p]) : 0));
  return std::make_shared<const TetMesh>(std::move(map));
}

MaterialEdges material_edges(const TissueProblem& problem, const TissueModel& model) {
  constexpr std::size_t kMixed = ~std::size_t{0}, kUnseen = kMixed - 1;
  MaterialEdges edges;
  edges.of.assign(model.constraints().size(), -1);
  if (problem.materials.size() == 1) return edges;
  std::vector<std::size_t> of_point(model.point_count(), kUnseen);
  const auto same = [&](std::size_t a, std::size_t b) {
    return problem.materials[a].young_mpa == problem.materials[b].young_mpa &&
           problem.materials[a].poisson == problem.materials[b].poisson;
  };
  for (std::size_t t = 0; t < problem.materials.size(); ++t) {
    for (const std::uint32_t p : model.tets()[t]) {
      if (of_point[p] == kUnseen) of_point[p] = t;
      if (of_point[p] != kMixed && !same(of_point[p], t)) of_point[p] = kMixed;
    }
  }
  std::map<double, std::vector<std::size_t>> found;  // by true modulus
  for (std::size_t c = 0; c < edges.of.size(); ++c) {
    if (!is_edge(model.constraints()[c])) continue;
    const std::size_t a = of_point[model.constraints()[c].node[0]], b = of_point[model.constraints()[c].node[1]];
    if (a >= kUnseen || b >= kUnseen || !same(a, b)) continue;
    found[1000 * problem.materials[a].young_mpa].push_back(c);
  }
  for (const auto& [young, all] : found) {
    for (const std::size_t c : all) edges.of[c] = static_cast<int>(edges.young_kpa.size());
    edges.young_kpa.push_back(young);
  }
  return edges;
}

Json learnt(const MaterialEdges& edges, std::span<const double> kpa) {
  Json all = Json::list();
  for (std::size_t m = 0; m < edges.young_kpa.size(); ++m) {
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t c = 0; c < edges.of.size(); ++c) {
      if (edges.of[c] != static_cast<int>(m)) continue;
      sum += std::log(kpa[c]);
      ++count;
    }
    all.push_back({{"young_kpa", edges.young_kpa[m]},
                   {"learnt_kpa", std::exp(sum / static_cast<double>(count))},
                   {"edges", count}});
  }
  return all;
}

std::vector<std::size_t> loads_named(const TissueProblem& problem, const std::string& names) {
  std::vector<std::size_t> loads;
  for (std::size_t at = 0; at < names.size();) {
    const std::size_t comma = std::min(names.find(',', at), names.size());
    loads.push_back(load_named(problem, names.substr(at, comma - at)));
    at = comma + 1;
  }
  return loads;
}

}  // namespace osteo::inline app::tissue
