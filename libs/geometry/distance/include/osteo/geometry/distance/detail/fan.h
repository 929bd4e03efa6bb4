// A triangle that closes an opening.
#pragma once
#include "osteo/core/data/vec.h"

namespace osteo::inline geometry {

struct Fan {
  Vec3 a, b, c;
  int weight = 1;  ///< how often it counts
};

}  // namespace osteo::inline geometry
