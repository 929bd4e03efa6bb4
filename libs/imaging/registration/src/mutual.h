// Mutual information of two scans as a function of how they lie to each other, and its maximum.
#pragma once
#include "levels.h"

namespace osteo::inline imaging::registration {

struct Match {
  RigidTransform to_from;
  double score = 0;    // normalized mutual information, 1 (independent) to 2
  double overlap = 0;  // share of the sampled points that lie inside the other scan
};

/// From the coarsest levels, over turns and shifts around where the files put the scans and where their middles meet,
/// to the level at `stop` (0: the finest). Points are taken from `from`.
[[nodiscard]] Match search(const Levels& from, const Levels& to, std::size_t stop, const Context& context);

/// From a transform that is nearly right, on the levels from `start` to the finest.
[[nodiscard]] Match refine(const Levels& from, const Levels& to, const RigidTransform& guess, std::size_t start,
                           const Context& context);

/// Correlation of the values of both where they overlap: near 1 for two CTs, below for scans of other kinds.
[[nodiscard]] double likeness(const Levels& from, const Levels& to, const RigidTransform& to_from,
                              const Context& context);

}  // namespace osteo::inline imaging::registration
