#include "osteo/simulation/tissue/dynamics.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <type_traits>

#include "body_parts.h"
#include "dynamics_impl.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/simd.h"
#include "osteo/core/base/union_find.h"

namespace osteo::inline simulation {

using namespace tissue;

namespace {

template <class Real>
tissue::ForceFunction<Real> force_function() {
  if constexpr (std::is_same_v<Real, float>) {
    switch (simd()) {
#if defined(__x86_64__)
      case Simd::avx512:
        return tissue::avx512::forces_float;
      case Simd::avx2:
        return tissue::avx2::forces_float;
#endif
      default:
        return tissue::base::forces_float;
    }
  } else {
    switch (simd()) {
#if defined(__x86_64__)
      case Simd::avx512:
        return tissue::avx512::forces_double;
      case Simd::avx2:
        return tissue::avx2::forces_double;
#endif
      default:
        return tissue::base::forces_double;
    }
  }
}

// Of the certified frequency at rest: so much is allowed for stretch before points are made heavier for it.
constexpr double kStretchMargin = 1.25;
constexpr std::uint64_t kObstacleSteps = 10, kTieSteps = 200, kCertifySteps = 100;

}  // namespace

template <class Real>
void TissueDynamics<Real>::Impl::lay_out() {
  std::vector<const TissueModel::Constraint*> e, f, v[2], t;
  for (const auto& c : model.constraints()) {
    if (c.stiffness == 0 || c.rest == 0) continue;
    (c.nodes == 2 ? e : c.nodes == 3 ? f : c.nodes == 4 ? t : v[c.voxel]).push_back(&c);
  }
  const auto put = [](const std::vector<const TissueModel::Constraint*>& list, std::size_t n,
                      std::vector<std::uint32_t>& node, std::vector<Real>& k, std::vector<Real>& inverse) {
    node.resize(n * list.size());
    k.clear();
    inverse.clear();
    for (std::size_t i = 0; i < list.size(); ++i) {
      for (std::size_t a = 0; a < n; ++a) node[a * list.size() + i] = list[i]->node[a];
      k.push_back(static_cast<Real>(list[i]->stiffness / list[i]->rest));
      inverse.push_back(static_cast<Real>(1 / list[i]->rest));
    }
  };
  put(e, 2, edge, edge_k, edge_inverse);
  put(f, 3, face, face_k, face_inverse);
  for (int s = 0; s < 2; ++s) put(v[s], 8, voxel[s], voxel_k[s], voxel_inverse[s]);
  put(t, 4, tet, tet_k, tet_inverse);
  arrays = {};
  arrays.points = x.size();
  arrays.x = x.data();
  arrays.y = y.data();
  arrays.z = z.data();
  arrays.fx = fx.data();
  arrays.fy = fy.data();
  arrays.fz = fz.data();
  arrays.edges = e.size();
  arrays.edge = edge.data();
  arrays.edge_k = edge_k.data();
  arrays.edge_inverse = edge_inverse.data();
  arrays.faces = f.size();
  arrays.face = face.data();
  arrays.face_k = face_k.data();
  arrays.face_inverse = face_inverse.data();
  for (int s = 0; s < 2; ++s)
    arrays.voxels[s] = {v[s].size(), voxel[s].data(), voxel_k[s].data(), voxel_inverse[s].data()};
  arrays.tets = {t.size(), tet.data(), tet_k.data(), tet_inverse.data()};
}

// Of each point, a bound on its share of the highest frequency: sum over its constraints of k |grad_i C| sum_j |grad_j
// C|.
template <class Real>
template <class At>
void TissueDynamics<Real>::Impl::rows(bool edges, const At& place, std::vector<double>& row) const {
  Vec3 local[8], g[8];
  for (std::size_t c = 0; c < model.element_count(); ++c) {
    const auto& k = model.constraints()[c];
    if (k.stiffness == 0 || k.rest == 0 || (k.nodes == 2) != edges) continue;
    const auto nodes = model.nodes(c);
    for (std::size_t a = 0; a < nodes.size(); ++a) local[a] = place(nodes[a]);
    model.measure(c, local, g);
    double norm[8], sum = 0;
    for (std::size_t a = 0; a < nodes.size(); ++a) sum += norm[a] = length(g[a]) / k.rest;
    for (std::size_t a = 0; a < nodes.size(); ++a) row[nodes[a]] += k.stiffness * norm[a] * sum;
  }
}

// Limit of the step: 2 / omega, omega^2 <= max over points of row / m (Gershgorin).
template <class Real>
double TissueDynamics<Real>::Impl::certify() {
  edge_row.assign(x.size(), 0);
  const auto at_rest = [&](std::uint32_t p) { return model.rest()[p]; };
  rows(true, at_rest, edge_row);
  std::vector<double> row = edge_row;
  rows(false, at_rest, row);
  double most = 0;
  const double heaviest = options.least_step_s > 0 ? 4 / (options.least_step_s * options.least_step_s) : INFINITY;
  for (std::size_t p = 0; p < row.size(); ++p) {
    if (fixed[p] || mass[p] == 0) continue;
    double omega2 = kStretchMargin * row[p] / mass[p];
    if (options.step_share * options.step_share * heaviest < omega2) {
      mass[p] *= omega2 / (options.step_share * options.step_share * heaviest);
      omega2 = options.step_share * options.step_share * heaviest;
      ++counts.made_heavier;
    }
    most = std::max(most, omega2);
  }
  return most > 0 ? options.step_share * 2 / std::sqrt(most) : 1e-3;
}

// Edges are as stiff along themselves however long they are, and across them less; areas and volumes get stiffer as
// they are stretched, without a bound. What has become too stiff for the step is moved as if it were heavier while it
// is.
template <class Real>
void TissueDynamics<Real>::Impl::certify_again() {
  std::vector<double> row = edge_row;
  rows(
      false, [&](std::uint32_t p) { return at(p); }, row);
  const double most = 4 * options.step_share * options.step_share / (dt * dt);
  for (std::size_t p = 0; p < row.size(); ++p) {
    if (inverse_mass[p] == 0) continue;
    const double needed = row[p] / most;
    if (needed > mass[p]) ++counts.stretched;
    const Real before = inverse_mass[p];
    inverse_mass[p] = static_cast<Real>(1 / std::max(mass[p], needed));
    // Heavier it keeps its momentum, lighter its velocity: neither adds energy.
    const Real keep = std::min(Real(1), inverse_mass[p] / before);
    if (keep == 1) continue;
    dx[p] *= keep;
    dy[p] *= keep;
    dz[p] *= keep;
  }
}

template <class Real>
TissueDynamics<Real>::TissueDynamics(const TissueModel& model, std::span<const std::uint32_t> fixed,
                                     const DynamicsOptions& options, std::span<const Slider> sliders)
    : impl_(std::make_unique<Impl>(model, options)) {
  Impl& m = *impl_;
  if (!(options.density_kg_m3 > 0)) throw Error(ExitCode::usage, "tissue needs a density above 0");
  const std::size_t n = model.point_count();
  m.fixed.assign(n, false);
  for (const std::uint32_t p : fixed) {
    if (p >= n)
      throw Error(ExitCode::usage,
                  "point " + std::to_string(p) + " is to be fixed, but there are only " + std::to_string(n));
    m.fixed[p] = true;
  }
  for (const Slider& s : sliders) {
    if (s.point >= n)
      throw Error(ExitCode::usage,
                  "point " + std::to_string(s.point) + " is to slide, but there are only " + std::to_string(n));
  }
  m.sliders.assign(sliders.begin(), sliders.end());
  m.mass = masses(model, options.density_kg_m3);
  for (auto* const v : {&m.x, &m.y, &m.z, &m.dx, &m.dy, &m.dz, &m.fx, &m.fy, &m.fz, &m.lx, &m.ly, &m.lz})
    v->assign(n, 0);
  for (std::uint32_t p = 0; p < n; ++p) set_position(p, model.rest()[p]);
  m.lay_out();
  m.lay_surface();
  for (const auto& t : model.tets())
    m.margin = std::max(m.margin, 0.25 * length(model.rest()[t[1]] - model.rest()[t[0]]));
  m.dt = m.certify();
  m.inverse_mass.assign(n, 0);
  for (std::size_t p = 0; p < n; ++p) {
    if (!m.fixed[p] && m.mass[p] > 0) m.inverse_mass[p] = static_cast<Real>(1 / m.mass[p]);
  }
}

template <class Real>
TissueDynamics<Real>::~TissueDynamics() = default;

template <class Real>
void TissueDynamics<Real>::set_load(std::span<const std::pair<std::uint32_t, Vec3>> forces) {
  Impl& m = *impl_;
  require_load(forces, m.x.size());
  for (auto* const v : {&m.lx, &m.ly, &m.lz}) std::fill(v->begin(), v->end(), Real(0));
  m.load_size = 0;
  for (const auto& [p, f] : forces) {
    m.lx[p] += static_cast<Real>(f.x);
    m.ly[p] += static_cast<Real>(f.y);
    m.lz[p] += static_cast<Real>(f.z);
  }
  for (std::size_t p = 0; p < m.x.size(); ++p)
    m.load_size = std::max(m.load_size, std::hypot(static_cast<double>(m.lx[p]), static_cast<double>(m.ly[p]),
                                                   static_cast<double>(m.lz[p])));
}

template <class Real>
void TissueDynamics<Real>::set_position(std::uint32_t p, Vec3 at) {
  Impl& m = *impl_;
  m.x[p] = static_cast<Real>(at.x);
  m.y[p] = static_cast<Real>(at.y);
  m.z[p] = static_cast<Real>(at.z);
  m.dx[p] = m.dy[p] = m.dz[p] = 0;
}

template <class Real>
void TissueDynamics<Real>::cut_off(std::span<const std::uint32_t> tets) {
  Impl& m = *impl_;
  if (!m.cutter) m.cutter = std::make_unique<Cutter>(m.model);
  m.cutter->cut(m.model, tets);
  m.lay_out();  // what is gone only lowers the frequencies: the step stays
  m.lay_surface();
  for (std::uint32_t p = 0; p < m.x.size(); ++p) {
    if (m.cutter->tets_of_point(p) == 0) m.inverse_mass[p] = 0;
  }
  m.tool_steps = 0;
}

template <class Real>
std::vector<std::uint32_t> TissueDynamics<Real>::loose() const {
  const Impl& m = *impl_;
  std::vector<std::uint32_t> parent(m.x.size());
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root = [&](std::uint32_t i) { return root_of(parent, i); };
  const auto there = [&](std::uint32_t t) { return !m.cutter || m.cutter->there(t); };
  for (std::uint32_t t = 0; t < m.model.tets().size(); ++t) {
    if (!there(t)) continue;
    for (const std::uint32_t p : m.model.tets()[t]) join_sets(parent, p, m.model.tets()[t][0]);
  }
  std::vector<bool> held(m.x.size());
  for (std::uint32_t p = 0; p < m.x.size(); ++p) {
    if (m.fixed[p] || (!m.tied.empty() && m.tied[p])) held[root(p)] = true;
  }
  for (const Slider& s : m.sliders) held[root(s.point)] = true;
  std::vector<std::uint32_t> tets;
  for (std::uint32_t t = 0; t < m.model.tets().size(); ++t) {
    if (there(t) && !held[root(m.model.tets()[t][0])]) tets.push_back(t);
  }
  return tets;
}

template <class Real>
void TissueDynamics<Real>::Impl::forces() {
  static const auto function = force_function<Real>();
  std::copy(lx.begin(), lx.end(), fx.begin());
  std::copy(ly.begin(), ly.end(), fy.begin());
  std::copy(lz.begin(), lz.end(), fz.begin());
  function(arrays);
  for (Tool& tool : tools) push_by(tool);
  if (obstacle.shape) push_by_obstacle();
  for (const Slider& q : sliders) {
    for (std::size_t a = 0; a < 3; ++a) {
      if ((q.held >> a & 1) != 0) (a == 0 ? fx : a == 1 ? fy : fz)[q.point] = 0;
    }
  }
}

template <class Real>
Vec3 TissueDynamics<Real>::step(int steps) {
  Impl& m = *impl_;
  for (int s = 0; s < steps; ++s) {
    if (++m.since_certified >= kCertifySteps) {
      m.since_certified = 0;
      m.certify_again();
    }
    if (m.has_tool() && m.tool_steps++ % kObstacleSteps == 0) m.find_near();
    if (m.obstacle.shape) {
      if (m.steps % kObstacleSteps == 0) m.find_planes();
      if (m.steps % kTieSteps == 0) m.untie();
      ++m.steps;
    }
    m.forces();
    const Real a = static_cast<Real>(0.5 * m.options.damping_per_s * m.dt), keep = 1 - a, whole = 1 / (1 + a);
    const Real dt2 = static_cast<Real>(m.dt * m.dt);
    for (std::size_t p = 0; p < m.x.size(); ++p) {
      const Real w = dt2 * m.inverse_mass[p];
      if (m.inverse_mass[p] == 0) {
        m.dx[p] = m.dy[p] = m.dz[p] = 0;
        continue;
      }
      m.dx[p] = (keep * m.dx[p] + w * m.fx[p]) * whole;
      m.dy[p] = (keep * m.dy[p] + w * m.fy[p]) * whole;
      m.dz[p] = (keep * m.dz[p] + w * m.fz[p]) * whole;
      const Real nx = m.x[p] + m.dx[p], ny = m.y[p] + m.dy[p], nz = m.z[p] + m.dz[p];
      if (std::isfinite(nx + ny + nz)) {
        m.x[p] = nx;
        m.y[p] = ny;
        m.z[p] = nz;
      } else {
        m.dx[p] = m.dy[p] = m.dz[p] = 0;
        ++m.counts.not_finite;
      }
    }
  }
  return force_on_tool_n(0);
}

template <class Real>
double TissueDynamics<Real>::step_s() const {
  return impl_->dt;
}
template <class Real>
Vec3 TissueDynamics<Real>::force_on_tool_n(std::size_t number) const {
  return number < impl_->tools.size() ? impl_->tools[number].force : Vec3{};
}
template <class Real>
int TissueDynamics<Real>::met_by_tool(std::size_t number) const {
  return number < impl_->tools.size() ? impl_->tools[number].met : 0;
}
template <class Real>
std::size_t TissueDynamics<Real>::point_count() const {
  return impl_->x.size();
}
template <class Real>
const typename TissueDynamics<Real>::Counts& TissueDynamics<Real>::counts() const {
  return impl_->counts;
}

template <class Real>
std::vector<Vec3> TissueDynamics<Real>::positions_mm() const {
  const Impl& m = *impl_;
  std::vector<Vec3> all;
  for (std::size_t p = 0; p < m.x.size(); ++p)
    all.push_back({static_cast<double>(m.x[p]), static_cast<double>(m.y[p]), static_cast<double>(m.z[p])});
  return all;
}

template <class Real>
Vec3 TissueDynamics<Real>::position_mm(std::uint32_t point) const {
  return impl_->at(point);
}

template <class Real>
double TissueDynamics<Real>::residual() const {
  Impl& m = *impl_;
  m.forces();
  double most = 0;
  for (std::size_t p = 0; p < m.x.size(); ++p) {
    if (m.inverse_mass[p] == 0) continue;
    most = std::max(
        most, std::hypot(static_cast<double>(m.fx[p]), static_cast<double>(m.fy[p]), static_cast<double>(m.fz[p])));
  }
  return most / (m.load_size > 0 ? m.load_size : 1);
}

template <class Real>
double TissueDynamics<Real>::kinetic_mj() const {
  Impl& m = *impl_;
  m.forces();
  double sum = 0;
  for (std::size_t p = 0; p < m.x.size(); ++p) {
    // The velocity now, half a step after that between the last two places.
    const Vec3 f{static_cast<double>(m.fx[p]), static_cast<double>(m.fy[p]), static_cast<double>(m.fz[p])};
    const Vec3 v =
        Vec3{static_cast<double>(m.dx[p]), static_cast<double>(m.dy[p]), static_cast<double>(m.dz[p])} / m.dt +
        f * (0.5 * m.dt * static_cast<double>(m.inverse_mass[p]));
    sum += m.fixed[p] ? 0 : 0.5 * m.mass[p] * dot(v, v);
  }
  return sum;
}

template <class Real>
double TissueDynamics<Real>::elastic_mj() const {
  return total_energy(impl_->model, positions_mm());
}

template <class Real>
Vec3 TissueDynamics<Real>::momentum_n_s() const {
  const Impl& m = *impl_;
  Vec3 sum{};
  for (std::size_t p = 0; p < m.x.size(); ++p) {
    sum += Vec3{static_cast<double>(m.dx[p]), static_cast<double>(m.dy[p]), static_cast<double>(m.dz[p])} *
           (m.mass[p] / m.dt);
  }
  return sum;
}

template class TissueDynamics<float>;
template class TissueDynamics<double>;

}  // namespace osteo::inline simulation
