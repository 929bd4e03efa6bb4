#include "permute.h"

#include <algorithm>
#include <cmath>

#include "check.h"

namespace osteo::statistics {
namespace {

double difference(const Block& b, const std::vector<int>& labels) {
  double with = 0, without = 0, n = 0;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    (labels[i] != 0 ? with : without) += b.values[i];
    n += labels[i] != 0 ? 1 : 0;
  }
  return with / n - without / (static_cast<double>(labels.size()) - n);
}

// Each different way to share out the labels of a block, as the difference it gives.
std::vector<double> all_differences(const Block& b) {
  std::vector<int> labels = b.labels;
  std::sort(labels.begin(), labels.end());
  std::vector<double> found;
  do {
    found.push_back(difference(b, labels));
  } while (std::next_permutation(labels.begin(), labels.end()));
  return found;
}

double ways_of(const Block& b) {
  const auto k = static_cast<double>(std::count(b.labels.begin(), b.labels.end(), 1));
  double ways = 1;
  for (double i = 1; i <= k; ++i) ways *= (static_cast<double>(b.labels.size()) - k + i) / i;
  return std::round(ways);
}

}  // namespace

Permutation permute(const std::vector<Block>& blocks, const PermutationSettings& s) {
  if (s.draws < 100) refuse("a permutation test of fewer than 100 draws says nothing");
  Permutation r;
  if (blocks.empty()) return r;
  double ways = 1, observed = 0, size = 0;
  for (const Block& b : blocks) {
    ways *= ways_of(b);
    observed += difference(b, b.labels);
    for (const double v : b.values) size = std::max(size, std::abs(v));
  }
  const double n = static_cast<double>(blocks.size()), hair = 1e-12 * size * n;
  r.statistic = observed / n;
  r.exact = ways <= static_cast<double>(s.limit);
  r.smallest_p = std::min(1.0, 2 / ways);
  double below = 0, above = 0;
  const auto count = [&](double sum) {
    below += sum <= observed + hair ? 1 : 0;
    above += sum >= observed - hair ? 1 : 0;
    r.ways += 1;
  };
  if (r.exact) {
    std::vector<double> sums{0.0};
    for (const Block& b : blocks) {
      std::vector<double> next;
      const std::vector<double> own = all_differences(b);
      next.reserve(sums.size() * own.size());
      for (const double so_far : sums) {
        for (const double d : own) next.push_back(so_far + d);
      }
      sums = std::move(next);
    }
    for (const double sum : sums) count(sum);
  } else {
    Random random(s.seed);
    count(observed);
    std::vector<std::vector<int>> labels;
    for (const Block& b : blocks) labels.push_back(b.labels);
    for (int i = 0; i < s.draws; ++i) {
      double sum = 0;
      for (std::size_t k = 0; k < blocks.size(); ++k) {
        random.shuffle(labels[k]);
        sum += difference(blocks[k], labels[k]);
      }
      count(sum);
    }
    r.smallest_p = std::max(r.smallest_p, 2 / r.ways);
  }
  r.p = std::min(1.0, 2 * std::min(below, above) / r.ways);
  return r;
}

}  // namespace osteo::statistics
