// Which part of each voxel the burr has reached.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/simulation/bone/action.h"
#include "osteo/simulation/bone/round_cone.h"

namespace osteo::inline simulation {

/// Bone goes only where the burr has been. The bone of a voxel that the burr covers in part is kept as grains, points
/// spread evenly through it, which are lost for good once the burr has covered them, whenever that was: what is left of
/// them is what the voxel's density may not fall below. Where bone fills a voxel in part, the grains lie on the inner
/// side of the plane that its neighbours tell of (as they were before any drilling) and that leaves as much bone.
/// Voxels that the burr has covered whole need a bit each, those that it has not touched nothing but a byte for what
/// they were. 64 grains a voxel below 0.28 mm, 512 below 0.56 mm, 4096 above. Memory: 1.25 bytes a voxel of the bone,
/// and at most 17 to 30 MB for room() voxels that the burr has covered in part. All of it is made at once; the rest
/// neither allocates nor locks.
class Grains {
 public:
  /// `bone` as nobody has drilled it yet, as large as it is when used; nobody writes it meanwhile.
  explicit Grains(const BrickGrid& bone);

  /// Takes over what is known of another bone of the same grid that this one came out of by sawing, taking apart or
  /// putting together. Voxels that have more bone than there count as untouched. Not in the servo, and while nobody
  /// writes either bone or `known`. O(voxels).
  void inherit(const BrickGrid& bone, const BrickGrid& from, const Grains& known);

  /// A bit for each voxel, in the order of their keys, the lowest first in each byte: a burr has covered it in part.
  [[nodiscard]] const std::uint8_t* begun() const { return begun_.data(); }
  [[nodiscard]] bool begun(VoxelKey voxel) const { return (begun_[voxel / 8] >> (voxel % 8) & 1) != 0; }
  /// How much bone, of `density`, a shape has in a voxel that is begun, when it covers `share` of it with its surface's
  /// unit `normal` outwards, in voxels. What a burr may still take there lies at the edge of what it has covered, what
  /// it has never covered beyond that: a burr that rests where it has taken all feels nothing, so that what presses on
  /// a burr is what it can take. A shape that comes from another side than the burr did finds the bone spread through
  /// the voxel. Cost: 20 ns.
  struct Felt {
    float bone = 0, slope = 0;  ///< shares of the voxel; how fast it grows with `share`
  };
  [[nodiscard]] Felt felt(VoxelKey voxel, float density, float share, const float* normal) const noexcept;

  /// A hand's burr turns here from now on. `start_mm`, `axis`: of the head, in the bone's frame. `every`: each voxel
  /// asked for is looked at.
  void place(const BrickGrid& bone, const RoundCone& head, Vec3 start_mm, Vec3 axis, bool every = false,
             std::size_t hand = 0) noexcept;
  /// Takes what the burr covers of a voxel where it is placed, and tells how much bone is left that it never covered:
  /// density cannot fall below. `share` of the voxel is what it covers by the measure of who asks: at the same place it
  /// will feel what it may take there, and no more. Unless `every` voxel is looked at, rows of them take turns while
  /// the burr moves little. Cost: 5 ns where it covers the voxel whole, else 0.02 (64 grains) to 0.4 us, twice that for
  /// tapers.
  [[nodiscard]] float reach(const BrickGrid& bone, VoxelKey voxel, float share = 1) noexcept;

  /// How many voxels can be covered in part at a time; the next ones stay as they are until the burr covers them whole.
  [[nodiscard]] std::size_t room() const { return slots_.size() / 2; }
  [[nodiscard]] std::size_t used() const { return used_; }
  /// A voxel was left whole for want of room since this was last asked.
  [[nodiscard]] bool overflowed() noexcept {
    const bool was = overflowed_;
    overflowed_ = false;
    return was;
  }
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Slot {
    VoxelKey voxel = BrickGrid::kNone;
    float grain = 0;  // density of one
    std::uint32_t left = 0;
    float seen = 0;                        // the largest share that was measured when grains were taken
    std::array<std::int8_t, 3> towards{};  // the burr's normal then, in 127ths
  };
  [[nodiscard]] std::size_t home(VoxelKey voxel) const noexcept;
  std::size_t find(VoxelKey voxel) const noexcept;  // its slot, or the free one where it would be
  void erase(std::size_t slot) noexcept;
  void fill(const BrickGrid& bone, VoxelKey voxel, std::size_t slot) noexcept;

  std::vector<std::uint8_t> before_;    // density in 1/255 before any drilling
  std::vector<std::uint64_t> covered_;  // whole voxels, a bit each
  std::vector<std::uint8_t> begun_;     // those with a slot, a bit each
  std::vector<Slot> slots_;             // open addressing, at most half full
  std::vector<std::uint64_t> grains_;   // words_ to each slot, a bit for each that is left
  std::uint32_t parts_ = 1;             // along each edge of a voxel; 64 grains, a word, in each
  std::size_t words_ = 1, used_ = 0;
  bool overflowed_ = false;
  // The burr in voxels, as the kernel has it; its axis starts at its hand's start.
  struct Head {
    float axis[3] = {}, length = 0, start_radius = 0, slope = 0, slope_run = 0;
    bool ball = true;
  } head_;
  struct Place {
    Vec3 start, axis;
    std::uint32_t turn = 0;
  };
  std::array<Place, kMaxHands> places_;  // of each hand's burr when it was last placed
  Vec3 start_;                           // of the one placed now
  std::uint32_t turns_ = 1, turn_ = 0;
};

}  // namespace osteo::inline simulation
