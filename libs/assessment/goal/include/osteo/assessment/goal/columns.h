// How deep a burr may go straight down, column by column, before it comes too near to what a procedure protects.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "osteo/assessment/evidence/procedure.h"
#include "osteo/simulation/bone/structure_map.h"
#include "osteo/simulation/bone/world.h"

namespace osteo::inline assessment {

/// Margin between a structure's face and the burr, mm: 0.4 where it is to be exposed, 1.2 where its wall is to be
/// thinned, 1 else; none for what is to be opened.
[[nodiscard]] double kept_mm(ProcedureRole role);

/// From the bone to who drills, unit: the mean of the directions that the procedure's items name. Error(usage) where no
/// item of kind no_overhang or exposed has one.
[[nodiscard]] Vec3 toward_of(const Procedure& procedure);

/// A burr that goes straight down: by the depth of its lowest point, mm along `toward`.
struct Column {
  double top = 0;  ///< the bone's surface
  bool bone = false;
  double safe = 0;               ///< as deep as it may
  std::optional<double> target;  ///< as deep as a target region goes, above what is not safe
  double in_target_mm = 0;       ///< of the way, with the burr in a target region
};

/// Coordinates u, v across and t along `toward`, mm from the world's origin. Bone and structures must outlive it. Not
/// for several threads at once. A column costs a clearance of all structures each 0.25 mm of its depth.
class Columns {
 public:
  /// Error(usage) where the procedure has no target region, or the case none of their structures. `by_tip`: a target
  /// region is reached by the burr's lowest point, so that nothing below it is wanted; else by any part of the burr.
  Columns(const World& world, const StructureMap& structures, const Procedure& procedure, Vec3 toward,
          double most_depth_mm, bool by_tip = false);
  [[nodiscard]] Vec3 place(double u, double v, double t) const { return across_ * u + along_ * v + toward_ * t; }
  [[nodiscard]] Vec3 across() const { return across_; }
  [[nodiscard]] Vec3 along() const { return along_; }
  /// Around the structures of the target regions, in u, v, t.
  [[nodiscard]] const BoxMm& flat() const { return flat_; }
  /// `belief`: by how much it thinks structures deeper. `ruled`: it keeps out of where only other instruments are
  /// allowed.
  [[nodiscard]] Column column(double u, double v, double radius, double belief, bool ruled) const;

 private:
  const BrickGrid& bone_;
  const StructureMap& structures_;
  Vec3 toward_, across_, along_;
  double most_depth_, above_ = 0;
  bool by_tip_;
  std::vector<ProcedureRole> role_;
  std::vector<double> within_, ruled_;  // by number of structure
  mutable std::vector<double> each_;
  BoxMm flat_;
};

}  // namespace osteo::inline assessment
