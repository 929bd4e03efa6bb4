// Voxels in bricks of 8^3 behind a flat table: the form in which bone is drilled and its surface made.
#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "osteo/core/data/frame.h"
#include "osteo/core/data/sparse_grid.h"

namespace osteo::inline geometry {

struct Ijk {
  int i = 0, j = 0, k = 0;
  friend bool operator==(Ijk, Ijk) = default;
};

/// A name for one stored voxel: brick number times 512 plus the place in the brick (x fastest).
using VoxelKey = std::uint32_t;

/// The set of bricks is fixed when the grid is made; values may change. A voxel outside every brick reads as 0.
/// Limits: kMaxBricks bricks, since names are 32 bits wide (17 GB of densities), in a box of at most kMaxCells bricks
/// (a table of 0.5 GB: 0.2 mm over 820 mm each way), 2^17 - 1 of them along an axis. One thread writes (`set`), others
/// may read at the same time (`at`): each value is a relaxed atomic, so a reader sees old or new values, never torn
/// ones. A copy has values of its own; sharing() gives a grid that has all bricks in common with this one, until one of
/// the two takes some for itself (own_brick, empty_bricks) or from elsewhere (share_brick). What is written into a
/// brick is seen in all grids that have it. Memory: 4 bytes a voxel of each brick, shared ones once, 28 bytes a brick,
/// and 4 for each brick of the bounding box. Bricks that are made empty cost no memory until something is written into
/// them. What a grid was made with is given back when none of its bricks is in use any more; bricks that were made its
/// own one by one.
class BrickGrid {
 public:
  static constexpr int kEdge = 8;
  static constexpr int kVoxels = kEdge * kEdge * kEdge;
  static constexpr std::uint32_t kNone = 0xffffffffU;
  static constexpr std::uint32_t kMaxBricks =
      (1U << 23) - 1;  ///< one less than there are numbers: kNone is the last voxel's name
  static constexpr std::uint64_t kMaxCells = 1ULL << 27;

  BrickGrid() = default;
  /// All-zero bricks at the given brick coordinates (>= 0, each at most once, any order; they are sorted z, y, x).
  /// Error(corrupt) where they are beyond the limits.
  BrickGrid(Frame frame, std::vector<Ijk> bricks);
  /// All-zero, with every brick that holds a voxel of the frame.
  [[nodiscard]] static BrickGrid dense(const Frame& frame);
  BrickGrid(const BrickGrid& other);
  BrickGrid(BrickGrid&&) noexcept = default;
  BrickGrid& operator=(BrickGrid&&) noexcept = default;

  [[nodiscard]] const Frame& frame() const { return frame_; }
  [[nodiscard]] std::size_t brick_count() const { return origins_.size(); }
  [[nodiscard]] Ijk brick_coordinate(std::uint32_t brick) const { return origins_[brick]; }
  /// kNone when there is no such brick.
  [[nodiscard]] std::uint32_t find_brick(int bi, int bj, int bk) const {
    if (static_cast<unsigned>(bi) >= extent_[0] || static_cast<unsigned>(bj) >= extent_[1] ||
        static_cast<unsigned>(bk) >= extent_[2])
      return kNone;
    return table_[(static_cast<std::size_t>(bk) * extent_[1] + static_cast<std::size_t>(bj)) * extent_[0] +
                  static_cast<std::size_t>(bi)];
  }
  [[nodiscard]] static constexpr std::uint32_t offset_in_brick(int i, int j, int k) {
    return static_cast<std::uint32_t>((i & 7) | (j & 7) << 3 | (k & 7) << 6);
  }
  /// kNone when the voxel is not stored.
  [[nodiscard]] VoxelKey find(int i, int j, int k) const {
    const std::uint32_t b = find_brick(i >> 3, j >> 3, k >> 3);
    return b == kNone ? kNone : b * kVoxels + offset_in_brick(i, j, k);
  }
  [[nodiscard]] Ijk coordinate(VoxelKey key) const {
    const Ijk b = origins_[key / kVoxels];
    const int o = static_cast<int>(key % kVoxels);
    return {b.i * 8 + (o & 7), b.j * 8 + (o >> 3 & 7), b.k * 8 + (o >> 6)};
  }
  [[nodiscard]] float value(VoxelKey key) const {
    return std::atomic_ref<float>(bricks_[key / kVoxels].get()[key % kVoxels]).load(std::memory_order_relaxed);
  }
  [[nodiscard]] float at(int i, int j, int k) const {
    const VoxelKey key = find(i, j, k);
    return key == kNone ? 0.0F : value(key);
  }
  /// The value of the voxel that holds a point of the world.
  [[nodiscard]] float nearest(Vec3 world_mm) const {
    const Vec3 x = frame_.index_from_world(world_mm);
    const auto round = [](double v) { return static_cast<int>(std::floor(v + 0.5)); };
    return at(round(x.x), round(x.y), round(x.z));
  }
  /// The 512 values of a brick, x fastest, for the thread that writes (or when nobody does): plain loads, so vectors.
  [[nodiscard]] const float* values_of_brick(std::uint32_t brick) const { return bricks_[brick].get(); }
  void set(VoxelKey key, float v) {
    std::atomic_ref<float>(bricks_[key / kVoxels].get()[key % kVoxels]).store(v, std::memory_order_relaxed);
  }

  /// The same voxels, none of them copied. O(bricks).
  [[nodiscard]] BrickGrid sharing() const;
  /// From now on this grid has the brick for itself, with the values it had; or, of empty_bricks, with zeros. While
  /// another thread reads or writes this grid, call it on a grid that shares with it, not on this one.
  void own_brick(std::uint32_t brick);
  void empty_bricks(std::span<const std::uint32_t> bricks);
  /// From now on the brick is the same as brick `from` of `other`.
  void share_brick(std::uint32_t brick, const BrickGrid& other, std::uint32_t from) {
    bricks_[brick] = other.bricks_[from];
  }
  [[nodiscard]] bool shares_brick(std::uint32_t brick, const BrickGrid& other, std::uint32_t from) const {
    return bricks_[brick] == other.bricks_[from];
  }

  /// Copies the block of voxels [lo, lo + n) into `out`, x fastest; voxels that are not stored are 0.
  void read_block(Ijk lo, std::array<int, 3> n, float* out) const;
  /// Sum over all voxels in brick order: the same for the same content.
  [[nodiscard]] double sum() const;
  [[nodiscard]] std::size_t memory_bytes() const;
  /// Content hash of frame, bricks and values.
  [[nodiscard]] std::string hash() const;

 private:
  Frame frame_;
  std::array<std::uint32_t, 3> extent_{0, 0, 0};  // bricks along each axis
  std::vector<std::uint32_t> table_;
  std::vector<Ijk> origins_;  // in bricks
  std::vector<std::shared_ptr<float>>
      bricks_;  // kVoxels values each; those that were made together keep one block alive
};

/// Whether so many bricks, or bricks within a box of so many along each axis, are more than a BrickGrid takes.
[[nodiscard]] constexpr bool too_many_bricks(std::uint64_t bricks) {
  return bricks > BrickGrid::kMaxBricks;
}
[[nodiscard]] constexpr bool too_wide_for_bricks(std::array<std::uint64_t, 3> n) {
  // Along an axis 2^20 voxels less a brick: surfaces name a cell by 20 bits an axis. That also keeps the products from
  // overflowing.
  constexpr std::uint64_t most = BrickGrid::kMaxCells, along = (std::uint64_t{1} << 17) - 1;
  return n[0] > along || n[1] > along || n[2] > along || n[0] * n[1] > most || n[0] * n[1] * n[2] > most;
}
/// All leaves that hold a value > 0, or with `all` every leaf that stores anything. O(stored voxels). Error(corrupt)
/// where the grid is beyond the limits of a BrickGrid.
[[nodiscard]] BrickGrid to_bricks(const SparseGrid& grid, bool all = false);
/// Bricks with only zeros are left out; equal values come back bit for bit.
[[nodiscard]] SparseGrid to_sparse(const BrickGrid& bricks, const std::string& name);

}  // namespace osteo::inline geometry
