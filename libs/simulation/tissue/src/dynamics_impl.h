// The inside of TissueDynamics: the body in its arrays (dynamics.cpp) and what it meets (dynamics_contact.cpp).
#pragma once
#include <algorithm>
#include <cmath>
#include <memory>

#include "cutter.h"
#include "dynamics_kernel.h"
#include "osteo/simulation/tissue/dynamics.h"

namespace osteo::inline simulation {

template <class Real>
struct TissueDynamics<Real>::Impl {
  TissueModel model;
  DynamicsOptions options;
  double dt = 0;
  // Now, by how much that is further than before, force. Not the place before: its difference would be rounded to the
  // place's last digit, which a float's short steps do not outweigh.
  std::vector<Real> x, y, z, dx, dy, dz, fx, fy, fz;
  std::vector<Real> inverse_mass;  // 1 / (N s2 / mm); 0: fixed
  std::vector<Real> lx, ly, lz;    // load
  std::vector<double> mass, edge_row;
  std::vector<bool> fixed;
  std::vector<Slider> sliders;
  std::vector<std::uint32_t> edge, face, voxel[2], tet;
  std::vector<Real> edge_k, edge_inverse, face_k, face_inverse, voxel_k[2], voxel_inverse[2], tet_k, tet_inverse;
  tissue::Arrays<Real> arrays;
  // Contact (dynamics_contact.cpp).
  RigidContact obstacle;
  std::vector<std::uint32_t> surface;  // points of the body's boundary
  std::vector<bool> tied;              // of all points: to its place in the obstacle
  std::vector<std::uint32_t> ties;     // those
  struct Plane {
    std::uint32_t point;
    Vec3 normal;
    double offset;  // pushes where normal . x < offset
  };
  std::vector<Plane> planes;
  // The tool meets the triangles of the surface where they are nearest to it, and points: all, so that one that is
  // inside is pushed out, too.
  std::vector<std::array<std::uint32_t, 3>> triangles;  // facing outwards
  std::vector<std::uint32_t> triangles_of;              // of each point: how many; 0 inside the body
  // Of a tool and a triangle, from when it was met until it has been left.
  struct Touch {
    bool on = false;      // met, and from outside
    Vec3 centre, normal;  // of the tool's bounds and the triangle when it was met
    double place[3]{};    // what sticks to the tool: where in the triangle,
    Vec3 held;            // and where from the middle of the tool's bounds
  };
  struct Tool {
    RigidContact contact;
    std::vector<RigidShape::Ball> balls;
    std::vector<std::uint32_t> near_triangles, near_points;  // those that it may reach before they are looked for again
    std::vector<Touch> touches;                              // one a triangle; empty: it meets none
    Vec3 force;                                              // on it
    int met = 0;
  };
  std::vector<Tool> tools;
  double crowd = 1;   // tools that may reach the body
  double margin = 0;  // nearer to the obstacle than this a point gets a plane
  std::uint64_t steps = 0, tool_steps = 0, since_certified = 0;
  std::unique_ptr<tissue::Cutter> cutter;  // once something was cut
  double load_size = 0;
  Counts counts;

  Impl(const TissueModel& m, const DynamicsOptions& o) : model(m), options(o) {}
  void lay_out();
  double certify();
  void certify_again();
  template <class At>
  void rows(bool edges, const At& place, std::vector<double>& row) const;
  void forces();
  // What the certified step leaves room for, of tool and obstacle each: with both omega dt stays below 2.
  [[nodiscard]] double room(std::uint32_t p) const {
    return 0.45 * (4 - 4 * options.step_share * options.step_share) * mass[p] / (dt * dt);
  }
  double stiffness(const RigidContact& by, double most);
  void add(std::uint32_t p, Vec3 f) {
    fx[p] += static_cast<Real>(f.x);
    fy[p] += static_cast<Real>(f.y);
    fz[p] += static_cast<Real>(f.z);
  }
  [[nodiscard]] Vec3 at(std::uint32_t p) const {
    return {static_cast<double>(x[p]), static_cast<double>(y[p]), static_cast<double>(z[p])};
  }
  // Half of critical damping, as a depth less: velocity along `out` times the root of m / k.
  [[nodiscard]] double slowed(std::uint32_t p, double k, Vec3 out) const {
    const Vec3 further{static_cast<double>(dx[p]), static_cast<double>(dy[p]), static_cast<double>(dz[p])};
    return dot(out, further) / dt * std::sqrt(mass[p] / k);
  }
  void find_planes();
  void lay_surface();
  [[nodiscard]] bool has_tool() const {
    return std::any_of(tools.begin(), tools.end(), [](const Tool& t) { return t.contact.shape != nullptr; });
  }
  void find_near();
  void find_near(Tool& tool);
  void push_by(Tool& tool);
  void push_triangle(Tool& tool, std::uint32_t triangle);
  // Each triangle of a point may push all of it, of each tool.
  [[nodiscard]] double tool_share(std::uint32_t p) const {
    return room(p) / std::max<double>(1, triangles_of[p]) / crowd;
  }
  void push_by_obstacle();
  // Points whose place in the obstacle is gone.
  void untie();
};

}  // namespace osteo::inline simulation
