#include "osteo/tissue/dynamics.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <string_view>
#include <type_traits>

#include "body_parts.h"
#include "cutter.h"
#include "dynamics_kernel.h"
#include "osteo/base/error.h"
#include "osteo/data/tet_mesh.h"
#include "osteo/distance/triangle_tree.h"

namespace osteo {

using namespace tissue;

namespace {

enum class Isa { base, avx2, avx512 };
Isa chosen() {
  static const Isa isa = [] {
#if defined(__x86_64__)
    const char* const wish = std::getenv("OSTEO_SIMD");
    const std::string_view most = wish != nullptr ? wish : "avx512";
    if (most == "avx512" && __builtin_cpu_supports("avx512f")) return Isa::avx512;
    if (most != "scalar" && __builtin_cpu_supports("avx2")) return Isa::avx2;
#endif
    return Isa::base;
  }();
  return isa;
}

template <class Real>
tissue::ForceFunction<Real> force_function() {
  if constexpr (std::is_same_v<Real, float>) {
    switch (chosen()) {
#if defined(__x86_64__)
      case Isa::avx512:
        return tissue::avx512::forces_float;
      case Isa::avx2:
        return tissue::avx2::forces_float;
#endif
      default:
        return tissue::base::forces_float;
    }
  } else {
    switch (chosen()) {
#if defined(__x86_64__)
      case Isa::avx512:
        return tissue::avx512::forces_double;
      case Isa::avx2:
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

const char* tissue_simd_name() {
  return chosen() == Isa::avx512 ? "avx512" : chosen() == Isa::avx2 ? "avx2" : "base";
}

template <class Real>
struct TissueDynamics<Real>::Impl {
  TissueModel model;
  DynamicsOptions options;
  double dt = 0;
  std::vector<Real> x, y, z, px, py, pz, fx, fy, fz;  // now, before, force
  std::vector<Real> inverse_mass;                     // 1 / (N s2 / mm); 0: fixed
  std::vector<Real> lx, ly, lz;                       // load
  std::vector<double> mass, edge_row;
  std::vector<bool> fixed;
  std::vector<Slider> sliders;
  std::vector<std::uint32_t> edge, face, voxel[2], tet;
  std::vector<Real> edge_k, edge_inverse, face_k, face_inverse, voxel_k[2], voxel_inverse[2], tet_k, tet_inverse;
  tissue::Arrays<Real> arrays;
  RigidContact tool, obstacle;
  std::vector<std::uint32_t> surface;  // points of the body's boundary
  std::vector<bool> surface_point;     // of all points
  std::vector<bool> tied;              // of all points: to its place in the obstacle
  std::vector<std::uint32_t> ties;     // those
  struct Plane {
    std::uint32_t point;
    Vec3 normal;
    double offset;  // pushes where normal . x < offset
  };
  std::vector<Plane> planes;
  double margin = 0;  // nearer to the obstacle than this a point gets a plane
  std::uint64_t steps = 0, tool_steps = 0, since_certified = 0;
  std::unique_ptr<Cutter> cutter;  // once something was cut
  double load_size = 0;
  int met = 0;
  Counts counts;

  Impl(const TissueModel& m, const DynamicsOptions& o) : model(m), options(o) {}
  void lay_out();
  double certify();
  void certify_again();
  template <class At>
  void rows(bool edges, const At& place, std::vector<double>& row) const;
  Vec3 forces();
  // What the certified step leaves room for, of tool and obstacle each: with both omega dt stays below 2.
  [[nodiscard]] double room(std::uint32_t p) const {
    return 0.45 * (4 - 4 * options.step_share * options.step_share) * mass[p] / (dt * dt);
  }
  // The obstacle on a point: `deep` above 0, along `out`.
  void push(std::uint32_t p, double deep, Vec3 out);
  void add(std::uint32_t p, Vec3 f) {
    fx[p] += static_cast<Real>(f.x);
    fy[p] += static_cast<Real>(f.y);
    fz[p] += static_cast<Real>(f.z);
  }
  [[nodiscard]] Vec3 at(std::uint32_t p) const { return {static_cast<double>(x[p]), static_cast<double>(y[p]), static_cast<double>(z[p])}; }
  void find_planes();
  // The tool meets the triangles of the surface where they are nearest to it, and points: all, so that one that is inside is pushed out,
  // too.
  std::vector<std::array<std::uint32_t, 3>> triangles;     // facing outwards
  std::vector<std::uint32_t> near_triangles, near_points;  // those that the tool may reach before it is looked for again
  std::vector<RigidShape::Ball> tool_balls;
  void lay_triangles();
  void find_near();
  Vec3 push_by_tool();
  // Points whose place in the obstacle is gone.
  void untie();
};

template <class Real>
void TissueDynamics<Real>::Impl::lay_out() {
  std::vector<const TissueModel::Constraint*> e, f, v[2], t;
  for (const auto& c : model.constraints()) {
    if (c.stiffness == 0 || c.rest == 0) continue;
    (c.nodes == 2 ? e : c.nodes == 3 ? f : c.nodes == 4 ? t : v[c.voxel]).push_back(&c);
  }
  const auto put = [](const std::vector<const TissueModel::Constraint*>& list, std::size_t n, std::vector<std::uint32_t>& node,
                      std::vector<Real>& k, std::vector<Real>& inverse) {
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
  for (int s = 0; s < 2; ++s) arrays.voxels[s] = {v[s].size(), voxel[s].data(), voxel_k[s].data(), voxel_inverse[s].data()};
  arrays.tets = {t.size(), tet.data(), tet_k.data(), tet_inverse.data()};
}

// Of each point, a bound on its share of the highest frequency: sum over its constraints of k |grad_i C| sum_j |grad_j C|.
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

// Edges are as stiff along themselves however long they are, and across them less; areas and volumes get stiffer as they are stretched,
// without a bound. What has become too stiff for the step is moved as if it were heavier while it is.
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
    inverse_mass[p] = static_cast<Real>(1 / std::max(mass[p], needed));
  }
}

template <class Real>
TissueDynamics<Real>::TissueDynamics(const TissueModel& model, std::span<const std::uint32_t> fixed, const DynamicsOptions& options,
                                     std::span<const Slider> sliders)
    : impl_(std::make_unique<Impl>(model, options)) {
  Impl& m = *impl_;
  if (!(options.density_kg_m3 > 0)) throw Error(ExitCode::usage, "tissue needs a density above 0");
  const std::size_t n = model.point_count();
  m.fixed.assign(n, false);
  for (const std::uint32_t p : fixed) {
    if (p >= n) throw Error(ExitCode::usage, "point " + std::to_string(p) + " is to be fixed, but there are only " + std::to_string(n));
    m.fixed[p] = true;
  }
  for (const Slider& s : sliders) {
    if (s.point >= n)
      throw Error(ExitCode::usage, "point " + std::to_string(s.point) + " is to slide, but there are only " + std::to_string(n));
  }
  m.sliders.assign(sliders.begin(), sliders.end());
  m.mass = masses(model, options.density_kg_m3);
  for (auto* const v : {&m.x, &m.y, &m.z, &m.px, &m.py, &m.pz, &m.fx, &m.fy, &m.fz, &m.lx, &m.ly, &m.lz}) v->assign(n, 0);
  for (std::uint32_t p = 0; p < n; ++p) set_position(p, model.rest()[p]);
  m.lay_out();
  m.surface = points_of_boundary(model);
  m.surface_point.assign(n, false);
  for (const std::uint32_t p : m.surface) m.surface_point[p] = true;
  for (const auto& t : model.tets()) m.margin = std::max(m.margin, 0.25 * length(model.rest()[t[1]] - model.rest()[t[0]]));
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
  for (auto* const v : {&m.lx, &m.ly, &m.lz}) std::fill(v->begin(), v->end(), Real(0));
  m.load_size = 0;
  for (const auto& [p, f] : forces) {
    if (p >= m.x.size() || !std::isfinite(dot(f, f)))
      throw Error(ExitCode::usage, "a load on point " + std::to_string(p) + " is not finite, or there is no such point");
    m.lx[p] += static_cast<Real>(f.x);
    m.ly[p] += static_cast<Real>(f.y);
    m.lz[p] += static_cast<Real>(f.z);
  }
  for (std::size_t p = 0; p < m.x.size(); ++p)
    m.load_size =
        std::max(m.load_size, std::hypot(static_cast<double>(m.lx[p]), static_cast<double>(m.ly[p]), static_cast<double>(m.lz[p])));
}

template <class Real>
void TissueDynamics<Real>::set_tool(RigidContact tool) {
  impl_->tool = std::move(tool);
  impl_->tool_steps = 0;
  impl_->tool_balls = impl_->tool.shape ? impl_->tool.shape->balls() : std::vector<RigidShape::Ball>{};
  if (!impl_->tool_balls.empty() && impl_->triangles.empty()) impl_->lay_triangles();
}

template <class Real>
void TissueDynamics<Real>::set_obstacle(RigidContact obstacle) {
  Impl& m = *impl_;
  m.obstacle = std::move(obstacle);
  m.planes.clear();
  m.ties.clear();
  m.tied.assign(m.x.size(), false);
  m.steps = 0;
  if (!m.obstacle.shape) return;
  m.ties = points_inside(*m.obstacle.shape, m.model.rest(), m.surface);
  for (const std::uint32_t p : m.ties) m.tied[p] = true;
}

template <class Real>
void TissueDynamics<Real>::set_position(std::uint32_t p, Vec3 at) {
  Impl& m = *impl_;
  m.x[p] = m.px[p] = static_cast<Real>(at.x);
  m.y[p] = m.py[p] = static_cast<Real>(at.y);
  m.z[p] = m.pz[p] = static_cast<Real>(at.z);
}

template <class Real>
void TissueDynamics<Real>::cut_off(std::span<const std::uint32_t> tets) {
  Impl& m = *impl_;
  if (!m.cutter) m.cutter = std::make_unique<Cutter>(m.model);
  m.cutter->cut(m.model, tets);
  m.lay_out();  // what is gone only lowers the frequencies: the step stays
  for (const std::uint32_t t : tets) {
    if (t >= m.model.tets().size()) continue;
    for (const std::uint32_t p : m.model.tets()[t]) {
      if (m.surface_point[p]) continue;
      m.surface_point[p] = true;
      m.surface.push_back(p);
    }
  }
  for (std::uint32_t p = 0; p < m.x.size(); ++p) {
    if (m.cutter->tets_of_point(p) == 0) m.inverse_mass[p] = 0;
  }
  if (!m.triangles.empty()) m.lay_triangles();
  m.tool_steps = 0;
}

template <class Real>
std::vector<std::uint32_t> TissueDynamics<Real>::loose() const {
  const Impl& m = *impl_;
  std::vector<std::uint32_t> parent(m.x.size());
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root = [&](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  const auto there = [&](std::uint32_t t) { return !m.cutter || m.cutter->there(t); };
  for (std::uint32_t t = 0; t < m.model.tets().size(); ++t) {
    if (!there(t)) continue;
    for (const std::uint32_t p : m.model.tets()[t]) parent[root(p)] = root(m.model.tets()[t][0]);
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
void TissueDynamics<Real>::Impl::push(std::uint32_t p, double deep, Vec3 out) {
  const double most = room(p);
  if (obstacle.stiffness_n_per_mm > most) ++counts.softened;
  add(p, out * (std::min(obstacle.stiffness_n_per_mm, most) * deep));
}

template <class Real>
void TissueDynamics<Real>::Impl::lay_triangles() {
  TetMesh mesh;
  for (const Vec3& p : model.rest()) mesh.points_mm.push_back(to_floats(p));
  for (std::uint32_t t = 0; t < model.tets().size(); ++t) {
    if (!cutter || cutter->there(t)) mesh.tets.push_back(model.tets()[t]);
  }
  std::vector<std::uint32_t> point_of;
  const TriMesh boundary = boundary_of(mesh, &point_of);
  triangles.clear();
  for (const auto& t : boundary.triangles) triangles.push_back({point_of[t[0]], point_of[t[1]], point_of[t[2]]});
}

template <class Real>
void TissueDynamics<Real>::Impl::find_near() {
  near_triangles.clear();
  near_points.clear();
  const RigidShape::Ball ball = tool.shape->bounds();
  // Triangles reach beyond their first point, and things move.
  const double reach = ball.radius_mm + 8 * margin;
  const auto close = [&](std::uint32_t p) {
    const Vec3 off = at(p) - ball.centre_mm;
    return dot(off, off) < reach * reach;
  };
  for (std::uint32_t p = 0; p < x.size(); ++p) {
    if (mass[p] > 0 && close(p) && !(cutter && cutter->tets_of_point(p) == 0)) near_points.push_back(p);
  }
  for (std::uint32_t t = 0; t < triangles.size() && !tool_balls.empty(); ++t) {
    if (close(triangles[t][0])) near_triangles.push_back(t);
  }
}

template <class Real>
Vec3 TissueDynamics<Real>::Impl::push_by_tool() {
  Vec3 on_tool{};
  // A point has about six triangles, each of which may push all of it; and itself.
  const auto stiffness = [&](double most) {
    if (tool.stiffness_n_per_mm > most / 7) ++counts.softened;
    return std::min(tool.stiffness_n_per_mm, most / 7);
  };
  for (const std::uint32_t p : near_points) {
    Vec3 out;
    const double d = tool.shape->distance_mm(at(p), out);
    if (!(d < 0) || (surface_point[p] && !tool_balls.empty())) continue;
    ++met;
    const Vec3 f = out * (stiffness(room(p)) * -d);
    add(p, f);
    on_tool -= f;
  }
  for (const std::uint32_t t : near_triangles) {
    const auto& q = triangles[t];
    const Vec3 a = at(q[0]), u = at(q[1]) - a, v = at(q[2]) - a, area = cross(u, v);
    const double square = dot(area, area);
    if (!(square > 0)) continue;
    for (const RigidShape::Ball& ball : tool_balls) {
      const ClosestPoint c = closest_on_triangle(ball.centre_mm, a, a + u, a + v);
      if (!(c.distance_mm < ball.radius_mm) || !(c.distance_mm > 0)) continue;
      ++met;
      Vec3 out = (c.point_mm - ball.centre_mm) / c.distance_mm;
      // A tool outside pushes the surface inwards. Where its nearest side lies the other way it has sunk in by more than half: without this
      // the surface would slip past it.
      const Vec3 normal = area / std::sqrt(square);
      out -= normal * (2 * std::max(0.0, dot(out, normal)));
      const Vec3 f = out * (stiffness(std::min({room(q[0]), room(q[1]), room(q[2])})) * (ball.radius_mm - c.distance_mm));
      const Vec3 w = c.point_mm - a;
      const double b1 = dot(cross(w, v), area) / square, b2 = dot(cross(u, w), area) / square;
      add(q[0], f * (1 - b1 - b2));
      add(q[1], f * b1);
      add(q[2], f * b2);
      on_tool -= f;
    }
  }
  return on_tool;
}

template <class Real>
void TissueDynamics<Real>::Impl::untie() {
  const auto still = points_inside(*obstacle.shape, model.rest(), ties);
  if (still.size() == ties.size()) return;
  for (const std::uint32_t p : ties) tied[p] = false;
  for (const std::uint32_t p : still) tied[p] = true;
  ties = still;
}

template <class Real>
void TissueDynamics<Real>::Impl::find_planes() {
  planes.clear();
  for (const std::uint32_t p : surface) {
    if (inverse_mass[p] == 0 || tied[p]) continue;
    const Vec3 here = at(p);
    Vec3 out;
    const double d = obstacle.shape->distance_mm(here, out);
    if (d < margin) planes.push_back({p, out, dot(out, here) - d});
  }
}

template <class Real>
Vec3 TissueDynamics<Real>::Impl::forces() {
  static const auto function = force_function<Real>();
  std::copy(lx.begin(), lx.end(), fx.begin());
  std::copy(ly.begin(), ly.end(), fy.begin());
  std::copy(lz.begin(), lz.end(), fz.begin());
  function(arrays);
  Vec3 on_tool{};
  met = 0;
  if (tool.shape) on_tool = push_by_tool();
  for (const Plane& q : planes) {
    // Not all of a great depth at once, and with half of critical damping: who comes out of bone is not thrown.
    const double deep = std::min(q.offset - dot(q.normal, at(q.point)), margin);
    if (!(deep > 0)) continue;
    const double k = std::min(obstacle.stiffness_n_per_mm, room(q.point));
    const Vec3 before{static_cast<double>(px[q.point]), static_cast<double>(py[q.point]), static_cast<double>(pz[q.point])};
    const double slows = dot(q.normal, at(q.point) - before) / dt * std::sqrt(mass[q.point] / k);
    push(q.point, std::max(0.0, deep - slows), q.normal);
  }
  for (const std::uint32_t p : ties) {
    if (inverse_mass[p] != 0) push(p, 1, model.rest()[p] - at(p));
  }
  for (const Slider& q : sliders) {
    for (std::size_t a = 0; a < 3; ++a) {
      if ((q.held >> a & 1) != 0) (a == 0 ? fx : a == 1 ? fy : fz)[q.point] = 0;
    }
  }
  return on_tool;
}

template <class Real>
Vec3 TissueDynamics<Real>::step(int steps) {
  Impl& m = *impl_;
  Vec3 on_tool{};
  for (int s = 0; s < steps; ++s) {
    if (++m.since_certified >= kCertifySteps) {
      m.since_certified = 0;
      m.certify_again();
    }
    if (m.tool.shape && m.tool_steps++ % kObstacleSteps == 0) m.find_near();
    if (m.obstacle.shape) {
      if (m.steps % kObstacleSteps == 0) m.find_planes();
      if (m.steps % kTieSteps == 0) m.untie();
      ++m.steps;
    }
    on_tool = m.forces();
    const Real a = static_cast<Real>(0.5 * m.options.damping_per_s * m.dt), keep = 1 - a, whole = 1 / (1 + a);
    const Real dt2 = static_cast<Real>(m.dt * m.dt);
    for (std::size_t p = 0; p < m.x.size(); ++p) {
      const Real w = dt2 * m.inverse_mass[p];
      const Real nx = (2 * m.x[p] - keep * m.px[p] + w * m.fx[p]) * whole, ny = (2 * m.y[p] - keep * m.py[p] + w * m.fy[p]) * whole,
                 nz = (2 * m.z[p] - keep * m.pz[p] + w * m.fz[p]) * whole;
      m.px[p] = m.x[p];
      m.py[p] = m.y[p];
      m.pz[p] = m.z[p];
      if (m.inverse_mass[p] == 0) continue;
      if (std::isfinite(nx + ny + nz)) {
        m.x[p] = nx;
        m.y[p] = ny;
        m.z[p] = nz;
      } else {
        ++m.counts.not_finite;
      }
    }
  }
  return on_tool;
}

template <class Real>
double TissueDynamics<Real>::step_s() const {
  return impl_->dt;
}
template <class Real>
int TissueDynamics<Real>::met_by_tool() const {
  return impl_->met;
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
double TissueDynamics<Real>::residual() const {
  Impl& m = *impl_;
  m.forces();
  double most = 0;
  for (std::size_t p = 0; p < m.x.size(); ++p) {
    if (m.inverse_mass[p] == 0) continue;
    most = std::max(most, std::hypot(static_cast<double>(m.fx[p]), static_cast<double>(m.fy[p]), static_cast<double>(m.fz[p])));
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
        Vec3{static_cast<double>(m.x[p] - m.px[p]), static_cast<double>(m.y[p] - m.py[p]), static_cast<double>(m.z[p] - m.pz[p])} / m.dt +
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
    sum += Vec3{static_cast<double>(m.x[p] - m.px[p]), static_cast<double>(m.y[p] - m.py[p]), static_cast<double>(m.z[p] - m.pz[p])} *
           (m.mass[p] / m.dt);
  }
  return sum;
}

template class TissueDynamics<float>;
template class TissueDynamics<double>;

}  // namespace osteo
