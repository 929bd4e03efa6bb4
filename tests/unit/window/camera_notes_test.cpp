// What a window tells its session of where one looks from.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "camera_notes.h"
#include "osteo/simulation/camera/microscope.h"

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
  int reported = 0;
  for (int n = 0; n < 1000; ++n) {
    view.eye_mm.x = n;
    reported += notes.next(view, 20 + n / 1000.0, &first).has_value() ? 1 : 0;
  }
  EXPECT_LE(reported, 61);
  EXPECT_GE(reported, 50);
  EXPECT_TRUE(notes.next(view, 21.1, &first)) << "what came too soon is not forgotten";
  EXPECT_TRUE(notes.next(view, 21.1, &second)) << "a new session knows no view yet";
}

TEST(CameraNotes, AreReadBackAsTheViewTheyTellOf) {
  ScopeView view = overview({1, 2, 3}, 20, normalized({1, -0.5, 0.3}));
  roll(view, 0.4);
  magnify(view, 7);
  const PictureArea area{0, 0, 1000, 800};
  CameraNotes notes;
  const auto note = notes.next(
      {view.eye_mm(), view.focus_mm, view.up, view.view_angle_deg(area), view.pixels_per_mm(area), view.magnification},
      0, &notes);
  ASSERT_TRUE(note);
  const auto back = view_of_note(*note);
  ASSERT_TRUE(back);
  const ViewError error = view_error(view, *back);
  EXPECT_LT(error.place_mm, 1e-9);
  EXPECT_LT(error.angle_rad, 1e-6);
  EXPECT_NEAR(error.zoom, 1, 1e-12);
  EXPECT_NEAR(back->working_distance_mm, view.working_distance_mm, 1e-9);
  // Older notes: the angle of view alone, which is that of the picture's height.
  const auto old = view_of_note("{\"eye_mm\":[250,0,0],\"target_mm\":[0,0,0],\"view_angle_deg\":" +
                                std::to_string(view.view_angle_deg(area)) + "}");
  ASSERT_TRUE(old);
  EXPECT_NEAR(old->view_angle_deg({0, 0, 500, 400}), view.view_angle_deg(area), 1e-4);
  EXPECT_NEAR(old->back.x, 1, 1e-12);
  for (const char* const wrong :
       {"", "{}", "[1]", "{\"eye_mm\":[0,0,1],\"target_mm\":[0,0]}", "{\"eye_mm\":[0,0,1],\"target_mm\":[0,0,1]}"})
    EXPECT_FALSE(view_of_note(wrong)) << wrong;
}

}  // namespace
}  // namespace osteo
