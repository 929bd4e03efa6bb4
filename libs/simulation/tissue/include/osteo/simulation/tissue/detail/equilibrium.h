// Where an elastic body comes to rest under a load.
#pragma once
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/simulation/tissue/contact.h"
#include "osteo/simulation/tissue/detail/energy.h"

namespace osteo::inline simulation {

/// A point that is held along some axes (bit 0: x, 1: y, 2: z) and slides along the others, as in a plane of symmetry.
struct Slider {
  std::uint32_t point = 0;
  std::uint8_t held = 0;
};

/// Dead loads on the points of a mesh, and what does not move. Forces in N.
struct TissueLoad {
  std::vector<std::pair<std::uint32_t, Vec3>> forces_n;
  std::vector<std::uint32_t> fixed;
  std::vector<Slider> sliders;
  /// Which of the forces really act in the middle of an edge (half of each is in forces_n at either end): what a force
  /// spread over faces is for quadratic tetrahedra. FemBody::on_all_points() moves them there.
  struct EdgeForce {
    std::array<std::uint32_t, 2> edge;
    Vec3 force_n;
  };
  std::vector<EdgeForce> edge_forces_n;
  /// Edges both of whose ends are held, the middle along these axes alone: ends that different places hold, with what
  /// is free between them. What is not here is held as both its ends are.
  struct EdgeHeld {
    std::array<std::uint32_t, 2> edge;
    std::uint8_t held = 0;  ///< axes, as of Slider
  };
  std::vector<EdgeHeld> edges_held;
  /// Points that are held along some axes at another place than at rest.
  struct Moved {
    std::uint32_t point = 0;
    std::uint8_t held = 0;  ///< axes, as of Slider
    Vec3 by_mm;             ///< along those
  };
  std::vector<Moved> moved;
  /// Rigid things that points of the body's surface are pushed out of.
  std::vector<RigidContact> contacts;
  /// Gravity whose weight is not among the forces: for inp_text(), which writes it as such. What solves rejects it.
  Vec3 gravity_m_s2{};
  /// Spreads a force over a tetrahedron as a body force (gravity) acts: a quarter a corner; of quadratic ones a fifth
  /// in the middle of each edge and less than nothing at the corners.
  void add_in_tet(const std::array<std::uint32_t, 4>& corners, Vec3 force_n);
  /// Spreads a force evenly over a triangle.
  void add_on_face(const std::array<std::uint32_t, 3>& corners, Vec3 force_n);
};

struct EquilibriumOptions {
  double tolerance = 1e-10;  ///< of the residual force, relative to the load (without load: to the first); rounding may
                             ///< end it sooner: below 1e-7, or when the next step would be a 10^13th of the body
  int iterations = 100;
  int load_steps = 1;  ///< the load grows in so many equal steps
};

struct Equilibrium {
  std::vector<Vec3> points_mm;
  bool converged = false;
  std::string why;  ///< not converged: what happened
  int iterations = 0, factorisations = 0;
  double residual = 0;        ///< relative, as for tolerance
  double energy_mj = 0;       ///< internal
  std::uint64_t shifted = 0;  ///< factorisations that needed a shift: the energy was not convex there
};

/// Errors: usage, when a part of the body could still move as a rigid body, with that part's first point; elements of
/// one point hold theirs.
void require_held(const Energy& energy, std::span<const Vec3> rest, std::span<const std::uint32_t> fixed,
                  std::span<const Slider> sliders);

/// Newton's method with exact Hessians: where Cholesky fails the diagonal is shifted until it does not; steps are
/// shortened until the energy falls (L. Armijo 1966). Each iteration's cost is a sparse factorisation (AMD order; from
/// 1,500 rows on CHOLMOD's supernodal one where the build has it: 17 times quicker at 25,000). Made once for a topology
/// and a set of fixed points; solves as often as asked. Deterministic.
class EquilibriumSolver {
 public:
  /// Errors: usage, when a part of the body could still move as a rigid body (elements of one point hold it too), or an
  /// index is out of range; `rest` decides that.
  EquilibriumSolver(const Energy& energy, std::span<const Vec3> rest, std::span<const std::uint32_t> fixed,
                    std::span<const Slider> sliders = {});
  EquilibriumSolver(const Energy& energy, std::span<const Vec3> rest, const TissueLoad& held);
  ~EquilibriumSolver();

  /// From `start`, which must have finite energy. `energy` may be another of the same topology than it was made for.
  Equilibrium solve(const Energy& energy, std::span<const Vec3> start,
                    std::span<const std::pair<std::uint32_t, Vec3>> forces_n, const EquilibriumOptions& options = {},
                    const Context& context = {});

  /// Right after solve(): answers `right` (one vector a point) of H x = right at the equilibrium, zero at fixed points.
  /// For sensitivities.
  void back_solve(std::span<const Vec3> right, std::span<Vec3> x);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteo::inline simulation
