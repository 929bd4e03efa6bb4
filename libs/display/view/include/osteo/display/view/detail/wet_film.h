// Where bone is wet, for its colours: the water of the dust's model as it was last looked at.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <unordered_set>

#include "osteo/simulation/bone/dust.h"

namespace osteo::inline display {

/// Keeps a byte a cell of bricks that hold water, in sixteenths of a film, so that what dries slowly changes its looks
/// seldom. Where there is no water it costs nothing. The dust and its bone must not change between update() and the
/// calls that follow it.
class WetFilm {
 public:
  /// Looks again; true where something is drier or wetter than it was. About 20 ns a wet cell.
  bool update(const Dust& dust);
  /// There is no dust and no water any more, and what was looked at last may be gone; true where something was wet.
  bool clear() { return take({}); }
  /// 0: dry, 1: a whole film or more, of the free cells around a place, linear between their middles. Just outside of
  /// the bone. 0.2 us.
  [[nodiscard]] double at(Vec3 world_mm) const;
  /// The last update() that was true changed something within a brick of dust of this place.
  [[nodiscard]] bool changed_near(Vec3 world_mm) const;
  [[nodiscard]] bool dry() const { return bricks_.empty(); }

 private:
  using Cells = std::array<std::uint8_t, BrickGrid::kVoxels>;
  using Bricks = std::unordered_map<std::uint64_t, std::unique_ptr<Cells>>;
  [[nodiscard]] static std::uint64_t key(int bi, int bj, int bk);
  bool take(Bricks now);
  Bricks bricks_;
  std::unordered_set<std::uint64_t> changed_;  // and those around them
  const BrickGrid* bone_ = nullptr;            // of the dust; gone with it, as the bricks are
  Frame frame_;                                // its, which clear() needs later
};

}  // namespace osteo::inline display
