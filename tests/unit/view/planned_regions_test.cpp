// Regions of a procedure around a ball of known size.
#include "osteo/display/view/planned_regions.h"

#include <gtest/gtest.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkRenderer.h>

#include <cmath>
#include <cstdio>

#include "osteo/display/view/actors.h"
#include "osteo/display/view/detail/bone_view.h"
#include "osteo/display/view/offscreen.h"
#include "osteo/simulation/bone/live_surface.h"
#include "solid.h"

namespace osteo {
namespace {

// A ball of 3 mm in the middle.
StructureMap ball_map() {
  Labels labels;
  labels.frame.dims = {40, 40, 40};
  labels.frame.spacing_mm = {0.5, 0.5, 0.5};
  labels.frame.origin_mm = {-9.75, -9.75, -9.75};
  const auto voxels = make_voxels<std::uint8_t>(labels.frame.voxel_count());
  for (int k = 0; k < 40; ++k)
    for (int j = 0; j < 40; ++j)
      for (int i = 0; i < 40; ++i)
        voxels[static_cast<std::size_t>((k * 40 + j) * 40 + i)] =
            length(labels.frame.world_from_index({double(i), double(j), double(k)})) < 3 ? 6 : 0;
  labels.voxels = voxels;
  labels.structures = {{6, "facial nerve", {255, 255, 0}}};
  return StructureMap(labels);
}

TEST(PlannedRegions, LieSoFarFromTheFace) {
  const StructureMap map = ball_map();
  for (const double within : {0.3, 1.0, 2.5, 8.0}) {
    const TriMesh surface = offset_surface(map, 0, within);
    ASSERT_GT(surface.points_mm.size(), 100U);
    double mean = 0, worst = 0;
    for (const auto& p : surface.points_mm) {
      const double off = length(from_floats(p)) - 3 - within;
      mean += off / static_cast<double>(surface.points_mm.size());
      worst = std::max(worst, std::abs(off));
    }
    std::printf("%.1f mm around a ball of 3 mm: mean %+.3f mm, worst %.3f\n", within, mean, worst);
    // Farther off the map's distances are coarser.
    EXPECT_LT(std::abs(mean), within > 4 ? 0.2 : 0.1);
    EXPECT_LT(worst, within > 4 ? 0.45 : 0.15);
  }
}

TEST(PlannedRegions, AreSeenThroughBoneInTheirColoursUntilHidden) {
  const StructureMap map = ball_map();
  const auto bone = test::solid(
      0.5, 12, [](Vec3 p) { return length(p) < 8; }, {}, 2);
  LiveSurface surface(bone, {});
  OffscreenWindow window(300, 300);
  vtkNew<vtkRenderer> renderer;
  window.window()->AddRenderer(renderer);
  set_up_scene(renderer);
  look_at(renderer, {0, 0, 0}, 12, {0, -1, 0});
  BoneView view(renderer);
  view.show(surface);
  const Picture without = window.render();
  for (const bool forbidden : {false, true}) {
    RegionsView regions(renderer, map, {{"shell", "facial nerve", forbidden, 1}, {"cells", "air cells", false, 2}});
    EXPECT_EQ(regions.missing(), std::vector<std::string>{"cells"});
    ASSERT_EQ(regions.all().size(), 1U);
    const Picture with = window.render();
    // The rim lies 4 mm from the middle: 300 pixels show 2 tan(15 deg) 12 / 0.24 mm.
    const double pixels_per_mm = 300 / (2 * std::tan(15 * 3.14159265358979 / 180) * 12 / 0.24);
    double red = 0, green = 0, n = 0, middle = 0, m = 0;
    for (int y = 0; y < 300; ++y)
      for (int x = 0; x < 300; ++x) {
        const auto i = 3 * (static_cast<std::size_t>(y) * 300 + static_cast<std::size_t>(x));
        const double r = std::hypot(x - 149.5, y - 149.5) / pixels_per_mm;
        if (std::abs(r - 3.9) < 0.15)
          red += with.rgb[i] - without.rgb[i], green += with.rgb[i + 1] - without.rgb[i + 1], ++n;
        if (r < 1.5) middle += std::abs(with.rgb[i] - without.rgb[i]), ++m;
      }
    std::printf("%s: rim red %+.0f, green %+.0f; middle %.0f\n", forbidden ? "forbidden" : "target", red / n, green / n,
                middle / m);
    EXPECT_GT((forbidden ? 1 : -1) * (red - green) / n, 25);
    EXPECT_LT(middle / m, 40);
    regions.show(false);
    EXPECT_TRUE(window.render().rgb == without.rgb);
  }
}

}  // namespace
}  // namespace osteo
