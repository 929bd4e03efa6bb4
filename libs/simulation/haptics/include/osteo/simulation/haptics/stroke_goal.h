// Where a scripted hand wants to be at a time: what ScriptedDevice follows, for those that follow it otherwise.
#pragma once
#include <cstddef>

#include "osteo/simulation/haptics/device.h"

namespace osteo::inline simulation {

/// On the straight way between waypoints; behind the last, there with the pedal up. `leg`: 0 at the first call, kept
/// for the next, whose time is not earlier. O(1) from tick to tick.
[[nodiscard]] HandGoal goal_at(const Strokes& strokes, double t_s, std::size_t& leg) noexcept;

}  // namespace osteo::inline simulation
