#include "osteo/simulation/tissue/implicit.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "body_parts.h"
#include "cutter.h"
#include "osteo/core/base/error.h"

namespace osteo::inline simulation {

using namespace tissue;

namespace {

// The model's constraints, then an element for each point: its inertia, and what pushes it.
class Incremental final : public Energy {
 public:
  explicit Incremental(const TissueModel& m)
      : model(m),
        weight(m.point_count()),
        target(m.rest()),
        by_obstacle(m.point_count(), Meets::nothing),
        met(m.point_count(), true),
        own_(m.point_count()) {
    std::iota(own_.begin(), own_.end(), 0U);
  }
  [[nodiscard]] std::size_t point_count() const override { return model.point_count(); }
  [[nodiscard]] std::size_t element_count() const override { return model.element_count() + own_.size(); }
  [[nodiscard]] std::span<const std::uint32_t> nodes(std::size_t e) const override {
    return e < model.element_count() ? model.nodes(e) : std::span(own_.data() + (e - model.element_count()), 1);
  }
  double element(std::size_t e, const Vec3* x, double* gradient, double* hessian) const override {
    if (e < model.element_count()) return model.element(e, x, gradient, hessian);
    const std::size_t p = e - model.element_count();
    const Vec3 off = x[0] - target[p];
    double energy = 0.5 * weight[p] * dot(off, off);
    if (gradient != nullptr) {
      for (std::size_t a = 0; a < 3; ++a) gradient[a] = weight[p] * off[a];
    }
    if (hessian != nullptr) {
      for (std::size_t i = 0; i < 9; ++i) hessian[i] = i % 4 == 0 ? weight[p] : 0;
    }
    if (met[p]) energy += pushed(tool, x[0], gradient, hessian);
    if (met[p]) energy += held(p, x[0], gradient, hessian);
    return energy;
  }
  // By the obstacle: pushed out of it, or tied to a place in it.
  double held(std::size_t p, Vec3 x, double* gradient, double* hessian) const {
    if (by_obstacle[p] == Meets::pushed) return pushed(obstacle, x, gradient, hessian);
    if (by_obstacle[p] == Meets::nothing) return 0;
    const Vec3 off = x - model.rest()[p];
    for (std::size_t a = 0; a < 3; ++a) {
      if (gradient != nullptr) gradient[a] += obstacle.stiffness_n_per_mm * off[a];
      if (hessian != nullptr) hessian[4 * a] += obstacle.stiffness_n_per_mm;
    }
    return 0.5 * obstacle.stiffness_n_per_mm * dot(off, off);
  }
  // k/2 depth^2.
  static double pushed(const RigidContact& by, Vec3 x, double* gradient, double* hessian) {
    if (!by.shape) return 0;
    const RigidShape::Ball near = by.shape->bounds();
    const Vec3 to = x - near.centre_mm;
    if (!(dot(to, to) < near.radius_mm * near.radius_mm)) return 0;
    Vec3 out;
    const double d = by.shape->distance_mm(x, out);
    if (!(d < 0)) return 0;
    for (std::size_t a = 0; a < 3; ++a) {
      if (gradient != nullptr) gradient[a] += by.stiffness_n_per_mm * d * out[a];
      for (std::size_t b = 0; b < 3 && hessian != nullptr; ++b)
        hessian[3 * a + b] += by.stiffness_n_per_mm * out[a] * out[b];
    }
    return 0.5 * by.stiffness_n_per_mm * d * d;
  }

  TissueModel model;
  std::vector<double> weight;
  std::vector<Vec3> target;
  enum class Meets : std::uint8_t { nothing, pushed, tied };
  std::vector<Meets> by_obstacle;
  std::vector<bool> met;  // by tool or obstacle at all
  RigidContact tool, obstacle;

 private:
  std::vector<std::uint32_t> own_;
};

}  // namespace

struct ImplicitDynamics::Impl {
  Incremental energy;
  ImplicitOptions options;
  EquilibriumSolver solver;
  std::vector<double> mass;
  std::vector<Vec3> x, v, load;
  std::vector<std::uint8_t> held;
  std::vector<std::uint32_t> surface;
  double load_size = 0;
  std::unique_ptr<Cutter> cutter;  // once something was cut
  Counts counts;

  Impl(const TissueModel& m, std::span<const std::uint32_t> fixed, const ImplicitOptions& o,
       std::span<const Slider> sliders)
      : energy(m),
        options(o),
        solver(energy, m.rest(), fixed, sliders),
        mass(masses(m, o.density_kg_m3)),
        x(m.rest()),
        v(x.size()),
        load(x.size()),
        held(x.size()),
        surface(points_of(boundary_triangles(m))) {
    for (const std::uint32_t p : fixed) held[p] = 7;
    for (const Slider& s : sliders) held[s.point] = static_cast<std::uint8_t>(held[s.point] | s.held);
    for (std::size_t p = 0; p < x.size(); ++p)
      energy.weight[p] = mass[p] > 0 ? mass[p] * (1 + o.damping_per_s * o.step_s) / (o.step_s * o.step_s)
                                     : 1;  // of no mass: of no element, stays
  }
  [[nodiscard]] Vec3 of_free(std::size_t p, Vec3 f) const {
    for (std::size_t a = 0; a < 3; ++a) f[a] = (held[p] >> a & 1) != 0 ? 0 : f[a];
    return f;
  }
};

ImplicitDynamics::ImplicitDynamics(const TissueModel& model, std::span<const std::uint32_t> fixed,
                                   const ImplicitOptions& options, std::span<const Slider> sliders) {
  if (!(options.density_kg_m3 > 0)) throw Error(ExitCode::usage, "tissue needs a density above 0");
  if (!(options.step_s > 0)) throw Error(ExitCode::usage, "steps in time need a length above 0");
  impl_ = std::make_unique<Impl>(model, fixed, options, sliders);
}
ImplicitDynamics::~ImplicitDynamics() = default;

void ImplicitDynamics::set_load(std::span<const std::pair<std::uint32_t, Vec3>> forces) {
  Impl& m = *impl_;
  require_load(forces, m.x.size());
  std::fill(m.load.begin(), m.load.end(), Vec3{});
  for (const auto& [p, f] : forces) m.load[p] += f;
  m.load_size = 0;
  for (const Vec3& f : m.load) m.load_size = std::max(m.load_size, length(f));
}

void ImplicitDynamics::set_tool(RigidContact tool) {
  impl_->energy.tool = std::move(tool);
}

void ImplicitDynamics::set_obstacle(RigidContact obstacle) {
  Impl& m = *impl_;
  m.energy.obstacle = std::move(obstacle);
  auto& meets = m.energy.by_obstacle;
  std::fill(meets.begin(), meets.end(), Incremental::Meets::nothing);
  if (!m.energy.obstacle.shape) return;
  for (const std::uint32_t p : m.surface) meets[p] = Incremental::Meets::pushed;
  for (const std::uint32_t p : points_inside(*m.energy.obstacle.shape, m.energy.model.rest(), m.surface))
    meets[p] = Incremental::Meets::tied;
}

void ImplicitDynamics::set_position(std::uint32_t p, Vec3 at) {
  impl_->x[p] = at;
  impl_->v[p] = {};
}

void ImplicitDynamics::cut_off(std::span<const std::uint32_t> tets) {
  Impl& m = *impl_;
  if (!m.cutter) m.cutter = std::make_unique<Cutter>(m.energy.model);
  m.cutter->cut(m.energy.model, tets);
  for (std::uint32_t p = 0; p < m.x.size(); ++p) {
    if (m.mass[p] > 0 && m.cutter->tets_of_point(p) == 0) {
      m.energy.met[p] = false;
      m.load[p] = m.v[p] = {};
    }
  }
}

Vec3 ImplicitDynamics::step(int steps) {
  Impl& m = *impl_;
  const double h = m.options.step_s, slow = 1 + m.options.damping_per_s * h;
  for (int s = 0; s < steps; ++s) {
    for (std::size_t p = 0; p < m.x.size(); ++p) {
      const Vec3 push = m.mass[p] > 0 ? m.load[p] * (h * h / m.mass[p]) : Vec3{};
      m.energy.target[p] = m.x[p] + m.of_free(p, (m.v[p] * h + push) / slow);
    }
    const Equilibrium r = m.solver.solve(m.energy, m.x, {}, {m.options.tolerance, m.options.iterations, 1});
    m.counts.iterations += static_cast<std::uint64_t>(r.iterations);
    if (!r.converged) ++m.counts.unfinished;
    for (std::size_t p = 0; p < m.x.size(); ++p) m.v[p] = (r.points_mm[p] - m.x[p]) / h;
    m.x = r.points_mm;
  }
  Vec3 on_tool{};
  for (std::size_t p = 0; p < m.x.size(); ++p) {
    if (!m.energy.met[p]) continue;
    double g[3] = {};
    Incremental::pushed(m.energy.tool, m.x[p], g, nullptr);
    on_tool += Vec3{g[0], g[1], g[2]};
  }
  return on_tool;
}

double ImplicitDynamics::step_s() const {
  return impl_->options.step_s;
}
const std::vector<Vec3>& ImplicitDynamics::positions_mm() const {
  return impl_->x;
}
const ImplicitDynamics::Counts& ImplicitDynamics::counts() const {
  return impl_->counts;
}

double ImplicitDynamics::residual() const {
  const Impl& m = *impl_;
  std::vector<Vec3> g(m.x.size());
  total_gradient(m.energy.model, m.x, g);
  double most = 0;
  for (std::size_t p = 0; p < m.x.size(); ++p) {
    double push[3] = {};
    if (!m.energy.met[p]) continue;
    Incremental::pushed(m.energy.tool, m.x[p], push, nullptr);
    m.energy.held(p, m.x[p], push, nullptr);
    most = std::max(most, length(m.of_free(p, m.load[p] - g[p] - Vec3{push[0], push[1], push[2]})));
  }
  return most / (m.load_size > 0 ? m.load_size : 1);
}
double ImplicitDynamics::kinetic_mj() const {
  double sum = 0;
  for (std::size_t p = 0; p < impl_->x.size(); ++p) sum += 0.5 * impl_->mass[p] * dot(impl_->v[p], impl_->v[p]);
  return sum;
}
double ImplicitDynamics::elastic_mj() const {
  return total_energy(impl_->energy.model, impl_->x);
}

}  // namespace osteo::inline simulation
