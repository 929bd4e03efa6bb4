#include <gtest/gtest.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "osteo/display/view/actors.h"
#include "osteo/display/view/detail/bone_view.h"
#include "osteo/display/view/detail/dust_view.h"
#include "osteo/display/view/offscreen.h"
#include "osteo/imaging/io/surface_io.h"
#include "osteo/simulation/bone/live_surface.h"
#include "solid.h"

namespace osteo {
namespace {

BrickGrid wide_bowl() {
  return test::solid(0.5, 12, [](Vec3 p) { return length(p) < 11 && p.y > -4 && !(length(p - Vec3{0, -5, 0}) < 9); });
}
BrickGrid bowl() {
  return test::solid(0.5, 12, [](Vec3 p) { return length(p) < 11 && !(length(p - Vec3{0, -3, 0}) < 8); });
}

// Where somebody wants to look at them.
void keep(const Picture& picture, const char* name) {
  if (const char* const folder = std::getenv("OSTEO_PICTURES"))
    save_picture(picture, std::filesystem::path(folder) / name);
}

// The dust's colour: brighter than the background, red over blue.
int lit(const Picture& p) {
  int n = 0;
  for (std::size_t i = 0; i + 2 < p.rgb.size(); i += 3) n += p.rgb[i] > 90 && p.rgb[i] > p.rgb[i + 2] + 12 ? 1 : 0;
  return n;
}

struct Stage {
  OffscreenWindow window{300, 300};
  vtkNew<vtkRenderer> renderer;
  explicit Stage(Vec3 eye, double radius_mm = 12, Vec3 at = {}) {
    window.window()->AddRenderer(renderer);
    set_up_scene(renderer);
    look_at(renderer, at, radius_mm, eye);
  }
};

// A heap of dust in a bowl is seen, and gone when it is sucked off.
TEST(DustView, IsSeenWhereItLies) {
  const auto bone = bowl();
  Dust dust(bone);
  for (int s = 0; s < 400; ++s) {
    dust.add(bone.find(24, 10, 24), 0.1);
    dust.step();
  }
  Stage stage({0, -1, 0});
  DustView view(stage.renderer, 0.5);
  view.update(dust);
  const Picture seen = stage.window.render();
  keep(seen, "dust-heap.png");
  EXPECT_GT(lit(seen), 500);
  dust.suck({0, 0, 0}, 12, 1e9);
  view.update(dust);
  EXPECT_EQ(lit(stage.window.render()), 0);
}

// How alike a part of a picture is to itself moved by so many pixels, brightness about its mean: 1 is the same.
double likeness(const Picture& p, int width, std::array<int, 4> part, int dx, int dy) {
  const auto [x0, x1, y0, y1] = part;
  const auto at = [&](int x, int y) {
    return static_cast<double>(
        p.rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x))]);
  };
  double mean = 0;
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) mean += at(x, y);
  mean /= (x1 - x0) * (y1 - y0);
  double sum = 0, square = 0;
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      sum += (at(x, y) - mean) * (at(x + dx, y + dy) - mean);
      square += (at(x, y) - mean) * (at(x, y) - mean);
    }
  return square > 0 ? sum / square : 0;
}

// 300 pixels show 2 * tan(15 deg) * radius / 0.24 mm.
double pixels_a_cell(double radius_mm) {
  return 0.5 * 300 / (2 * std::tan(15 * 3.14159265358979 / 180) * radius_mm / 0.24);
}

// A flat layer of dust seen from above, along the rows of its cells: brightness moved by a cell's width resembles
// itself no more than when moved by any other width.
TEST(DustView, ShowsNoRows) {
  const auto bone = test::slab(0.5);
  Dust dust(bone, {.gravity = {0, 0, -1}});
  for (int j = 24; j < 56; ++j)
    for (int i = 24; i < 56; ++i) dust.add_at(bone.frame().world_from_index({double(i), double(j), 36}), 0.004);
  for (int s = 0; s < 60; ++s) dust.step();
  const Vec3 middle = bone.frame().world_from_index({39.5, 39.5, 24});
  Stage stage({0, 0, 1}, 6, middle);
  DustView view(stage.renderer, 0.5);
  view.update(dust);
  const Picture p = stage.window.render();
  keep(p, "dust-layer.png");
  ASSERT_GT(lit(p), 4000);
  double worst = 0;
  for (const int cells : {1, 2, 3}) {
    const int by = static_cast<int>(std::lround(cells * pixels_a_cell(6)));
    for (int off = -2; off <= 2; ++off)
      worst = std::max({worst, likeness(p, 300, {70, 230, 70, 230}, by + off, 0),
                        likeness(p, 300, {70, 230, 70, 230}, 0, by + off)});
  }
  std::printf("likeness at the cells' distance (%.1f pixels): %.3f\n", pixels_a_cell(6), worst);
  EXPECT_LT(worst, 0.25);
}

// Slurry that runs over an edge and falls, seen from the side: drops, not rods along gravity. Of how pixels within the
// stream differ, hardly anything is what columns of pixels have in common.
TEST(DustView, WhatFallsShowsNoRows) {
  const auto bone = test::solid(0.5, 12, [](Vec3 p) { return p.x < 0 && p.y > -10 && p.y < -6; });
  Dust dust(bone, {.gravity = {0, 1, 0}});
  for (int s = 0; s < 160; ++s) {
    for (double z = -3; z <= 3; z += 0.5) {
      dust.irrigate({-0.5, -11, z}, {0, 1, 0}, 6, 0.2);
      dust.add_at({-0.5, -10.5, z}, 0.01);
    }
    dust.step();
  }
  Stage stage({0, 0, -1}, 6, {2, 3, 0});
  DustView view(stage.renderer, 0.5);
  view.update(dust);
  const Picture p = stage.window.render();
  keep(p, "dust-falling.png");
  const auto at = [&](int x, int y) {
    return static_cast<double>(p.rgb[3 * (static_cast<std::size_t>(y) * 300 + static_cast<std::size_t>(x))]);
  };
  std::array<double, 300> column{};
  for (int x = 0; x < 300; ++x)
    for (int y = 60; y < 240; ++y) column[static_cast<std::size_t>(x)] += at(x, y) / 180;
  const double brightest = *std::max_element(column.begin(), column.end());
  const auto in_stream = [&](int x) { return column[static_cast<std::size_t>(x)] > 0.6 * brightest; };
  double mean = 0, wide = 0, columns = 0, pixels = 0;
  for (int x = 0; x < 300; ++x)
    if (in_stream(x)) mean += column[static_cast<std::size_t>(x)], ++wide;
  mean /= wide;
  std::array<double, 4> alike{};
  for (int x = 0; x < 300; ++x) {
    if (!in_stream(x)) continue;
    const double c = column[static_cast<std::size_t>(x)];
    columns += 180 * (c - mean) * (c - mean);
    for (int y = 60; y < 240; ++y) {
      pixels += (at(x, y) - c) * (at(x, y) - c);
      for (int cells = 1; cells < 4; ++cells)
        alike[static_cast<std::size_t>(cells)] +=
            (at(x, y) - c) * (at(x, y + static_cast<int>(std::lround(cells * pixels_a_cell(6)))) - c);
    }
  }
  const double worst = *std::max_element(alike.begin(), alike.end()) / pixels;
  std::printf("the stream is %.0f pixels wide; columns make %.3f of its differences; moved by cells: %.3f\n", wide,
              columns / (columns + pixels), worst);
  EXPECT_GT(wide, 2 * pixels_a_cell(6));
  EXPECT_LT(columns / (columns + pixels), 0.2);
  EXPECT_LT(worst, 0.1);
}

// Chips fly off an edge for two seconds, with nothing below: a few of them are in the air, not a ribbon of all. What
// comes to lie on a floor is seen as before.
TEST(DustView, AStreamInTheAirIsNoRibbon) {
  const auto drawn = [](double floor_y, const char* name) {
    const auto bone = test::solid(0.5, 12, [floor_y](Vec3 p) {
      return (p.x < 0 && p.y > -10 && p.y < -6) || (p.y > floor_y && p.y < floor_y + 2);
    });
    Dust dust(bone, {.gravity = {0, 1, 0}});
    for (int s = 0; s < 200; ++s) {
      for (double z = -1; z <= 1; z += 0.5) dust.add_at({1, -8, z}, 0.01);
      dust.step();
    }
    Stage stage({0, 0, -1}, 14);
    DustView view(stage.renderer, 0.5);
    view.update(dust);
    const Picture p = stage.window.render();
    keep(p, name);
    return lit(p);
  };
  const int in_air = drawn(1e9, "dust-in-air.png"), on_floor = drawn(4, "dust-on-floor.png");
  std::printf("lit pixels: %d in the air, %d with a floor\n", in_air, on_floor);
  EXPECT_GT(in_air, 20) << "that something falls is seen";
  EXPECT_LT(in_air, 300);
  EXPECT_GT(on_floor, 4 * in_air);
}

// A pool is seen as a surface, darker than bone where it is clear, pale where it is thick; a dry bowl shows none of it.
TEST(DustView, WaterIsSeenAndSlurryIsPaler) {
  const auto bone = wide_bowl();
  const LiveSurface surface(bone, {});
  Stage stage({0.1, -0.99, 0.1});
  BoneView bone_view(stage.renderer, nullptr);
  bone_view.show(surface);
  const auto brightness = [](const Picture& p) {
    double sum = 0;
    for (int y = 140; y < 160; ++y)
      for (int x = 140; x < 160; ++x)
        sum += p.rgb[3 * (static_cast<std::size_t>(y) * 300 + static_cast<std::size_t>(x)) + 1];
    return sum / 400;
  };
  const auto warmth = [](const Picture& p) {
    double sum = 0;
    for (int y = 140; y < 160; ++y)
      for (int x = 140; x < 160; ++x) {
        const std::size_t at = 3 * (static_cast<std::size_t>(y) * 300 + static_cast<std::size_t>(x));
        sum += double{p.rgb[at] * 1.0} - p.rgb[at + 2];
      }
    return sum / 400;
  };
  Dust dust(bone);
  DustView view(stage.renderer, 0.5);
  view.update(dust);
  const Picture dry = stage.window.render();
  keep(dry, "water-none.png");
  const auto pour = [&] {
    for (int s = 0; s < 80; ++s) {
      dust.irrigate({1, -1, 1}, {0, 1, 0}, 10, 1.5);
      dust.step();
    }
    for (int s = 0; s < 300; ++s) dust.step();
    view.update(dust);
  };
  pour();
  const Picture clear = stage.window.render();
  keep(clear, "water-clear.png");
  EXPECT_LT(brightness(clear), 0.9 * brightness(dry));
  for (int s = 0; s < 200; ++s) {
    dust.add(bone.find(24, 10, 24), 0.15);
    dust.step();
  }
  pour();
  const Picture thick = stage.window.render();
  keep(thick, "water-slurry.png");
  EXPECT_GT(warmth(thick), warmth(clear) + 15) << "clear water is grey, slurry has the colour of bone";
  // From behind the bone hides it.
  look_at(stage.renderer, {}, 12, {0, 1, 0});
  const Picture behind = stage.window.render();
  keep(behind, "water-behind.png");
  const double hidden = brightness(behind);
  dust.suck({0, 0, 0}, 14, 1e9);
  view.update(dust);
  EXPECT_NEAR(brightness(stage.window.render()), hidden, 0.5);
  look_at(stage.renderer, {}, 12, {0.1, -0.99, 0.1});
  EXPECT_NEAR(brightness(stage.window.render()), brightness(dry), 1);
}

}  // namespace
}  // namespace osteo
