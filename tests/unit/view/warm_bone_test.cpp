// Bone that drilling warmed is seen to be warm, where it is.
#include <gtest/gtest.h>
#include <vtkCamera.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkRenderer.h>

#include <array>

#include "osteo/display/view/actors.h"
#include "osteo/display/view/detail/bone_view.h"
#include "osteo/display/view/offscreen.h"
#include "osteo/display/view/world_view.h"
#include "osteo/simulation/bone/live_surface.h"
#include "solid.h"

namespace osteo {
namespace {

std::array<double, 3> mean(const Picture& p, int cx, int cy) {
  std::array<double, 3> sum{};
  for (int y = cy - 10; y <= cy + 10; ++y)
    for (int x = cx - 10; x <= cx + 10; ++x)
      for (std::size_t c = 0; c < 3; ++c)
        sum[c] +=
            p.rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(p.width) + static_cast<std::size_t>(x)) +
                  c] /
            441.0;
  return sum;
}

TEST(WarmBone, GlowsWhereItIsWarmUntilItHasCooled) {
  const BrickGrid bone = test::slab(0.5);
  LiveSurface surface{bone, {}};
  OffscreenWindow window{300, 300};
  const vtkNew<vtkRenderer> renderer;
  window.window()->AddRenderer(renderer);
  set_up_scene(renderer);
  surface.shade({});
  BoneView view{renderer};
  view.show(surface);
  look_at(renderer, bone.frame().world_from_index({39.5, 39.5, 31.5}), 8, normalized(Vec3{0.05, 0, 1}));
  const auto draw = [&] {
    renderer->ResetCameraClippingRange();
    return window.render();
  };
  const Picture cool = draw();
  // On the right (smaller x) so warm, elsewhere as the body.
  const std::vector<std::pair<Vec3, double>> near{{bone.frame().world_from_index({30, 40, 31.5}), 3}};
  double celsius = 41;
  const auto at = [&](Vec3 p) { return length(p - near[0].first) < 3 ? celsius : 37; };
  view.warm(surface, near, at);
  EXPECT_TRUE(draw().rgb == cool.rgb) << "below 42 C nothing is shown";
  double last = mean(cool, 225, 150)[2];
  const double redness = mean(cool, 225, 150)[0] / mean(cool, 225, 150)[1];
  for (const double c : {44.0, 50.0, 57.0}) {
    celsius = c;
    view.warm(surface, near, at);
    const Picture warm = draw();
    EXPECT_LT(mean(warm, 225, 150)[2], 0.85 * last) << c << " C: less and less blue";
    EXPECT_EQ(mean(warm, 75, 150), mean(cool, 75, 150)) << "not beside it";
    last = mean(warm, 225, 150)[2];
  }
  EXPECT_GT(mean(draw(), 225, 150)[0] / mean(draw(), 225, 150)[1], 1.5 * redness);
  const std::uint64_t stamp = scene_stamp(renderer);
  celsius = 90;
  view.warm(surface, near, at);
  EXPECT_EQ(scene_stamp(renderer), stamp) << "redder than red there is not";
  celsius = 37;
  view.warm(surface, {}, at);
  EXPECT_TRUE(draw().rgb == cool.rgb);
}

}  // namespace
}  // namespace osteo
