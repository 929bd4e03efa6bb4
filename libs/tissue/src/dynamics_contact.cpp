// What pushes a body in time: tools and obstacles.
#include <algorithm>

#include "body_parts.h"
#include "dynamics_impl.h"
#include "osteo/distance/triangle_tree.h"

namespace osteo {

using namespace tissue;

template <class Real>
void TissueDynamics<Real>::set_tool(RigidContact tool) {
  impl_->tool = std::move(tool);
  impl_->tool_steps = 0;
  impl_->tool_balls = impl_->tool.shape ? impl_->tool.shape->balls() : std::vector<RigidShape::Ball>{};
}

template <class Real>
void TissueDynamics<Real>::set_obstacle(RigidContact obstacle) {
  Impl& m = *impl_;
  m.obstacle = std::move(obstacle);
  m.planes.clear();
  m.ties.clear();
  m.tied.assign(m.x.size(), false);
  m.steps = 0;
  m.factorised.reset();
  if (!m.obstacle.shape) return;
  m.ties = points_inside(*m.obstacle.shape, m.model.rest(), m.surface);
  for (const std::uint32_t p : m.ties) m.tied[p] = true;
}

// What of a contact's stiffness the step has room for.
template <class Real>
double TissueDynamics<Real>::Impl::stiffness(const RigidContact& by, double most) {
  if (by.stiffness_n_per_mm > most) ++counts.softened;
  return std::min(by.stiffness_n_per_mm, most);
}

template <class Real>
void TissueDynamics<Real>::Impl::lay_surface() {
  triangles = boundary_triangles(model, cutter.get());
  triangles_of.assign(x.size(), 0);
  for (const auto& t : triangles) {
    for (const std::uint32_t p : t) ++triangles_of[p];
  }
  surface = points_of(triangles);
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
  // Each triangle of a point may push all of it.
  const auto share = [&](std::uint32_t p) { return room(p) / std::max<double>(1, triangles_of[p]); };
  for (const std::uint32_t p : near_points) {
    Vec3 out;
    const double d = tool.shape->distance_mm(at(p), out);
    if (!(d < 0) || (triangles_of[p] > 0 && !tool_balls.empty())) continue;
    ++met;
    const Vec3 f = out * (stiffness(tool, share(p)) * -d);
    add(p, f);
    on_tool -= f;
  }
  for (const std::uint32_t t : near_triangles) {
    const auto& q = triangles[t];
    const Vec3 a = at(q[0]), u = at(q[1]) - a, v = at(q[2]) - a, area = cross(u, v);
    const double square = dot(area, area);
    if (!(square > 0)) continue;
    // The ball that it lies deepest in; one push a triangle.
    double deep = 0;
    Vec3 out, where;
    for (const RigidShape::Ball& ball : tool_balls) {
      const ClosestPoint c = closest_on_triangle(ball.centre_mm, a, a + u, a + v);
      if (!(ball.radius_mm - c.distance_mm > deep) || !(c.distance_mm > 0)) continue;
      deep = ball.radius_mm - c.distance_mm;
      out = (c.point_mm - ball.centre_mm) / c.distance_mm;
      where = c.point_mm;
    }
    if (deep == 0) continue;
    ++met;
    // A tool outside pushes the surface inwards. Where its nearest side lies the other way it has sunk in by more than half: without this
    // the surface would slip past it.
    const Vec3 normal = area / std::sqrt(square);
    out -= normal * (2 * std::max(0.0, dot(out, normal)));
    const Vec3 w = where - a;
    const double b1 = dot(cross(w, v), area) / square, b2 = dot(cross(u, w), area) / square;
    const double b[3] = {1 - b1 - b2, b1, b2};
    const double k = stiffness(tool, std::min({share(q[0]), share(q[1]), share(q[2])}));
    double slows = 0;
    for (std::size_t n = 0; n < 3; ++n) slows += b[n] * slowed(q[n], k, out);
    const Vec3 f = out * (k * std::max(0.0, deep - slows));
    for (std::size_t n = 0; n < 3; ++n) add(q[n], f * b[n]);
    on_tool -= f;
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
void TissueDynamics<Real>::Impl::push_by_obstacle() {
  for (const Plane& q : planes) {
    // Not all of a great depth at once, and with half of critical damping: who comes out of bone is not thrown.
    const double deep = std::min(q.offset - dot(q.normal, at(q.point)), margin);
    if (!(deep > 0)) continue;
    const double k = stiffness(obstacle, room(q.point));
    add(q.point, q.normal * (k * std::max(0.0, deep - slowed(q.point, k, q.normal))));
  }
  for (const std::uint32_t p : ties) {
    if (inverse_mass[p] != 0) add(p, (model.rest()[p] - at(p)) * stiffness(obstacle, room(p)));
  }
}

template void TissueDynamics<float>::set_tool(RigidContact);
template void TissueDynamics<double>::set_tool(RigidContact);
template void TissueDynamics<float>::set_obstacle(RigidContact);
template void TissueDynamics<double>::set_obstacle(RigidContact);
template struct TissueDynamics<float>::Impl;
template struct TissueDynamics<double>::Impl;

}  // namespace osteo
