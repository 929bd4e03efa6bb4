#include "tool_touch.h"

#include <gtest/gtest.h>

namespace osteo {
namespace {

TEST(ToolTouch, IsToldOnceAndShownWhileItLasts) {
  TickRecord drill, sucker;
  drill.device.tool = static_cast<std::uint8_t>(instrument_index("cutting 4 mm"));
  sucker.device.tool = static_cast<std::uint8_t>(instrument_index("sucker 8 Fr"));
  sucker.hand = 1;
  drill.device.axis = sucker.device.axis = {0, 0, 1};
  ToolTouch touch;
  const auto look = [&](float x_mm, float z_mm = 0) {
    sucker.device.position_mm = {x_mm, 0, z_mm};
    const TickRecord hands[] = {drill, sucker};
    return touch.look(hands);
  };
  EXPECT_FALSE(look(8));
  EXPECT_FALSE(touch.at_mm());
  const auto reported = look(3);
  ASSERT_TRUE(reported);
  EXPECT_EQ(reported->text.shown, "the suction tube touches the drill");
  EXPECT_EQ(reported->note.find("{\"hands\":[0,1],\"tools\":[\"cutting 4 mm\",\"suction tube 8 Fr\"],\"at_mm\":["), 0U)
      << reported->note;
  ASSERT_TRUE(touch.at_mm());
  EXPECT_NEAR(touch.at_mm()->x, 1.83, 0.05);
  EXPECT_FALSE(look(3));  // once
  EXPECT_TRUE(touch.at_mm());
  EXPECT_FALSE(look(3.5F));  // a tremble
  EXPECT_FALSE(touch.at_mm());
  EXPECT_FALSE(look(3));
  EXPECT_FALSE(look(8));  // away and back
  const auto shaft = look(2, 8);
  ASSERT_TRUE(shaft);
  EXPECT_EQ(shaft->text.shown, "the suction tube touches the drill's shaft");
  drill.flags = kPlateInHand;
  EXPECT_FALSE(look(8));
  EXPECT_FALSE(look(3));
  const TickRecord alone[] = {drill};
  EXPECT_FALSE(touch.look(alone));
}

}  // namespace
}  // namespace osteo
