#include <gtest/gtest.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkRenderer.h>

#include <cstdio>

#include "osteo/io/surface_io.h"
#include "osteo/view/actors.h"
#include "osteo/view/dust_view.h"
#include "osteo/view/offscreen.h"
#include "solid.h"

namespace osteo {
namespace {

// A heap of dust in a bowl is seen, and gone when it is sucked off.
TEST(DustView, IsSeenWhereItLies) {
  const auto bone = test::solid(0.5, 12, [](Vec3 p) { return length(p) < 11 && !(length(p - Vec3{0, -3, 0}) < 8); });
  Dust dust(bone);
  for (int s = 0; s < 400; ++s) {
    dust.add(bone.find(24, 10, 24), 0.1);
    dust.step();
  }
  OffscreenWindow window(300, 300);
  vtkNew<vtkRenderer> renderer;
  window.window()->AddRenderer(renderer);
  set_up_scene(renderer);
  look_at(renderer, {0, 0, 0}, 12, {0, -1, 0});
  const auto lit = [&] {
    const Picture p = window.render();
    int n = 0;
    // The dust's colour: brighter than the background, red over blue.
    for (std::size_t i = 0; i + 2 < p.rgb.size(); i += 3) n += p.rgb[i] > 100 && p.rgb[i] > p.rgb[i + 2] + 15 ? 1 : 0;
    return n;
  };
  DustView view(renderer, 0.5);
  view.update(dust);
  const int seen = lit();
  EXPECT_GT(seen, 500);
  dust.suck({0, 0, 0}, 12, 1e9);
  view.update(dust);
  EXPECT_EQ(lit(), 0);
}

}  // namespace
}  // namespace osteo
