// Mutual information of two scans as a function of how they lie to each other, and its maximum.
#pragma once
#include "levels.h"

namespace osteo::inline imaging::registration {

struct Match {
  RigidTransform to_from;
  double score = 0;    // normalized mutual information, 1 (independent) to 2
  double overlap = 0;  // share of the sampled points that lie inside the other scan
};

/// Turns and shifts around where the files put the scans, where their middles meet and where their shadows fit.
[[nodiscard]] std::vector<RigidTransform> anywhere(const Levels& from, const Levels& to, const Context& context);

/// How many of the best go on from one level to the next: so many times the usual number, `most` at the most.
struct SearchWidth {
  std::size_t times = 1, most = 1000;
};

/// The best of `starts` climb, from the coarsest levels to the level at `stop` (0: the finest). Points are taken from
/// `from`.
[[nodiscard]] Match search(const Levels& from, const Levels& to, const std::vector<RigidTransform>& starts,
                           const SearchWidth& width, std::size_t stop, const Context& context);

/// From a transform that is nearly right, on the levels from `start` to the finest.
[[nodiscard]] Match refine(const Levels& from, const Levels& to, const RigidTransform& guess, std::size_t start,
                           const Context& context);

/// Correlation of the values of both where they overlap: near 1 for two CTs, below for scans of other kinds.
[[nodiscard]] double likeness(const Levels& from, const Levels& to, const RigidTransform& to_from,
                              const Context& context);

}  // namespace osteo::inline imaging::registration
