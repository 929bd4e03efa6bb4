// The goal of an operation on this patient's bone: what a procedure's rules say is to be removed, with its margins.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "osteo/assessment/goal/columns.h"
#include "osteo/core/base/context.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline assessment {

struct GoalOptions {
  double burr_mm = 4;          ///< diameter of the smallest burr that is to reach everywhere. 1 to 8
  double most_depth_mm = 28;   ///< below the bone's surface. 2 to 60
  double slope = 0.25;         ///< the cavity widens by so much for each mm upwards (saucerised). 0 to 1
  double pitch_mm = 0.5;       ///< of the columns. 0.25 to 2
  std::optional<Vec3> toward;  ///< else the best of 17 around the direction that the procedure's items name
};

/// Between the goal and a structure's face.
struct GoalMargin {
  std::string structure;
  double margin_mm = 0;  ///< the smallest; the map's reach where it is farther
  double asked_mm = 0;   ///< kept_mm of its role
};

/// A cavity that is open towards the surgeon: on a grid of columns along `toward` all that lies above a floor. Values
/// of columns are NaN where nothing is to be done.
struct GoalCavity {
  Vec3 toward, across, along;  ///< unit vectors; places are mm along them, from the world's origin
  double pitch_mm = 0, u0 = 0, v0 = 0, burr_mm = 0;
  int nu = 0, nv = 0;
  std::vector<double> top;     ///< the bone's surface, u fastest
  std::vector<double> bottom;  ///< lowest point of the burr there
  std::vector<double> safe;    ///< as deep as the burr might go without breaking a margin
  std::vector<double> floor;   ///< the cavity's: of all burrs around

  double bone_mm3 = 0;  ///< bone in it
  std::vector<GoalMargin> margins;
  std::vector<std::string> notes;  ///< what was left out and why, for people

  [[nodiscard]] std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(nu) + static_cast<std::size_t>(i);
  }
  [[nodiscard]] Vec3 place(double u, double v, double t) const { return across * u + along * v + toward * t; }
  /// Whether the place lies in the cavity. O(1).
  [[nodiscard]] bool has(Vec3 world_mm) const;
  /// 1 in the cavity, on the grid of the scene's bone.
  [[nodiscard]] Labels labels(const World& world) const;
};

/// Columns go down until a margin would be broken, and stay in the goal as far as they reach target regions; what lies
/// above is saucerised by `slope`. The margin between each structure and the goal is at least kept_mm of its role,
/// by construction. Errors: as Columns, and usage where no column reaches a target region. About 2 s for an ear; same
/// arguments, same bits.
[[nodiscard]] GoalCavity goal_cavity(const World& world, const StructureMap& structures, const Procedure& procedure,
                                     const GoalOptions& options = {}, const Context& context = {});

/// How bone that is gone compares with the goal.
struct GoalScore {
  double dice = 0;  ///< of bone removed and bone in the goal, mm3
  double done_mm3 = 0, left_mm3 = 0, beyond_mm3 = 0;
  double beyond_mm = 0;  ///< 95th percentile of how far bone removed beyond the goal lies from it, along `toward`
};
/// `before` and `after`: bone of the first body. Voxels count by the density that is gone.
[[nodiscard]] GoalScore score_against(const GoalCavity& goal, const BrickGrid& before, const BrickGrid& after);

}  // namespace osteo::inline assessment
