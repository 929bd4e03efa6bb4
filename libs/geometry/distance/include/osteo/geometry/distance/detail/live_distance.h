// A band of exact distances that follows a surface while it changes.
#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "osteo/geometry/distance/distance_map.h"

namespace osteo::inline geometry {

/// Says of a voxel whether it is inside now: the voxels themselves know, when it is their surface.
using InsideAt = std::function<bool(int i, int j, int k)>;

/// Exact signed distances of all voxels within `reach_mm` of a surface, which stay exact when triangles are taken away
/// and others come: after an update every voxel has what a new map of the whole would have. Work is in proportion to
/// the voxels whose nearest triangle went, or to which a new one may be nearer; for a 3 mm burr's bite well below a
/// millisecond. One thread at a time.
class LiveDistance {
 public:
  /// `frame`: isotropic or not, any axes. Errors as of TriangleTree (a surface without triangles is allowed here).
  LiveDistance(const TriangleSoup& surface, const Frame& frame, double reach_mm, const InsideAt& inside,
               const Context& context = {});

  /// Takes triangles away (by the numbers that `add`ing gave; the first surface has 0, 1, ...) and adds others. Returns
  /// the number of the first one added; the others follow. Error usage for a number that is not there.
  std::uint32_t update(std::span<const std::uint32_t> removed, std::span<const std::array<Vec3, 3>> added,
                       const InsideAt& inside);

  struct Sample {
    double distance_mm = 0;  ///< negative inside
    std::uint32_t triangle = ClosestPoint::kNone;
    [[nodiscard]] bool stored() const { return triangle != ClosestPoint::kNone; }
  };
  /// Not stored: farther than the reach.
  [[nodiscard]] Sample at(int i, int j, int k) const;
  [[nodiscard]] const Frame& frame() const { return frame_; }
  /// Voxels measured in the last update.
  [[nodiscard]] std::uint64_t touched() const { return touched_; }

 private:
  struct Brick {
    std::array<double, 512> distance_mm;
    std::array<std::uint32_t, 512> triangle;
  };
  [[nodiscard]] std::size_t cell(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(cells_[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(cells_[0]) +
           static_cast<std::size_t>(i);
  }
  [[nodiscard]] Brick& brick_for(int bi, int bj, int bk);
  [[nodiscard]] std::array<int, 3> cell_of(const std::array<Vec3, 3>& t) const;
  void measure(std::array<int, 3> lo, std::array<int, 3> hi, const VoxelBits& wanted, const InsideAt& inside);

  Frame frame_;
  double reach_mm_;
  std::vector<std::array<Vec3, 3>> triangles_;
  std::vector<std::uint8_t> alive_;
  std::array<int, 3> cells_{};                       // of 8 voxels
  std::vector<std::vector<std::uint32_t>> in_cell_;  // by the triangle's centre
  double largest_mm_ = 0;                            // from a triangle's centre to its corner
  std::vector<std::int32_t> table_;                  // brick -> place in bricks_, or -1
  std::vector<Brick> bricks_;
  std::uint64_t touched_ = 0;
};

}  // namespace osteo::inline geometry
