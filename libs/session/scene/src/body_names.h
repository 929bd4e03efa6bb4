// Which of several bodies a voxel's name in the stream belongs to. Private to libs/session/scene.
#pragma once
#include "osteo/simulation/bone/world.h"

namespace osteo::inline session {

/// `bodies`: a map from ids to what has a `body`. Null where the voxel belongs to none.
template <class Bodies>
auto* owner_of(Bodies& bodies, VoxelKey name) {
  const std::uint32_t brick = name / BrickGrid::kVoxels;
  for (auto& [id, f] : bodies) {
    if (brick >= f.body->first_brick && brick - f.body->first_brick < f.body->bone.brick_count()) return &f;
  }
  return decltype(&bodies.begin()->second)(nullptr);
}

/// Bricks that went from one body to another as they are: what is known of them went with them, and is not to be made
/// again.
class KnownBricks {
 public:
  void note(std::uint32_t body, const BrickGrid& whole, const PieceOrigin& origin) {
    auto& bricks = known_[body];
    bricks.resize(whole.brick_count());
    for (std::size_t b = 0; b < origin.brick.size(); ++b) {
      if (origin.unchanged[b] != 0) bricks[origin.brick[b]] = 1;
    }
  }
  [[nodiscard]] bool has(std::uint32_t body, std::uint32_t brick) const {
    const auto it = known_.find(body);
    return it != known_.end() && it->second[brick] != 0;
  }

 private:
  std::map<std::uint32_t, std::vector<std::uint8_t>> known_;
};

}  // namespace osteo::inline session
