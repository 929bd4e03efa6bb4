// Where a flat cut goes through bodies: outlines as lines, which no number of pixels makes coarse.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "osteo/core/data/tri_mesh.h"
#include "osteo/core/data/volume.h"
#include "osteo/display/view/slices.h"
#include "osteo/geometry/grid/sampler.h"
#include "osteo/simulation/bone/round_cone.h"
#include "osteo/simulation/bone/world.h"

namespace osteo::inline display {

/// A line in the plane of a cut; closed, the last point is joined to the first.
struct CutLine {
  std::vector<Vec3> points_mm;
  bool closed = false;
};

/// Where a plane goes through a mesh: loops of a closed one. Exact on the triangles, so nothing thin is lost.
/// O(triangles), about 3 ns for one that the plane misses. Vertices on the plane count as beyond it.
[[nodiscard]] std::vector<CutLine> section_of(const TriMesh& mesh, Vec3 through_mm, Vec3 normal);

/// The outline of a round cone (its origin at `at_mm`, its z axis along the unit vector `axis`) in a cut; empty where
/// the cut misses it. 128 points, closer where it ends; each within 1e-4 mm of the surface. About 20 us.
[[nodiscard]] CutLine section_of(const RoundCone& shape, Vec3 at_mm, Vec3 axis, Vec3 through_mm, Vec3 normal);

// -- A cut through a scene that is operated on: the CT where it is known, what of the bone is left, what has been
// removed.

/// CT values of a case, for one thread at a time.
class CtValues {
 public:
  /// As a case keeps them: only where there was bone.
  explicit CtValues(const SparseGrid& hu) : stored_(std::in_place, hu) {}
  /// All of a scan, soft tissue too.
  explicit CtValues(Image scan) : scan_(std::move(scan)) {}
  [[nodiscard]] const Frame& frame() const { return scan_ ? scan_->frame : stored_->frame(); }
  /// Linear between voxels, at a point in index coordinates; not a number where none is known.
  [[nodiscard]] float at(Vec3 index) const;
  [[nodiscard]] std::optional<double> at_world(Vec3 world_mm) const;
  [[nodiscard]] bool soft_tissue() const { return scan_.has_value(); }

 private:
  std::optional<GridSampler> stored_;
  std::optional<Image> scan_;
};

/// How far a scan's values are from those that a case keeps, in the middle of at most 20,000 of its voxels, HU;
/// infinite where more than a twentieth of them lie outside the scan. The case's own scan: below 30 (they were
/// resampled).
[[nodiscard]] double difference_hu(const SparseGrid& kept, const Image& scan);

struct LiveCut {
  struct Part {
    std::shared_ptr<const Body> body;
    RigidTransform body_from_world;
    friend bool operator==(const Part& a, const Part& b) {
      return a.body == b.body && a.body_from_world.shift_mm == b.body_from_world.shift_mm &&
             a.body_from_world.rotation == b.body_from_world.rotation;
    }
  };
  std::vector<Part> parts;
  const CtValues* ct = nullptr;  ///< none: bone is as bright as it is dense
  /// Density as the case has it, the finest first: a place belongs to the first in whose box it lies. Empty: nothing is
  /// told of what was removed.
  std::vector<const GridSampler*> before;
  HuWindow hu;
  bool tint_removed = true;
};

inline constexpr std::array<std::uint8_t, 3> kRemovedColour{40, 110, 255};

/// The bone's parts as they are, where they are, each with the CT value of the place it came from; what bone the case
/// has there and the scene has not any more is tinted by as much as is missing. Black where nothing is known. RGBA, top
/// row first. Bone may be drilled meanwhile: each voxel is shown as it was or as it is. 0.1 to 0.2 us a pixel with one
/// body.
void draw_live_cut(const SliceView& view, const LiveCut& cut, std::vector<std::uint32_t>& rgba);

}  // namespace osteo::inline display
