// What VTK draws for each eye, in pixels.
#include <gtest/gtest.h>
#include <vtkActor.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "osteo/display/view/actors.h"
#include "osteo/display/view/offscreen.h"

namespace osteo {
namespace {

constexpr int kWidth = 500, kHeight = 400;
const PictureArea kArea{0, 0, kWidth, kHeight};

// A ball of light in the dark, and where its picture lies.
class Marker {
 public:
  Marker() : window_(kWidth, kHeight) {
    window_.window()->AddRenderer(renderer_);
    renderer_->SetBackground(0, 0, 0);
    mapper_->SetInputData(round_cone_surface({0, 0, 1, 1}));
    actor_->SetMapper(mapper_);
    actor_->GetProperty()->SetLighting(false);
    actor_->GetProperty()->SetColor(1, 1, 1);
    renderer_->AddActor(actor_);
  }
  void put(Vec3 at) { actor_->SetPosition(at.x, at.y, at.z); }
  std::array<double, 2> seen() {
    renderer_->ResetCameraClippingRange();
    const Picture p = window_.render();
    double sum = 0, x = 0, y = 0;
    for (int row = 0; row < kHeight; ++row) {
      for (int column = 0; column < kWidth; ++column) {
        const double light = p.rgb[3 * (static_cast<std::size_t>(row) * kWidth + static_cast<std::size_t>(column))];
        sum += light;
        x += light * (column + 0.5);
        y += light * (row + 0.5);
      }
    }
    EXPECT_GT(sum, 100 * 255.0);
    return {x / sum, y / sum};
  }
  vtkNew<vtkRenderer> renderer_;

 private:
  OffscreenWindow window_;
  vtkNew<vtkPolyDataMapper> mapper_;
  vtkNew<vtkActor> actor_;
};

ScopeView some_view(double magnification) {
  ScopeView v;
  v.focus_mm = {20, -10, 5};
  look_from(v, {0.7, -0.6, 0.3});
  magnify(v, magnification);
  return v;
}

TEST(ScopeCamera, APlaceIsDrawnAtItsPixel) {
  Marker marker;
  double worst = 0;
  for (const double m : {4.0, 10.0}) {
    const ScopeView v = some_view(m);
    aim(marker.renderer_, v, kArea);
    for (const Vec3 off : {Vec3{}, Vec3{0.3, 0.2, 0}, Vec3{-0.35, 0.1, 0.4}}) {
      const Vec3 at = v.focus_mm + (v.right() * off.x + v.up * off.y + v.back * off.z) * v.field_mm();
      marker.put(at);
      const auto seen = marker.seen(), wanted = *v.pixel(at, kArea);
      EXPECT_NEAR(seen[0], wanted[0], 0.3);
      EXPECT_NEAR(seen[1], wanted[1], 0.3);
      worst = std::max({worst, std::abs(seen[0] - wanted[0]), std::abs(seen[1] - wanted[1])});
    }
  }
  RecordProperty("worst_px", std::to_string(worst));
}

TEST(ScopeCamera, DisparityIsAsTheFormulaSaysAndNoughtAtTheFocus) {
  Marker marker;
  double worst = 0, rows = 0;
  for (const double m : {4.0, 10.0}) {
    const ScopeView v = some_view(m);
    for (const StereoParams& s : {StereoParams{StereoMode::anaglyph, 24}, StereoParams{StereoMode::anaglyph, 22, 3}}) {
      for (const double nearer : {-8.0, 0.0, 3.0, 6.0}) {
        const Vec3 at = v.focus_mm + v.back * nearer + v.right() * (0.15 * v.field_mm()) - v.up * (0.1 * v.field_mm());
        marker.put(at);
        aim_eye(marker.renderer_, v, s, kArea, 0);
        const auto left = marker.seen();
        aim_eye(marker.renderer_, v, s, kArea, 1);
        const auto right = marker.seen();
        const double wanted = disparity_px(v, s, kArea, at);
        worst = std::max(worst, std::abs(left[0] - right[0] - wanted));
        EXPECT_NEAR(left[0] - right[0], wanted, 0.5);
        if (nearer == s.convergence_mm) {
          EXPECT_NEAR(left[0] - right[0], 0, 0.5);
        }
        rows = std::max(rows, std::abs(left[1] - right[1]));
        EXPECT_NEAR(left[1], right[1], 0.2) << "toe-in would show here";
      }
    }
  }
  RecordProperty("worst_px", std::to_string(worst));
  RecordProperty("worst_rows_px", std::to_string(rows));
  // Back to one eye: nothing of the frusta's offset is left.
  const ScopeView v = some_view(4);
  aim(marker.renderer_, v, kArea);
  marker.put(v.focus_mm);
  EXPECT_NEAR(marker.seen()[0], kWidth / 2.0, 0.3);
}

}  // namespace
}  // namespace osteo
