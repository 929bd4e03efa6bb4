#include <gtest/gtest.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkRenderer.h>

#include <cmath>
#include <cstdlib>
#include <numbers>

#include "osteo/display/view/actors.h"
#include "osteo/display/view/instrument_view.h"
#include "osteo/display/view/offscreen.h"
#include "osteo/imaging/io/surface_io.h"

namespace osteo {
namespace {

constexpr int kSize = 300;

void keep(const Picture& picture, const std::string& name) {
  if (const char* const folder = std::getenv("OSTEO_PICTURES"))
    save_picture(picture, std::filesystem::path(folder) / (name + ".png"));
}

struct Stage {
  OffscreenWindow window{kSize, kSize};
  vtkNew<vtkRenderer> renderer;
  InstrumentView view{renderer};
  Stage(Vec3 at, double radius_mm, Vec3 eye = {0, -1, 0}) {
    window.window()->AddRenderer(renderer);
    set_up_scene(renderer);
    look_at(renderer, at, radius_mm, eye);
  }
};

TickRecord holding(const std::string& name, std::uint64_t tick = 1) {
  TickRecord t;
  t.tick = tick;
  t.device.tool = static_cast<std::uint8_t>(instrument_index(name));
  return t;
}

double difference(const Picture& a, const Picture& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) sum += std::abs(int{a.rgb[i]} - int{b.rgb[i]});
  return sum / static_cast<double>(a.rgb.size());
}

// Pixels that are no background: it is bluish and dark.
int drawn(const Picture& p) {
  int n = 0;
  for (std::size_t i = 0; i + 2 < p.rgb.size(); i += 3) n += p.rgb[i] > 45 ? 1 : 0;  // the background has 23
  return n;
}

TEST(BurrSpin, TurnsAsFastAsTheBurrAndBlursBeforeFlutesWouldSeemToStand) {
  BurrSpin spin;
  spin.turn(60, 0.25, 8);  // a quarter of a turn: two flutes' distance
  EXPECT_NEAR(spin.angle_rad, std::numbers::pi / 2, 1e-12);
  EXPECT_EQ(spin.sharp, 0);
  spin.turn(60, 0.01, 8);  // 3.6 degrees of 45
  EXPECT_EQ(spin.sharp, 1);
  spin.turn(60000, 1.0 / 60, 8);
  EXPECT_EQ(spin.sharp, 0) << "at any speed of a drill";
  spin.turn(0, 1, 8);
  EXPECT_EQ(spin.sharp, 1);
  double last = 1;
  for (double rpm = 10; rpm < 1000; rpm *= 1.3) {
    BurrSpin s;
    s.turn(rpm, 1.0 / 60, 8);
    EXPECT_LE(s.sharp, last);
    last = s.sharp;
  }
}

TEST(InstrumentView, FlutesAreSeenAtRestTurnWithTheBurrAndAreABlurAtSpeed) {
  Stage stage({0, 0, 0}, 3);
  TickRecord t = holding("cutting 5 mm");
  stage.view.show(t, 1000);
  const Picture rest = stage.window.render();
  keep(rest, "burr-rest");
  t.tick = 101;
  t.speed_rpm = 10;  // in a tenth of a second 6 degrees
  stage.view.show(t, 1000);
  const Picture turned = stage.window.render();
  keep(turned, "burr-turned");
  EXPECT_GT(difference(rest, turned), 1);
  // Fast: two pictures in a row are the same, whatever the angle.
  t.speed_rpm = 60000;
  t.tick = 118;
  stage.view.show(t, 1000);
  const Picture fast = stage.window.render();
  keep(fast, "burr-fast");
  t.tick = 135;
  t.speed_rpm = 59876;
  stage.view.show(t, 1000);
  EXPECT_LT(difference(fast, stage.window.render()), 0.6);
  EXPECT_GT(difference(rest, fast), 1);
  // What is felt keeps its outline: as wide as the diameter says, whether it turns or not.
  const double pixels_a_mm = kSize / (2 * std::tan(15 * std::numbers::pi / 180) * 3 / 0.24);
  const auto width = [&](const Picture& p) {
    int n = 0;
    for (int x = 0; x < kSize; ++x)
      n += p.rgb[3 * (static_cast<std::size_t>(kSize / 2) * kSize + static_cast<std::size_t>(x))] > 45
               ? 1
               : 0;  // the background has 23
    return n / pixels_a_mm;
  };
  EXPECT_NEAR(width(fast), 5, 0.15);
  EXPECT_NEAR(width(rest), 5, 0.4);
}

TEST(InstrumentView, EachLooksLikeWhatItIs) {
  std::vector<Picture> all;
  for (const char* const name : {"cutting 4 mm", "diamond 4 mm", "cutting taper 4 mm", "sucker 10 Fr", "irrigator 2 mm",
                                 "probe 1 mm", "hook 2 mm"}) {
    Stage stage({0, 0, 2.5}, 5, normalized({0.3, -0.8, -0.5}));
    stage.view.show(holding(name), 1000);
    all.push_back(stage.window.render());
    keep(all.back(), std::string("instrument-") + name);
    EXPECT_GT(drawn(all.back()), 800) << name;
    for (std::size_t other = 0; other + 1 < all.size(); ++other)
      EXPECT_GT(difference(all[other], all.back()), 0.5) << name;
    stage.view.hide();
    EXPECT_LT(drawn(stage.window.render()), 50) << name;
  }
  Stage whole({0, 0, 60}, 75, {1, 0, 0});
  for (const char* const name : {"cutting 4 mm", "sucker 10 Fr", "probe 1 mm"}) {
    whole.view.show(holding(name), 1000);
    keep(whole.window.render(), std::string("whole-") + name);
  }
}

// The shaft through a wall of bone, as nothing hides it: what is within is missing, and beside it a band tells.
TEST(InstrumentView, OfTheShaftNothingIsDrawnWithinBone) {
  Stage stage({0, 0, 12}, 12, {0, -1, 0});
  TickRecord t = holding("cutting 4 mm");
  stage.view.show(t, 1000);
  const Picture free = stage.window.render();
  EXPECT_EQ(stage.view.shaft_in_bone(), 0);
  const auto wall = [](Vec3 p) { return p.z > 10 && p.z < 14; };
  stage.view.show(t, 1000, wall);
  EXPECT_EQ(stage.view.shaft_in_bone(), 0) << "the servo tells of no contact";
  t.flags = kShaftContact;
  stage.view.show(t, 1000, wall);
  const Picture cut = stage.window.render();
  keep(cut, "shaft-cut");
  EXPECT_GT(stage.view.shaft_in_bone(), 0.02);
  EXPECT_LT(drawn(cut), drawn(free) - 300);
  int orange = 0;
  for (std::size_t i = 0; i + 2 < cut.rgb.size(); i += 3)
    orange += cut.rgb[i] > 120 && cut.rgb[i] > 2 * cut.rgb[i + 2] ? 1 : 0;
  EXPECT_GT(orange, 100);
  t.flags = 0;
  stage.view.show(t, 1000, wall);
  EXPECT_LT(difference(free, stage.window.render()), 0.01);
}

TEST(InstrumentView, TheTrueHandIsSeenWhereItIsFarFromTheTool) {
  Stage stage({0, 0, 0}, 8, {0, -1, 0});
  TickRecord t = holding("cutting 4 mm");
  t.shown_offset_mm = {1, 0, 0};
  stage.view.show(t, 1000);
  EXPECT_FALSE(stage.view.ghost_shown());
  t.shown_offset_mm = {-6, 0, 0};
  stage.view.show(t, 1000);
  EXPECT_TRUE(stage.view.ghost_shown());
  keep(stage.window.render(), "ghost");
  t.flags = kPlateInHand;
  stage.view.show(t, 1000);
  EXPECT_FALSE(stage.view.ghost_shown());
  EXPECT_LT(drawn(stage.window.render()), 50);
}

}  // namespace
}  // namespace osteo
