// The inner loops of the nearest point on a curve, once for each instruction set.
#pragma once
#include "osteo/geometry/mesh/curve.h"

namespace osteo::inline geometry {

struct Curve::Loops {
  /// Lower bounds of the score on sixteen segments: the distance to each, and the way to its nearer end.
  void (*leaf_bounds)(const Leaf& leaf, const float p[3], float arc, float penalty, float out[16]);
  /// The same in sixteen boxes.
  void (*bounds)(const Group& group, const float p[3], float arc, float penalty, float out[16]);

  static const Loops scalar, avx2, avx512;
  static const Loops& chosen();  // for simd()
};

}  // namespace osteo::inline geometry
