// Structures at risk: how far a tool is from nerves, vessels and membranes.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "osteo/base/context.h"
#include "osteo/bone/round_cone.h"
#include "osteo/data/tri_mesh.h"
#include "osteo/data/volume.h"
#include "osteo/grid/brick_grid.h"

namespace osteo {

/// Signed distances to all structures of a label map (exact between voxel centres, so true to half a voxel; linear between them), kept
/// within `reach_mm` of them, and which is the nearest. About 8 bytes a voxel of that neighbourhood; made in O(voxels of the map).
/// Immutable.
class StructureMap {
 public:
  /// Error(failed) when the map holds no structure.
  explicit StructureMap(const Labels& labels, double reach_mm = 8, const Context& context = {});

  struct Answer {
    double distance_mm = 0;      ///< negative inside; reach_mm() where nothing is near
    std::uint8_t structure = 0;  ///< value in the label map; 0: none within reach
  };
  /// 0.1 us.
  [[nodiscard]] Answer at(Vec3 world_mm) const noexcept;
  /// Between a tool and the nearest structure; negative when it reaches into one. Cost: an at() for each half radius along its axis.
  [[nodiscard]] Answer clearance(const RoundCone& tool, Vec3 start_mm, Vec3 axis) const noexcept;

  [[nodiscard]] double reach_mm() const { return reach_mm_; }
  [[nodiscard]] const std::vector<Structure>& structures() const { return structures_; }
  /// The surface of all structures, closed, and for each point which it belongs to.
  [[nodiscard]] std::pair<TriMesh, std::vector<std::uint8_t>> surface(const Context& context = {}) const;
  /// Red, green, blue, 0 to 1: the map's own, or one of a fixed row.
  [[nodiscard]] std::array<double, 3> colour_of(std::uint8_t structure) const;
  [[nodiscard]] std::string name_of(std::uint8_t structure) const;  ///< "structure 3" where the map has no name
  [[nodiscard]] std::size_t memory_bytes() const { return closeness_.memory_bytes() + nearest_.memory_bytes(); }
  [[nodiscard]] std::string hash() const;

 private:
  BrickGrid closeness_, nearest_;  // closeness: reach less distance, so that what is not stored is far
  double reach_mm_;
  std::vector<Structure> structures_;
};

}  // namespace osteo
