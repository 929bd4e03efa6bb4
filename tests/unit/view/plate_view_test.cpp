#include <gtest/gtest.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkRenderer.h>

#include <cstdlib>

#include "osteo/display/view/actors.h"
#include "osteo/display/view/instrument_view.h"
#include "osteo/display/view/offscreen.h"
#include "osteo/imaging/io/surface_io.h"
#include "slab.h"

namespace osteo {
namespace {

Picture picture_of(OffscreenWindow& window, const char* name) {
  Picture p = window.render();
  if (const char* const folder = std::getenv("OSTEO_PICTURES")) save_picture(p, std::filesystem::path(folder) / name);
  return p;
}

int red(const Picture& p) {
  int n = 0;
  for (std::size_t i = 0; i + 2 < p.rgb.size(); i += 3) n += p.rgb[i] > 60 && p.rgb[i] > 1.5 * p.rgb[i + 2] ? 1 : 0;
  return n;
}

int drawn(const Picture& p) {
  int n = 0;
  for (std::size_t i = 0; i + 2 < p.rgb.size(); i += 3) n += p.rgb[i] > 70 ? 1 : 0;
  return n;
}

// Bone of the slab is below z = 0.
struct Stage {
  World world{test::slab(0.4)};
  OffscreenWindow window{400, 300};
  vtkNew<vtkRenderer> renderer;
  PlateView view{renderer};
  Stage() {
    window.window()->AddRenderer(renderer);
    set_up_scene(renderer);
    look_at(renderer, {}, 16, normalized({0.2, -0.8, 0.6}));
  }
};

TEST(PlateView, AFixedPlateHasScrewsAndIsRedWhereItIsInBone) {
  Stage s;
  const auto plate = static_cast<std::uint32_t>(plate_index("miniplate-6"));
  ASSERT_TRUE(s.world.act(SceneAction::attach(plate, {{}, {0, 0, 0.05}}, 0)).done);
  s.view.update(s.world);
  EXPECT_EQ(s.view.tinted(), 0u);
  const Picture on = picture_of(s.window, "plate-on-bone.png");
  EXPECT_EQ(red(on), 0);
  EXPECT_LT(plate_in_bone_mm(s.world, plate_library()[plate], {{}, {0, 0, 0.05}}), kPlateCollisionMm);
  // Tilted: one end half a millimetre in, which the figure says too.
  s.world.act(SceneAction::detach(1));
  const RigidTransform tilted = rotation_about({}, {0, 1, 0}, 0.03) * RigidTransform{{}, {0, 0, 0.05}};
  ASSERT_TRUE(s.world.act(SceneAction::attach(plate, tilted, 0)).done);
  s.view.update(s.world);
  EXPECT_GT(s.view.tinted(), 50u);
  EXPECT_GT(red(picture_of(s.window, "plate-in-bone.png")), 100);
  EXPECT_NEAR(plate_in_bone_mm(s.world, plate_library()[plate], tilted), 19 * 0.03 - 0.05, 0.15);
  s.world.act(SceneAction::detach(2));
  s.view.update(s.world);
  EXPECT_EQ(drawn(s.window.render()), 0);
}

TEST(PlateView, BothFeetOfADistractorAndItsScrews) {
  Stage s;
  const auto plate = static_cast<std::uint32_t>(plate_index("distractor"));
  s.view.show_in_hand(s.world, plate, {{}, {0, 0, 3}});
  const int without = drawn(picture_of(s.window, "distractor-in-hand.png"));
  EXPECT_GT(without, 3000);
  EXPECT_EQ(s.view.tinted(), 0u);
  s.view.show_in_hand(s.world, plate, {{}, {0, 0, -1}});
  EXPECT_GT(s.view.tinted(), 100u) << "in bone";
  s.view.hide_in_hand();
  EXPECT_EQ(drawn(s.window.render()), 0);
  ASSERT_TRUE(s.world.act(SceneAction::attach(plate, {{}, {0, 0, 0.1}}, 0)).done);
  s.view.update(s.world);
  // From the left and the right of the middle: each foot is seen.
  const Picture p = picture_of(s.window, "distractor.png");
  int left = 0, right = 0;
  for (std::size_t y = 0; y < 300; ++y)
    for (std::size_t x = 0; x < 400; ++x) (x < 200 ? left : right) += p.rgb[3 * (y * 400 + x)] > 70 ? 1 : 0;
  EXPECT_GT(left, 1500);
  EXPECT_GT(right, 1500);
}

}  // namespace
}  // namespace osteo
