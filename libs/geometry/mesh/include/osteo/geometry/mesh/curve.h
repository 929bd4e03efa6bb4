// The nearest point of a sampled curve, also under a penalty on the way along it.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "osteo/core/data/vec.h"

namespace osteo::inline geometry {

struct CurvePoint {
  std::uint32_t segment = 0;  ///< between points segment and segment + 1
  double t = 0;               ///< 0 at the segment's start, 1 at its end
  double arc_mm = 0;          ///< way along the curve from its start
  double distance_mm = 0;
  double score_mm = 0;  ///< distance_mm + penalty * |arc_mm - where it was|
  Vec3 point_mm;
};

/// A polyline with a tree of boxes over runs of sixteen segments, which need no sorting as the curve has an order; a
/// box also knows its stretch of arc, so that the penalised minimum is found by branch and bound over all segments:
/// exact, where the k nearest sample points (D. Morris 2006, section 6.2) may all lie on another branch. The penalty is
/// per mm of arc, so it does not depend on units or on the curve's length. Immutable; any number of threads may ask;
/// asking never allocates. Memory about 60 bytes a point.
class Curve {
 public:
  Curve() = default;
  /// At least two points, finite (Error corrupt otherwise). Equal neighbours are allowed. O(n).
  explicit Curve(std::span<const Vec3> points_mm);

  /// The nearest point. `hint`: a segment probably near. O(log n) for hints that are.
  [[nodiscard]] CurvePoint nearest(Vec3 p, std::uint32_t hint = 0) const { return minimum(p, 0, 0, hint); }
  /// The minimum of |x - p| + penalty * |arc(x) - arc_mm| over all points x of the curve. penalty >= 0.
  [[nodiscard]] CurvePoint nearest_from(Vec3 p, double arc_mm, double penalty, std::uint32_t hint) const {
    return minimum(p, arc_mm, penalty, hint);
  }

  [[nodiscard]] double length_mm() const { return arcs_.empty() ? 0 : arcs_.back(); }
  [[nodiscard]] std::size_t point_count() const { return points_.size(); }
  [[nodiscard]] CurvePoint at_arc(double arc_mm) const;

 private:
  struct Group {  // sixteen boxes with their stretches of arc
    float lo[3][16], hi[3][16], arc_lo[16], arc_hi[16];
  };
  struct Loops;
  struct Leaf {  // sixteen segments: start, unit direction, length and arc, about the curve's centre
    float at[3][16], direction[3][16], length[16], arc[16];
  };
  [[nodiscard]] CurvePoint minimum(Vec3 p, double arc_mm, double penalty, std::uint32_t hint) const;
  [[nodiscard]] CurvePoint on_segment(std::uint32_t segment, Vec3 p, double arc_mm, double penalty) const;

  std::vector<Vec3> points_;
  std::vector<double> arcs_;
  std::vector<std::vector<Group>> levels_;  // level 0: a box is 16 segments
  std::vector<Leaf> leaves_;
  const Loops* loops_ = nullptr;
  Vec3 centre_;
  double rounding_ = 0, arc_rounding_ = 0;  // of single-precision bounds, mm
};

}  // namespace osteo::inline geometry
