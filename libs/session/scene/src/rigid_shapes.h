// What soft tissue meets in a rehearsal: the tool's head, and the bone as it is now.
#pragma once
#include "osteo/simulation/bone/round_cone.h"
#include "osteo/simulation/bone/world.h"
#include "osteo/simulation/tissue/contact.h"

namespace osteo::inline session {

/// A round cone with its origin at `at_mm` and z along `axis` (unit). Exact.
class ToolShape final : public RigidShape {
 public:
  ToolShape(const RoundCone& cone, Vec3 at_mm, Vec3 axis) : cone_(cone), at_(at_mm), axis_(axis) {}
  [[nodiscard]] Ball bounds() const override;
  double distance_mm(Vec3 at, Vec3& outwards) const override;
  /// Along the axis, a quarter of a radius apart.
  [[nodiscard]] std::vector<Ball> balls() const override;

 private:
  RoundCone cone_;
  Vec3 at_, axis_;
};

/// The bodies of a world by their densities now, drilled, sawn and moved as they are. Depth along the gradient to where
/// the density falls below a half, found up to kReachMm deep; outside within a voxel. While the world's bodies do not
/// come and go; densities may be written meanwhile.
class LiveBone final : public RigidShape {
 public:
  static constexpr double kReachMm = 4;
  explicit LiveBone(const World& world) : world_(world) {}
  [[nodiscard]] Ball bounds() const override { return {{}, 1e9}; }
  double distance_mm(Vec3 at, Vec3& outwards) const override;

 private:
  [[nodiscard]] double density(Vec3 at) const;
  const World& world_;
};

}  // namespace osteo::inline session
