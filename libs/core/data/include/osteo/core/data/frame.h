// Where a grid of voxels lies in the patient.
#pragma once
#include <array>
#include <cstddef>
#include <string>

#include "osteo/core/data/vec.h"

namespace osteo {

/// World is DICOM's LPS in millimetres: +x to the patient's left, +y to the back, +z to the head.
/// world = origin_mm + direction * (spacing_mm * ijk); the origin is the centre of voxel (0,0,0).
struct Frame {
  std::array<int, 3> dims{0, 0, 0};
  Vec3 spacing_mm{1, 1, 1};
  Vec3 origin_mm{};
  Mat3 direction{};  ///< columns of unit length at right angles; may be left-handed

  [[nodiscard]] std::size_t voxel_count() const {
    return static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) * static_cast<std::size_t>(dims[2]);
  }
  [[nodiscard]] double voxel_volume_mm3() const { return spacing_mm.x * spacing_mm.y * spacing_mm.z; }
  [[nodiscard]] Vec3 world_from_index(Vec3 ijk) const {
    return origin_mm + direction * Vec3{ijk.x * spacing_mm.x, ijk.y * spacing_mm.y, ijk.z * spacing_mm.z};
  }
  [[nodiscard]] Vec3 index_from_world(Vec3 world_mm) const {
    const Vec3 v = inverse(direction) * (world_mm - origin_mm);
    return {v.x / spacing_mm.x, v.y / spacing_mm.y, v.z / spacing_mm.z};
  }
  [[nodiscard]] Vec3 centre_mm() const {
    return world_from_index({(dims[0] - 1) / 2.0, (dims[1] - 1) / 2.0, (dims[2] - 1) / 2.0});
  }
  friend bool operator==(const Frame&, const Frame&) = default;
};

/// Throws Error(corrupt) that says what is wrong: no voxels, more than 1e18, spacing not positive and finite, direction
/// not orthonormal (beyond 1e-3; smaller deviations are accepted).
void require_valid(const Frame& frame);

/// True when both put every voxel at the same place to within `tolerance_mm`.
[[nodiscard]] bool same_place(const Frame& a, const Frame& b, double tolerance_mm = 1e-3);

/// Three letters for the index axes, e.g. "LPS" or "RAI": where each axis points, to the nearest body direction.
[[nodiscard]] std::string orientation_code(const Frame& frame);

}  // namespace osteo
