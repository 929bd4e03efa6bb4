// What a simulated trainee means to do: a window through bone to what the procedure's target regions surround, column
// by column.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "osteo/assessment/evidence/procedure.h"
#include "osteo/assessment/goal/goal.h"
#include "osteo/assessment/trainee/skill.h"
#include "osteo/simulation/bone/structure_map.h"
#include "osteo/simulation/bone/world.h"

namespace osteo::inline assessment {

/// A stroke of the hand: its places one after the other, of the burr's centre.
struct TraineeStroke {
  struct Point {
    Vec3 at_mm;  ///< as deep as it wants to come
    Vec3 axis;   ///< unit, from tip to handle
    double press_mm =
        0;  ///< so much deeper the burr may be pressed until that bone is gone: a layer's floor stops no hand
  };
  std::uint8_t tool = 0;  ///< index in instrument_library()
  bool drilling = true;   ///< presses; else it moves freely, the pedal up
  int layer = 0;          ///< strokes of a layer are repeated until no bone is seen in it
  std::vector<Point> points;
};

/// Where it drills, from the surface inwards in layers. Coarse layers with a large cutting burr stay clear of what the
/// procedure's instrument rules protect; fine ones go on with a small diamond to the margin that each structure's role
/// asks for.
struct WorkPlan {
  Vec3 centre_mm;        ///< middle of the window, at the bone's surface
  Vec3 toward;           ///< unit, from the bone to who drills
  double radius_mm = 0;  ///< of the window, for the burr's centre
  double open_mm = 0;    ///< of what of it is opened at the surface
  Vec3 shifted_mm;       ///< by how much it lies beside the best place, for want of skill
  bool steep = false;    ///< from stroke to stroke it goes by the outside: walls stand between
  std::vector<TraineeStroke> strokes;
  std::uint8_t coarse_tool = 0, fine_tool = 0;
};

struct WorkPlanOptions {
  double radius_mm = 4.5, most_depth_mm = 11, layer_mm = 3, fine_layer_mm = 0.8;
  double coarse_diameter_mm = 6, fine_diameter_mm = 4;
  std::optional<Vec3> toward;  ///< else from the directions that the procedure's items name
  bool goal = false;           ///< the whole of the procedure's goal cavity, not a window of radius_mm
};

/// With `options.goal`: the goal cavity, in layers at right angles to its direction; skill.region, undercut and
/// knowledge have no say. Else the window is put where its columns have the longest ways in target regions before they come too near to a
/// structure. Errors: usage where the procedure has no target region, none of its structures is in the map, no item
/// says from where, or no column reaches the target. Same arguments, same plan on any machine.
[[nodiscard]] WorkPlan plan_work(const World& world, const StructureMap& structures, const Procedure& procedure,
                                 const TraineeSkill& skill, std::uint64_t seed, const WorkPlanOptions& options = {});

}  // namespace osteo::inline assessment
