// The fast model in long steps, for stiff bodies.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "osteo/simulation/tissue/contact.h"
#include "osteo/simulation/tissue/detail/equilibrium.h"
#include "osteo/simulation/tissue/detail/tissue_model.h"

namespace osteo::inline simulation {

struct ImplicitOptions {
  double density_kg_m3 = 1000;
  double damping_per_s = 0;  ///< viscous, besides what the method itself takes away
  double step_s = 0.01;      ///< any
  double tolerance = 1e-6;   ///< of each step's residual, relative to where it begins
  int iterations = 30;       ///< of Newton's method in a step
};

/// Backward Euler as a minimum of energy (m/2h^2 |x - x^|^2 + E(x), T. Gast et al., Optimization Integrator for Large
/// Time Steps, 2015), found by Newton's method with exact Hessians: stable for steps of any length, contact with tools
/// and obstacles in it, first order in time, and so more damped the longer the step. Each iteration costs a sparse
/// factorisation. In double precision, deterministic.
class ImplicitDynamics {
 public:
  /// Errors: usage for a density, or a step, not above 0; as of EquilibriumSolver, but parts may move freely.
  ImplicitDynamics(const TissueModel& model, std::span<const std::uint32_t> fixed, const ImplicitOptions& options = {},
                   std::span<const Slider> sliders = {});
  ~ImplicitDynamics();

  void set_load(std::span<const std::pair<std::uint32_t, Vec3>> forces_n);
  void set_tool(RigidContact tool);          ///< meets points only, all of them
  void set_obstacle(RigidContact obstacle);  ///< as of TissueDynamics
  void set_position(std::uint32_t point, Vec3 at_mm);
  void cut_off(std::span<const std::uint32_t> tets);  ///< as of TissueDynamics

  /// Returns the force on the tool at the end of the step, N.
  Vec3 step(int steps = 1);

  [[nodiscard]] double step_s() const;
  [[nodiscard]] const std::vector<Vec3>& positions_mm() const;
  [[nodiscard]] double residual() const;  ///< as of TissueDynamics
  [[nodiscard]] double kinetic_mj() const;
  [[nodiscard]] double elastic_mj() const;

  struct Counts {
    std::uint64_t iterations = 0;
    std::uint64_t unfinished = 0;  ///< steps that ended before their residual was small: the best found was taken
  };
  [[nodiscard]] const Counts& counts() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteo::inline simulation
