#include "osteo/simulation/tissue/fem.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <set>

#include "osteo/core/base/error.h"

namespace osteo::inline simulation {
namespace {

struct M3 {
  double m[3][3];  // rows
};

double determinant_of(const M3& f) {
  return f.m[0][0] * (f.m[1][1] * f.m[2][2] - f.m[1][2] * f.m[2][1]) -
         f.m[0][1] * (f.m[1][0] * f.m[2][2] - f.m[1][2] * f.m[2][0]) +
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

// F = R S, R a rotation. The Hessian of tr S = max over rotations of tr(R^T F) has three eigenvectors (twists in the
// axes of S) that are not of the value zero (B. Smith, F. De Goes, T. Kim, ACM Trans. Graph. 38, 2019).
struct Polar {
  M3 r{};
  double trace = 0;
  M3 u{}, v{};
  double bend[3] = {};  // those values
};

constexpr std::size_t kPairs[3][2] = {{1, 2}, {0, 2}, {0, 1}};

Polar polar_of(const M3& f, bool second) {
  using Square = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const Eigen::Map<const Square> matrix(&f.m[0][0]);
  const Eigen::JacobiSVD<Square> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Square u = svd.matrixU(), v = svd.matrixV();
  Eigen::Vector3d s = svd.singularValues();  // falling
  // The mirroring, if there is one, goes where it costs least.
  if (u.determinant() * v.determinant() < 0) {
    u.col(2) = -u.col(2);
    s[2] = -s[2];
  }
  Polar p;
  Eigen::Map<Square>(&p.r.m[0][0]) = u * v.transpose();
  p.trace = s.sum();
  if (!second) return p;
  Eigen::Map<Square>(&p.u.m[0][0]) = u;
  Eigen::Map<Square>(&p.v.m[0][0]) = v;
  for (std::size_t t = 0; t < 3; ++t)
    p.bend[t] =
        2 / std::max(s[static_cast<Eigen::Index>(kPairs[t][0])] + s[static_cast<Eigen::Index>(kPairs[t][1])], 1e-3);
  return p;
}

// The eigenvector t applied to gradients of shape functions: (u_i v_j^T - u_j v_i^T) / sqrt 2 grad.
void twists(const Polar& p, std::size_t t, std::span<const Vec3> gradients, Vec3* out) {
  const std::size_t i = kPairs[t][0], j = kPairs[t][1];
  const Vec3 ui{p.u.m[0][i], p.u.m[1][i], p.u.m[2][i]}, uj{p.u.m[0][j], p.u.m[1][j], p.u.m[2][j]};
  const Vec3 vi{p.v.m[0][i], p.v.m[1][i], p.v.m[2][i]}, vj{p.v.m[0][j], p.v.m[1][j], p.v.m[2][j]};
  for (std::size_t a = 0; a < gradients.size(); ++a)
    out[a] = (ui * dot(vj, gradients[a]) - uj * dot(vi, gradients[a])) * std::sqrt(0.5);
}

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
  if (order == TetOrder::t4_mean) make_patches();
}

double FemBody::element(std::size_t e, const Vec3* x, double* gradient, double* hessian) const {
  if (e >= count_) return patch_element(patches_[e - count_], x, gradient, hessian);
  const Material& mat = material(e);
  // What a patch averages it also accounts for.
  const bool mean = order_ == TetOrder::t4_mean;
  const double mu = mat.shear_mpa(), lambda = mean ? 0 : mat.lambda_mpa();
  const std::size_t n = per_;
  if (gradient != nullptr) std::fill(gradient, gradient + 3 * n, 0.0);
  if (hessian != nullptr) std::fill(hessian, hessian + 9 * n * n, 0.0);
  double energy = 0;
  for (std::size_t q = 0; q < gauss_per_; ++q) {
    const Gauss& g = gauss_[e * gauss_per_ + q];
    M3 f{};
    for (std::size_t a = 0; a < n; ++a) {
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j)
          f.m[i][j] += x[a][static_cast<std::size_t>(i)] * g.gradient[a][static_cast<std::size_t>(j)];
      }
    }
    const double w = g.weight_mm3;
    M3 p{}, inv{}, s{};
    // Of both neo-Hookean laws: P = along_f F + along_inv F^-T; dP/dF = along_f 1 - along_inv (F^-T dF^T F^-T) +
    // mixed (F x F^-T + F^-T x F) + twice_inv F^-T x F^-T.
    double along_f = 0, along_inv = 0, mixed = 0, twice_inv = lambda;
    Polar polar;
    double along_turn = 0;  // corotated: of the Hessian of tr(R^T F)
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
    } else if (law_ == ElasticLaw::corotated) {
      polar = polar_of(f, hessian != nullptr);
      double square = 0;
      const double stretch = polar.trace - 3;
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
          const double d = f.m[i][j] - polar.r.m[i][j];
          square += d * d;
          p.m[i][j] = 2 * mu * d + lambda * stretch * polar.r.m[i][j];
        }
      }
      energy += w * (mu * square + 0.5 * lambda * stretch * stretch);
      along_turn = lambda * stretch - 2 * mu;
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
        const double bulk = mean ? 0 : mat.bulk_mpa(), shape = mu / std::cbrt(det * det);
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
          // Of the corotated law R takes the place of F.
          turned[a][i] += (law_ == ElasticLaw::corotated ? polar.r.m[i][j] : f.m[i][j]) * g.gradient[a][j];
          back[a][i] += inv.m[i][j] * g.gradient[a][j];
        }
      }
    }
    if (law_ == ElasticLaw::corotated) {
      Vec3 twist[3][kMostNodes];
      for (std::size_t t = 0; t < 3; ++t) twists(polar, t, {g.gradient.data(), n}, twist[t]);
      for (std::size_t a = 0; a < n; ++a) {
        for (std::size_t b = 0; b < n; ++b) {
          const double both = 2 * mu * dot(g.gradient[a], g.gradient[b]);
          for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t k = 0; k < 3; ++k) {
              double v = (i == k ? both : 0) + lambda * turned[a][i] * turned[b][k];
              for (std::size_t t = 0; t < 3; ++t) v += along_turn * polar.bend[t] * twist[t][a][i] * twist[t][b][k];
              hessian[(3 * a + i) * 3 * n + 3 * b + k] += w * v;
            }
          }
        }
      }
      continue;
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
              v = (i == k ? stress : 0) + mu * (left[i][k] * both + turned[b][i] * turned[a][k]) +
                  lambda * turned[a][i] * turned[b][k];
            } else {
              v = (i == k ? along_f * both : 0) - along_inv * back[b][i] * back[a][k] +
                  twice_inv * back[a][i] * back[b][k];
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

// Greedy: where the fewest neighbours are left a patch begins, and takes the neighbour that shares most faces with it,
// so that patches are round and few tetrahedra are left over; those join a neighbour's patch afterwards.
void FemBody::make_patches() {
  constexpr std::size_t kTets = 8, kFew = 4;
  constexpr std::uint32_t kNone = 0xffffffffU;
  constexpr std::size_t kFaces[4][3] = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
  std::vector<std::pair<std::array<std::uint32_t, 3>, std::uint32_t>> faces;
  for (std::uint32_t e = 0; e < count_; ++e) {
    const auto n = nodes(e);
    for (const auto& f : kFaces) {
      faces.push_back({{n[f[0]], n[f[1]], n[f[2]]}, e});
      std::sort(faces.back().first.begin(), faces.back().first.end());
    }
  }
  std::sort(faces.begin(), faces.end());
  std::vector<std::vector<std::uint32_t>> near(count_);  // of one material, through a face
  const auto same = [&](std::uint32_t a, std::uint32_t b) {
    return material(a).young_mpa == material(b).young_mpa && material(a).poisson == material(b).poisson;
  };
  for (std::size_t i = 0; i + 1 < faces.size(); ++i) {
    const std::uint32_t a = faces[i].second, b = faces[i + 1].second;
    if (faces[i].first != faces[i + 1].first || !same(a, b)) continue;
    near[a].push_back(b);
    near[b].push_back(a);
  }
  std::vector<std::uint32_t> of(count_, kNone);
  std::vector<std::vector<std::uint32_t>> groups;
  std::set<std::pair<std::size_t, std::uint32_t>> open;  // neighbours left, tetrahedron
  std::vector<std::size_t> left(count_);
  for (std::uint32_t e = 0; e < count_; ++e) open.insert({left[e] = near[e].size(), e});
  const auto take = [&](std::uint32_t e) {
    of[e] = static_cast<std::uint32_t>(groups.size() - 1);
    groups.back().push_back(e);
    open.erase({left[e], e});
    for (const std::uint32_t n : near[e]) {
      if (of[n] != kNone) continue;
      open.erase({left[n], n});
      open.insert({--left[n], n});
    }
  };
  while (!open.empty()) {
    groups.emplace_back();
    take(open.begin()->second);
    while (groups.back().size() < kTets) {
      // Most faces shared, then fewest neighbours left, then the first.
      std::uint32_t best = kNone;
      std::size_t best_shared = 0;
      for (const std::uint32_t e : groups.back()) {
        for (const std::uint32_t n : near[e]) {
          if (of[n] != kNone) continue;
          std::size_t shared = 0;
          for (const std::uint32_t m : near[n]) shared += of[m] == groups.size() - 1 ? 1 : 0;
          if (best != kNone &&
              (shared < best_shared || (shared == best_shared && std::pair{left[n], n} >= std::pair{left[best], best})))
            continue;
          best = n;
          best_shared = shared;
        }
      }
      if (best == kNone) break;
      take(best);
    }
  }
  const auto nodes_of = [&](std::span<const std::uint32_t> tets, std::span<const std::uint32_t> more) {
    std::vector<std::uint32_t> all;
    for (const auto list : {tets, more}) {
      for (const std::uint32_t e : list) all.insert(all.end(), nodes(e).begin(), nodes(e).end());
    }
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
  };
  for (std::uint32_t g = 0; g < groups.size(); ++g) {
    if (groups[g].size() >= kFew) continue;
    std::pair<std::size_t, std::uint32_t> smallest{0, kNone};
    for (const std::uint32_t e : groups[g]) {
      for (const std::uint32_t n : near[e]) {
        const std::uint32_t other = of[n];
        if (other == g || nodes_of(groups[g], groups[other]).size() > kMostNodes) continue;
        if (smallest.second == kNone || std::pair{groups[other].size(), other} < smallest)
          smallest = {groups[other].size(), other};
      }
    }
    if (smallest.second == kNone) continue;
    auto& to = groups[smallest.second];
    for (const std::uint32_t e : groups[g]) of[e] = smallest.second;
    to.insert(to.end(), groups[g].begin(), groups[g].end());
    groups[g].clear();
  }
  for (auto& group : groups) {
    if (group.empty()) continue;
    std::sort(group.begin(), group.end());
    Patch p;
    p.nodes = nodes_of(group, {});
    for (const std::uint32_t e : group) {
      std::array<std::uint8_t, 4> local{};
      for (std::size_t a = 0; a < 4; ++a)
        local[a] =
            static_cast<std::uint8_t>(std::lower_bound(p.nodes.begin(), p.nodes.end(), nodes(e)[a]) - p.nodes.begin());
      p.local.push_back(local);
      p.mm3 += gauss_[e].weight_mm3;
    }
    p.tets = std::move(group);
    patches_.push_back(std::move(p));
  }
}

// Volume times U(q), q the mean over the tetrahedra of what the law calls the change of volume: tr eps, tr E, tr S - 3
// or det F.
double FemBody::patch_element(const Patch& patch, const Vec3* x, double* gradient, double* hessian) const {
  const std::size_t n = patch.nodes.size();
  const Material& mat = material(patch.tets.front());
  if (gradient != nullptr) std::fill(gradient, gradient + 3 * n, 0.0);
  if (hessian != nullptr) std::fill(hessian, hessian + 9 * n * n, 0.0);
  const auto gradients = [&](std::size_t t) { return std::span(gauss_[patch.tets[t]].gradient.data(), 4); };
  const auto deformation = [&](std::size_t t) {
    M3 f{};
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) f.m[i][j] += x[patch.local[t][a]][i] * gradients(t)[a][j];
      }
    }
    return f;
  };
  double q = 0, by_q[3 * kMostNodes] = {};
  for (std::size_t t = 0; t < patch.tets.size(); ++t) {
    const M3 f = deformation(t);
    const double share = gauss_[patch.tets[t]].weight_mm3 / patch.mm3;
    M3 slope{};  // of q by F
    switch (law_) {
      case ElasticLaw::linear:
        q += share * (f.m[0][0] + f.m[1][1] + f.m[2][2] - 3);
        for (int i = 0; i < 3; ++i) slope.m[i][i] = 1;
        break;
      case ElasticLaw::stvk: {
        double norm = 0;
        for (const auto& row : f.m)
          for (const double v : row) norm += v * v;
        q += share * 0.5 * (norm - 3);
        slope = f;
        break;
      }
      case ElasticLaw::corotated: {
        const Polar p = polar_of(f, false);
        q += share * (p.trace - 3);
        slope = p.r;
        break;
      }
      case ElasticLaw::neo_hooke:
      case ElasticLaw::neo_hooke_split:
        q += share * determinant_of(f);
        slope = inverse_transposed(f, 1);  // cofactors
        break;
    }
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j)
          by_q[3 * patch.local[t][a] + i] += share * slope.m[i][j] * gradients(t)[a][j];
      }
    }
  }
  const double lambda = mat.lambda_mpa(), bulk = mat.bulk_mpa();
  double u = 0.5 * lambda * q * q, first = lambda * q, second = lambda;
  if (law_ == ElasticLaw::neo_hooke) {
    if (!(q > 0)) return std::numeric_limits<double>::infinity();
    const double log_q = std::log(q);
    u = 0.5 * lambda * log_q * log_q;
    first = lambda * log_q / q;
    second = lambda * (1 - log_q) / (q * q);
  } else if (law_ == ElasticLaw::neo_hooke_split) {
    u = 0.5 * bulk * (q - 1) * (q - 1);
    first = bulk * (q - 1);
    second = bulk;
  }
  for (std::size_t r = 0; r < 3 * n && gradient != nullptr; ++r) gradient[r] = patch.mm3 * first * by_q[r];
  if (hessian == nullptr) return patch.mm3 * u;
  for (std::size_t r = 0; r < 3 * n; ++r) {
    for (std::size_t c = 0; c < 3 * n; ++c) hessian[r * 3 * n + c] = patch.mm3 * second * by_q[r] * by_q[c];
  }
  for (std::size_t t = 0; t < patch.tets.size() && law_ != ElasticLaw::linear; ++t) {
    const M3 f = deformation(t);
    const double w = gauss_[patch.tets[t]].weight_mm3 * first;
    Polar polar;
    Vec3 twist[3][4];
    if (law_ == ElasticLaw::corotated) {
      polar = polar_of(f, true);
      for (std::size_t k = 0; k < 3; ++k) twists(polar, k, gradients(t), twist[k]);
    }
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t b = 0; b < 4; ++b) {
        const Vec3 ga = gradients(t)[a], gb = gradients(t)[b];
        double block[3][3] = {};
        if (law_ == ElasticLaw::stvk) {
          for (int i = 0; i < 3; ++i) block[i][i] = dot(ga, gb);
        } else if (law_ == ElasticLaw::corotated) {
          for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t i = 0; i < 3; ++i)
              for (std::size_t j = 0; j < 3; ++j) block[i][j] += polar.bend[k] * twist[k][a][i] * twist[k][b][j];
        } else {
          // Cofactors are bilinear in F: the second derivative is the cross product's matrix of F (ga x gb).
          const Vec3 across = cross(ga, gb);
          Vec3 v{};
          for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t j = 0; j < 3; ++j) v[i] += f.m[i][j] * across[j];
          block[0][1] = v.z;
          block[1][0] = -v.z;
          block[0][2] = -v.y;
          block[2][0] = v.y;
          block[1][2] = v.x;
          block[2][1] = -v.x;
        }
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t k = 0; k < 3; ++k)
            hessian[(3 * patch.local[t][a] + i) * 3 * n + 3 * patch.local[t][b] + k] += w * block[i][k];
      }
    }
  }
  return patch.mm3 * u;
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
    const auto goes = static_cast<std::uint8_t>(both & (axes_a | axes_b)),
               stays = static_cast<std::uint8_t>(both & ~goes);
    if (goes != 0) all.moved.push_back({point, goes, (by_a + by_b) * 0.5});
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

std::size_t FemBody::inverted(std::span<const Vec3> x) const {
  std::size_t count = 0;
  for (std::size_t e = 0; e < count_; ++e) {
    bool bad = false;
    for (std::size_t q = 0; q < gauss_per_; ++q) {
      M3 f{};
      for (std::size_t a = 0; a < per_; ++a)
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t j = 0; j < 3; ++j)
            f.m[i][j] += x[nodes_[e * per_ + a]][i] * gauss_[e * gauss_per_ + q].gradient[a][j];
      bad = bad || !(determinant_of(f) > 0);
    }
    count += bad ? 1 : 0;
  }
  return count;
}

}  // namespace osteo::inline simulation
