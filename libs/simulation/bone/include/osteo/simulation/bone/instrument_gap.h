// How near two instruments are to each other. They do not push each other: this is for telling and hearing that they
// touch.
#pragma once
#include "osteo/simulation/bone/instrument.h"

namespace osteo::inline simulation {

/// Where an instrument is: its tip's centre, and the unit vector along its handle.
struct InstrumentPlace {
  const Instrument* held = nullptr;
  Vec3 tip_mm, axis;
};

struct InstrumentGap {
  double gap_mm = 0;  ///< between the surfaces of heads and shafts; negative: so deep in each other
  Vec3 at_mm;         ///< midway between the nearest places
  bool first_head = true, other_head = true;  ///< which parts of the first and the other are nearest; false: the shaft
};
/// To a micrometre: of two round cones the distance is convex along an axis, so the least is found by halving. The
/// handpiece behind a burr's shaft is not looked at. 2 us; where they are more than 20 mm apart it may be any larger
/// number, in 0.1 us.
[[nodiscard]] InstrumentGap gap_between(const InstrumentPlace& first, const InstrumentPlace& other) noexcept;

}  // namespace osteo::inline simulation
