// Thin tubes in a CT: a nerve in its canal, a vessel full of contrast medium. From a few points on it to centre line,
// radius and mask.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline imaging {

/// nerve: soft tissue within bone (dark), also where it crosses air (bright). vessel: brighter than what is around it.
enum class TubeKind : int { nerve, vessel };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(TubeKind) {
  return {"nerve", "vessel"};
}

struct TubeParams {
  TubeKind kind = TubeKind::nerve;
  double max_radius_mm = 2.5;   ///< 0.2 to 5
  double lumen_hu = 40;         ///< what fills a nerve's canal; thin canals show less of it. Vessels: not used
  double snap_mm = 1;           ///< a given point may move this far to the nearest tube
  double max_uncertain_mm = 4;  ///< a longer stretch without walls and without a given point is an error
};

/// A place along the centre line.
struct TubeStation {
  Vec3 at_mm;
  double arc_mm = 0;      ///< from the first given point
  double radius_mm = 0;   ///< of the circle of equal area
  double confidence = 0;  ///< 0 to 1: the chance that the place lies within the nerve and the radius is right to half a
                          ///< millimetre; below 0.5 where fewer than half of the directions across it meet a wall
  double walls = 0;       ///< share of the directions across the tube in which its wall is met
};

struct Tube {
  std::vector<TubeStation> stations;  ///< every 0.25 mm
  double length_mm = 0, radius_mean_mm = 0, radius_min_mm = 0, radius_max_mm = 0;
  double confidence = 0;                         ///< mean along the line
  std::vector<std::array<double, 2>> unsure_mm;  ///< from, to along the line, where confidence is below one half
};

/// The cheapest way through `points_mm` (LPS, two or more, in order; within the CT), where a place costs little if
/// across some direction the CT curves like a tube of up to max_radius_mm: lines by the second derivatives at five
/// scales, the way by A*. Then the line is moved to the middle of the walls that 24 rays meet across it (edges half-way
/// up, circle by least squares), five times, smoothed over 0.4 mm. Where no walls are met a spline bridges, through the
/// given points: the CT shows nothing there. The radius is that of what is missing from the wall's level, which the
/// scanner's blur does not change, at most max_radius_mm, and where it is not sure that of the nearest place that is.
/// Confidence comes from walls, roundness, evenness along the line and the way's length by weights that were fitted on
/// nerves whose truth is known; docs/validation/structures.md has how often it is true. Vessels were not among them. O(volume
/// around the points). Errors: usage for fewer than two points or a point outside; failed when a stretch longer than
/// max_uncertain_mm has no walls, or three quarters of the line: the points are not joined by a tube. Y. Sato et al.,
/// Three-dimensional multi-scale line filter, Med. Image Anal. 1998; half-way edges: S. Prevrhal et al. 1999.
[[nodiscard]] Tube trace_tube(const Image& ct, std::span<const Vec3> points_mm, const TubeParams& params,
                              const Context& context = {});

/// Adds the tube to a label map (or makes one in `frame` when `onto` is null) as a new structure called `name`, or in
/// place of one of that name. A voxel belongs to it when its centre does, or the centre line goes through it: a tube
/// thinner than a voxel stays in one piece. Error(usage) when 255 structures are there already, or `onto` lies
/// elsewhere than `frame`.
[[nodiscard]] Labels draw_tube(const Tube& tube, const Frame& frame, const std::string& name,
                               const Labels* onto = nullptr);

}  // namespace osteo::inline imaging
