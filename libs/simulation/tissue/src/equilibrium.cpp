#include "osteo/simulation/tissue/detail/equilibrium.h"

#include <Eigen/Eigenvalues>
#ifdef OSTEO_WITH_CHOLMOD
#include <Eigen/CholmodSupport>
#endif
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include "body_parts.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"
#include "osteo/core/base/union_find.h"

#ifdef OSTEO_WITH_CHOLMOD
extern "C" void openblas_set_num_threads(int) __attribute__((weak));  // where BLAS is that one
#endif

namespace osteo::inline simulation {

using namespace tissue;

namespace {

using Matrix = Eigen::SparseMatrix<double>;
using Simplicial = Eigen::SimplicialLLT<Matrix, Eigen::Lower>;

// Sparse Cholesky: Eigen's own for small systems; for large ones, where this build has it, CHOLMOD's with dense blocks
// through BLAS, in one thread so that sums come in one order.
class Factor {
 public:
  // False where the matrix, with `shift` on its diagonal, is not positive definite.
  bool factorise(const Matrix& h, double shift) {
#ifdef OSTEO_WITH_CHOLMOD
    if (h.rows() >= kLarge) {
      if (!large_) {
        large_ = std::make_unique<Supernodal>();
        large_->cholmod().print = 0;  // else it tells stdout of every matrix that is not positive definite
        if (openblas_set_num_threads != nullptr) openblas_set_num_threads(1);
        large_->analyzePattern(h);
      }
      large_->setShift(shift);
      large_->factorize(h);
      return large_->info() == Eigen::Success;
    }
#endif
    if (!small_) {
      small_ = std::make_unique<Simplicial>();
      small_->analyzePattern(h);
    }
    small_->setShift(shift);
    small_->factorize(h);
    return small_->info() == Eigen::Success;
  }
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& right) const {
#ifdef OSTEO_WITH_CHOLMOD
    if (large_) return large_->solve(right);
#endif
    return small_->solve(right);
  }

 private:
#ifdef OSTEO_WITH_CHOLMOD
  using Supernodal = Eigen::CholmodSupernodalLLT<Matrix, Eigen::Lower>;
  static constexpr Eigen::Index kLarge = 1500;  // rows: below, the other is as quick
  std::unique_ptr<Supernodal> large_;
#endif
  std::unique_ptr<Simplicial> small_;
};

constexpr std::uint32_t kFixed = 0xffffffffU;

// Of the six rigid motions of a part, how many the given axes of points leave free: rank of the moved distances,
// lengths taken relative to the part's size.
int free_motions(std::span<const std::pair<Vec3, std::uint8_t>> held) {
  if (held.empty()) return 6;
  Vec3 middle{};
  for (const auto& [p, axes] : held) middle += p / static_cast<double>(held.size());
  double size = 0;
  for (const auto& [p, axes] : held) size = std::max(size, length(p - middle));
  Eigen::Matrix<double, 6, 6> gram = Eigen::Matrix<double, 6, 6>::Zero();
  for (const auto& [p, axes] : held) {
    const Vec3 r = size > 0 ? (p - middle) / size : Vec3{};
    for (std::size_t a = 0; a < 3; ++a) {
      if ((axes >> a & 1) == 0) continue;
      Vec3 e{};
      e[a] = 1;
      const Vec3 turn = cross(r, e);
      Eigen::Matrix<double, 6, 1> row;
      row << e.x, e.y, e.z, turn.x, turn.y, turn.z;
      gram += row * row.transpose();
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> eigen(gram, Eigen::EigenvaluesOnly);
  int left = 0;
  for (int i = 0; i < 6; ++i) left += eigen.eigenvalues()[i] > 1e-14 * eigen.eigenvalues()[5] ? 0 : 1;
  return left;
}

constexpr std::uint8_t kAllAxes = 7;

}  // namespace

void TissueLoad::add_on_face(const std::array<std::uint32_t, 3>& corners, Vec3 force_n) {
  for (std::size_t i = 0; i < 3; ++i) {
    edge_forces_n.push_back({{corners[i], corners[(i + 1) % 3]}, force_n / 3});
    forces_n.push_back({corners[i], force_n / 3});
  }
}

void TissueLoad::add_in_tet(const std::array<std::uint32_t, 4>& corners, Vec3 force_n) {
  for (std::size_t i = 0; i < 4; ++i) {
    forces_n.push_back({corners[i], force_n / 4});
    for (std::size_t j = i + 1; j < 4; ++j) edge_forces_n.push_back({{corners[i], corners[j]}, force_n / 5});
  }
}

struct EquilibriumSolver::Impl {
  std::vector<std::uint32_t> number;  // of a point among those that move
  std::size_t moving = 0;
  std::vector<std::uint8_t> held;    // axes of each point that do not move
  std::vector<std::uint32_t> first;  // of each element in slots
  std::vector<std::int64_t>
      slots;  // where block (a, b), a >= b by number, of an element goes: its first value in each of three columns
  Matrix h;
  Factor factor;
  double shift = 0;
  bool stale = false;  // h is newer than its factor

  // What of a vector at a point lies along axes that may move.
  [[nodiscard]] Vec3 of_free(std::uint32_t p, Vec3 v) const {
    for (std::size_t a = 0; a < 3; ++a) v[a] = (held[p] >> a & 1) != 0 ? 0 : v[a];
    return v;
  }
  void pattern(const Energy& energy);
  bool factorise(Equilibrium& counts);
  void assemble(const Energy& energy, std::span<const Vec3> x, std::vector<Vec3>& gradient);
};

void EquilibriumSolver::Impl::pattern(const Energy& energy) {
  // Lower blocks of each column of blocks.
  std::vector<std::vector<std::uint32_t>> below(moving);
  for (std::size_t e = 0; e < energy.element_count(); ++e) {
    for (const std::uint32_t a : energy.nodes(e)) {
      for (const std::uint32_t b : energy.nodes(e)) {
        const std::uint32_t i = number[a], j = number[b];
        if (i != kFixed && j != kFixed && i >= j) below[j].push_back(i);
      }
    }
  }
  std::size_t blocks = 0;
  for (auto& column : below) {
    std::sort(column.begin(), column.end());
    column.erase(std::unique(column.begin(), column.end()), column.end());
    blocks += column.size();
  }
  // Whole 3 x 3 blocks on the diagonal too: the upper part is stored and not used.
  const auto n = static_cast<Eigen::Index>(3 * moving);
  h.resize(n, n);
  h.resizeNonZeros(static_cast<Eigen::Index>(9 * blocks));
  std::vector<std::int64_t> block_at;  // of each lower block, by column: value of its first row in the first column
  std::int64_t at = 0;
  for (std::size_t j = 0; j < moving; ++j) {
    for (std::size_t c = 0; c < 3; ++c) {
      h.outerIndexPtr()[3 * j + c] = static_cast<int>(at);
      for (const std::uint32_t i : below[j]) {
        for (std::size_t r = 0; r < 3; ++r) h.innerIndexPtr()[at++] = static_cast<int>(3 * i + r);
      }
    }
  }
  h.outerIndexPtr()[n] = static_cast<int>(at);
  first.assign(energy.element_count() + 1, 0);
  slots.clear();
  for (std::size_t e = 0; e < energy.element_count(); ++e) {
    first[e] = static_cast<std::uint32_t>(slots.size());
    for (const std::uint32_t a : energy.nodes(e)) {
      for (const std::uint32_t b : energy.nodes(e)) {
        const std::uint32_t i = number[a], j = number[b];
        if (i == kFixed || j == kFixed || i < j) {
          slots.push_back(-1);
          continue;
        }
        const auto& column = below[j];
        const auto place = std::lower_bound(column.begin(), column.end(), i) - column.begin();
        slots.push_back(h.outerIndexPtr()[3 * j] + 3 * place);
      }
    }
  }
}

// Cholesky, with a shift where the energy is not convex; what sufficed last time is tried first, a tenth of it.
bool EquilibriumSolver::Impl::factorise(Equilibrium& counts) {
  stale = false;
  double mean = 0;
  for (Eigen::Index d = 0; d < h.rows(); ++d) mean += std::abs(h.coeff(d, d)) / static_cast<double>(h.rows());
  shift = shift > 1e-9 * mean ? 0.1 * shift : 0;
  for (int tries = 0;; ++tries) {
    ++counts.factorisations;
    if (factor.factorise(h, shift)) return true;
    ++counts.shifted;
    shift = shift > 0 ? 4 * shift : 1e-4 * mean;
    if (tries == 40 || !std::isfinite(mean)) return false;
  }
}

void EquilibriumSolver::Impl::assemble(const Energy& energy, std::span<const Vec3> x, std::vector<Vec3>& gradient) {
  std::fill(h.valuePtr(), h.valuePtr() + h.nonZeros(), 0.0);
  std::fill(gradient.begin(), gradient.end(), Vec3{});
  Vec3 local[Energy::kMaxNodes];
  double g[3 * Energy::kMaxNodes], k[9 * Energy::kMaxNodes * Energy::kMaxNodes];
  for (std::size_t e = 0; e < energy.element_count(); ++e) {
    const auto nodes = energy.nodes(e);
    const std::size_t n = nodes.size();
    for (std::size_t a = 0; a < n; ++a) local[a] = x[nodes[a]];
    energy.element(e, local, g, k);
    const std::int64_t* slot = slots.data() + first[e];
    for (std::size_t a = 0; a < n; ++a) {
      gradient[nodes[a]] += Vec3{g[3 * a], g[3 * a + 1], g[3 * a + 2]};
      for (std::size_t b = 0; b < n; ++b, ++slot) {
        if (*slot < 0) continue;
        const auto j = static_cast<std::size_t>(number[nodes[b]]);
        const std::int64_t step = h.outerIndexPtr()[3 * j + 1] - h.outerIndexPtr()[3 * j];
        for (std::size_t c = 0; c < 3; ++c) {
          double* const value = h.valuePtr() + *slot + static_cast<std::int64_t>(c) * step;
          const double* const own = k + 3 * a * 3 * n + 3 * b + c;
          if ((held[nodes[a]] | held[nodes[b]]) == 0) {
            for (std::size_t r = 0; r < 3; ++r) value[r] += own[r * 3 * n];
            continue;
          }
          // An axis that is held keeps a diagonal alone, whose size is that of its neighbours'.
          for (std::size_t r = 0; r < 3; ++r) {
            const bool off = (held[nodes[a]] >> r & 1) != 0 || (held[nodes[b]] >> c & 1) != 0;
            if (!off) value[r] += own[r * 3 * n];
            if (off && a == b && r == c) value[r] += std::abs(own[r * 3 * n]);
          }
        }
      }
    }
  }
}

namespace {

struct Held {
  std::vector<std::uint8_t> axes;  // of each point that do not move
  std::vector<bool> used;          // by an element
};

// Parts that are connected must each be held.
Held held_of(const Energy& energy, std::span<const Vec3> rest, std::span<const std::uint32_t> fixed,
             std::span<const Slider> sliders) {
  const std::size_t points = energy.point_count();
  if (rest.size() != points) throw Error(ExitCode::usage, "the rest shape has another number of points than the model");
  Held result{std::vector<std::uint8_t>(points), std::vector<bool>(points)};
  auto& [held, used] = result;
  const auto hold = [&](std::uint32_t p, std::uint8_t axes) {
    if (p >= points)
      throw Error(ExitCode::usage,
                  "point " + std::to_string(p) + " is to be fixed, but there are only " + std::to_string(points));
    held[p] = static_cast<std::uint8_t>(held[p] | (axes & kAllAxes));
  };
  for (const std::uint32_t p : fixed) hold(p, kAllAxes);
  for (const Slider& s : sliders) hold(s.point, s.held);
  std::vector<bool> anchored(points);
  std::vector<std::uint32_t> parent(points);
  std::iota(parent.begin(), parent.end(), 0U);
  for (std::size_t e = 0; e < energy.element_count(); ++e) {
    const auto nodes = energy.nodes(e);
    for (const std::uint32_t p : nodes) {
      if (p >= points)
        throw Error(ExitCode::usage,
                    "element " + std::to_string(e) + " names point " + std::to_string(p) + ", which is not there");
      used[p] = true;
      join_sets(parent, nodes[0], p);
    }
    if (nodes.size() == 1) anchored[nodes[0]] = true;
  }
  std::vector<std::vector<std::pair<Vec3, std::uint8_t>>> holds(points);
  for (std::uint32_t p = 0; p < points; ++p) {
    if (used[p] && (held[p] != 0 || anchored[p]))
      holds[root_of(parent, p)].push_back({rest[p], anchored[p] ? kAllAxes : held[p]});
  }
  for (std::uint32_t p = 0; p < points; ++p) {
    if (!used[p] || root_of(parent, p) != p) continue;
    if (const int left = free_motions(holds[p]); left > 0) {
      throw Error(ExitCode::usage,
                  "the part of the body with point " + std::to_string(p) +
                      " can move freely: of its six rigid motions " + std::to_string(holds[p].size()) +
                      " points that are held stop " + std::to_string(6 - left),
                  "fix at least three of its points that do not lie in a line, or leave the part out");
    }
  }
  return result;
}

std::vector<Slider> sliders_of(const TissueLoad& load) {
  std::vector<Slider> all = load.sliders;
  for (const TissueLoad::Moved& m : load.moved) all.push_back({m.point, m.held});
  return all;
}

}  // namespace

void require_held(const Energy& energy, std::span<const Vec3> rest, std::span<const std::uint32_t> fixed,
                  std::span<const Slider> sliders) {
  static_cast<void>(held_of(energy, rest, fixed, sliders));
}

EquilibriumSolver::EquilibriumSolver(const Energy& energy, std::span<const Vec3> rest, const TissueLoad& held)
    : EquilibriumSolver(energy, rest, held.fixed, sliders_of(held)) {}

EquilibriumSolver::EquilibriumSolver(const Energy& energy, std::span<const Vec3> rest,
                                     std::span<const std::uint32_t> fixed, std::span<const Slider> sliders)
    : impl_(std::make_unique<Impl>()) {
  const std::size_t points = energy.point_count();
  const auto [axes, used] = held_of(energy, rest, fixed, sliders);
  std::vector<std::uint8_t>& held = impl_->held;
  held = axes;
  impl_->number.assign(points, kFixed);
  for (std::uint32_t p = 0; p < points; ++p) {
    if (used[p] && held[p] != kAllAxes) impl_->number[p] = static_cast<std::uint32_t>(impl_->moving++);
  }
  impl_->pattern(energy);
}

EquilibriumSolver::~EquilibriumSolver() = default;

Equilibrium EquilibriumSolver::solve(const Energy& energy, std::span<const Vec3> start,
                                     std::span<const std::pair<std::uint32_t, Vec3>> forces,
                                     const EquilibriumOptions& options, const Context& context) {
  Impl& m = *impl_;
  Equilibrium result;
  result.points_mm.assign(start.begin(), start.end());
  std::vector<Vec3>& x = result.points_mm;
  std::vector<Vec3> load(x.size()), gradient(x.size()), trial(x.size());
  require_load(forces, x.size());
  for (const auto& [p, f] : forces) load[p] += f;
  const auto free = [&](std::uint32_t p) { return m.number[p] != kFixed; };
  double load_size = 0;
  for (std::uint32_t p = 0; p < x.size(); ++p) {
    if (!free(p)) continue;
    load[p] = m.of_free(p, load[p]);
    load_size += dot(load[p], load[p]);
  }
  load_size = std::sqrt(load_size);
  double share = 0, extent = 0;
  for (const Vec3& p : start) extent = std::max({extent, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  const auto potential = [&](std::span<const Vec3> at) {
    double work = 0;
    for (std::uint32_t p = 0; p < at.size(); ++p) work += dot(load[p], at[p] - start[p]) * share;
    return total_energy(energy, at) - work;
  };
  const auto n = static_cast<Eigen::Index>(3 * m.moving);
  Eigen::VectorXd right(n), step(n);
  m.shift = 0;
  for (int s = 1; s <= std::max(1, options.load_steps); ++s) {
    share = static_cast<double>(s) / std::max(1, options.load_steps);
    double value = potential(x);
    if (!std::isfinite(value)) {
      result.why = "the model has no finite energy where it starts";
      return result;
    }
    bool done = false;
    double first_residual = 0, last_residual = 1e300;
    for (int it = 0; it < options.iterations && !done; ++it) {
      context.check_cancelled();
      m.assemble(energy, x, gradient);
      double residual = 0;
      for (std::uint32_t p = 0; p < x.size(); ++p) {
        if (!free(p)) continue;
        const Vec3 r = m.of_free(p, load[p] * share - gradient[p]);
        residual += dot(r, r);
        for (std::size_t a = 0; a < 3; ++a) right[static_cast<Eigen::Index>(3 * m.number[p] + a)] = r[a];
      }
      residual = std::sqrt(residual);
      if (it == 0) first_residual = residual;
      const double scale = load_size > 0 ? load_size : first_residual;
      result.residual = scale > 0 ? residual / scale : 0;
      // Nearer than rounding lets it, it does not come: then it neither halves any more nor is it large.
      const bool stalled = result.residual < 1e-7 && result.residual > 0.5 * last_residual;
      last_residual = result.residual;
      const bool small = result.residual <= options.tolerance || stalled;
      if (small) {
        m.stale = true;  // factorised where back_solve() needs it
        done = true;
        break;
      }
      if (!m.factorise(result)) {
        result.why = "the Hessian cannot be factorised: a number in it is not finite";
        return result;
      }
      step = m.factor.solve(right);
      // What is left to move is lost in the rounding of the places themselves: at rest, whatever the forces' rounding
      // adds up to.
      if (step.size() == 0 || step.lpNorm<Eigen::Infinity>() <= 1e-13 * extent) {
        done = true;
        break;
      }
      ++result.iterations;
      const double slope = -right.dot(step);  // of the potential along the step
      double length = 1;
      bool moved = false;
      for (int halve = 0; halve < 40; ++halve, length *= 0.5) {
        for (std::uint32_t p = 0; p < x.size(); ++p) {
          trial[p] = x[p];
          if (free(p)) {
            const auto i = static_cast<Eigen::Index>(3 * m.number[p]);
            trial[p] += Vec3{step[i], step[i + 1], step[i + 2]} * length;
          }
        }
        const double next = potential(trial);
        // Where the energies differ by no more than their rounding, the residual decides.
        const double noise = 1e-13 * (std::abs(value) + std::abs(next));
        if (std::isfinite(next) && next <= value + 1e-4 * length * slope + noise) {
          x.swap(trial);
          value = next;
          moved = true;
          break;
        }
        // Near the end energies differ by less than they are rounded: then a full step counts that halves the forces.
        if (halve == 0 && std::isfinite(next) && result.residual < 1e-3) {
          total_gradient(energy, trial, gradient);
          double after = 0;
          for (std::uint32_t p = 0; p < x.size(); ++p) {
            const Vec3 r = m.of_free(p, load[p] * share - gradient[p]);
            after += free(p) ? dot(r, r) : 0;
          }
          if (std::sqrt(after) < 0.5 * residual) {
            x.swap(trial);
            value = next;
            moved = true;
            break;
          }
        }
      }
      if (!moved) {
        result.why = "no step lowers the energy any more, at a residual of " + format_number(result.residual);
        break;
      }
    }
    if (!done) {
      if (result.why.empty())
        result.why = "not at rest after " + std::to_string(options.iterations) + " iterations, at a residual of " +
                     format_number(result.residual);
      result.energy_mj = total_energy(energy, x);
      return result;
    }
  }
  result.converged = true;
  result.energy_mj = total_energy(energy, x);
  return result;
}

void EquilibriumSolver::back_solve(std::span<const Vec3> right, std::span<Vec3> x) {
  Impl& m = *impl_;
  if (Equilibrium ignored; m.stale && !m.factorise(ignored))
    throw Error(ExitCode::failed, "the Hessian at rest is not finite");
  Eigen::VectorXd b(static_cast<Eigen::Index>(3 * m.moving));
  for (std::uint32_t p = 0; p < right.size(); ++p) {
    if (m.number[p] == kFixed) continue;
    const Vec3 r = m.of_free(p, right[p]);
    for (std::size_t a = 0; a < 3; ++a) b[static_cast<Eigen::Index>(3 * m.number[p] + a)] = r[a];
  }
  const Eigen::VectorXd answer = m.factor.solve(b);
  for (std::uint32_t p = 0; p < x.size(); ++p) {
    x[p] = {};
    if (m.number[p] == kFixed) continue;
    for (std::size_t a = 0; a < 3; ++a) x[p][a] = answer[static_cast<Eigen::Index>(3 * m.number[p] + a)];
  }
}

}  // namespace osteo::inline simulation
