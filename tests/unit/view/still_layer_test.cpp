// What lies still is drawn once, and the picture is as if all had been drawn.
#include "osteo/display/view/detail/still_layer.h"

#include <gtest/gtest.h>
#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

#include <algorithm>

#include "osteo/display/view/actors.h"
#include "osteo/display/view/offscreen.h"
#include "osteo/display/view/world_view.h"
#include "osteo/imaging/io/vtk_data.h"

namespace osteo {
namespace {

// Balls in a row that lie still, one that goes through them, and one of water over them.
struct Scene {
  static constexpr int kBalls = 5;
  const QuietVtk quiet;  // GLEW's complaint that there is no X display
  OffscreenWindow window{240, 200};
  vtkSmartPointer<vtkRenderer> renderer = make_layered_renderer();
  std::vector<vtkSmartPointer<vtkActor>> balls;
  vtkSmartPointer<vtkActor> moving, water;
  vtkNew<vtkMatrix4x4> pose, water_pose;
  StillLayer layer{window.window(), renderer};

  static vtkSmartPointer<vtkActor> ball(vtkSmartPointer<vtkActor> actor, double radius_mm, vtkMatrix4x4* pose) {
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(round_cone_surface({0, 0, radius_mm, radius_mm}));
    actor->SetMapper(mapper);
    actor->SetUserMatrix(pose);
    return actor;
  }

  Scene() {
    window.window()->AddRenderer(renderer);
    set_up_scene(renderer);
    for (int n = 0; n < kBalls; ++n) {
      vtkNew<vtkMatrix4x4> at;
      at->SetElement(0, 3, 5.0 * (n - 2));
      balls.push_back(ball(vtkSmartPointer<vtkActor>::New(), 2.4, at));
      balls.back()->GetProperty()->SetColor(0.9, 0.3 + 0.1 * n, 0.4);
      renderer->AddActor(balls.back());
    }
    moving = ball(vtkSmartPointer<vtkActor>::New(), 1.5, pose);
    renderer->AddActor(moving);
    water = ball(make_late_actor(Late::nearest), 2, water_pose);
    water->GetProperty()->SetOpacity(0.5);
    renderer->AddActor(water);
    look_at(renderer, {0, 0, 0}, 14, {0, -1, 0});
    move(0);
  }
  // From before the balls to behind them, and to the side.
  void move(int n) {
    pose->SetElement(0, 3, -9 + 0.37 * n);
    pose->SetElement(1, 3, -3 + 0.21 * n);
    water_pose->SetElement(0, 3, 6 - 0.3 * n);
    water_pose->SetElement(1, 3, -1);
    renderer->ResetCameraClippingRange();
  }
  // So many, each with what moves a little on, and the same either way.
  void pictures(int count, const char* what) {
    for (int k = 0; k < count; ++k) {
      next();
      expect_same(what);
    }
  }
  void next() { move(moved_++); }
  // By the layer, and all at once.
  void expect_same(const std::string& what) {
    layer.render();
    const Picture parts = grab(window.window());
    window.window()->Render();
    const Picture whole = grab(window.window());
    std::size_t off = 0;
    for (std::size_t n = 0; n < whole.rgb.size(); ++n) off += std::abs(int(whole.rgb[n]) - int(parts.rgb[n])) > 2;
    EXPECT_LE(off, 12U) << what;  // of 144,000: depths fall otherwise where surfaces cut each other
  }

 private:
  int moved_ = 0;
};

TEST(StillLayer, DrawsOnlyWhatChanges) {
  Scene scene;
  int two = 0;
  for (int n = 0; n < 50; ++n) {
    scene.move(n);
    scene.expect_same("picture " + std::to_string(n));
    if (n >= 2) EXPECT_EQ(scene.layer.kept(), 5U) << n;
    two += scene.layer.drawn() == 2 ? 1 : 0;
  }
  EXPECT_GE(two, 44);  // now and then what moves leaves the clipping planes of what is kept
}

TEST(StillLayer, WhatChangesIsSeenAndLeftOutWhileItDoes) {
  Scene scene;
  scene.pictures(5, "at first");
  // A chunk of bone that is drilled.
  for (int k = 0; k < 4; ++k) {
    scene.balls[2]->GetProperty()->SetColor(0.2, 0.2 + 0.1 * k, 0.9);
    scene.pictures(1, "one changes");
  }
  EXPECT_EQ(scene.layer.kept(), 4U);
  EXPECT_EQ(scene.layer.drawn(), 3U);
  EXPECT_NEAR(scene.layer.live_share(), 3.0 / 7, 0.01);  // of balls of as many triangles each
  scene.balls[1]->VisibilityOff();
  scene.pictures(1, "one is hidden");
  scene.renderer->RemoveActor(scene.balls[0]);
  scene.pictures(2, "one is gone");
  EXPECT_EQ(scene.layer.kept(), 2U);
  scene.balls[1]->VisibilityOn();
  scene.pictures(1, "one is back");
  scene.pictures(static_cast<int>(2 * StillLayer::kLive), "later");
  EXPECT_EQ(scene.layer.kept(), 4U) << "what has come to rest is kept again";
}

TEST(StillLayer, FollowsCameraSizeAndEffects) {
  Scene scene;
  scene.pictures(4, "at first");
  for (int k = 0; k < 3; ++k) {
    scene.renderer->GetActiveCamera()->Azimuth(3);
    scene.pictures(1, "turned");
    EXPECT_EQ(scene.layer.kept(), 0U) << "nothing is kept of a camera that moves";
  }
  scene.pictures(2, "at rest again");
  EXPECT_EQ(scene.layer.kept(), 5U);
  scene.renderer->GetActiveCamera()->Dolly(1.4);
  scene.pictures(3, "nearer");
  scene.window.window()->SetSize(180, 150);
  scene.pictures(3, "smaller");
  EXPECT_EQ(scene.layer.kept(), 5U);
  // A picture at rest between two that move: what was kept is good for the next.
  set_depth(scene.renderer, {true, 1});
  scene.layer.render();
  EXPECT_EQ(scene.layer.kept(), 0U);
  set_depth(scene.renderer, {false, 1});
  scene.next();
  scene.layer.render();
  EXPECT_EQ(scene.layer.kept(), 5U);
  EXPECT_EQ(scene.layer.drawn(), 2U);
  scene.pictures(2, "after effects");
  // Another drew into the window meanwhile, in another size.
  scene.window.window()->SetSize(60, 50);
  scene.window.window()->Render();
  scene.window.window()->SetSize(180, 150);
  scene.pictures(2, "after another size");
}

TEST(StillLayer, AnyOtherRendererIsDrawnWhole) {
  Scene scene;
  vtkNew<vtkRenderer> plain;
  scene.window.window()->RemoveRenderer(scene.renderer);
  scene.window.window()->AddRenderer(plain);
  set_up_scene(plain);
  plain->AddActor(scene.moving);
  look_at(plain, {0, 0, 0}, 14, {0, -1, 0});
  StillLayer layer(scene.window.window(), plain);
  for (int n = 0; n < 3; ++n) layer.render();
  EXPECT_EQ(layer.kept(), 0U);
  EXPECT_EQ(layer.drawn(), 1U);
}

}  // namespace
}  // namespace osteo
