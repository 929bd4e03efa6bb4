// Rigid things that tissue does not enter: tools, bone.
#pragma once
#include <memory>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/tri_mesh.h"

namespace osteo::inline simulation {

/// Immutable as far as threads see it.
class RigidShape {
 public:
  struct Ball {
    Vec3 centre_mm;
    double radius_mm = 0;
  };
  virtual ~RigidShape() = default;
  /// A ball that holds it.
  [[nodiscard]] virtual Ball bounds() const = 0;
  /// Signed distance, negative inside, and its gradient (of length about 1, 0 where it has none). Beyond its bounds any
  /// number above 0 will do.
  virtual double distance_mm(Vec3 at, Vec3& outwards) const = 0;
  /// Balls that together are nearly the shape; none where that is not known. With them a tool meets triangles, not only
  /// points.
  [[nodiscard]] virtual std::vector<Ball> balls() const { return {}; }
};

class BallShape final : public RigidShape {
 public:
  /// `triangles` false: points alone meet it.
  BallShape(Vec3 centre_mm, double radius_mm, bool triangles = true)
      : ball_{centre_mm, radius_mm}, triangles_(triangles) {}
  [[nodiscard]] Ball bounds() const override { return ball_; }
  double distance_mm(Vec3 at, Vec3& outwards) const override;
  [[nodiscard]] std::vector<Ball> balls() const override {
    return triangles_ ? std::vector{ball_} : std::vector<Ball>{};
  }

 private:
  Ball ball_;
  bool triangles_;
};

/// All that lies behind a plane.
class PlaneShape final : public RigidShape {
 public:
  /// `normal` points out of it, of any length above 0.
  PlaneShape(Vec3 at_mm, Vec3 normal) : at_(at_mm), normal_(normalized(normal)) {}
  [[nodiscard]] Ball bounds() const override { return {at_, 1e300}; }
  double distance_mm(Vec3 at, Vec3& outwards) const override {
    outwards = normal_;
    return dot(at - at_, normal_);
  }
  [[nodiscard]] Vec3 at_mm() const { return at_; }
  [[nodiscard]] Vec3 normal() const { return normal_; }

 private:
  Vec3 at_, normal_;
};

/// A closed surface by its distance map (exact at the map's points, linear between) over a box; outside the box it is
/// not felt.
class SurfaceShape final : public RigidShape {
 public:
  /// O(voxels of the box). Errors: usage for a box of more than 200 million voxels, and as of DistanceMapper.
  SurfaceShape(const TriMesh& surface, Vec3 lo_mm, Vec3 hi_mm, double spacing_mm, const Context& context = {});
  [[nodiscard]] Ball bounds() const override;
  double distance_mm(Vec3 at, Vec3& outwards) const override;

 private:
  Vec3 lo_;
  double spacing_;
  std::array<std::size_t, 3> dims_{};
  std::vector<float> distance_;  // x fastest
};

/// A shape and how hard it pushes: a point inside feels stiffness times depth along the shortest way out.
struct RigidContact {
  std::shared_ptr<const RigidShape> shape;  ///< null: none
  double stiffness_n_per_mm = 1;
  /// Coulomb's coefficient of what has dug in: from one radius past where it met a triangle on, whole from one and a
  /// half. Without it a surface slips round a tool that is pressed two radii deep. Of tools of TissueDynamics alone.
  double grip = 0;
};

}  // namespace osteo::inline simulation
