// What the tables of tissue have in common.
#pragma once
#include <chrono>
#include <cmath>
#include <vector>

#include "block.h"
#include "osteo/simulation/tissue/calibrate.h"
#include "osteo/simulation/tissue/fem.h"

namespace osteo::bench {

inline double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Body {
  test::Block b;
  std::vector<std::uint32_t> fixed;
};

// A load on the points near a place, shared evenly.
inline void patch(const Body& body, Vec3 at, double radius, Vec3 total, TissueLoad& load) {
  std::vector<std::uint32_t> near;
  std::vector<bool> held(body.b.points.size());
  for (const std::uint32_t p : body.fixed) held[p] = true;
  for (std::uint32_t p = 0; p < body.b.points.size(); ++p) {
    if (!held[p] && length(body.b.points[p] - at) < radius) near.push_back(p);
  }
  for (const std::uint32_t p : near) load.forces_n.push_back({p, total / static_cast<double>(near.size())});
}

struct Truth {
  std::vector<Vec3> x;
  double seconds = 0;
  bool converged = false;
};

inline Truth solve_fem(const Body& body, const std::vector<Material>& materials, ElasticLaw law, TetOrder order,
                       const TissueLoad& load) {
  const double begin = now_s();
  const FemBody fem(body.b.points, body.b.tets, materials, law, order);
  EquilibriumSolver solver(fem, fem.rest(), fem.with_middles(body.fixed));
  const Equilibrium r = solver.solve(fem, fem.rest(), load.forces_n, {1e-10, 60, 1});
  Truth t;
  t.x.assign(r.points_mm.begin(), r.points_mm.begin() + static_cast<std::ptrdiff_t>(body.b.points.size()));
  t.seconds = now_s() - begin;
  t.converged = r.converged;
  return t;
}

inline double nrms_of(TissueModel& model, const Body& body, const TissueLoad& load, std::span<const Vec3> truth) {
  EquilibriumSolver solver(model, model.rest(), body.fixed);
  const Equilibrium r = solver.solve(model, model.rest(), load.forces_n);
  return r.converged ? calibration_error(model.rest(), r.points_mm, truth).nrms : NAN;
}

/// bench_tissue_fem.cpp: finite elements against analytic answers. bench_tissue_time.cpp: steps in time, resolution,
/// skins. bench_tissue_pressed.cpp: fewer steps than real time under a tool. bench_tissue_measured.cpp: calibration from
/// measured surfaces.
void tissue_elements();
void tissue_time();
void tissue_pressed();
void tissue_measured(const Context& context);

}  // namespace osteo::bench
