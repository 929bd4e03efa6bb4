// Long steps of TissueDynamics: backward Euler by conjugate gradients, preconditioned by the body's stiffness at rest,
// which is factorised once (T. Liu et al., ACM Trans. Graph. 36, 2017, take such steps with a matrix of their own).
#include <algorithm>
#include <cmath>

#include "block_factor.h"
#include "dynamics_impl.h"

namespace osteo::inline simulation {

using namespace tissue;

namespace {
// Gradient times change, of the first iteration's: what is left is the rounding of floats.
constexpr double kRounding = 1e-9;
}  // namespace

template <class Real>
struct TissueDynamics<Real>::Impl::Factorised {
  BlockFactor factor;
  // 4 numbers a point: gradient here and after the whole step, what the factor makes of it, the direction.
  std::vector<float> gradient, after, change, direction;
  std::vector<Vec3> target;
  std::vector<Real> x0, y0, z0;

  Factorised(std::size_t points, std::vector<BlockFactor::Block> blocks)
      : factor(points, std::move(blocks)),
        gradient(4 * points),
        after(4 * points),
        change(4 * points),
        direction(4 * points),
        target(points),
        x0(points),
        y0(points),
        z0(points) {}
};

// N/mm with which a point resists to be moved within a step.
template <class Real>
double TissueDynamics<Real>::Impl::inertia(std::uint32_t p) const {
  return mass[p] * (1 + options.damping_per_s * dt) / (dt * dt);
}

// The model's Hessian at rest is positive (all its energies are squares), with masses positive definite. What is cut
// off later only lowers it, so the factor stays a good one and none is made while a hand waits.
template <class Real>
void TissueDynamics<Real>::Impl::factorise() {
  std::vector<BlockFactor::Block> blocks;
  std::vector<std::uint8_t> held(x.size());
  for (const Slider& s : sliders) held[s.point] = static_cast<std::uint8_t>(held[s.point] | s.held);
  for (std::uint32_t p = 0; p < x.size(); ++p) {
    if (inverse_mass[p] == 0) held[p] = 7;
    const double own = (mass[p] > 0 ? inertia(p) : 1) + (!tied.empty() && tied[p] ? obstacle.stiffness_n_per_mm : 0);
    blocks.push_back({p, p, {own, 0, 0, 0, own, 0, 0, 0, own}});
  }
  double hessian[9 * Energy::kMaxNodes * Energy::kMaxNodes], gradient_here[3 * Energy::kMaxNodes];
  for (std::size_t e = 0; e < model.element_count(); ++e) {
    const auto& c = model.constraints()[e];
    if (c.stiffness == 0 || c.rest == 0) continue;
    const auto nodes = model.nodes(e);
    Vec3 at_rest[Energy::kMaxNodes];
    for (std::size_t a = 0; a < nodes.size(); ++a) at_rest[a] = model.rest()[nodes[a]];
    model.element(e, at_rest, gradient_here, hessian);
    const std::size_t row = 3 * nodes.size();
    for (std::size_t a = 0; a < nodes.size(); ++a) {
      for (std::size_t b = 0; b < nodes.size(); ++b) {
        if (nodes[a] < nodes[b]) continue;
        BlockFactor::Block block{nodes[a], nodes[b], {}};
        for (std::size_t i = 0; i < 3; ++i) {
          for (std::size_t j = 0; j < 3; ++j) {
            const bool fast = (held[nodes[a]] >> i & 1) != 0 || (held[nodes[b]] >> j & 1) != 0;
            block.value[3 * i + j] = fast ? 0 : hessian[(3 * a + i) * row + 3 * b + j];
          }
        }
        blocks.push_back(block);
      }
    }
  }
  factorised = std::make_shared<Factorised>(x.size(), std::move(blocks));
}

// Of the energy that the step makes least: inertia and all that pushes. Zero where nothing moves.
template <class Real>
void TissueDynamics<Real>::Impl::gradient_of_step(const std::vector<Vec3>& target, std::vector<float>& gradient) {
  forces();
  for (std::uint32_t p = 0; p < x.size(); ++p) {
    float* const g = gradient.data() + 4 * static_cast<std::size_t>(p);
    if (inverse_mass[p] == 0) {
      g[0] = g[1] = g[2] = 0;
      continue;
    }
    const double w = inertia(p);
    g[0] = static_cast<float>(w * (static_cast<double>(x[p]) - target[p].x) - static_cast<double>(fx[p]));
    g[1] = static_cast<float>(w * (static_cast<double>(y[p]) - target[p].y) - static_cast<double>(fy[p]));
    g[2] = static_cast<float>(w * (static_cast<double>(z[p]) - target[p].z) - static_cast<double>(fz[p]));
  }
  for (const Slider& q : sliders) {
    for (std::size_t a = 0; a < 3; ++a) {
      if ((q.held >> a & 1) != 0) gradient[4 * static_cast<std::size_t>(q.point) + a] = 0;
    }
  }
}

template <class Real>
void TissueDynamics<Real>::Impl::step_factorised() {
  if (!factorised) factorise();
  Factorised& m = *factorised;
  if (has_tool()) find_near();
  if (obstacle.shape) {
    find_planes();
    if (steps++ % 20 == 0) untie();
  }
  const std::size_t n = x.size();
  const Real slow = static_cast<Real>(1 / (1 + options.damping_per_s * dt));
  // Begins where it would go without any force.
  const auto ahead = [&](std::vector<Real>& now, std::vector<Real>& before, std::vector<Real>& kept, std::uint32_t p) {
    kept[p] = now[p];
    const Real there = inverse_mass[p] == 0 ? now[p] : now[p] + (now[p] - before[p]) * slow;
    before[p] = now[p];
    return static_cast<double>(now[p] = there);
  };
  for (std::uint32_t p = 0; p < n; ++p)
    m.target[p] = {ahead(x, px, m.x0, p), ahead(y, py, m.y0, p), ahead(z, pz, m.z0, p)};
  const auto product = [&](const std::vector<float>& a, const std::vector<float>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += static_cast<double>(a[i]) * static_cast<double>(b[i]);
    return sum;
  };
  const auto move = [&](float by) {
    for (std::size_t p = 0; p < n; ++p) {
      x[p] += static_cast<Real>(by * m.direction[4 * p]);
      y[p] += static_cast<Real>(by * m.direction[4 * p + 1]);
      z[p] += static_cast<Real>(by * m.direction[4 * p + 2]);
    }
  };
  double first = 0, last = 0;  // gradient times change: of the first iteration, of the one before
  std::fill(m.direction.begin(), m.direction.end(), 0.0F);
  std::fill(m.change.begin(), m.change.end(), 0.0F);
  for (int it = 0; it < options.iterations; ++it) {
    gradient_of_step(m.target, m.gradient);
    const double mixed = last > 0 ? product(m.gradient, m.change) : 0;  // with the change before
    m.change = m.gradient;
    m.factor.solve(m.change);
    const double now = product(m.gradient, m.change);
    first = it == 0 ? now : first;
    if (!(now > kRounding * first) || !std::isfinite(now)) break;
    const auto keep =
        static_cast<float>(last > 0 ? std::clamp((now - mixed) / last, 0.0, 1.0) : 0);  // E. Polak, G. Ribiere 1969
    for (std::size_t i = 0; i < m.direction.size(); ++i) m.direction[i] = keep * m.direction[i] - m.change[i];
    double slope = product(m.gradient, m.direction);
    if (!(slope < 0)) {
      for (std::size_t i = 0; i < m.direction.size(); ++i) m.direction[i] = -m.change[i];
      slope = -now;
    }
    last = now;
    // As far as the slope at the whole step's end says; no farther than that where the energy is not convex.
    move(1);
    gradient_of_step(m.target, m.after);
    const double end = product(m.after, m.direction);
    const double share = end > slope ? std::min(-slope / (end - slope), 1.5) : 1.0;
    move(static_cast<float>(share) - 1);
  }
  forces();
  for (std::size_t p = 0; p < n; ++p) {
    if (std::isfinite(x[p] + y[p] + z[p])) continue;
    x[p] = m.x0[p];
    y[p] = m.y0[p];
    z[p] = m.z0[p];
    ++counts.not_finite;
  }
}

template <class Real>
void TissueDynamics<Real>::prepare() {
  if (impl_->is_factorised() && !impl_->factorised) impl_->factorise();
}
template <class Real>
std::size_t TissueDynamics<Real>::factor_bytes() const {
  return impl_->factorised ? impl_->factorised->factor.memory_bytes() : 0;
}

template void TissueDynamics<float>::prepare();
template void TissueDynamics<double>::prepare();
template std::size_t TissueDynamics<float>::factor_bytes() const;
template std::size_t TissueDynamics<double>::factor_bytes() const;
template void TissueDynamics<float>::Impl::step_factorised();
template void TissueDynamics<double>::Impl::step_factorised();

}  // namespace osteo::inline simulation
