// What a turning tool takes off soft tissue made of voxels.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "osteo/simulation/tissue/contact.h"
#include "osteo/simulation/tissue/detail/tissue_model.h"
#include "osteo/simulation/tissue/dynamics.h"

namespace osteo::inline simulation {

/// Whole voxels (five tetrahedra one after the other, as grid_tets makes them), by force and time as in bone: what the
/// tool is allowed adds up until a voxel's worth is there, and then the voxel whose corners lie deepest in the tool
/// goes. What comes loose goes with it. Same calls, same voxels. One thread.
class VoxelCutting {
 public:
  /// Guesses, no measured rates were found: a twentieth of a newton cuts some tens of mm3 a second, and no burr more
  /// than powered shavers do.
  static constexpr double kEasierThanBone = 200, kMaxMm3PerS = 100;
  /// So many voxels at most are saved up while the tool meets none.
  static constexpr double kMaxSaved = 8;
  /// Of a tool that removes `bone_mm3_per_s_per_n` of bone.
  [[nodiscard]] static double rate_mm3_per_s(double force_n, double bone_mm3_per_s_per_n);

  /// `model` must outlive it; all voxels are of `voxel_mm3`.
  VoxelCutting(const TissueModel& model, double voxel_mm3);

  /// The tool may take `mm3` more; `number`: of several, each with what it has saved. True when something was cut off
  /// `body`, whose tetrahedra are the model's. O(voxels), and O(constraints) when something goes.
  bool cut(TissueDynamics<float>& body, const RigidShape& tool, double mm3, std::size_t number = 0);

  [[nodiscard]] const std::vector<bool>& gone() const { return gone_; }  ///< one a tetrahedron
  [[nodiscard]] double cut_mm3() const { return cut_mm3_; }              ///< with what came loose

 private:
  void take(TissueDynamics<float>& body, std::span<const std::uint32_t> tets);

  const TissueModel& model_;
  double voxel_mm3_, cut_mm3_ = 0;
  std::vector<double> saved_mm3_;  // of each tool
  std::vector<bool> gone_;
};

}  // namespace osteo::inline simulation
