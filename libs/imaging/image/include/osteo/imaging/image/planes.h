// Two-dimensional work on slices: outlines, filling, morphology, thumbnails, first alignment. OpenCV inside: G.
// Bradski, The OpenCV Library, Dr. Dobb's Journal 2000. Slices across the last two index axes are wrapped, not copied;
// across the first they must be.
//
// What is done in three dimensions elsewhere stays there: distances in mm (distance.h) are exact and know spacing,
// components (components.h) are of the whole body, and closing by `threshold` is a ball in mm. OpenCV has none of these
// for volumes.
#pragma once
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/data.h"

namespace osteo::inline imaging {

/// The slice at `index` across the index axis `axis` (2: as most scanners stack them). Columns run along the first of
/// the other axes.
struct SliceAt {
  int axis = 2;
  int index = 0;
};

/// A closed line in a slice, LPS mm; the last point joins the first.
struct Outline {
  std::vector<Vec3> points_mm;
  bool hole = false;    ///< it bounds a hole in what lies around
  double area_mm2 = 0;  ///< enclosed, holes not taken off
};

/// Where the values of a slice cross `level`, between pixels: cubic interpolation at four times the resolution, then
/// each point moved along the gradient onto the level. Off a circle's edge by 0.02 pixels on average. Outer lines
/// before their holes. Error(usage) for a slice that is not there. O(pixels).
[[nodiscard]] std::vector<Outline> outlines_of(const Image& image, SliceAt slice, double level);
/// The same of the voxels with `value` (0: with any but 0), whose edge is first blurred by 0.7 pixels: steps of pixels
/// do not show, corners are rounded and what is a single pixel wide may vanish.
[[nodiscard]] std::vector<Outline> outlines_of(const Labels& labels, SliceAt slice, std::uint8_t value = 0);

enum class Morphology : int { dilate, erode, open, close };
[[nodiscard]] constexpr std::array<std::string_view, 4> enum_names(Morphology) {
  return {"dilate", "erode", "open", "close"};
}
/// In each slice across `axis`, of the voxels with `value`; what it grows into must be background, what it leaves
/// becomes background. The radius is in mm along both axes of the slice. Beyond the border there is nothing.
[[nodiscard]] Labels morph_slices(const Labels& labels, std::uint8_t value, Morphology what, double radius_mm,
                                  int axis = 2, const Context& context = {});
/// Background that a slice's `value` encloses, up to `most_mm2` (0: any), becomes `value`.
[[nodiscard]] Labels fill_slices(const Labels& labels, std::uint8_t value, double most_mm2, int axis = 2,
                                 const Context& context = {});

/// A slice as a small picture, its longer edge `pixels` long, pixels square in mm, greys from `lo` to `hi`. Means over
/// areas: nothing aliases.
[[nodiscard]] Picture thumbnail(const Image& image, SliceAt slice, int pixels, double lo, double hi);

/// Values on a plane, rows from the top.
struct PlaneImage {
  int width = 0, height = 0;
  std::vector<float> values;
};
struct PlaneMatch {
  double dx = 0, dy = 0;  ///< a place of the first lies this much further right and down in the second, in pixels
  double angle_rad = 0;   ///< turned about the first's middle before it is moved
  double score = 0;       ///< phase: height of the peak; ECC: correlation. 0 where nothing was found
};
/// A shift alone, by phase correlation under a Hann window (C. Kuglin, D. Hines 1975). Both must have one size (Error
/// usage).
[[nodiscard]] PlaneMatch match_by_phase(const PlaneImage& first, const PlaneImage& second);
/// Turn and shift from a guess that is right to some pixels and 15 degrees, by enhanced correlation (G. Evangelidis, E.
/// Psarakis, IEEE TPAMI 2008). Score 0 where it does not settle.
[[nodiscard]] PlaneMatch match_by_correlation(const PlaneImage& first, const PlaneImage& second,
                                              const PlaneMatch& guess);

}  // namespace osteo::inline imaging
