// A finer region in the bone around it, drawn.
#include <gtest/gtest.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkRenderer.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "osteo/display/view/actors.h"
#include "osteo/display/view/offscreen.h"
#include "osteo/display/view/world_view.h"
#include "osteo/imaging/io/surface_io.h"
#include "osteo/session/scene/scene_readers.h"
#include "solid.h"

namespace osteo {
namespace {

void keep(const Picture& picture, const char* name) {
  if (const char* const folder = std::getenv("OSTEO_PICTURES"))
    save_picture(picture, std::filesystem::path(folder) / name);
}

bool is_bone(Vec3 p) {
  return p.z < 2 && !(p.z > -2 && std::hypot(p.x, p.y) < 2.8);
}

Picture picture_of(const World& world) {
  SceneReaders readers(world, {}, 1000, {});
  return draw_world(world, readers, nullptr, {{0, 0, 0}, 7, {0, 0, 1}, 300, 300});
}

// A hole whose floor lies in the region, its mouth outside of it.
TEST(RegionView, IsShadedByTheBoneAroundItAsIfBothWereOne) {
  const World whole(test::solid(0.4, 10, is_bone, {}, 2));
  World both(test::solid(0.4, 10, is_bone, {}, 2));
  both.add_region(test::solid(
      0.2, 3.2,
      [](Vec3 p) {
        return is_bone(p + Vec3{0, 0, -2});
      },
      {0, 0, -2}, 2));
  const Picture one = picture_of(whole), two = picture_of(both);
  keep(one, "region-whole.png");
  keep(two, "region-both.png");
  double off = 0, most = 0, floor_one = 0, floor_two = 0, n = 0;
  for (int y = 0; y < 300; ++y)
    for (int x = 0; x < 300; ++x) {
      const auto i = 3 * (static_cast<std::size_t>(y) * 300 + static_cast<std::size_t>(x)) + 1;
      const double d = std::abs(one.rgb[i] - two.rgb[i]);
      off += d / 90000;
      most = std::max(most, d);
      if (std::hypot(x - 150, y - 150) > 25) continue;
      floor_one += one.rgb[i];
      floor_two += two.rgb[i];
      ++n;
    }
  std::printf("floor: one body %.1f, region %.1f; mean difference %.2f, most %.0f\n", floor_one / n, floor_two / n, off,
              most);
  EXPECT_LT(floor_one / n, 160);
  EXPECT_NEAR(floor_two / n, floor_one / n, 14);
  EXPECT_LT(off, 5);
}

}  // namespace
}  // namespace osteo
