// The fast model in time: explicit steps, vectorised, with a time step that is known to be stable.
#pragma once
#include <array>
#include <memory>
#include <span>
#include <vector>

#include "osteo/simulation/tissue/contact.h"
#include "osteo/simulation/tissue/detail/equilibrium.h"
#include "osteo/simulation/tissue/detail/tissue_model.h"

namespace osteo::inline simulation {

struct DynamicsOptions {
  double density_kg_m3 = 1000;
  double damping_per_s = 0;  ///< viscous: forces of -damping * mass * velocity; 0: energy is kept
  double step_share = 0.9;   ///< of the certified limit
  double least_step_s =
      0;  ///< a step may be this long at least: points are then made heavier until it is stable, which is counted
};

/// Verlet's method with implicit viscous damping (D. Morris 2006, section 5.4.1). The step is certified by Gershgorin's
/// bound on the highest frequency at rest, with a quarter more for stretch; what is stretched further is looked for
/// every hundred steps. Lumped masses. A place that is no number is not taken, and counted. `Real` float: the quick one;
/// double: the exact one, momentum kept to rounding. The same bits for any instruction set.
template <class Real>
class TissueDynamics {
 public:
  /// Errors: usage for a density not above 0, or a fixed point that is not there.
  TissueDynamics(const TissueModel& model, std::span<const std::uint32_t> fixed, const DynamicsOptions& options = {},
                 std::span<const Slider> sliders = {});
  ~TissueDynamics();

  void set_load(std::span<const std::pair<std::uint32_t, Vec3>> forces_n);
  /// Pushes, at each step, the surface's triangles where they are nearest to it (a shape without balls: points only),
  /// and points inside the body that it meets. Its stiffness is that of each triangle or point; where several tools are
  /// near, each has its part of what the step leaves room for. `number`: of several tools, from 0.
  void set_tool(RigidContact tool, std::size_t number = 0);
  /// Pushes points of the surface; where it is is looked up every tenth step, in between it is a plane for each point.
  /// Points that lie in it at rest may stay as deep.
  void set_obstacle(RigidContact obstacle);
  /// The next step looks where the obstacle is and what of it is gone, which it does every so many steps otherwise.
  void look_at_obstacle();
  void set_position(std::uint32_t point, Vec3 at_mm);
  /// Cuts off tetrahedra (their numbers in the model), without a restart: what they held goes, what they shared gets
  /// weaker. A point of which nothing is left stays where it is and meets nothing. O(constraints).
  void cut_off(std::span<const std::uint32_t> tets);
  /// Tetrahedra of parts that nothing holds: no fixed or sliding point, nothing tied to the obstacle. O(tets).
  [[nodiscard]] std::vector<std::uint32_t> loose() const;

  /// Returns the force on tool 0 in the last step, N.
  Vec3 step(int steps = 1);

  [[nodiscard]] double step_s() const;
  /// The force on a tool in the last step, N; none on one that is not there.
  [[nodiscard]] Vec3 force_on_tool_n(std::size_t number) const;
  /// Triangles and points that the tool met in the last step.
  [[nodiscard]] int met_by_tool(std::size_t number = 0) const;
  [[nodiscard]] std::vector<Vec3> positions_mm() const;
  [[nodiscard]] Vec3 position_mm(std::uint32_t point) const;
  [[nodiscard]] std::size_t point_count() const;
  /// Largest unbalanced force on a free point over the largest load (or 1 N): at rest when small and kinetic energy is
  /// too.
  [[nodiscard]] double residual() const;
  [[nodiscard]] double kinetic_mj() const;
  [[nodiscard]] double elastic_mj() const;
  [[nodiscard]] Vec3 momentum_n_s() const;

  struct Counts {
    std::uint64_t not_finite = 0;    ///< points put back where they were because their place was no number
    std::uint64_t made_heavier = 0;  ///< points, for least_step_s
    std::uint64_t stretched =
        0;  ///< points, at each check, that were moved as if heavier since what they belong to was stretched far
    std::uint64_t softened = 0;  ///< pushes of tool or obstacle that the step allowed less stiffness than asked for
  };
  [[nodiscard]] const Counts& counts() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteo::inline simulation
