// Bone that water ran over looks wet where it did, until it dries.
#include <gtest/gtest.h>
#include <vtkCamera.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "osteo/display/view/actors.h"
#include "osteo/display/view/detail/bone_view.h"
#include "osteo/display/view/detail/wet_film.h"
#include "osteo/display/view/offscreen.h"
#include "osteo/display/view/world_view.h"
#include "osteo/imaging/io/surface_io.h"
#include "osteo/simulation/bone/live_surface.h"
#include "solid.h"

namespace osteo {
namespace {

void keep(const Picture& picture, const char* name) {
  if (const char* const folder = std::getenv("OSTEO_PICTURES"))
    save_picture(picture, std::filesystem::path(folder) / name);
}

double mean(const Picture& p, int cx, int cy, int half) {
  double sum = 0;
  for (int y = cy - half; y <= cy + half; ++y)
    for (int x = cx - half; x <= cx + half; ++x) {
      const auto i =
          3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(p.width) + static_cast<std::size_t>(x));
      sum += (p.rgb[i] + p.rgb[i + 1] + p.rgb[i + 2]) / 3.0;
    }
  return sum / ((2 * half + 1) * (2 * half + 1));
}

struct WetBone : testing::Test {
  WetBone() {
    window.window()->AddRenderer(renderer);
    set_up_scene(renderer);
    surface.shade({});
    view.set_film(&film);
    view.show(surface);
    look(0.05, 0);
  }
  // From above, so much aside.
  void look(double x, double y) {
    look_at(renderer, bone.frame().world_from_index({39.5, 39.5, 31.5}), 8, normalized({x, y, 1}));
  }
  // Water over what shows on the right (smaller x), without the layer of water itself.
  void wash(double mm3) {
    for (int j = 26; j < 54; ++j)
      for (int i = 25; i < 35; ++i)
        dust.irrigate(bone.frame().world_from_index({double(i), double(j), 36}), {0, 0, -1}, 15, mm3 / 280);
  }
  bool update() {
    const bool changed = film.update(dust);
    if (changed) view.wet(surface);
    return changed;
  }
  Picture draw() {
    renderer->ResetCameraClippingRange();
    return window.render();
  }

  BrickGrid bone = test::slab(0.5);
  LiveSurface surface{bone, {}};
  Dust dust{bone, {.gravity = {0, 0, -1}}};
  WetFilm film;
  OffscreenWindow window{300, 300};
  vtkNew<vtkRenderer> renderer;
  BoneView view{renderer};
};

TEST_F(WetBone, AWashedPatchIsDarkerThanDryBesideItUntilItDries) {
  EXPECT_FALSE(update());
  EXPECT_TRUE(film.dry());
  const Picture dry = draw();
  const double left = mean(dry, 75, 150, 20), right = mean(dry, 225, 150, 20);
  EXPECT_NEAR(right / left, 1, 0.05);
  wash(3);
  for (int s = 0; s < 300; ++s) dust.step();
  ASSERT_TRUE(update());
  const Picture wet = draw();
  keep(wet, "wet-patch.png");
  std::printf("dry %.1f and %.1f, washed %.1f and %.1f\n", left, right, mean(wet, 75, 150, 20),
              mean(wet, 225, 150, 20));
  EXPECT_LT(mean(wet, 225, 150, 20), 0.88 * right);
  EXPECT_NEAR(mean(wet, 75, 150, 20), left, 1);  // beside it, dry
  // A stroke of the burr through it: what is cut is as wet as what is around it, at once.
  std::vector<std::uint32_t> all;
  for (std::uint32_t b = 0; b < bone.brick_count(); ++b) all.push_back(b);
  const double before = mean(wet, 225, 150, 20);
  view.update(surface, all);
  EXPECT_NEAR(mean(draw(), 225, 150, 20), before, 1);
  for (int s = 0; s < static_cast<int>(100 * Dust::kDrySeconds) + 6000; ++s) dust.step();
  EXPECT_TRUE(update());
  EXPECT_TRUE(film.dry());
  const Picture again = draw();
  EXPECT_TRUE(again.rgb == dry.rgb);
}

TEST_F(WetBone, WithoutDustItIsDryAtOnce) {
  const Picture dry = draw();
  wash(3);
  for (int s = 0; s < 300; ++s) dust.step();
  ASSERT_TRUE(update());
  EXPECT_FALSE(draw().rgb == dry.rgb);
  EXPECT_TRUE(film.clear());
  view.wet(surface);
  EXPECT_TRUE(draw().rgb == dry.rgb);
  EXPECT_FALSE(film.clear()) << "there is nothing more to dry";
}

TEST_F(WetBone, MirrorsTheLamp) {
  // Of the washed patch, over the darkest that it is, as one looks from above and around.
  const auto brightest = [&] {
    double least = 255, most = 0;
    for (double a = -0.3; a <= 0.31; a += 0.1)
      for (double b = -0.3; b <= 0.31; b += 0.1) {
        look(a, b);
        const double patch = mean(draw(), 225, 150, 20);
        least = std::min(least, patch);
        most = std::max(most, patch);
      }
    return most / least;
  };
  const double dry = brightest();
  wash(3);
  for (int s = 0; s < 300; ++s) dust.step();
  ASSERT_TRUE(update());
  const double wet = brightest();
  std::printf("brightest over darkest: dry %.2f, wet %.2f\n", dry, wet);
  EXPECT_GT(wet, dry + 0.08);
}

TEST_F(WetBone, OnlyWhatChangedIsMadeAgain) {
  wash(3);
  for (int s = 0; s < 300; ++s) dust.step();
  ASSERT_TRUE(update());
  EXPECT_FALSE(update());  // nothing has moved
  static_cast<void>(draw());
  const std::uint64_t stamp = scene_stamp(renderer);
  view.wet(surface);
  EXPECT_EQ(scene_stamp(renderer), stamp);  // looked at, found the same
  const Vec3 washed = bone.frame().world_from_index({30, 40, 32}), dry = bone.frame().world_from_index({60, 40, 32});
  EXPECT_TRUE(film.changed_near(washed));
  EXPECT_FALSE(film.changed_near(dry));
  EXPECT_GT(film.at(bone.frame().world_from_index({30, 40, 31.8})), 0.3);
  EXPECT_EQ(film.at(dry), 0);
}

}  // namespace
}  // namespace osteo
