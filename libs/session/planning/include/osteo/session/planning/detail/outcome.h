// What came of a plan: where a CT after surgery shows each fragment and each cut, and how sure that is.
#pragma once
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/volume.h"
#include "osteo/geometry/mesh/soup.h"
#include "osteo/session/planning/detail/plan.h"

namespace osteo::inline session {

struct OutcomeParams {
  double min_drop_hu = 200;  ///< an edge of bone drops by at least this much
  double metal_hu = 2500;    ///< edges within 8 mm of what is brighter are left out
  double max_unsure_mm = 1;  ///< half-width of an interval from which on it is not known
  double max_unsure_deg = 2;
};

/// A number and the half-width of its 95 % interval.
struct Interval95 {
  double value = 0, half = 0;
  [[nodiscard]] bool holds(double truth) const { return truth >= value - half && truth <= value + half; }
};

/// Deviations are from the plan, in the axes of the plan's CT, with the reference fragment where it was.
struct FragmentOutcome {
  std::string name;
  bool known = false, reference = false;
  std::string why;                               ///< it is not known
  std::array<Interval95, 3> shift_mm, turn_deg;  ///< at `middle_mm`; rotation vector
  /// Unit: the surface slides in itself along it, as a shaft does, so the CT does not show the shift along it;
  /// `shift_mm` is then what lies across. Zero: there is no such direction.
  Vec3 slides_along;
  Vec3 middle_mm;      ///< of the fragment as planned
  double edge_mm = 0;  ///< root mean square of what edges are off along their normals
  double found = 0;    ///< share of places at which the CT shows an edge that fits
  RigidTransform postop_from_ct;
};

struct CutOutcome {
  std::string plane, fragment;
  bool known = false;
  std::string why;
  Interval95 off_mm;                   ///< of the face from the planned one, at its middle, towards the waste
  std::array<Interval95, 2> tilt_deg;  ///< by which it rises along two axes in the plane
  std::array<Vec3, 2> axes;            ///< these, in the CT of the bone: the face rises along them by the tilts
  std::array<double, 2> middle{};      ///< of the face, along the axes from the plane's place
  double angle_deg = 0;                ///< between both planes
  double seen = 0;                     ///< share of the face at which the CT shows it
};

/// How far the outline of what the plan moves lies from a target, with the reference where it was. Of the plan: the
/// surface of all fragments that it moves, along the shortest way to where the plan has that bone's surface. Of the
/// mirrored side, where segments of another bone lie between two planes: from places on its lower border, 2 mm apart,
/// across the axis of the segment that is planned there.
struct ContourOutcome {
  std::string against;  ///< "plan", "mirrored side"
  bool known = false;
  std::string why;
  Interval95 mean_mm, p95_mm;                      ///< of all places the mean, and what 95 % of them keep
  double planned_mean_mm = 0, planned_p95_mm = 0;  ///< what the plan has
};

/// A condyle of the jaw, where the surface before surgery shows one: the middle of the surface within 8 mm of the
/// hindmost and highest place of its side.
struct CondyleOutcome {
  std::string side;      ///< "left", "right": the patient's
  FragmentOutcome pose;  ///< of the fragment that it is a part of, by that one's name; `middle_mm`: the condyle's
};

/// A screw or an empty hole against the plan, relative to the fragment that it is in, in the CT of that one's bone.
struct ScrewOutcome {
  std::string name, fragment;
  bool empty = false;  ///< the plan has a hole without a screw
  bool found = true;   ///< false: the CT shows that nothing like it is near the planned place
  bool known = false;  ///< where it enters
  bool direction_known = false, tip_known = false;
  std::string why;                     ///< of the first of these that is not known
  std::string finding;                 ///< that it may be another one; empty: it lies near its place
  std::array<Interval95, 3> entry_mm;  ///< where its axis passes the planned entry, across the planned axis
  std::array<Interval95, 3> tip_mm;    ///< of the axis' end
  std::array<Interval95, 2> tilt_deg;  ///< of its axis, towards two directions across the planned one
  std::array<Vec3, 2> axes;            ///< these
  double angle_deg = 0;                ///< between both axes
  Vec3 slides_along;                   ///< as of its fragment: places along it are not known
  double seen = 0;                     ///< share of its surface that other metal leaves to be seen
};

/// A plate against a fragment: against the reference as the plan has it, against another where that one came to lie.
/// Each piece of a plate's surface is a plate: "NAME 1", "NAME 2".
struct PlateOutcome {
  std::string against;
  FragmentOutcome pose;  ///< its name is the plate's; `edge_mm` is not set
};

struct Outcome {
  std::vector<FragmentOutcome> fragments;  ///< as in the plan
  std::vector<CutOutcome> cuts;            ///< of each fragment each plane
  std::vector<ContourOutcome> contours;    ///< against the plan, against the mirrored side
  std::vector<CondyleOutcome> condyles;    ///< left, right
  std::vector<ScrewOutcome> screws;        ///< as in the plan
  std::vector<PlateOutcome> plates;        ///< of each plate the reference, and each fragment within 5 mm of it
};

/// `bones`: names as in the plan, and surfaces in the CT of the plan. The reference is the largest fragment that the
/// plan does not move; it is looked for within about 20 mm and 12 degrees of where the plan's CT has it, the others
/// within 4 mm and 8 degrees of where they should be.
///
/// A fragment is what lies behind its planes, in one piece with what is nearest to the first one. At 2000 places on its
/// outer surface, 2 mm and more from its cuts and 8 mm from metal, the CT is read along the normal; an edge
/// is where a smoothed profile drops most. Pose and a common offset (threshold, blur) by least squares, what does not
/// fit left out; where edges do not hold a fragment, it stays as planned. Cut faces the same way, along the plane's
/// normal: where the bone changes along it, the edge is corrected for the slope; where other bone begins within 2.4 mm
/// or it is brighter there than beside the bone's surface, it is left out. A face that lies upon another fragment shows
/// no edge, and then is not known. Intervals: errors of edges within 8 mm are alike, so each such patch is left out in
/// turn (J. MacKinnon, H. White, Journal of Econometrics 1985), with Student's quantile; of a cut face, patches of at
/// most 8 mm, as large as leaves eight of them. The pose's part is in that of the cuts.
///
/// Outlines: how far a place is off changes with each pose; intervals are of 1000 draws of the poses' errors.
///
/// A screw is looked for within 2.5 mm and 15 degrees of where the plan has it in its fragment, a plate within 3 mm and
/// 4 degrees of where the reference has it. Its blurred shape, over what lies beside it, is held against the voxels by
/// least squares: pose, brightness and blur, cut off where the CT is; sectors with other metal beside them are left
/// out. Two planned screws are never found in one. An empty hole is the same in dark. Intervals as above, with the
/// fragment's pose in them.
///
/// Errors: usage: a bone that is
/// missing, no fragment that stays; failed: the reference is not found. Same bytes for any number of threads.
[[nodiscard]] Outcome measure_outcome(const SurgicalPlan& plan,
                                      const std::vector<std::pair<std::string, TriangleSoup>>& bones,
                                      const Image& postop, const OutcomeParams& params, const Context& context = {});

}  // namespace osteo::inline session
