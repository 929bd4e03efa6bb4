#include "osteo/core/base/union_find.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <numeric>
#include <random>
#include <vector>

namespace osteo {
namespace {

TEST(UnionFind, TheLeastNumberStandsForASetInAnyOrderOfJoining) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> links;
  std::mt19937 random(3);
  for (int n = 0; n < 900; ++n) links.emplace_back(random() % 1000, random() % 1000);
  // By spreading labels until nothing changes.
  std::vector<std::uint32_t> label(1000);
  std::iota(label.begin(), label.end(), 0U);
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& [a, b] : links) {
      const std::uint32_t least = std::min(label[a], label[b]);
      changed = changed || label[a] != label[b];
      label[a] = label[b] = least;
    }
  }
  for (int order = 0; order < 5; ++order) {
    std::shuffle(links.begin(), links.end(), random);
    std::vector<std::uint32_t> parent(1000);
    std::iota(parent.begin(), parent.end(), 0U);
    std::size_t sets = 1000;
    for (const auto& [a, b] : links) sets -= join_sets(parent, a, b) ? 1 : 0;
    for (std::uint32_t i = 0; i < 1000; ++i) ASSERT_EQ(root_of(parent, i), label[i]);
    std::size_t roots = 0;
    for (std::uint32_t i = 0; i < 1000; ++i) roots += label[i] == i ? 1 : 0;
    EXPECT_EQ(sets, roots);
  }
}

TEST(UnionFind, InMapsAndWhenCompiling) {
  std::map<int, int> parent{{-4, -4}, {7, 7}, {100, 100}};
  EXPECT_TRUE(join_sets(parent, 100, 7));
  EXPECT_FALSE(join_sets(parent, 7, 100));
  EXPECT_EQ(root_of(parent, 100), 7);
  EXPECT_EQ(root_of(parent, -4), -4);
  constexpr auto joined = [] {
    std::array<unsigned char, 4> p{0, 1, 2, 3};
    join_sets(p, static_cast<unsigned char>(3), static_cast<unsigned char>(1));
    return p;
  }();
  static_assert(joined[3] == 1 && joined[2] == 2);
}

}  // namespace
}  // namespace osteo
