// A shape held against points that were measured on its surface.
#pragma once
#include <array>
#include <vector>

#include "fit.h"
#include "osteo/geometry/distance/triangle_tree.h"
#include "osteo/simulation/tissue/measured.h"

namespace osteo::inline simulation::tissue {

class SurfaceGoal final : public Goal {
 public:
  // Of one load. Views with more points than `most` keep that many, drawn by `seed`. Errors as of calibrate_measured().
  SurfaceGoal(const TissueModel& model, const BodySurface& surface, std::span<const MeasuredPoints> views,
              bool find_pose, std::size_t most, const Context& context);

  struct View {
    const MeasuredPoints* source = nullptr;
    std::vector<std::size_t> drawn;  // of the source's points
    std::vector<double> weight;      // noise over the median noise
    std::size_t first_row = 0;
    Vec3 centre;                 // poses turn about it
    double turn = 0, shift = 0;  // of an own parameter of 1: radians, mm
    double sigma_mm = 0;         // robust, of what was left of the last shape
    double width_mm = 0;         // of the loss
    [[nodiscard]] bool markers() const { return !source->rest_mm.empty(); }
    [[nodiscard]] std::size_t rows() const { return drawn.size() * (markers() ? 3 : 1); }
  };

  [[nodiscard]] std::size_t rows() const override { return rows_; }
  [[nodiscard]] std::size_t own() const override { return find_pose_ ? 6 * views_.size() : 0; }
  void residuals(std::span<const Vec3> shape, const double* own, double* out) override;
  void along(std::span<const Vec3> du, double* column, std::size_t stride) const override;
  void by_own(double* first, std::size_t stride) const override;

  [[nodiscard]] const std::vector<View>& views() const { return views_; }
  // Residuals are distances times this.
  void set_scale(double scale) { scale_ = scale; }
  // Losses as wide as the noise that the last shape left, which `shape` is.
  void widen_by_noise(std::span<const Vec3> shape);
  // Poses that bring the views onto a shape, from those given.
  void align(std::span<const Vec3> shape, double* own);
  // Squared distances over weights, of the last shape; a marker's is a third of its square.
  [[nodiscard]] std::vector<double> squares() const;
  // Of the last shape: what is left at a view's points, along the normal (of markers, in all three), as measured, not
  // by the loss.
  [[nodiscard]] Vec3 left(std::size_t view, std::size_t point) const { return seen_[seen_at_[view] + point].left; }
  // Where a view's points lie on the body, by the pose of the last shape.
  [[nodiscard]] Vec3 placed(std::size_t view, std::size_t point) const { return seen_[seen_at_[view] + point].at; }
  // The triangle of the surface that it is nearest to; of clouds.
  [[nodiscard]] std::uint32_t nearest(std::size_t view, std::size_t point) const {
    return seen_[seen_at_[view] + point].triangle;
  }
  [[nodiscard]] MeasuredError error(std::size_t view, std::span<const Vec3> shape) const;
  [[nodiscard]] std::vector<Vec3> moved(std::span<const Vec3> shape) const;  // the surface's points
  [[nodiscard]] const BodySurface& surface() const { return surface_; }

 private:
  struct Seen {
    Vec3 at, before;  // of the measured point: on the body, and as it was measured
    Vec3 left;        // from there to the body: along `out` (cloud), or all of it (marker)
    // Cloud: the nearest triangle, where on it, and the direction in which it is off.
    std::uint32_t triangle = ClosestPoint::kNone;
    std::array<double, 3> share{};
    Vec3 out;
    double slope = 0;  // of the residual by `left` along `out`
    // Marker: the tetrahedron that it is in, and the residual by what is left.
    std::array<std::uint32_t, 4> corners{};
    std::array<double, 4> weights{};
    std::array<Vec3, 3> by_left{};
  };
  void check(const MeasuredPoints& view, Vec3 lo, Vec3 hi) const;
  void embed(const TissueModel& model, View& view);
  void place(const double* own);

  const BodySurface& surface_;
  const std::vector<Vec3>& rest_;
  bool find_pose_;
  const Context& context_;
  std::vector<View> views_;
  std::vector<std::size_t> seen_at_;  // first of each view
  std::vector<Seen> seen_;
  std::vector<std::array<Vec3, 3>> turn_by_;  // of each view: what turned parameters turn about, in place
  std::vector<Vec3> centre_;                  // where that is
  std::size_t rows_ = 0;
  double scale_ = 1;
};

}  // namespace osteo::inline simulation::tissue
