// Plates and distractors that are fixed to bone.
#pragma once
#include <string>
#include <vector>

#include "osteo/core/data/tri_mesh.h"
#include "osteo/simulation/bone/world.h"

namespace osteo::inline simulation {

/// A plate in a frame of its own: x along it, z away from the bone, its underside at z = 0, the origin in its middle
/// (of a distractor: where the two feet meet).
struct PlateModel {
  std::string name;
  std::string about;           ///< what it stands for, with its dimensions
  TriMesh mesh;                ///< closed; of a distractor the part that stays
  TriMesh moving;              ///< of a distractor: what goes with the second piece, along x; else empty
  std::vector<Vec3> holes_mm;  ///< middles of the screw holes, at the underside; those with x > 0 of a distractor move
  double thickness_mm = 0;
  double screw_mm = 0;         ///< diameter of its screws
  double most_opening_mm = 0;  ///< 0: no distractor
};

/// Made when first asked for, 0.1 s. Generated shapes with dimensions as they are usual for such plates; none copies a
/// product.
[[nodiscard]] const std::vector<PlateModel>& plate_library();
/// Index in the library. Error(usage) that lists the names.
[[nodiscard]] int plate_index(const std::string& name);

/// Points spread evenly over a plate's surface, each with the area it stands for, moved outwards a little: plates are
/// thin next to voxels (D. Morris 2006, section 3.2.5).
struct PlateSample {
  Vec3 at_mm, outwards;
  double area_mm2;
};
/// About `count` points, the same ones for the same arguments. With `moving` those of the part that moves, at opening
/// 0.
[[nodiscard]] std::vector<PlateSample> sample_plate(const PlateModel& plate, int count, double extrude_mm,
                                                    bool moving = false);

// -- How a plate lies on bone.

/// Points of a plate's underside, in its own frame, and how far below each the bone begins, towards the bone; negative
/// where the plate is in bone; `reach_mm` where none is met within that.
struct PlateGap {
  Vec3 at_mm;
  double gap_mm;
  std::uint32_t body;  ///< SceneAction::kNobody where none is met
};
/// Measured along the screws (-z of the plate) to half density, crossings interpolated: within a tenth of a voxel of
/// smooth bone. 1 us a point. A distractor's moving foot stands at `opening_mm`.
[[nodiscard]] std::vector<PlateGap> plate_gaps(const World& world, const PlateModel& plate,
                                               const RigidTransform& world_from_plate, double opening_mm = 0,
                                               int count = 400, double reach_mm = 5);

/// The pieces that a plate would be fixed to: those below most of its underside within `near_mm`, at most two, of a
/// distractor one a foot; the first is the one that the plate stays with. Empty: it is nowhere near bone.
[[nodiscard]] std::vector<std::uint32_t> bodies_under(const World& world, const PlateModel& plate,
                                                      const RigidTransform& world_from_plate, double near_mm = 2);

}  // namespace osteo::inline simulation
