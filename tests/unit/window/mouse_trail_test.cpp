// What a mouse did within one picture, however long that took.
#include "mouse_trail.h"

#include <gtest/gtest.h>

namespace osteo {
namespace {

TEST(MouseTrail, ADragWithinOnePictureIsADrag) {
  MouseTrail trail;
  trail.move(100, 100, 0);
  ASSERT_EQ(trail.take().size(), 1u);
  trail.move(110, 105, 0);
  trail.button(1, true, 0);
  trail.move(170, 125, 0);
  trail.move(175, 130, 0);
  trail.button(1, false, 0);
  trail.move(500, 300, 0);
  const std::vector<MouseSpell> all = trail.take();
  ASSERT_EQ(all.size(), 3u);
  EXPECT_FALSE(all[0].right);
  EXPECT_EQ(all[0].dx, 10);
  EXPECT_TRUE(all[1].right);
  EXPECT_EQ(all[1].dx, 65);
  EXPECT_EQ(all[1].dy, 25);
  EXPECT_EQ(all[1].x, 175);
  EXPECT_FALSE(all[2].right);
  EXPECT_EQ(all[2].dx, 325);
  EXPECT_EQ(all[2].y, 300);
  // Nothing since: what is now, and no motion.
  const std::vector<MouseSpell> rest = trail.take();
  ASSERT_EQ(rest.size(), 1u);
  EXPECT_EQ(rest[0].dx, 0);
  EXPECT_EQ(rest[0].x, 500);
}

TEST(MouseTrail, AClickIsWhereItWasAndAButtonHeldStaysDown) {
  MouseTrail trail;
  trail.move(40, 50, 0);
  trail.button(0, true, MouseTrail::kShift);
  trail.button(0, false, MouseTrail::kShift);
  trail.move(400, 90, 0);
  trail.button(0, true, 0);
  std::vector<MouseSpell> all = trail.take();
  ASSERT_EQ(all.size(), 3u);
  EXPECT_TRUE(all[0].clicked);
  EXPECT_TRUE(all[0].left);
  EXPECT_TRUE(all[0].shift);
  EXPECT_EQ(all[0].x - all[0].dx, 40);
  EXPECT_FALSE(all[1].clicked);
  EXPECT_FALSE(all[1].shift);
  EXPECT_EQ(all[1].dx, 360);
  EXPECT_TRUE(all[2].clicked);
  EXPECT_EQ(all[2].x, 400);
  // A click is told once; the button stays down. The mouse that comes from nowhere has gone no way.
  all = trail.take();
  ASSERT_EQ(all.size(), 1u);
  EXPECT_FALSE(all[0].clicked);
  EXPECT_TRUE(all[0].left);
  MouseTrail other;
  other.move(300, 300, 0);
  EXPECT_EQ(other.take()[0].dx, 0);
}

TEST(MouseTrail, TheWheelBelongsToTheModifiersThatWereDown) {
  MouseTrail trail;
  trail.wheel(1, MouseTrail::kShift);
  trail.wheel(1, MouseTrail::kShift);
  trail.wheel(-1, 0);
  trail.wheel(2, MouseTrail::kCtrl | MouseTrail::kAlt);
  trail.button(4, true, 0);  // no part of it, but its modifiers are
  const std::vector<MouseSpell> all = trail.take();
  ASSERT_EQ(all.size(), 4u);
  EXPECT_TRUE(all[0].shift);
  EXPECT_EQ(all[0].wheel, 2);
  EXPECT_FALSE(all[1].shift);
  EXPECT_EQ(all[1].wheel, -1);
  EXPECT_TRUE(all[2].ctrl);
  EXPECT_TRUE(all[2].alt);
  EXPECT_EQ(all[2].wheel, 2);
  EXPECT_FALSE(all[3].ctrl);
  EXPECT_FALSE(all[3].left || all[3].right || all[3].middle);
}

}  // namespace
}  // namespace osteo
