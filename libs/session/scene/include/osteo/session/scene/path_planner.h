// Where a tool can go without touching bone: where it waits, how it gets out, how it gets to a place.
#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "osteo/simulation/bone/structure_map.h"
#include "osteo/simulation/haptics/device.h"

namespace osteo::inline session {

/// A tool and where it is held. `axis` is a unit vector, from the tool to the handle. Ways begin where the tool is
/// shown: where bone holds a shaft the hand may be elsewhere.
struct HandPose {
  Vec3 at_mm, axis{0, 0, 1};
};

/// Points of a tool's surface in the hand's frame (frame_of_axis), each with its normal.
struct ToolSkin {
  struct Point {
    Vec3 at_mm, outwards;
  };
  std::vector<Point> points;
  double reach_mm = 0;  ///< from the hand's position to the farthest of them
};
/// An instrument with its shaft, or with `head` false the shaft alone.
[[nodiscard]] ToolSkin skin_of_instrument(std::size_t tool, bool head = true);
/// A plate as it is gripped.
[[nodiscard]] ToolSkin skin_of_plate(std::size_t plate, const RigidTransform& grip);

/// Looks at bone as it is now; bodies that change meanwhile are seen in part as they were. Critical structures are in
/// the way like bone, with kClearOfStructuresMm between them and the tool; where a tool is nearer at the beginning it
/// may not come nearer. Soft tissue is not looked at. One thread.
class PathPlanner {
 public:
  /// More than the error of the structures' faces (StructureMap) with voxels of a millimetre.
  static constexpr double kClearOfStructuresMm = 0.5;

  /// Keeps the bodies of the world, not the world; `structures`, where there are some, must outlive it. O(bricks).
  PathPlanner(const World& world, ToolSkin tool, const StructureMap* structures = nullptr);

  /// The ball that all bone lies in.
  [[nodiscard]] Vec3 centre_mm() const { return centre_mm_; }
  [[nodiscard]] double radius_mm() const { return radius_mm_; }

  /// No bone within `margin_mm` of the tool's surface, a negative margin lets it be that deep; and no structure within
  /// that, or within kClearOfStructuresMm where that is more.
  [[nodiscard]] bool free(const HandPose& pose, double margin_mm) const;

  /// Beside the bone, on the side of `eye` (unit, from the bone towards who looks); `axis` should not point away from
  /// there.
  [[nodiscard]] HandPose waiting(Vec3 eye, Vec3 axis) const;

  struct Found {
    HandWay way;
    HandPose end;
    /// No way keeps clear of the structures; this one is clear of bone only, and may touch them.
    bool past_structures = false;
  };
  /// Out of the bone, across free air, to a place that is free. `put` where the tool is shut in, so that no way was
  /// found.
  [[nodiscard]] Found way(const HandPose& from, const HandPose& to) const;

  /// To bone that is seen along `forward` (unit) at `seen_mm`: the nearest place before it on that line of sight where
  /// the tool is free by half a millimetre and gets to from outside with room all the way. Held along `axis`, or where
  /// it does not fit so, leaning to another side or towards who looks.
  [[nodiscard]] Found approach(const HandPose& from, Vec3 seen_mm, Vec3 forward, Vec3 axis) const;

  /// `axis` turned towards `wanted`, by `most_rad` at most and only as far as the tool touches no more bone than it
  /// does, nor comes nearer to a structure that it is close to.
  [[nodiscard]] Vec3 turned(const HandPose& pose, Vec3 wanted, double most_rad) const;

 private:
  struct Bone {
    std::shared_ptr<const Body> body;
    RigidTransform body_from_world;
    Vec3 centre_mm;  // of the ball around it, in its own frame
    double radius_mm = 0;
  };
  using Poses = std::vector<HandPose>;  // the ones after the first
  [[nodiscard]] bool outside(Vec3 at_mm) const;
  [[nodiscard]] bool in_bone(Vec3 at_mm) const;
  [[nodiscard]] std::optional<Poses> straight_out(const HandPose& from, Vec3 rather, double least_margin_mm) const;
  [[nodiscard]] std::optional<Poses> way_out(const HandPose& from, Vec3 rather) const;
  [[nodiscard]] bool leaves(const HandPose& from, Vec3 direction, double near_margin_mm, double margin_mm,
                            HandPose& end) const;
  [[nodiscard]] std::optional<Poses> search_out(const HandPose& from, double near_margin_mm, double far_margin_mm,
                                                double step_mm) const;
  [[nodiscard]] std::optional<Poses> across(const HandPose& from, const HandPose& to) const;
  [[nodiscard]] std::optional<Poses> over(const HandPose& from, const HandPose& to, Vec3 lift) const;
  [[nodiscard]] bool free_leg(const HandPose& a, const HandPose& b, double margin_mm) const;
  [[nodiscard]] std::size_t touching(const HandPose& pose, double margin_mm, std::size_t most) const;
  [[nodiscard]] std::size_t touching_bone(const HandPose& pose, double margin_mm, std::size_t most) const;
  [[nodiscard]] std::size_t touching_structures(const HandPose& pose, double clear_mm, std::size_t most) const;
  [[nodiscard]] Found found_way(const HandPose& from, const HandPose& to) const;
  [[nodiscard]] Found found_approach(const HandPose& from, Vec3 seen_mm, Vec3 forward, Vec3 axis) const;
  [[nodiscard]] Found clear_or_past_structures(const auto& find) const;
  [[nodiscard]] double margin_at(const HandPose& pose) const;
  [[nodiscard]] std::optional<HandWay> finished(const HandPose& from, const Poses& poses) const;

  std::vector<Bone> bones_;
  ToolSkin tool_;
  const StructureMap* structures_;
  Vec3 centre_mm_;
  double radius_mm_ = 0;
};

}  // namespace osteo::inline session
