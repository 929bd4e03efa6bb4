// What an action changed of a body's bone, kept until the stream has come to that action.
#pragma once
#include <cstdint>
#include <vector>

#include "osteo/simulation/bone/world.h"

namespace osteo::inline session {

/// The bricks of a body that differ since, and their values as they were when they were copied: 512 for each brick.
struct ChangedBricks {
  std::uint32_t body;
  std::vector<std::uint32_t> bricks;
  std::vector<float> values;
};
/// Of all bodies that an action changed, as the world has them now; at once in Reader::scene_changed(), before the
/// servo writes there.
[[nodiscard]] std::vector<ChangedBricks> changed_bricks(const World& world, const World::Effect& effect);

}  // namespace osteo::inline session
