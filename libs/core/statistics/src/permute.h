// Tests by exchanging labels inside blocks: one block for two groups of people, a block for each person where
// conditions repeat.
#pragma once
#include <vector>

#include "osteo/core/statistics/compare.h"

namespace osteo::statistics {

struct Block {
  std::vector<double> values;
  std::vector<int> labels;  ///< 1 or 0, both there
};
/// The mean over blocks of (mean of values labelled 1 - mean of those labelled 0), against what other labels would have
/// given.
[[nodiscard]] Permutation permute(const std::vector<Block>& blocks, const PermutationSettings& settings);

}  // namespace osteo::statistics
