// A cutting guide to print: a block that fits the bone in one place and leads the saw in the planned planes.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/rigid_transform.h"
#include "osteo/geometry/mesh/soup.h"
#include "osteo/session/planning/detail/plan.h"

namespace osteo::inline session {

/// closed: a bridge at both ends of each slot. open: the saw can also come in from one end.
enum class GuideSlot : int { closed, open };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(GuideSlot) {
  return {"closed", "open"};
}

/// Where the guide lies when it is rehearsed with. rocked: as far as its play lets it turn each plane, held at its
/// middle.
enum class GuideSeat : int { planned, rocked };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(GuideSeat) {
  return {"planned", "rocked"};
}

struct CuttingGuideParams {
  std::string bone;                  ///< as the plan names it; empty: the plan's only one
  std::string planes;                ///< names, separated by commas; empty: all of the bone
  std::array<double, 3> approach{};  ///< from the bone to where the guide comes from; zero: chosen
  GuideSlot slot = GuideSlot::closed;
  double gap_mm = 0.1;                  ///< between guide and bone
  double play_mm = 0.1;                 ///< a slot is this much wider than the kerf
  double wall_mm = 6;                   ///< over the highest place of the bone, and of the bridges
  double margin_mm = 12;                ///< of the block beyond the outermost slots
  double depth_mm = 4;                  ///< how far the guide reaches down beside the highest place
  GuideSeat seat = GuideSeat::planned;  ///< of a rehearsal's; the solid is the same
  std::string code;                     ///< engraved
};

/// What one planned plane became.
struct GuideCut {
  std::string plane;
  bool two_sided = true;  ///< else one opening with the neighbour's: the face towards what stays leads the saw
  double width_mm = 0;    ///< between the faces of a two-sided slot; the least one of a shared opening
  double rock_mm = 0;     ///< most that the seated guide's play moves the plane at its place in the bone; 5 and more:
                          ///< the bone does not hold it
  double rock_deg = 0;    ///< most that it turns it; the same from 5 on
  /// Middle of the slot's faces in the plan's plane (half a kerf off the face that stays); from the bone out, as long
  /// as they are high at least; how long they are across. Of a shared opening: of the face that leads.
  Vec3 slot_at_mm, slot_up_mm;
  double slot_length_mm = 0;
  double play_deg = 0;  ///< that the slot's play lets the blade tilt in it; of a shared opening 0: the face leads
  /// Of the motions that the play allows, the one that turns the plane most of 16 directions.
  RigidTransform rocked;
};

struct PrintedGuide {
  TriangleSoup solid;          ///< closed, manifold, in the axes of the bone's CT
  Vec3 approach;               ///< unit; the guide is put on against it
  Vec3 along;                  ///< unit, at right angles to it: from the first plane to the last
  std::vector<GuideCut> cuts;  ///< in this order
  double min_gap_mm = 0;       ///< least distance of the underside to the bone, exact at its nodes and between
  double seat_mm2 = 0;         ///< of the underside that follows the bone
  double seat_off_mm = 0;      ///< most that the gap differs from the wanted one there
  double insertion_mm = 0;     ///< insertion_clearance_mm of it
  double length_mm = 0, width_mm = 0, height_mm = 0;
  bool engraved = false;
};

/// A block with a flat top (that is the side it is printed on) and an underside that is the bone's offset surface, as
/// it is seen from the approach: the height at which a guide that is let down would be `gap_mm` from the bone, by exact
/// distances to the triangles. So nothing catches on the way. Faces of slots lie in the planned planes: one half of
/// `play_mm` from the face that stays, or in it where two neighbours' slots would run into each other and share an
/// opening. Nodes are 0.3 mm apart, across the bone down to 0.075 mm where it is steep; where the surface between them
/// comes nearer to the bone than the gap less 0.01 mm, they are raised. Rocking: linear programmes over small motions
/// of the seated guide, which the exact gaps limit, those of its walls too; its middle is held down. Errors: usage: no
/// such bone or plane, an approach along the bone, a code of other characters than A to Z, 0 to 9 and '-'; failed: a
/// plane that misses the bone, planes too close, a wedge that closes towards the guide, bone in the way. Same bytes for
/// any number of threads.
[[nodiscard]] PrintedGuide make_cutting_guide(const TriangleSoup& bone, const SurgicalPlan& plan,
                                              const CuttingGuideParams& params, const Context& context = {});

/// The exact sweep: over all lines along `approach`, the least height of a place of the guide above one of the bone.
/// Not below zero: the guide can be put on along it. Touching triangles are clipped against each other in the plane
/// across; infinity where none lie over each other.
[[nodiscard]] double insertion_clearance_mm(const TriangleSoup& guide, const TriangleSoup& bone, Vec3 approach);

}  // namespace osteo::inline session
