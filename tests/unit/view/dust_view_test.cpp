#include <gtest/gtest.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "osteo/bone/live_surface.h"
#include "osteo/io/surface_io.h"
#include "osteo/view/actors.h"
#include "osteo/view/bone_view.h"
#include "osteo/view/dust_view.h"
#include "osteo/view/offscreen.h"
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
  if (const char* const folder = std::getenv("OSTEO_PICTURES")) save_picture(picture, std::filesystem::path(folder) / name);
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

// A flat layer of dust seen from above, along the rows of its cells: brightness moved by a cell's width resembles itself no more than when
// moved by any other width.
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
  const int size = 300, from = 70, to = 230;
  const auto at = [&](int x, int y) {
    return static_cast<double>(p.rgb[3 * (static_cast<std::size_t>(y) * size + static_cast<std::size_t>(x))]);
  };
  double mean = 0, count = 0;
  for (int y = from; y < to; ++y)
    for (int x = from; x < to; ++x) mean += at(x, y), ++count;
  mean /= count;
  const auto likeness = [&](int dx, int dy) {
    double sum = 0, square = 0;
    for (int y = from; y < to; ++y)
      for (int x = from; x < to; ++x) {
        sum += (at(x, y) - mean) * (at(x + dx, y + dy) - mean);
        square += (at(x, y) - mean) * (at(x, y) - mean);
      }
    return square > 0 ? sum / square : 0;
  };
  ASSERT_GT(lit(p), 4000);
  // 300 pixels show 2 * tan(15 deg) * 6 / 0.24 mm.
  const double pixels_a_cell = 0.5 * 300 / (2 * std::tan(15 * 3.14159265358979 / 180) * 6 / 0.24);
  double worst = 0;
  for (const int cells : {1, 2, 3}) {
    const int by = static_cast<int>(std::lround(cells * pixels_a_cell));
    for (int off = -2; off <= 2; ++off) worst = std::max({worst, likeness(by + off, 0), likeness(0, by + off)});
  }
  std::printf("likeness at the cells' distance (%.1f pixels): %.3f\n", pixels_a_cell, worst);
  EXPECT_LT(worst, 0.25);
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
      for (int x = 140; x < 160; ++x) sum += p.rgb[3 * (static_cast<std::size_t>(y) * 300 + static_cast<std::size_t>(x)) + 1];
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
