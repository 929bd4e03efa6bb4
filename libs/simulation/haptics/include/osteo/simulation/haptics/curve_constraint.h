// A force that keeps the hand on a curve.
#pragma once
#include <algorithm>

#include "osteo/geometry/mesh/curve.h"

namespace osteo::inline simulation {

struct CurveConstraintParams {
  double stiffness_n_per_mm = 0.5;
  double max_force_n = 3;    ///< the pull grows no further
  double arc_penalty = 0.3;  ///< mm of distance that a mm of arc counts as: 0 jumps to whatever branch is nearest, 1
                             ///< holds on to the place
  double engage_mm = 1e9;    ///< nearer than this the constraint takes hold
  double release_mm = 1e9;   ///< farther than this it lets go; >= engage_mm
};

/// A virtual spring to the place on the curve; the place moves along it with the hand and does not jump to other
/// branches that come near (D. Morris 2006, section 6.2, with its arc penalty per mm instead of per unit of the world).
/// For the haptic thread: no allocation, no locks, a microsecond or two.
class CurveConstraint {
 public:
  CurveConstraint(const Curve& curve, const CurveConstraintParams& params) : curve_(&curve), params_(params) {}

  struct Answer {
    bool engaged = false;
    CurvePoint place;
    Vec3 force_n;
  };
  Answer update(Vec3 device_mm) {
    const auto& p = params_;
    const CurvePoint c = engaged_ ? curve_->nearest_from(device_mm, arc_mm_, p.arc_penalty, segment_)
                                  : curve_->nearest(device_mm, segment_);
    engaged_ = c.distance_mm <= (engaged_ ? p.release_mm : p.engage_mm);
    segment_ = c.segment;
    arc_mm_ = c.arc_mm;
    Answer a{engaged_, c, {}};
    if (engaged_ && c.distance_mm > 0) {
      const double magnitude = std::min(p.stiffness_n_per_mm * c.distance_mm, p.max_force_n);
      a.force_n = (c.point_mm - device_mm) * (magnitude / c.distance_mm);
    }
    return a;
  }
  /// Forgets the place: the next update takes hold of whatever is nearest.
  void release() { engaged_ = false; }

 private:
  const Curve* curve_;
  CurveConstraintParams params_;
  bool engaged_ = false;
  std::uint32_t segment_ = 0;
  double arc_mm_ = 0;
};

}  // namespace osteo::inline simulation
