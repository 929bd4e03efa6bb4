// Sets of numbers that grow together. The caller holds an array (or map) in which each number points to one nearer its
// set's root, at first to itself. The least number of a set is its root, so that what comes out does not depend on the
// order of joining. Almost O(1) a call.
#pragma once

namespace osteo {

/// The number that stands for i's set; halves the way there.
template <class Parents, class Index>
constexpr Index root_of(Parents& parent, Index i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

/// Makes one set of those of a and b. False when they were one already.
template <class Parents, class Index>
constexpr bool join_sets(Parents& parent, Index a, Index b) {
  a = root_of(parent, a);
  b = root_of(parent, b);
  if (a == b) return false;
  if (b < a) {
    parent[a] = b;
  } else {
    parent[b] = a;
  }
  return true;
}

}  // namespace osteo
