#include "osteo/simulation/heat/heat_field.h"

#include <gtest/gtest.h>

namespace osteo {
namespace {

// Minutes of dose a minute, as tables have them.
TEST(ThermalDose, MinutesAMinute) {
  for (const auto& [c, minutes] :
       {std::pair{38.9, 0.0}, {41.0, 1.0 / 16}, {43.0, 1.0}, {45.0, 4.0}, {47.0, 16.0}, {50.0, 128.0}, {55.0, 4096.0}})
    EXPECT_NEAR(cem43_per_s(c) * 60, minutes, 1e-9 * minutes) << c;
}

TEST(ThermalDose, FortySevenForAMinuteIsBonesLimit) {
  ThermalDose d;
  for (int n = 0; n < 600; ++n) d.stay(47, 0.1);
  EXPECT_NEAR(d.cem43_min, kBoneLimitCem43, 1e-9);
  EXPECT_EQ(d.peak_c, 47);
  EXPECT_FALSE(d.coagulated);
  d.stay(57, 0.001);
  EXPECT_TRUE(d.coagulated);
}

}  // namespace
}  // namespace osteo
