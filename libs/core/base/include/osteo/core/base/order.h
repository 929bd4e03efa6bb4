// The value at a place in the order of many, without sorting them all. Where values are interpolated, as statistics of
// people want it, that is statistics::quantile.
#pragma once
#include <algorithm>
#include <cstddef>
#include <vector>

namespace osteo {

/// The middle one; of an even number the upper of the two. 0 of none. No NaN may be among them. O(n).
template <class T>
[[nodiscard]] T upper_median(std::vector<T> values) {
  if (values.empty()) return T{};
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// The one below which `share` (0 to 1) of the others lie, rounded down to one of them: 0 is the least, 1 the most.
/// 0 of none. No NaN may be among them. O(n).
template <class T>
[[nodiscard]] T value_at_share(std::vector<T> values, double share) {
  if (values.empty()) return T{};
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace osteo
