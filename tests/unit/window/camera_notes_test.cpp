// What a window tells its session of where one looks from.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "camera_notes.h"

namespace osteo {
namespace {

TEST(CameraNotes, ChangesAloneAndAtMostSixtyASecond) {
  CameraNotes notes;
  const int first = 0, second = 0;
  CameraView view{{1, 2, 3}, {0, 0, 0.5}, {0, 0, 1}, 30, 12.5, 6};
  const auto note = notes.next(view, 0, &first);
  ASSERT_TRUE(note);
  const auto j = nlohmann::json::parse(*note);
  EXPECT_EQ(j["eye_mm"], nlohmann::json({1, 2, 3}));
  EXPECT_EQ(j["target_mm"][2], 0.5);
  EXPECT_EQ(j["view_angle_deg"], 30);
  EXPECT_EQ(j["pixels_per_mm"], 12.5);
  EXPECT_EQ(j["magnification"], 6);
  EXPECT_FALSE(notes.next(view, 10, &first)) << "nothing changed";
  // A thousand pictures a second for a second.
  int told = 0;
  for (int n = 0; n < 1000; ++n) {
    view.eye_mm.x = n;
    told += notes.next(view, 20 + n / 1000.0, &first).has_value() ? 1 : 0;
  }
  EXPECT_LE(told, 61);
  EXPECT_GE(told, 50);
  EXPECT_TRUE(notes.next(view, 21.1, &first)) << "what came too soon is not forgotten";
  EXPECT_TRUE(notes.next(view, 21.1, &second)) << "a new session knows no view yet";
}

}  // namespace
}  // namespace osteo
