// What goes when tetrahedra are cut off.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "osteo/simulation/tissue/detail/tissue_model.h"

namespace osteo::inline simulation::tissue {

/// Keeps which tetrahedra are still there. An edge or face keeps the share of its stiffness that its tetrahedra still
/// there had of it; the volume of a voxel goes with its first tetrahedron.
class Cutter {
 public:
  explicit Cutter(const TissueModel& whole);
  /// Sets the stiffness of what changed in `model`; tetrahedra that are gone already are passed over. O(constraints
  /// near them).
  void cut(TissueModel& model, std::span<const std::uint32_t> tets);
  [[nodiscard]] bool there(std::uint32_t tet) const { return there_[tet]; }
  /// Tetrahedra of a point that are still there.
  [[nodiscard]] std::uint32_t tets_of_point(std::uint32_t point) const { return of_point_[point]; }

 private:
  std::vector<bool> there_;
  std::vector<std::uint32_t> of_point_;
  std::vector<std::uint32_t> first_, constraint_;  // of each tetrahedron: its constraints
  std::vector<std::uint32_t> had_, has_;           // of each constraint: tetrahedra
  std::vector<double> whole_;                      // stiffness
};

}  // namespace osteo::inline simulation::tissue
