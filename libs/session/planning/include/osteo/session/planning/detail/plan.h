// What is planned before surgery, as values: cut planes, fragments and where each fragment goes.
#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/data/rigid_transform.h"
#include "osteo/core/data/volume.h"
#include "osteo/geometry/mesh/soup.h"

namespace osteo::inline session {

namespace planning {
/// With so many decimals at most, for what people read.
[[nodiscard]] std::string rounded(double value, int decimals);
}  // namespace planning

/// A plane in which a bone is sawn, in LPS mm of that bone's CT. Names of bones are the plan's own ("mandible").
struct CutPlane {
  std::string name, bone;
  Vec3 at_mm;
  Vec3 normal;              ///< unit, to 1e-9
  double kerf_mm = 1;       ///< width of the saw's cut, removed on the side of `waste`
  bool waste_ahead = true;  ///< what the normal points to is discarded, and the kerf with it
  friend bool operator==(const CutPlane&, const CutPlane&) = default;
};

/// A part of a bone that keeps its shape: what lies behind (not on the waste side of) all planes named.
struct PlannedFragment {
  std::string name, bone;
  std::vector<std::string> planes;  ///< by name; of the same bone
  RigidTransform planned_from_ct;   ///< from where it lies in its CT to where it is wanted
};

/// A screw, or a hole that is drilled and left empty, in LPS mm of the CT of its fragment's bone.
struct PlannedScrew {
  std::string name, fragment;
  Vec3 entry_mm, tip_mm;  ///< of its axis: where the bone begins, and the end of the shaft or of the hole
  double diameter_mm = 2;
  bool empty = false;  ///< a hole without a screw
  friend bool operator==(const PlannedScrew&, const PlannedScrew&) = default;
};

/// Where the fragments are wanted, in the plan's CT. Not in the plan's file: a surface has a file of its own.
struct PlannedPlate {
  std::string name;
  TriangleSoup surface;  ///< closed
};

struct SurgicalPlan {
  std::vector<CutPlane> planes;
  std::vector<PlannedFragment> fragments;
  std::vector<PlannedScrew> screws;
  std::vector<PlannedPlate> plates;
  [[nodiscard]] const CutPlane& plane(std::string_view name) const;  ///< Error(usage) with the names there are
};

/// { "osteotome_surgical_plan": 1, "unit": "mm",
///   "planes": [ {"name": "a", "bone": "mandible", "at_mm": [x, y, z], "normal": [0, 0, 1], "kerf_mm": 1,
///                "waste_ahead": true} ],
///   "fragments": [ {"name": "segment 1", "bone": "fibula", "planes": ["b", "c"],
///                   "rotation_rows": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "shift_mm": [x, y, z]} ],
///   "screws": [ {"name": "1", "fragment": "segment 1", "entry_mm": [x, y, z], "tip_mm": [x, y, z],
///                "diameter_mm": 2, "empty": false} ] }
/// `screws` may be left out, and is where there are none.
/// Errors: usage, with file and line: another unit, unknown keys, ranges, a normal that is not of unit length, a
/// rotation that is not one (to 1e-9), two of one name, a plane that is not there or of another bone, a screw of no
/// fragment or of no length. `name`: the
/// file, as errors call it.
[[nodiscard]] SurgicalPlan plan_of(std::string_view text, const std::string& name);
/// What plan_of reads as the same, to the last bit. Errors as of plan_of, so that no plan is written that cannot be
/// read.
[[nodiscard]] std::string plan_json(const SurgicalPlan& plan);

/// A structure beside a planned cut, or in it.
struct StructureAtCut {
  std::string plane, structure;
  double nearest_mm = 0;  ///< from the kerf to the nearest voxel's face; 0: the saw meets it
  double cut_mm3 = 0;     ///< of it within the kerf
};
/// A structure in what is removed, and how much of it.
struct StructureRemoved {
  std::string structure;
  double mm3 = 0, share = 0;
};
struct PlannedHarm {
  std::vector<StructureAtCut> at_cuts;    ///< of each plane those within `within_mm`, the nearest first
  std::vector<StructureRemoved> removed;  ///< between the planes of the bone; the largest share first
};

/// What a plan does to the structures of the CT of one of its bones: nerves, teeth. A cut reaches as far as the circle
/// about the bone's section there. What is removed lies ahead of all planes of the bone, in it or within 3 mm of it,
/// and no farther from their middle than 1.5 times the farthest plane. By voxels: places are known to half of one.
/// Error(usage): no structure has a name; the bone is not in the plan. O(voxels).
[[nodiscard]] PlannedHarm harm_of(const SurgicalPlan& plan, std::string_view bone, const TriangleSoup& surface,
                                  const Labels& structures, double within_mm = 10);

}  // namespace osteo::inline session
