// What an element or a patch of a FemBody costs, and the derivatives of that: the innermost loops of every solve.
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

#include "osteo/simulation/tissue/fem.h"

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

// tr F^T F.
double square_of(const M3& f) {
  double norm = 0;
  for (const auto& row : f.m)
    for (const double v : row) norm += v * v;
  return norm;
}

// The deformation gradient: `x_of(a)` is where node a is, `gradients` are those of its shape functions.
template <typename Position>
M3 deformation(std::span<const Vec3> gradients, const Position& x_of) {
  M3 f{};
  for (std::size_t a = 0; a < gradients.size(); ++a) {
    const Vec3& x = x_of(a);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) f.m[i][j] += x[i] * gradients[a][j];
    }
  }
  return f;
}

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

// Of an element; 0 where a patch accounts for it.
struct Moduli {
  double mu = 0, lambda = 0, bulk = 0;  // MPa
};

// What a law makes of a deformation gradient F.
struct Response {
  double energy = 0;  // a mm3
  M3 stress{};        // P = d energy / dF
  // Of both neo-Hookean laws: P = along_f F + along_inv F^-T; dP/dF = along_f 1 - along_inv (F^-T dF^T F^-T) +
  // mixed (F x F^-T + F^-T x F) + twice_inv F^-T x F^-T.
  M3 inverse{};  // F^-T
  double along_f = 0, along_inv = 0, mixed = 0, twice_inv = 0;
  M3 second{};            // stvk: P = F second
  Polar polar;            // corotated
  double along_turn = 0;  // corotated: of the Hessian of tr(R^T F)
};

void linear_response(const M3& f, const Moduli& of, Response& r) {
  double trace = 0, square = 0;
  for (int i = 0; i < 3; ++i) trace += f.m[i][i] - 1;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const double eps = 0.5 * (f.m[i][j] + f.m[j][i]) - (i == j ? 1 : 0);
      square += eps * eps;
      r.stress.m[i][j] = 2 * of.mu * eps + (i == j ? of.lambda * trace : 0);
    }
  }
  r.energy = of.mu * square + 0.5 * of.lambda * trace * trace;
}

void stvk_response(const M3& f, const Moduli& of, Response& r) {
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
      r.second.m[i][j] = 2 * of.mu * green.m[i][j] + (i == j ? of.lambda * trace : 0);
    }
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) r.stress.m[i][j] += f.m[i][k] * r.second.m[k][j];
  r.energy = of.mu * square + 0.5 * of.lambda * trace * trace;
}

void corotated_response(const M3& f, const Moduli& of, bool hessian, Response& r) {
  r.polar = polar_of(f, hessian);
  double square = 0;
  const double stretch = r.polar.trace - 3;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const double d = f.m[i][j] - r.polar.r.m[i][j];
      square += d * d;
      r.stress.m[i][j] = 2 * of.mu * d + of.lambda * stretch * r.polar.r.m[i][j];
    }
  }
  r.energy = of.mu * square + 0.5 * of.lambda * stretch * stretch;
  r.along_turn = of.lambda * stretch - 2 * of.mu;
}

// False where F is inside out: the energy is infinite there, and has no derivative.
bool neo_hooke_response(ElasticLaw law, const M3& f, const Moduli& of, bool derivatives, Response& r) {
  const double det = determinant_of(f);
  if (!(det > 0)) return false;
  const double norm = square_of(f);
  if (law == ElasticLaw::neo_hooke) {
    const double log_j = std::log(det);
    r.energy = 0.5 * of.mu * (norm - 3) - of.mu * log_j + 0.5 * of.lambda * log_j * log_j;
    r.along_f = of.mu;
    r.along_inv = of.lambda * log_j - of.mu;
    r.twice_inv = of.lambda;
  } else {
    const double bulk = of.bulk, shape = of.mu / std::cbrt(det * det);
    r.energy = 0.5 * (shape * norm - 3 * of.mu) + 0.5 * bulk * (det - 1) * (det - 1);
    r.along_f = shape;
    r.along_inv = bulk * (det - 1) * det - shape * norm / 3;
    r.mixed = -2.0 / 3 * shape;
    r.twice_inv = bulk * (2 * det - 1) * det + 2.0 / 9 * shape * norm;
  }
  if (!derivatives) return true;
  r.inverse = inverse_transposed(f, det);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) r.stress.m[i][j] = r.along_f * f.m[i][j] + r.along_inv * r.inverse.m[i][j];
  return true;
}

bool respond(ElasticLaw law, const M3& f, const Moduli& of, bool derivatives, bool hessian, Response& r) {
  switch (law) {
    case ElasticLaw::linear:
      linear_response(f, of, r);
      return true;
    case ElasticLaw::stvk:
      stvk_response(f, of, r);
      return true;
    case ElasticLaw::corotated:
      corotated_response(f, of, hessian, r);
      return true;
    case ElasticLaw::neo_hooke:
    case ElasticLaw::neo_hooke_split:
      break;
  }
  return neo_hooke_response(law, f, of, derivatives, r);
}

// out[a] = m gradients[a].
void map_gradients(const M3& m, std::span<const Vec3> gradients, Vec3* out) {
  for (std::size_t a = 0; a < gradients.size(); ++a) {
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) out[a][i] += m.m[i][j] * gradients[a][j];
    }
  }
}

// Adds w d(force a, i) / d(x b, k) = w sum over j, l of grad_a[j] dP_ij/dF_kl grad_b[l]; `pair(a, b)` gives the
// function of i and k. What it takes it holds itself: the sums must not read again what they may have written over.
template <typename Pair>
void add_pairs(std::size_t nodes, double w, double* hessian, const Pair& pair) {
  for (std::size_t a = 0; a < nodes; ++a) {
    for (std::size_t b = 0; b < nodes; ++b) {
      const auto entry = pair(a, b);
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t k = 0; k < 3; ++k) hessian[(3 * a + i) * 3 * nodes + 3 * b + k] += w * entry(i, k);
    }
  }
}

void add_linear_hessian(const Moduli& of, std::span<const Vec3> gradients, double w, double* hessian) {
  add_pairs(gradients.size(), w, hessian, [mu = of.mu, lambda = of.lambda, gradients](std::size_t a, std::size_t b) {
    const Vec3 ga = gradients[a], gb = gradients[b];
    return [=, both = dot(ga, gb)](std::size_t i, std::size_t k) {
      return mu * ((i == k ? both : 0) + ga[k] * gb[i]) + lambda * ga[i] * gb[k];
    };
  });
}

void add_stvk_hessian(const M3& f, const Response& r, const Moduli& of, std::span<const Vec3> gradients, double w,
                      double* hessian) {
  Vec3 turned[Energy::kMaxNodes];  // F grad
  map_gradients(f, gradients, turned);
  M3 left;  // F F^T
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) left.m[i][k] = f.m[i][0] * f.m[k][0] + f.m[i][1] * f.m[k][1] + f.m[i][2] * f.m[k][2];
  add_pairs(
      gradients.size(), w, hessian,
      [&turned, left, second = r.second, mu = of.mu, lambda = of.lambda, gradients](std::size_t a, std::size_t b) {
        const Vec3 ga = gradients[a], gb = gradients[b];
        double stress = 0;
        for (std::size_t j = 0; j < 3; ++j)
          for (std::size_t l = 0; l < 3; ++l) stress += ga[j] * second.m[j][l] * gb[l];
        return [=, &left, both = dot(ga, gb), ta = turned[a], tb = turned[b]](std::size_t i, std::size_t k) {
          return (i == k ? stress : 0) + mu * (left.m[i][k] * both + tb[i] * ta[k]) + lambda * ta[i] * tb[k];
        };
      });
}

void add_neo_hooke_hessian(const M3& f, const Response& r, std::span<const Vec3> gradients, double w, double* hessian) {
  Vec3 turned[Energy::kMaxNodes], back[Energy::kMaxNodes];  // F grad, F^-T grad
  if (r.mixed != 0) map_gradients(f, gradients, turned);
  map_gradients(r.inverse, gradients, back);
  add_pairs(gradients.size(), w, hessian,
            [&turned, &back, gradients, along_f = r.along_f, along_inv = r.along_inv, mixed = r.mixed,
             twice_inv = r.twice_inv](std::size_t a, std::size_t b) {
              const double both = dot(gradients[a], gradients[b]);
              return [=, ta = turned[a], tb = turned[b], ba = back[a], bb = back[b]](std::size_t i, std::size_t k) {
                double v = (i == k ? along_f * both : 0) - along_inv * bb[i] * ba[k] + twice_inv * ba[i] * bb[k];
                if (mixed != 0) v += mixed * (ta[i] * bb[k] + ba[i] * tb[k]);
                return v;
              };
            });
}

void add_corotated_hessian(const Response& r, const Moduli& of, std::span<const Vec3> gradients, double w,
                           double* hessian) {
  Vec3 turned[Energy::kMaxNodes];  // R grad
  map_gradients(r.polar.r, gradients, turned);
  Vec3 twist[3][Energy::kMaxNodes];
  for (std::size_t t = 0; t < 3; ++t) twists(r.polar, t, gradients, twist[t]);
  const double along[3] = {r.along_turn * r.polar.bend[0], r.along_turn * r.polar.bend[1],
                           r.along_turn * r.polar.bend[2]};
  add_pairs(gradients.size(), w, hessian,
            [&turned, &twist, along, gradients, mu = of.mu, lambda = of.lambda](std::size_t a, std::size_t b) {
              const double both = 2 * mu * dot(gradients[a], gradients[b]);
              return [=, &along, &twist, ta = turned[a], tb = turned[b]](std::size_t i, std::size_t k) {
                double v = (i == k ? both : 0) + lambda * ta[i] * tb[k];
                for (std::size_t t = 0; t < 3; ++t) v += along[t] * twist[t][a][i] * twist[t][b][k];
                return v;
              };
            });
}

void add_hessian(ElasticLaw law, const M3& f, const Response& r, const Moduli& of, std::span<const Vec3> gradients,
                 double w, double* hessian) {
  switch (law) {
    case ElasticLaw::linear:
      return add_linear_hessian(of, gradients, w, hessian);
    case ElasticLaw::stvk:
      return add_stvk_hessian(f, r, of, gradients, w, hessian);
    case ElasticLaw::corotated:
      return add_corotated_hessian(r, of, gradients, w, hessian);
    case ElasticLaw::neo_hooke:
    case ElasticLaw::neo_hooke_split:
      break;
  }
  add_neo_hooke_hessian(f, r, gradients, w, hessian);
}

// What a law calls the change of volume (tr eps, tr E, tr S - 3 or det F), and its slope by F.
double change_of_volume(ElasticLaw law, const M3& f, M3& slope) {
  switch (law) {
    case ElasticLaw::linear:
      for (int i = 0; i < 3; ++i) slope.m[i][i] = 1;
      return f.m[0][0] + f.m[1][1] + f.m[2][2] - 3;
    case ElasticLaw::stvk:
      slope = f;
      return 0.5 * (square_of(f) - 3);
    case ElasticLaw::corotated: {
      const Polar p = polar_of(f, false);
      slope = p.r;
      return p.trace - 3;
    }
    case ElasticLaw::neo_hooke:
    case ElasticLaw::neo_hooke_split:
      break;
  }
  slope = inverse_transposed(f, 1);  // cofactors
  return determinant_of(f);
}

// U(q) of a patch's mean change of volume, and its derivatives; none of neo_hooke where q is not above 0.
struct VolumeEnergy {
  double u, first, second;
};

VolumeEnergy volume_energy(ElasticLaw law, double q, const Material& mat) {
  const double lambda = mat.lambda_mpa(), bulk = mat.bulk_mpa();
  if (law == ElasticLaw::neo_hooke) {
    const double log_q = std::log(q);
    return {0.5 * lambda * log_q * log_q, lambda * log_q / q, lambda * (1 - log_q) / (q * q)};
  }
  if (law == ElasticLaw::neo_hooke_split) return {0.5 * bulk * (q - 1) * (q - 1), bulk * (q - 1), bulk};
  return {0.5 * lambda * q * q, lambda * q, lambda};
}

// The second derivative of the change of volume by where nodes a and b are.
void curvature_of_volume(ElasticLaw law, const M3& f, const Polar& polar, const Vec3 (&twist)[3][4],
                         std::span<const Vec3> gradients, std::size_t a, std::size_t b, double (&block)[3][3]) {
  const Vec3 ga = gradients[a], gb = gradients[b];
  if (law == ElasticLaw::stvk) {
    for (int i = 0; i < 3; ++i) block[i][i] = dot(ga, gb);
  } else if (law == ElasticLaw::corotated) {
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
}

}  // namespace

double FemBody::element(std::size_t e, const Vec3* x, double* gradient, double* hessian) const {
  if (e >= count_) return patch_element(patches_[e - count_], x, gradient, hessian);
  const Material& mat = material(e);
  // What a patch averages it also accounts for.
  const bool mean = order_ == TetOrder::t4_mean;
  const Moduli moduli{mat.shear_mpa(), mean ? 0 : mat.lambda_mpa(), mean ? 0 : mat.bulk_mpa()};
  const std::size_t n = per_;
  if (gradient != nullptr) std::fill(gradient, gradient + 3 * n, 0.0);
  if (hessian != nullptr) std::fill(hessian, hessian + 9 * n * n, 0.0);
  const bool derivatives = gradient != nullptr || hessian != nullptr;
  double energy = 0;
  for (std::size_t q = 0; q < gauss_per_; ++q) {
    const Gauss& g = gauss_[e * gauss_per_ + q];
    const std::span<const Vec3> gradients(g.gradient.data(), n);
    const M3 f = deformation(gradients, [&](std::size_t a) -> const Vec3& { return x[a]; });
    const double w = g.weight_mm3;
    Response r;
    if (!respond(law_, f, moduli, derivatives, hessian != nullptr, r)) return std::numeric_limits<double>::infinity();
    energy += w * r.energy;
    if (gradient != nullptr) {
      for (std::size_t a = 0; a < n; ++a)
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t j = 0; j < 3; ++j) gradient[3 * a + i] += w * r.stress.m[i][j] * gradients[a][j];
    }
    if (hessian != nullptr) add_hessian(law_, f, r, moduli, gradients, w, hessian);
  }
  return energy;
}

// Volume times U(q), q the mean of the change of volume over the tetrahedra.
double FemBody::patch_element(const Patch& patch, const Vec3* x, double* gradient, double* hessian) const {
  const std::size_t n = patch.nodes.size();
  if (gradient != nullptr) std::fill(gradient, gradient + 3 * n, 0.0);
  if (hessian != nullptr) std::fill(hessian, hessian + 9 * n * n, 0.0);
  const auto gradients = [&](std::size_t t) { return std::span<const Vec3>(gauss_[patch.tets[t]].gradient.data(), 4); };
  const auto deformed = [&](std::size_t t) {
    return deformation(gradients(t), [&](std::size_t a) -> const Vec3& { return x[patch.local[t][a]]; });
  };
  double q = 0, by_q[3 * kMaxNodes] = {};
  for (std::size_t t = 0; t < patch.tets.size(); ++t) {
    const double share = gauss_[patch.tets[t]].weight_mm3 / patch.mm3;
    M3 slope{};
    q += share * change_of_volume(law_, deformed(t), slope);
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j)
          by_q[3 * patch.local[t][a] + i] += share * slope.m[i][j] * gradients(t)[a][j];
      }
    }
  }
  if (law_ == ElasticLaw::neo_hooke && !(q > 0)) return std::numeric_limits<double>::infinity();
  const VolumeEnergy of = volume_energy(law_, q, material(patch.tets.front()));
  for (std::size_t r = 0; r < 3 * n && gradient != nullptr; ++r) gradient[r] = patch.mm3 * of.first * by_q[r];
  if (hessian == nullptr) return patch.mm3 * of.u;
  for (std::size_t r = 0; r < 3 * n; ++r) {
    for (std::size_t c = 0; c < 3 * n; ++c) hessian[r * 3 * n + c] = patch.mm3 * of.second * by_q[r] * by_q[c];
  }
  for (std::size_t t = 0; t < patch.tets.size() && law_ != ElasticLaw::linear; ++t) {
    const M3 f = deformed(t);
    const double w = gauss_[patch.tets[t]].weight_mm3 * of.first;
    Polar polar;
    Vec3 twist[3][4];
    if (law_ == ElasticLaw::corotated) {
      polar = polar_of(f, true);
      for (std::size_t k = 0; k < 3; ++k) twists(polar, k, gradients(t), twist[k]);
    }
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t b = 0; b < 4; ++b) {
        double block[3][3] = {};
        curvature_of_volume(law_, f, polar, twist, gradients(t), a, b, block);
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t k = 0; k < 3; ++k)
            hessian[(3 * patch.local[t][a] + i) * 3 * n + 3 * patch.local[t][b] + k] += w * block[i][k];
      }
    }
  }
  return patch.mm3 * of.u;
}

std::size_t FemBody::inverted(std::span<const Vec3> x) const {
  std::size_t count = 0;
  for (std::size_t e = 0; e < count_; ++e) {
    bool bad = false;
    for (std::size_t q = 0; q < gauss_per_; ++q) {
      const M3 f = deformation(std::span(gauss_[e * gauss_per_ + q].gradient.data(), per_),
                               [&](std::size_t a) -> const Vec3& { return x[nodes_[e * per_ + a]]; });
      bad = bad || !(determinant_of(f) > 0);
    }
    count += bad ? 1 : 0;
  }
  return count;
}

}  // namespace osteo::inline simulation
