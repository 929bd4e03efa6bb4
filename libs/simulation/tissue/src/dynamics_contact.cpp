// What pushes a body in time: tools and obstacles.
#include <algorithm>
#include <utility>

#include "body_parts.h"
#include "dynamics_impl.h"
#include "osteo/geometry/distance/triangle_tree.h"

namespace osteo::inline simulation {

using namespace tissue;

template <class Real>
void TissueDynamics<Real>::set_tool(RigidContact contact, std::size_t number) {
  Impl& m = *impl_;
  if (number >= m.tools.size()) m.tools.resize(number + 1);
  auto& tool = m.tools[number];
  tool.contact = std::move(contact);
  tool.balls = tool.contact.shape ? tool.contact.shape->balls() : std::vector<RigidShape::Ball>{};
  tool.force = {};
  tool.met = 0;
  if (!tool.contact.shape) tool.touches.clear();
  m.tool_steps = 0;
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
void TissueDynamics<Real>::look_at_obstacle() {
  impl_->steps = 0;
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
  for (Tool& tool : tools) tool.touches.clear();
}

template <class Real>
void TissueDynamics<Real>::Impl::find_near() {
  crowd = 0;
  for (Tool& tool : tools) {
    find_near(tool);
    if (!tool.near_points.empty() || !tool.near_triangles.empty()) ++crowd;
  }
  crowd = std::max(1.0, crowd);
}

template <class Real>
void TissueDynamics<Real>::Impl::find_near(Tool& tool) {
  tool.near_triangles.clear();
  tool.near_points.clear();
  if (!tool.contact.shape) return;
  const RigidShape::Ball ball = tool.contact.shape->bounds();
  // Triangles reach beyond their first point, and things move.
  const double reach = ball.radius_mm + 8 * margin;
  const auto close = [&](std::uint32_t p) {
    const Vec3 off = at(p) - ball.centre_mm;
    return dot(off, off) < reach * reach;
  };
  for (std::uint32_t p = 0; p < x.size(); ++p) {
    if (mass[p] > 0 && close(p) && !(cutter && cutter->tets_of_point(p) == 0)) tool.near_points.push_back(p);
  }
  for (std::uint32_t t = 0; t < triangles.size() && !tool.balls.empty(); ++t) {
    if (close(triangles[t][0])) {
      tool.near_triangles.push_back(t);
    } else if (!tool.touches.empty()) {
      tool.touches[t].on = false;
    }
  }
}

template <class Real>
void TissueDynamics<Real>::Impl::push_by(Tool& tool) {
  tool.force = {};
  tool.met = 0;
  if (!tool.contact.shape) return;
  for (const std::uint32_t p : tool.near_points) {
    Vec3 out;
    const double d = tool.contact.shape->distance_mm(at(p), out);
    if (!(d < 0) || (triangles_of[p] > 0 && !tool.balls.empty())) continue;
    ++tool.met;
    const Vec3 f = out * (stiffness(tool.contact, tool_share(p)) * -d);
    add(p, f);
    tool.force -= f;
  }
  for (const std::uint32_t t : tool.near_triangles) push_triangle(tool, t);
}

// A tool outside pushes the surface inwards. Where its nearest side lies the other way it has sunk in by more than
// half, and without this the surface would slip past it.
template <class Real>
void TissueDynamics<Real>::Impl::push_triangle(Tool& tool, std::uint32_t t) {
  const auto& q = triangles[t];
  const Vec3 a = at(q[0]), u = at(q[1]) - a, v = at(q[2]) - a, area = cross(u, v);
  const double square = dot(area, area);
  if (!(square > 0)) return;
  // The ball that it lies deepest in; one push a triangle.
  double deep = 0;
  const RigidShape::Ball* in = nullptr;
  Vec3 out, where;
  for (const RigidShape::Ball& ball : tool.balls) {
    const ClosestPoint c = closest_on_triangle(ball.centre_mm, a, a + u, a + v);
    if (!(ball.radius_mm - c.distance_mm > deep) || !(c.distance_mm > 0)) continue;
    deep = ball.radius_mm - c.distance_mm;
    in = &ball;
    out = (c.point_mm - ball.centre_mm) / c.distance_mm;
    where = c.point_mm;
  }
  if (in == nullptr) {
    if (!tool.touches.empty()) tool.touches[t].on = false;
    return;
  }
  ++tool.met;
  const Vec3 normal = area / std::sqrt(square);
  const double beyond = dot(out, normal);
  out -= normal * (2 * std::max(0.0, beyond));
  const Vec3 w = where - a;
  const double b1 = dot(cross(w, v), area) / square, b2 = dot(cross(u, w), area) / square;
  const double b[3] = {1 - b1 - b2, b1, b2};
  const double k = stiffness(tool.contact, std::min({tool_share(q[0]), tool_share(q[1]), tool_share(q[2])}));
  double slows = 0;
  for (std::size_t n = 0; n < 3; ++n) slows += b[n] * slowed(q[n], k, out);
  const double push = k * std::max(0.0, deep - slows);
  const Vec3 f = out * push;
  for (std::size_t n = 0; n < 3; ++n) add(q[n], f * b[n]);
  tool.force -= f;
  if (!(tool.contact.grip > 0)) return;
  if (tool.touches.size() != triangles.size()) tool.touches.assign(triangles.size(), {});
  Touch& touch = tool.touches[t];
  const Vec3 centre = tool.contact.shape->bounds().centre_mm;
  if (!touch.on) {
    if (beyond > 0) return;
    touch = {true, centre, normal, {b[0], b[1], b[2]}, where - centre};
    return;
  }
  const double dug = dot(touch.centre - centre, touch.normal) / in->radius_mm;
  const double grip = tool.contact.grip * std::clamp(2 * (dug - 1), 0.0, 1.0);
  Vec3 off = a + u * touch.place[1] + v * touch.place[2] - centre - touch.held;
  off -= out * dot(off, out);
  // Slides when it is held by more than that: what sticks from there on is what lies nearest now.
  const double pull = k * length(off), most = grip * push;
  if (pull > most) {
    off = off * (most / pull);
    touch.held = where - centre - off;
    for (std::size_t n = 0; n < 3; ++n) touch.place[n] = b[n];
  }
  if (!(most > 0)) return;
  const Vec3 g = off * -k;
  for (std::size_t n = 0; n < 3; ++n) add(q[n], g * touch.place[n]);
  tool.force -= g;
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

template void TissueDynamics<float>::set_tool(RigidContact, std::size_t);
template void TissueDynamics<double>::set_tool(RigidContact, std::size_t);
template void TissueDynamics<float>::set_obstacle(RigidContact);
template void TissueDynamics<double>::set_obstacle(RigidContact);
template void TissueDynamics<float>::look_at_obstacle();
template void TissueDynamics<double>::look_at_obstacle();
// What dynamics.cpp calls; not all of Impl, which one source alone may ask for.
template void TissueDynamics<float>::Impl::lay_surface();
template void TissueDynamics<float>::Impl::find_near();
template void TissueDynamics<float>::Impl::push_by(Tool&);
template void TissueDynamics<float>::Impl::find_planes();
template void TissueDynamics<float>::Impl::untie();
template void TissueDynamics<float>::Impl::push_by_obstacle();
template void TissueDynamics<double>::Impl::lay_surface();
template void TissueDynamics<double>::Impl::find_near();
template void TissueDynamics<double>::Impl::push_by(Tool&);
template void TissueDynamics<double>::Impl::find_planes();
template void TissueDynamics<double>::Impl::untie();
template void TissueDynamics<double>::Impl::push_by_obstacle();

}  // namespace osteo::inline simulation
