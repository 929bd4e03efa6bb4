// A triangle that closes an opening.
#pragma once
#include "osteo/data/vec.h"

namespace osteo {

struct Fan {
  Vec3 a, b, c;
  int weight = 1;  ///< how often it counts
};

}  // namespace osteo
