#include "osteo/tissue/fem.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>

#include "osteo/base/error.h"

namespace osteo {
namespace {

struct M3 {
  double m[3][3];  // rows
};

double determinant_of(const M3& f) {
  return f.m[0][0] * (f.m[1][1] * f.m[2][2] - f.m[1][2] * f.m[2][1]) - f.m[0][1] * (f.m[1][0] * f.m[2][2] - f.m[1][2] * f.m[2][0]) +
         f.m[0][2] * (f.m[1][0] * f.m[2][1] - f.m[1][1] * f.m[2][0]);
}

// Inverse, transposed.
M3 inverse_transposed(const M3& f, double det) {
  M3 r{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
      r.m[i][j] = (f.m[a][c] * f.m[b][d] - f.m[a][d] * f.m[b][c]) / det;
    }
  }
  return r;
}

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

FemBody::FemBody(std::span<const Vec3> points, std::span<const std::array<std::uint32_t, 4>> tets, std::vector<Material> materials,
                 ElasticLaw law, TetOrder order)
    : rest_(points.begin(), points.end()),
      count_(tets.size()),
      per_(order == TetOrder::t4 ? 4 : 10),
      corners_(points.size()),
      gauss_per_(order == TetOrder::t4 ? 1 : 4),
      materials_(std::move(materials)),
      law_(law) {
  if (materials_.size() != 1 && materials_.size() != tets.size())
    throw Error(ExitCode::usage, std::to_string(materials_.size()) + " materials for " + std::to_string(tets.size()) + " tetrahedra",
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
        throw Error(ExitCode::usage, "tetrahedron " + std::to_string(t) + " names point " + std::to_string(p) + ", which is not there");
      nodes_.push_back(p);
    }
    for (int e = 0; e < 6 && per_ == 10; ++e) {
      const std::uint32_t a = tets[t][static_cast<std::size_t>(kEdges[e][0])], b = tets[t][static_cast<std::size_t>(kEdges[e][1])];
      const auto [it, fresh] = middles.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<std::uint32_t>(rest_.size()));
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
                  "mesh-info tells of all of them");
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
}

double FemBody::element(std::size_t e, const Vec3* x, double* gradient, double* hessian) const {
  const Material& mat = material(e);
  const double mu = mat.shear_mpa(), lambda = mat.lambda_mpa();
  const std::size_t n = per_;
  if (gradient != nullptr) std::fill(gradient, gradient + 3 * n, 0.0);
  if (hessian != nullptr) std::fill(hessian, hessian + 9 * n * n, 0.0);
  double energy = 0;
  for (std::size_t q = 0; q < gauss_per_; ++q) {
    const Gauss& g = gauss_[e * gauss_per_ + q];
    M3 f{};
    for (std::size_t a = 0; a < n; ++a) {
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) f.m[i][j] += x[a][static_cast<std::size_t>(i)] * g.gradient[a][static_cast<std::size_t>(j)];
      }
    }
    const double w = g.weight_mm3;
    M3 p{}, inv{}, s{};
    // Of both neo-Hookean laws: P = along_f F + along_inv F^-T; dP/dF = along_f 1 - along_inv (F^-T dF^T F^-T) +
    // mixed (F x F^-T + F^-T x F) + twice_inv F^-T x F^-T.
    double along_f = 0, along_inv = 0, mixed = 0, twice_inv = lambda;
    if (law_ == ElasticLaw::linear) {
      double trace = 0, square = 0;
      for (int i = 0; i < 3; ++i) trace += f.m[i][i] - 1;
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
          const double eps = 0.5 * (f.m[i][j] + f.m[j][i]) - (i == j ? 1 : 0);
          square += eps * eps;
          p.m[i][j] = 2 * mu * eps + (i == j ? lambda * trace : 0);
        }
      }
      energy += w * (mu * square + 0.5 * lambda * trace * trace);
    } else if (law_ == ElasticLaw::stvk) {
      double trace = 0, square = 0;
      M3 green{};
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
          double c = 0;
          for (int k = 0; k < 3; ++k) c += f.m[k][i] * f.m[k][j];
          green.m[i][j] = 0.5 * (c - (i == j ? 1 : 0));
        }
        trace += green.m[i][i];
      }
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
          square += green.m[i][j] * green.m[i][j];
          s.m[i][j] = 2 * mu * green.m[i][j] + (i == j ? lambda * trace : 0);
        }
      }
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          for (int k = 0; k < 3; ++k) p.m[i][j] += f.m[i][k] * s.m[k][j];
      energy += w * (mu * square + 0.5 * lambda * trace * trace);
    } else {
      const double det = determinant_of(f);
      if (!(det > 0)) return std::numeric_limits<double>::infinity();
      const double log_j = std::log(det);
      double norm = 0;
      for (const auto& row : f.m)
        for (const double v : row) norm += v * v;
      if (law_ == ElasticLaw::neo_hooke) {
        energy += w * (0.5 * mu * (norm - 3) - mu * log_j + 0.5 * lambda * log_j * log_j);
        along_f = mu;
        along_inv = lambda * log_j - mu;
      } else {
        const double bulk = mat.bulk_mpa(), shape = mu / std::cbrt(det * det);
        energy += w * (0.5 * (shape * norm - 3 * mu) + 0.5 * bulk * (det - 1) * (det - 1));
        along_f = shape;
        along_inv = bulk * (det - 1) * det - shape * norm / 3;
        mixed = -2.0 / 3 * shape;
        twice_inv = bulk * (2 * det - 1) * det + 2.0 / 9 * shape * norm;
      }
      if (gradient == nullptr && hessian == nullptr) continue;
      inv = inverse_transposed(f, det);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) p.m[i][j] = along_f * f.m[i][j] + along_inv * inv.m[i][j];
    }
    if (gradient != nullptr) {
      for (std::size_t a = 0; a < n; ++a)
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t j = 0; j < 3; ++j) gradient[3 * a + i] += w * p.m[i][j] * g.gradient[a][j];
    }
    if (hessian == nullptr) continue;
    // d(force a, i) / d(x b, k) = sum over j, l of grad_a[j] dP_ij/dF_kl grad_b[l].
    Vec3 turned[kMostNodes], back[kMostNodes];  // F grad, F^-T grad
    for (std::size_t a = 0; a < n; ++a) {
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
          turned[a][i] += f.m[i][j] * g.gradient[a][j];
          back[a][i] += inv.m[i][j] * g.gradient[a][j];
        }
      }
    }
    double left[3][3];  // F F^T (stvk)
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) left[i][k] = f.m[i][0] * f.m[k][0] + f.m[i][1] * f.m[k][1] + f.m[i][2] * f.m[k][2];
    for (std::size_t a = 0; a < n; ++a) {
      for (std::size_t b = 0; b < n; ++b) {
        const Vec3 ga = g.gradient[a], gb = g.gradient[b];
        const double both = dot(ga, gb);
        double stress = 0;
        if (law_ == ElasticLaw::stvk) {
          for (std::size_t j = 0; j < 3; ++j)
            for (std::size_t l = 0; l < 3; ++l) stress += ga[j] * s.m[j][l] * gb[l];
        }
        for (std::size_t i = 0; i < 3; ++i) {
          for (std::size_t k = 0; k < 3; ++k) {
            double v = 0;
            if (law_ == ElasticLaw::linear) {
              v = mu * ((i == k ? both : 0) + ga[k] * gb[i]) + lambda * ga[i] * gb[k];
            } else if (law_ == ElasticLaw::stvk) {
              v = (i == k ? stress : 0) + mu * (left[i][k] * both + turned[b][i] * turned[a][k]) + lambda * turned[a][i] * turned[b][k];
            } else {
              v = (i == k ? along_f * both : 0) - along_inv * back[b][i] * back[a][k] + twice_inv * back[a][i] * back[b][k];
              if (mixed != 0) v += mixed * (turned[a][i] * back[b][k] + back[a][i] * turned[b][k]);
            }
            hessian[(3 * a + i) * 3 * n + 3 * b + k] += w * v;
          }
        }
      }
    }
  }
  return energy;
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
  all.fixed = with_middles(load.fixed);
  all.edge_forces_n.clear();
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
  std::map<std::array<std::uint32_t, 2>, std::uint32_t> middle;
  for (std::size_t m = 0; m < middle_of_.size(); ++m) {
    const auto [a, b] = middle_of_[m];
    const auto point = static_cast<std::uint32_t>(corners_ + m);
    const auto both = static_cast<std::uint8_t>(held[a] & held[b]);
    const auto [axes_a, by_a] = of(a);
    const auto [axes_b, by_b] = of(b);
    const auto goes = static_cast<std::uint8_t>(both & (axes_a | axes_b)), stays = static_cast<std::uint8_t>(both & ~goes);
    if (goes != 0) all.moved.push_back({point, goes, (by_a + by_b) * 0.5});
    if (stays != 0 && stays != 7) all.sliders.push_back({point, stays});
    if (!load.edge_forces_n.empty()) middle[{std::min(a, b), std::max(a, b)}] = point;
  }
  for (const auto& [edge, force] : load.edge_forces_n) {
    const auto found = middle.find({std::min(edge[0], edge[1]), std::max(edge[0], edge[1])});
    if (found == middle.end())
      throw Error(ExitCode::usage,
                  "a force acts between points " + std::to_string(edge[0]) + " and " + std::to_string(edge[1]) + ", which no edge joins");
    for (const std::uint32_t end : edge) all.forces_n.push_back({end, force * -0.5});
    all.forces_n.push_back({found->second, force});
  }
  return all;
}

std::size_t FemBody::inverted(std::span<const Vec3> x) const {
  std::size_t count = 0;
  for (std::size_t e = 0; e < count_; ++e) {
    bool bad = false;
    for (std::size_t q = 0; q < gauss_per_; ++q) {
      M3 f{};
      for (std::size_t a = 0; a < per_; ++a)
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t j = 0; j < 3; ++j) f.m[i][j] += x[nodes_[e * per_ + a]][i] * gauss_[e * gauss_per_ + q].gradient[a][j];
      bad = bad || !(determinant_of(f) > 0);
    }
    count += bad ? 1 : 0;
  }
  return count;
}

}  // namespace osteo
