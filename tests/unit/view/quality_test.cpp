// Which level is chosen for which times.
#include "osteo/display/view/quality.h"

#include <gtest/gtest.h>

namespace osteo {
namespace {

constexpr double kPixels = 1e6;

void moving(QualityChoice& q, double ms, int times) {
  for (int n = 0; n < times; ++n) q.took(q.style(Motion::all), Motion::all, ms, kPixels);
}

TEST(Quality, WhatIsAskedForIsTaken) {
  EXPECT_FALSE(QualityChoice(Quality::plain).style(Motion::none).effects);
  EXPECT_TRUE(QualityChoice(Quality::calm).style(Motion::none).effects);
  EXPECT_FALSE(QualityChoice(Quality::calm).style(Motion::all).effects);
  EXPECT_TRUE(QualityChoice(Quality::deep).style(Motion::all).effects);
  QualityChoice q(Quality::plain);
  q.took({true, 1}, Motion::none, 1, kPixels);
  EXPECT_EQ(q.level(), Quality::plain);
  q.want(Quality::automatic);  // what was measured has stayed
  EXPECT_EQ(q.level(), Quality::deep);
}

TEST(Quality, SlowMovingPicturesGetFewerPixelsAndGetThemBack) {
  QualityChoice q;
  EXPECT_EQ(q.style(Motion::all).scale, 1);
  moving(q, 80, 2);
  EXPECT_EQ(q.style(Motion::all).scale, 1);  // one hitch is none
  moving(q, 80, 1);
  EXPECT_EQ(q.style(Motion::all).scale, 0.7);
  moving(q, 80, 3);
  EXPECT_EQ(q.style(Motion::all).scale, 0.5);
  moving(q, 300, 20);
  EXPECT_EQ(q.style(Motion::all).scale, 0.5);
  EXPECT_EQ(q.style(Motion::none).scale, 1);  // at rest always all
  // With so little to spare it stays, so that it does not go to and fro.
  moving(q, 30, 50);
  EXPECT_EQ(q.style(Motion::all).scale, 0.5);
  moving(q, 15, 7);
  EXPECT_EQ(q.style(Motion::all).scale, 0.5);
  moving(q, 15, 1);
  EXPECT_EQ(q.style(Motion::all).scale, 0.7);
  moving(q, 10, 8);
  EXPECT_EQ(q.style(Motion::all).scale, 1);
}

// Where only what changes is drawn again, all pixels are: the eye is there.
TEST(Quality, WhereLittleMovesNoPixelIsSaved) {
  QualityChoice q;
  moving(q, 80, 6);
  ASSERT_EQ(q.style(Motion::all).scale, 0.5);
  for (int n = 0; n < 20; ++n) q.took(q.style(Motion::little), Motion::little, 200, kPixels);
  EXPECT_EQ(q.style(Motion::little).scale, 1);
  for (int n = 0; n < 20; ++n) q.took(q.style(Motion::little), Motion::little, 2, kPixels);
  EXPECT_EQ(q.style(Motion::all).scale, 0.5) << "they tell nothing about a picture in which all moves";
}

// Whatever a picture costs for each pixel and besides, in the end one scale is kept.
TEST(Quality, DoesNotSwing) {
  for (double fixed = 0; fixed < 60; fixed += 7) {
    for (double full = 5; full < 200; full += 13) {
      QualityChoice q;
      int changes = 0;
      for (int n = 0; n < 200; ++n) {
        const double scale = q.style(Motion::all).scale;
        q.took(q.style(Motion::all), Motion::all, fixed + full * scale * scale, kPixels);
        if (n >= 40 && q.style(Motion::all).scale != scale) ++changes;
      }
      EXPECT_EQ(changes, 0) << fixed << " + " << full;
    }
  }
}

TEST(Quality, EffectsByWhatTheyCostAtRest) {
  QualityChoice q;
  EXPECT_EQ(q.level(), Quality::calm);
  q.took(q.style(Motion::none), Motion::none, 200, kPixels);
  EXPECT_EQ(q.level(), Quality::calm);
  q.took(q.style(Motion::none), Motion::none, 12, kPixels);
  EXPECT_EQ(q.level(), Quality::deep);
  moving(q, 30, 50);
  EXPECT_EQ(q.level(), Quality::deep);
  moving(q, 45, 8);
  EXPECT_EQ(q.level(), Quality::calm);
  q.took(q.style(Motion::none), Motion::none, 3000, kPixels);
  EXPECT_EQ(q.level(), Quality::plain);
  q.took(q.style(Motion::none), Motion::none, 90, kPixels);
  EXPECT_EQ(q.level(), Quality::plain);
  q.took(q.style(Motion::none), Motion::none, 90, kPixels / 2);  // a smaller window
  EXPECT_EQ(q.level(), Quality::calm);
  EXPECT_EQ(q.resting_ms(), 90);
}

}  // namespace
}  // namespace osteo
