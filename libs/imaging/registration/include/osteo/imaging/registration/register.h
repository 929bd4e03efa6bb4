// A second scan (CT after, CT of another day, MR) brought onto the case's, as a rigid body.
#pragma once
#include <array>
#include <string>
#include <string_view>

#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/data.h"
#include "osteo/core/data/rigid_transform.h"

namespace osteo::inline imaging {

/// mutual: mutual information of the values, for any two kinds of scan. surface: bone's surface onto bone's surface,
/// for two CTs.
enum class RegisterMethod : int { mutual, surface };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(RegisterMethod) {
  return {"mutual", "surface"};
}

struct RegisterParams {
  RegisterMethod method = RegisterMethod::mutual;
  double finest_mm = 1;
  double bone_hu = 300;
  double max_residual_mm = 0.6;
  bool accept_poor = false;
};

/// How well edges of both scans meet: at points on strong edges of the one, how far along its normal the like edge of
/// the other lies.
struct EdgeResidual {
  int points = 0;        ///< that lie inside both scans
  double found = 0;      ///< share of them at which the other scan has such an edge within 4 mm
  double median_mm = 0;  ///< of the distance, unsigned; points where none was found count as 4 mm
  double p90_mm = 0;
  double shift_mm = 0;  ///< median of the signed distance: above 0 the other scan's edges lie further out. Thresholds
                        ///< and blur, not motion
};

struct Registration {
  RigidTransform second_from_first;  ///< a point of the first scan, LPS mm, to where the same place is in the second
  EdgeResidual residual;
  bool mirror_tried =
      false;  ///< edges meet worse than those of one head do: the second scan was tried with left and right exchanged
  EdgeResidual mirror;       ///< what came of it
  bool sides_known = false;  ///< enough edges for both, and the two places are each other's mirror image
  double sides_mm = 0;  ///< of edges, place by place: what a smooth field that a mirror turns round explains of where
                        ///< they lie off, root mean square. Near 0 unless left and right are exchanged
  double mirror_sides_mm = 0;  ///< the same for the mirrored scan
  double overlap = 0;          ///< share of the smaller scan that lies inside the other
  double inverse_mm =
      0;  ///< farthest any corner of what both show moves by going there and back, back being found by itself
  double surface_mean_mm = 0;  ///< of bone's surfaces where both are seen; 0 where `method` is mutual
  double surface_p95_mm = 0;
  double surface_shape_mm =
      0;  ///< mean along the normals once boundary_shift_mm is taken off: what is left of difference in shape
  double boundary_shift_mm = 0;  ///< surface: second's bone is this much larger all round; not part of the transform
  double rotation_deg = 0, shift_mm = 0;  ///< of the transform, the shift at the first scan's centre
};

/// The rigid transform between two scans of one head that may lie anywhere to each other: turned by up to 40 degrees
/// and moved by up to 60 mm from where their files say, or from where their bodies' middles meet.
///
/// A search over turns and shifts on a coarse level, then the simplex method of Nelder and Mead on ever finer ones, by
/// normalized mutual information (C. Studholme et al., An overlap invariant entropy measure of 3D medical image
/// alignment, Pattern Recognition 1999). It needs no derivative, six unknowns are few, and it takes a fifth of the
/// time; Ceres solves least squares, which this is not. Where values of the two correlate by less than 0.8 (CT and MR),
/// edges are then brought upon edges along their normals, because a coil's shading pulls mutual information by some
/// tenths of a millimetre. With `surface` the last step is closest points on the exact triangle tree, along their
/// normals, the worst left out (Y. Chen, G. Medioni, Object modelling by registration of multiple range images, IVC
/// 1992; D. Chetverikov et al., The trimmed ICP algorithm, ICPR 2002), with one more unknown: how much larger the
/// second bone is all round, since thick slices and another kernel move a thresholded boundary.
///
/// Where half of all edges are more than 0.06 mm off, or a tenth more than 0.45 of the coarser scan's spacing (at least
/// 0.4 mm, at most 1.3 times `max_residual_mm`; that is a warning as well), the second scan is registered in a mirror
/// too, by `mutual`: that lowers the residual of a file with left and right exchanged, and of nothing else. Both are
/// then held against each other on voxels of 1 mm (of `finest_mm` where that is less, of the scans' where those are
/// more), and `residual` is of those. Whichever fits worse is started again from where the other lies. What decides
/// besides the residuals is where edges lie off (`sides_mm`). Where neither decides, a warning says that the two do not
/// show it. It takes as long again; more where a start is made anew.
///
/// Error(failed) that says why, unless `accept_poor`: a mirror that fits better, edges that do not meet to
/// `max_residual_mm` (another patient, the other side, not rigid), less than a quarter of the smaller scan inside the
/// other, too few edges, there and back not the same; surface: less than 2 cm3 of bone. Same bytes for any thread
/// count. Memory: both scans at `finest_mm` in single precision; with the mirror up to six of them, at 1 mm. 2 to 5 s
/// for heads, at least twice that with the mirror.
[[nodiscard]] Registration register_scans(const Image& first, const Image& second, const RegisterParams& params,
                                          const Context& context = {});

/// Where the edges of two scans meet under a transform. O(points).
[[nodiscard]] EdgeResidual edge_residual(const Image& first, const Image& second,
                                         const RigidTransform& second_from_first, const Context& context = {});

/// The second scan on the first's voxels: trilinear; where it has nothing, its least value (air).
[[nodiscard]] Image moved_onto(const Frame& first, const Image& second, const RigidTransform& second_from_first,
                               const Context& context = {});
/// Labels of the second scan on the first's voxels, each the label of the voxel its centre lies in. Names come along.
[[nodiscard]] Labels moved_onto(const Frame& first, const Labels& second, const RigidTransform& second_from_first,
                                const Context& context = {});

/// Three cuts through the first scan's middle in squares that show the one and the other in turn, each in its own grey
/// window.
[[nodiscard]] Picture checkerboard(const Image& first, const Image& second, const RigidTransform& second_from_first);

/// ITK's text file of a transform, LPS mm, as resampling uses it: from the first scan to the second. 3D Slicer reads it
/// and, put on the second scan, shows that one on the first.
[[nodiscard]] std::string itk_transform_text(const RigidTransform& second_from_first);

}  // namespace osteo::inline imaging
