// How deep a place of a surface lies: how much of the light from all around reaches it.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "osteo/core/data/vec.h"
#include "osteo/geometry/grid/brick_grid.h"

namespace osteo::inline display {

/// The share of the sky above a face that bone leaves free, weighted by the cosine to the face's normal, as far as
/// kReachMm: 1 on a flat or bulging face, small at the bottom of a drilled hole. By five cones through the bone's
/// density, averaged over cells of about 1, 2 and 4 mm (cone tracing: Crassin and others 2011). It depends on the bone
/// alone, not on the eye, so a picture costs nothing for it. Against the exact share at the bottom of round holes:
/// docs/validation/accuracy.md. Memory: about 1.2 bytes for each mm3 of the bone's box. For drawing only; not thread-safe while
/// renew() runs; it may read the bone while the servo writes it.
class Openness {
 public:
  static constexpr double kReachMm = 8;

  explicit Openness(const BrickGrid& bone, int threads = 0);
  /// Voxels of these bricks have changed. About 1 us a brick and 512 voxels.
  void renew(const BrickGrid& bone, std::span<const std::uint32_t> bricks);
  /// At a point of the surface in voxel indices, with its unit normal out of the bone along the index axes. 0.3 us.
  /// Other bone of the same world stands in the light too: where it is within reach, as long again for each.
  [[nodiscard]] double at(const std::array<float, 3>& index, const std::array<float, 3>& normal,
                          std::span<const std::shared_ptr<const Openness>> others = {}) const;

 private:
  struct Level {
    std::array<int, 3> n{};
    std::vector<std::uint8_t> cells;  // mean density in 255ths
    double edge_voxels = 1;
  };
  [[nodiscard]] bool reaches(Vec3 world_mm) const;
  [[nodiscard]] static double sample(const Level& level, Vec3 index);
  void sum_brick(const BrickGrid& bone, std::uint32_t brick);
  void sum_above(std::size_t level, std::array<int, 3> lo, std::array<int, 3> hi);
  Frame frame_;
  std::array<Vec3, 2> box_;  // of all its bricks, in voxels
  int edge_;                 // voxels along an edge of the finest cells
  std::array<Level, 3> levels_;
};

}  // namespace osteo::inline display
