// A jaw rebuilt from straight segments of a donor bone: how many, how long, cut where, put where.
#pragma once
#include <array>
#include <optional>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/geometry/mesh/soup.h"
#include "osteo/session/planning/detail/plan.h"
#include "osteo/session/planning/detail/symmetry.h"

namespace osteo::inline session {

struct ReconstructionParams {
  ReconstructionTarget target = ReconstructionTarget::mirrored;
  std::array<double, 3> a_mm{}, a_normal{}, b_mm{}, b_normal{};  ///< resection planes; normals towards what is removed
  std::array<double, 3> down{0, 0, -1};                          ///< roughly, in the jaw's CT
  int max_segments = 4;
  double min_length_mm = 15;  ///< of the shortest line along a segment
  double max_contour_mm = 1;  ///< fewer segments are taken while the mean error is not above this
  double kerf_mm = 1;         ///< of each cut, of both bones
  double reserve_mm = 60;     ///< left at each end of the donor bone
};

struct DonorSegment {
  double length_mm = 0;    ///< along its axis
  double shortest_mm = 0;  ///< of the lines along it on its surface
  double from_mm = 0;      ///< where its axis starts, from the donor's upper end
};

struct Reconstruction {
  SurgicalPlan plan;  ///< bones "mandible" and "fibula"; planes "resection a", "resection b", "segment 1 start", ...
  std::optional<SymmetryPlane> symmetry;  ///< mirrored target only
  std::vector<Vec3> contour_mm;  ///< middle of the target's lower border, as high as the donor is thick; from a to b
  std::vector<Vec3> axis_mm;     ///< corners of the segments' axes, one more than there are segments
  std::vector<DonorSegment> segments;
  std::vector<double> contact;    ///< of each joint from a to b: common area over the smaller face
  std::vector<double> wedge_deg;  ///< angle between neighbouring axes, one less than there are segments
  double contour_mean_mm = 0, contour_max_mm = 0;  ///< from places 2 mm apart on the contour to the nearest axis
  double donor_used_mm = 0, donor_thickness_mm = 0;
};

/// The thickness by which `contour_mm` is taken: the diameter of the circle that has the area of the donor's section
/// halfway along.
[[nodiscard]] double donor_thickness_mm(const TriangleSoup& donor);

/// Follows the target's lower border from plane a to plane b by its sections, fits chains of one to `max_segments`
/// straight axes to it by least squares, cuts joints in the plane that halves the angle (so that both faces are alike),
/// and turns the donor about its axis, and moves the ends within the resection planes by up to 2.5 mm, where the joints
/// touch most. Segments follow one another along the donor with one kerf between where two cuts come nearest. Of the
/// chains that keep to `min_length_mm`, the shortest whose mean error is at most `max_contour_mm`; else the nearest,
/// with a warning, unless that is off by more than 5 mm.
///
/// Holes within a section (marrow) are not looked at: contact is of outlines. No vessel, skin, tooth or muscle is
/// considered. Surfaces must be closed and welded. Errors: usage: a direction without length, planes that do not bound
/// a part of the jaw; failed: as of find_symmetry_plane; no section where one is needed; no number of segments keeps
/// to the limits; the donor is too short. Same bytes for any number of threads. Seconds.
[[nodiscard]] Reconstruction reconstruct(const TriangleSoup& jaw, const TriangleSoup& donor,
                                         const ReconstructionParams& params, const Context& context = {});

}  // namespace osteo::inline session
