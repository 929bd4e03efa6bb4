#include "osteo/simulation/tissue/fem.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "osteo/core/base/error.h"

namespace osteo::inline simulation {
namespace {

constexpr int kEdges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};  // of C3D10

}  // namespace

std::vector<Vec3> points_of(const TetMesh& mesh) {
  std::vector<Vec3> points;
  for (const auto& p : mesh.points_mm) points.push_back(from_floats(p));
  return points;
}
std::vector<std::array<std::uint32_t, 4>> tets_of(const TetMesh& mesh) {
  return {mesh.tets.begin(), mesh.tets.end()};
}

FemBody::FemBody(std::span<const Vec3> points, std::span<const std::array<std::uint32_t, 4>> tets,
                 std::vector<Material> materials, ElasticLaw law, TetOrder order)
    : rest_(points.begin(), points.end()),
      count_(tets.size()),
      per_(order == TetOrder::t10 ? 10 : 4),
      corners_(points.size()),
      gauss_per_(order == TetOrder::t10 ? 4 : 1),
      materials_(std::move(materials)),
      law_(law),
      order_(order) {
  if (materials_.size() != 1 && materials_.size() != tets.size())
    throw Error(ExitCode::usage,
                std::to_string(materials_.size()) + " materials for " + std::to_string(tets.size()) + " tetrahedra",
                "give one for all, or one each");
  for (const Material& m : materials_) {
    if (!(m.young_mpa > 0 && std::isfinite(m.young_mpa)) || !(m.poisson > -1 && m.poisson < 0.5))
      throw Error(ExitCode::usage, "a material needs a modulus above 0 and a Poisson's ratio between -1 and 0.5, not " +
                                       std::to_string(m.young_mpa) + " MPa and " + std::to_string(m.poisson));
  }
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  for (std::size_t t = 0; t < tets.size(); ++t) {
    for (const std::uint32_t p : tets[t]) {
      if (p >= corners_)
        throw Error(ExitCode::usage,
                    "tetrahedron " + std::to_string(t) + " names point " + std::to_string(p) + ", which is not there");
      nodes_.push_back(p);
    }
    for (int e = 0; e < 6 && per_ == 10; ++e) {
      const std::uint32_t a = tets[t][static_cast<std::size_t>(kEdges[e][0])],
                          b = tets[t][static_cast<std::size_t>(kEdges[e][1])];
      const auto [it, fresh] =
          middles.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<std::uint32_t>(rest_.size()));
      if (fresh) {
        rest_.push_back((rest_[a] + rest_[b]) * 0.5);
        middle_of_.push_back({a, b});
      }
      nodes_.push_back(it->second);
    }
    const Vec3 o = points[tets[t][0]];
    const Vec3 d[3] = {points[tets[t][1]] - o, points[tets[t][2]] - o, points[tets[t][3]] - o};
    const double six = dot(d[0], cross(d[1], d[2]));
    if (!(six > 0))
      throw Error(ExitCode::corrupt, "tetrahedron " + std::to_string(t) + " has no volume, or is inside out",
                  "mesh-info lists all of them");
    Vec3 corner[4];  // gradients of the barycentric coordinates
    corner[1] = cross(d[1], d[2]) / six;
    corner[2] = cross(d[2], d[0]) / six;
    corner[3] = cross(d[0], d[1]) / six;
    corner[0] = (corner[1] + corner[2] + corner[3]) * -1;
    for (std::size_t q = 0; q < gauss_per_; ++q) {
      Gauss g{};
      g.weight_mm3 = six / 6 / static_cast<double>(gauss_per_);
      if (per_ == 4) {
        for (std::size_t a = 0; a < 4; ++a) g.gradient[a] = corner[a];
      } else {
        // Exact for quadratics.
        constexpr double kA = 0.5854101966249685, kB = 0.1381966011250105;
        double l[4] = {kB, kB, kB, kB};
        l[q] = kA;
        for (std::size_t a = 0; a < 4; ++a) g.gradient[a] = corner[a] * (4 * l[a] - 1);
        for (std::size_t e = 0; e < 6; ++e) {
          const auto a = static_cast<std::size_t>(kEdges[e][0]), b = static_cast<std::size_t>(kEdges[e][1]);
          g.gradient[4 + e] = corner[a] * (4 * l[b]) + corner[b] * (4 * l[a]);
        }
      }
      gauss_.push_back(g);
    }
  }
  if (order == TetOrder::t4_mean) make_patches();
}

std::vector<std::uint32_t> FemBody::with_middles(std::span<const std::uint32_t> corners) const {
  std::vector<std::uint32_t> all(corners.begin(), corners.end());
  std::vector<bool> in(corners_);
  for (const std::uint32_t c : corners) {
    if (c < corners_) in[c] = true;
  }
  for (std::size_t m = 0; m < middle_of_.size(); ++m) {
    if (in[middle_of_[m][0]] && in[middle_of_[m][1]]) all.push_back(static_cast<std::uint32_t>(corners_ + m));
  }
  return all;
}

TissueLoad FemBody::on_all_points(const TissueLoad& load) const {
  TissueLoad all = load;
  if (per_ == 4) return all;
  all.edge_forces_n.clear();
  all.edges_held.clear();
  std::vector<std::uint8_t> held(corners_);
  const auto hold = [&](std::uint32_t p, std::uint8_t axes) {
    if (p < corners_) held[p] = static_cast<std::uint8_t>(held[p] | axes);
  };
  for (const std::uint32_t p : load.fixed) hold(p, 7);
  for (const Slider& s : load.sliders) hold(s.point, s.held);
  std::map<std::uint32_t, std::pair<std::uint8_t, Vec3>> moved;
  for (const TissueLoad::Moved& m : load.moved) {
    hold(m.point, m.held);
    auto& [axes, by] = moved[m.point];
    axes = static_cast<std::uint8_t>(axes | m.held);
    for (std::size_t a = 0; a < 3; ++a) by[a] = (m.held >> a & 1) != 0 ? m.by_mm[a] : by[a];
  }
  const auto of = [&](std::uint32_t p) {
    const auto found = moved.find(p);
    return found != moved.end() ? found->second : std::pair<std::uint8_t, Vec3>{};
  };
  std::map<std::array<std::uint32_t, 2>, std::uint8_t> left;
  for (const auto& [edge, axes] : load.edges_held)
    left[{std::min(edge[0], edge[1]), std::max(edge[0], edge[1])}] = axes;
  std::map<std::array<std::uint32_t, 2>, std::uint32_t> middle;
  for (std::size_t m = 0; m < middle_of_.size(); ++m) {
    const auto [a, b] = middle_of_[m];
    const auto point = static_cast<std::uint32_t>(corners_ + m);
    auto both = static_cast<std::uint8_t>(held[a] & held[b]);
    if (const auto l = left.find({std::min(a, b), std::max(a, b)}); l != left.end())
      both = static_cast<std::uint8_t>(both & l->second);
    const auto [axes_a, by_a] = of(a);
    const auto [axes_b, by_b] = of(b);
    const auto goes = static_cast<std::uint8_t>(both & (axes_a | axes_b)),
               stays = static_cast<std::uint8_t>(both & ~goes);
    if (goes != 0) all.moved.push_back({point, goes, (by_a + by_b) * 0.5});
    if (stays == 7) all.fixed.push_back(point);
    if (stays != 0 && stays != 7) all.sliders.push_back({point, stays});
    if (!load.edge_forces_n.empty()) middle[{std::min(a, b), std::max(a, b)}] = point;
  }
  for (const auto& [edge, force] : load.edge_forces_n) {
    const auto found = middle.find({std::min(edge[0], edge[1]), std::max(edge[0], edge[1])});
    if (found == middle.end())
      throw Error(ExitCode::usage, "a force acts between points " + std::to_string(edge[0]) + " and " +
                                       std::to_string(edge[1]) + ", which no edge joins");
    for (const std::uint32_t end : edge) all.forces_n.push_back({end, force * -0.5});
    all.forces_n.push_back({found->second, force});
  }
  return all;
}

}  // namespace osteo::inline simulation
