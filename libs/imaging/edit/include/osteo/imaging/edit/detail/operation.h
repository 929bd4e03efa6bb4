// What can be done to the bone mask and the structures of a case: plain values, one struct a kind, each field named
// once.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "osteo/core/base/param.h"
#include "osteo/core/data/vec.h"
#include "osteo/imaging/image/components.h"

namespace osteo::inline imaging {

/// at_risk: goes into the case, where coming near it is counted. landmark: a help for the eye that stays in the edits.
enum class StructureRole : int { at_risk, landmark };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(StructureRole) {
  return {"at_risk", "landmark"};
}

enum class IslandChoice : int { remove, keep };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(IslandChoice) {
  return {"remove", "keep"};
}

enum class BoxChoice : int { keep_inside, clear_inside };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(BoxChoice) {
  return {"keep_inside", "clear_inside"};
}

/// Bone is what lies between two HU values; what bone was before is forgotten.
struct ThresholdEdit {
  static constexpr std::string_view kName = "threshold";
  double lower_hu = 300, upper_hu = 32767;
  static void describe(ThresholdEdit& p, auto& visit) {
    visit({"lower_hu", "bone is at or above this value", "HU", -32768, 32767}, p.lower_hu);
    visit({"upper_hu", "and at or below this value", "HU", -32768, 32767}, p.upper_hu);
  }
};
/// The piece of bone (26 neighbours) with the voxel at a point: goes, or is all that stays.
struct IslandEdit {
  static constexpr std::string_view kName = "island";
  std::array<double, 3> at_mm{};
  IslandChoice choice = IslandChoice::remove;
  static void describe(IslandEdit& p, auto& visit) {
    visit({"at_mm", "a point in the piece, LPS", "mm", -1e6, 1e6}, p.at_mm);
    visit({"choice", "whether the piece goes or is all that stays"}, p.choice);
  }
};
/// Small pieces of bone go.
struct IslandSizeEdit {
  static constexpr std::string_view kName = "islands";
  double min_volume_mm3 = 10;
  int keep_largest = 0;
  static void describe(IslandSizeEdit& p, auto& visit) {
    visit({"min_volume_mm3", "smaller components go", "mm3", 0, 1e9}, p.min_volume_mm3);
    visit({"keep_largest", "only so many of the largest stay (0: all)", "", 0, 1000000}, p.keep_largest);
  }
};
/// Voxels whose centres lie in a box along the body's axes.
struct BoxEdit {
  static constexpr std::string_view kName = "box";
  std::array<double, 3> lo_mm{}, hi_mm{};
  BoxChoice choice = BoxChoice::clear_inside;
  static void describe(BoxEdit& p, auto& visit) {
    visit({"lo_mm", "lower corner, LPS", "mm", -1e6, 1e6}, p.lo_mm);
    visit({"hi_mm", "upper corner, LPS", "mm", -1e6, 1e6}, p.hi_mm);
    visit({"choice", "whether bone within the box stays or goes"}, p.choice);
  }
};
/// Cavities that bone encloses (6 neighbours) and that do not reach the edge of the volume become bone.
struct FillEdit {
  static constexpr std::string_view kName = "fill";
  double max_volume_mm3 = 50;
  static void describe(FillEdit& p, auto& visit) {
    visit({"max_volume_mm3", "larger cavities stay", "mm3", 0, 1e9}, p.max_volume_mm3);
  }
};
/// Each voxel becomes what most of its neighbourhood is, by binomial weights that reach floor(radius / spacing) voxels
/// along each axis, 5 at most: nothing changes that is farther than the radius, along an axis, from the surface as it
/// was. Walls thinner than that may go.
struct SmoothEdit {
  static constexpr std::string_view kName = "smooth";
  double radius_mm = 1;
  static void describe(SmoothEdit& p, auto& visit) {
    visit({"radius_mm", "how far from the surface, along an axis, anything may change", "mm", 0.05, 5}, p.radius_mm);
  }
};
/// A ball drawn from point to point: adds to bone or a structure, or takes from it.
struct BrushEdit {
  static constexpr std::string_view kName = "brush";
  int structure = 0;  ///< 0: bone
  bool erase = false;
  double radius_mm = 2;
  std::vector<Vec3> points_mm;  ///< LPS, at least one
  static void describe(BrushEdit& p, auto& visit) {
    visit({"structure", "value of the structure (0: bone)", "", 0, 255}, p.structure);
    visit({"erase", "takes away instead of adding; from a structure only what is that structure"}, p.erase);
    visit({"radius_mm", "radius of the ball", "mm", 0.05, 50}, p.radius_mm);
  }
};
/// Voxels of a structure that something else has found: a tube, a region, a label map of another program. They take the
/// place of what was there. The place for tools that add a structure: `voxels_of` makes it from a label map.
struct VoxelsEdit {
  static constexpr std::string_view kName = "voxels";
  int structure = 1;
  std::string runs;  ///< "skip length skip length ...", voxels in scan order of the CT's grid (x fastest)
  static void describe(VoxelsEdit& p, auto& visit) {
    visit({"structure", "value of the structure", "", 1, 255}, p.structure);
    visit({"runs", "skip and length of each run of voxels in scan order"}, p.runs);
  }
};
struct AddStructureEdit {
  static constexpr std::string_view kName = "add_structure";
  int structure = 1;
  std::string name;
  std::vector<int> rgb{255, 200, 60};
  StructureRole role = StructureRole::at_risk;
  // Of a structure that a program has found, as Structure has them; files leave out what is not known.
  std::string origin{}, doubt{};
  double within_mm = 0;  ///< below 0: within no distance that it could say
  static void describe(AddStructureEdit& p, auto& visit) {
    visit({"structure", "value of the structure, which no other has", "", 1, 255}, p.structure);
    visit({"name", "name, which no other has"}, p.name);
    visit({"rgb", "colour, three numbers from 0 to 255", "", 0, 255}, p.rgb);
    visit({"role", "at_risk goes into the case, landmark stays in the edits"}, p.role);
    visit({"origin", "what found it; empty: not known"}, p.origin);
    visit({"within_mm", "95 % of its boundary lie so near to where it was drawn; 0: not known, -1: of no distance",
           "mm", -1, 1000},
          p.within_mm);
    visit({"finding", "why it is not to be trusted here; empty: nothing is known against it"}, p.doubt);
  }
};
struct ChangeStructureEdit {
  static constexpr std::string_view kName = "change_structure";
  int structure = 1;
  std::string name;
  std::vector<int> rgb{255, 200, 60};
  StructureRole role = StructureRole::at_risk;
  static void describe(ChangeStructureEdit& p, auto& visit) {
    visit({"structure", "value of the structure", "", 1, 255}, p.structure);
    visit({"name", "name, which no other has"}, p.name);
    visit({"rgb", "colour, three numbers from 0 to 255", "", 0, 255}, p.rgb);
    visit({"role", "at_risk goes into the case, landmark stays in the edits"}, p.role);
  }
};
struct DeleteStructureEdit {
  static constexpr std::string_view kName = "delete_structure";
  int structure = 1;
  static void describe(DeleteStructureEdit& p, auto& visit) {
    visit({"structure", "value of the structure", "", 1, 255}, p.structure);
  }
};

using EditOperation = std::variant<ThresholdEdit, IslandEdit, IslandSizeEdit, BoxEdit, FillEdit, SmoothEdit, BrushEdit,
                                   VoxelsEdit, AddStructureEdit, ChangeStructureEdit, DeleteStructureEdit>;

/// As files call it: "threshold".
[[nodiscard]] std::string_view operation_name(const EditOperation& operation);
/// For people: "threshold from 300 HU", "eraser 4 mm".
[[nodiscard]] std::string operation_text(const EditOperation& operation);
/// References into the operation; what is no field (the points of a brush) is not among them.
[[nodiscard]] std::vector<FieldRef> operation_fields(EditOperation& operation);
/// Whether it changes bone; the others change structures only.
[[nodiscard]] bool changes_bone(const EditOperation& operation);
/// Error(usage) for values out of range: no points, corners in the wrong order, no name, no colour.
void require_valid(const EditOperation& operation);

}  // namespace osteo::inline imaging
