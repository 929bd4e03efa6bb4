// A screw or an empty hole in a CT: a cylinder of which axis, end, brightness and blur are looked for.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "osteo/session/planning/detail/plan.h"
#include "outcome_parts.h"

namespace osteo::inline session::outcome::rods {

struct Rod {
  Vec3 at;                             ///< on its axis, beside the planned entry; in the CT after surgery
  Mat3 axes;                           ///< the third runs from the entry to the tip
  double tip = 0, hu = 0, blur = 0.5;  ///< where it ends along the third
  [[nodiscard]] Vec3 local(Vec3 p) const { return transposed(axes) * (p - at); }
  [[nodiscard]] Vec3 world(Vec3 q) const { return at + axes * q; }
  // Shifted and tilted at `middle` along its axis.
  [[nodiscard]] Rod moved(double middle, double u, double v, double a, double b) const {
    Rod r = *this;
    const Vec3 pivot = world({u, v, middle}), w = normalized(axes * Vec3{a, b, 1});
    const Vec3 x = normalized(axes.column[0] - w * dot(axes.column[0], w));
    r.axes = {{x, cross(w, x), w}};
    r.at = pivot - w * middle;
    return r;
  }
};

struct RodFit {
  Rod rod;
  double middle = 0;                                     ///< along the axis; shifts and tilts are about it
  planning::Square<5> covariance{};                      ///< shift and tilt along the first two axes, tip
  double quantile = 0, seen = 0, shaft_mm = 0, off = 0;  ///< off: of the planned axis at the middle
  bool end_seen = true;
  bool plated = false;  ///< other metal goes out from its head
  /// What its tilt may be off by beyond what voxels show; radians.
  [[nodiscard]] double model_tilt(bool empty) const;
};

struct Wanted {
  const PlannedScrew* screw = nullptr;
  double length = 0, radius = 0;
  Rod planned;  ///< where its fragment has come to lie
};

/// Of one CT, which must stay.
class RodFinder {
 public:
  RodFinder(const planning::EdgeReader& ct, const Image& postop, const OutcomeParams& params);
  /// Nothing: `why`, and `there` is false where it is sure that the CT shows nothing like it. Metal of `taken` rods, of
  /// `taken_radius`, is that of others.
  [[nodiscard]] std::optional<RodFit> find(const Wanted& w, const std::vector<Rod>& taken, double taken_radius,
                                           std::string& why, bool& there) const;

 private:
  const planning::EdgeReader& ct_;
  const Image& postop_;
  double metal_, clip_;
};

}  // namespace osteo::inline session::outcome::rods
