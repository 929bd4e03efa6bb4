// Was what was removed seen? D. Morris 2006, section 3.5.1.
#pragma once
#include <functional>
#include <unordered_map>

#include "osteo/assessment/evidence/metric.h"

namespace osteo::inline assessment {

/// Whether the straight line between two points of the world meets a voxel of bone (density of at least a half), in any
/// body. Every voxel that the open segment enters is looked at, one after the other (Amanatides and Woo 1987), whole
/// bricks that are not stored at once. `left_out`, where not empty, says which voxels do not count: called for those of
/// bone only. Cost: 10 to 20 ns a voxel passed, so 1 to 5 us through a head in voxels of 0.5 mm.
class BoneSight {
 public:
  using LeftOut = std::function<bool(const PlacedBody& body, VoxelKey own)>;
  explicit BoneSight(const World& world) : world_(world) {}
  [[nodiscard]] bool blocked(Vec3 from_mm, Vec3 to_mm, const LeftOut& left_out = {}) const;
  /// The first voxel that blocks; false where none does.
  struct Hit {
    const PlacedBody* body = nullptr;
    VoxelKey own = 0;
  };
  [[nodiscard]] bool first_hit(Vec3 from_mm, Vec3 to_mm, const LeftOut& left_out, Hit& hit) const;

 private:
  const World& world_;
};

/// A voxel counts as removed in the frame in which its density falls below a half, and as seen when from its centre the
/// camera's eye of that frame can be seen past all bone but what was in touch with a burr then: what the frame itself
/// removed, and voxels whose centres lie within a voxel's diagonal of a burr's head in a tick of the frame in which it
/// removed bone. Of what is taken back by undo nothing is kept; what is removed again counts as it went the last time.
class VisibilityMetric final : public Metric {
 public:
  enum class Seen : std::uint8_t { seen, hidden, unknown };
  explicit VisibilityMetric(const EvidenceScene& scene) : scene_(scene) {}
  void frame(const EvidenceFrame& frame) override;
  void finish(const World& world, std::vector<Measured>& values, std::vector<Moment>& moments) override;

  struct Voxel {
    Seen seen = Seen::unknown;
    std::uint64_t tick = 0;
    Vec3 own_mm;  ///< centre, where the bone lay before any piece was moved
    float mm3 = 0;
  };
  /// By name, in the order of names: the voxels that prove it.
  [[nodiscard]] const std::map<VoxelKey, Voxel>& voxels() const { return voxels_; }

 private:
  EvidenceScene scene_;
  std::map<VoxelKey, Voxel> voxels_;
};

/// Near structures: what "near" means in metrics of hidden bone.
inline constexpr double kNearMm = 2;
/// Bone: density of at least this.
inline constexpr float kSolid = 0.5F;

}  // namespace osteo::inline assessment
