// A hand that drills holes.
#pragma once
#include "osteo/session/recording/script.h"

namespace osteo::test {

/// Holes from above in what has its upper face at z = 4: one each second from 0.2 to 0.6 s of it, 4 mm apart from
/// `first_x` on, six in a row at most, down to `deep_z`.
inline Script holes(int count, double first_x, double deep_z) {
  Script s;
  s.axis = {0, 0.3, 0.95};
  s.waypoints.push_back({0, {first_x, 0, 8}, true});
  for (int n = 0; n < count; ++n) {
    const double x = first_x + 4.0 * (n % 6);
    s.waypoints.push_back({n + 0.1, {x, 0, 8}, true});
    s.waypoints.push_back({n + 0.2, {x, 0, 5.4}, true});
    s.waypoints.push_back({n + 0.6, {x + 1, 0.5, deep_z}, true});
    s.waypoints.push_back({n + 0.65, {x, 0, 8}, true});
  }
  s.waypoints.push_back({count + 0.0, {first_x, 0, 8}, false});
  return s;
}

}  // namespace osteo::test
