#include "osteo/core/data/json_vec.h"

#include <gtest/gtest.h>

namespace osteo {
namespace {

TEST(JsonVec, ThreeNumbersComeBackAndNothingElseIsOne) {
  const Json there = json_of({1, -2.5, 0});
  EXPECT_EQ(there.dump(), "[1.0,-2.5,0.0]");
  const auto back = vec_of(&there);
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(length(*back - Vec3{1, -2.5, 0}), 0);
  EXPECT_FALSE(vec_of(nullptr).has_value());
  for (const char* const text : {"[1, 2]", "[1, 2, 3, 4]", "[1, 2, \"3\"]", "[1, 2, null]", "{}", "7"}) {
    const auto j = Json::parse(text);
    ASSERT_TRUE(j.has_value()) << text;
    EXPECT_FALSE(vec_of(&*j).has_value()) << text;
  }
}

}  // namespace
}  // namespace osteo
