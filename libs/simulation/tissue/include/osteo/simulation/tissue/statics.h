// A body of finite elements under all that a load can hold: forces, prescribed movements, contact with rigid things.
#pragma once
#include "osteo/simulation/tissue/fem.h"

namespace osteo::inline simulation {

struct Statics : Equilibrium {
  Vec3 reaction_n;             ///< on what is held or moved: what holds it exerts
  Vec3 contact_n;              ///< of rigid things on the body
  std::uint64_t touching = 0;  ///< points in contact
};

/// Where `body` comes to rest under `load`, as FemBody::on_all_points() makes it. Movements are prescribed to the full;
/// where the law has no finite energy there, they and the forces grow in 4, 16 and 64 steps. A rigid thing pushes each
/// point of the body's surface (of quadratic elements in the middle of edges too) out along its shortest way by its
/// stiffness times the depth: the depth that is left is the force over the stiffness. A body that contact alone holds
/// can still move freely. Errors: as of EquilibriumSolver.
[[nodiscard]] Statics statics(const FemBody& body, const TissueLoad& load, const EquilibriumOptions& options = {},
                              const Context& context = {});

}  // namespace osteo::inline simulation
