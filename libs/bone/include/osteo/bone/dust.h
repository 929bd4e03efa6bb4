// Bone dust: what the burr leaves behind, until it is sucked off.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "osteo/bone/round_cone.h"
#include "osteo/grid/brick_grid.h"

namespace osteo {

struct DustParams {
  Vec3 gravity{0, 1, 0};  ///< LPS; a patient on the back: towards the back. Its nearest grid axis is taken
  double packing = 0.35;  ///< mm3 of bone that a mm3 of loose chips holds
};

/// Density of dust on cells as large as the bone's voxels, in hashed bricks, not particles (D. Morris 2006, section 3.2.8): a step lets it
/// fall by a cell, slide to lower neighbours (so it piles at 45 degrees), and spread where a cell is too full. Amounts are whole numbers of
/// a 65,536th of a voxel, so nothing is lost or made: what was added is what lies there, was sucked off, washed away or fell out of reach.
/// Bricks in which nothing moves sleep and cost nothing. The same calls give the same dust. Reads the bone while the servo writes it. Cost:
/// about 15 ns a cell of bricks that are awake; push, suck and irrigate a few ns a cell of the bricks of dust they meet, however large
/// their radius. Memory: 2 KB a brick that holds dust.
class Dust {
 public:
  /// The bone must outlive this.
  explicit Dust(const BrickGrid& bone, const DustParams& params = {});

  /// Dust where bone was removed; what is no whole unit waits for the next call.
  void add(VoxelKey voxel, double mm3) { add(bone_.coordinate(voxel), mm3); }
  void add_at(Vec3 world_mm, double mm3);
  /// Bone went or came in this brick by other means: what lies there and beside it looks again.
  void bone_changed(std::uint32_t brick);
  /// Moves all dust by one cell at most; call it as often as a second has cells: 100 a second are 50 mm/s at 0.5 mm.
  void step();
  /// Out of the tool's way, along its surface's normals.
  void push(const RoundCone& tool, Vec3 start_mm, Vec3 axis);
  /// Takes up to `mm3` from within the radius, nearest cells first; returns what it took.
  double suck(Vec3 nozzle_mm, double radius_mm, double mm3);
  /// Water: carries the share away from within the radius; returns how much.
  double irrigate(Vec3 at_mm, double radius_mm, double share);

  struct Totals {
    double added_mm3 = 0, present_mm3 = 0, sucked_mm3 = 0, washed_mm3 = 0, fallen_mm3 = 0;  ///< added = the sum of the others, exactly
  };
  [[nodiscard]] Totals totals() const;
  /// Of all that lies where.
  [[nodiscard]] std::string hash() const;
  /// Cells that hold dust, in a fixed order: middle of the cell in mm and how full it is (1: packed).
  void visit(const std::function<void(Vec3, double)>& cell) const;
  [[nodiscard]] std::size_t awake_bricks() const { return awake_.size(); }
  [[nodiscard]] std::size_t memory_bytes() const { return bricks_.size() * sizeof(Brick); }

 private:
  static constexpr double kUnitsAVoxel = 65536;
  static constexpr int kReach = 8;  // bricks beyond the bone's box
  struct Brick {
    Ijk at;  // in bricks
    std::array<std::uint32_t, 512> units{};
    bool awake = false;
  };
  [[nodiscard]] static std::uint64_t key(int bi, int bj, int bk) {
    return (static_cast<std::uint64_t>(bi + 0x8000) << 32) | (static_cast<std::uint64_t>(bj + 0x8000) << 16) |
           static_cast<std::uint64_t>(bk + 0x8000);
  }
  [[nodiscard]] bool solid(Ijk c) const { return bone_.at(c.i, c.j, c.k) >= 0.5F; }
  [[nodiscard]] bool in_reach(Ijk c) const;
  void add(Ijk cell, double mm3);
  std::uint32_t* cell(Ijk c, bool make);
  void wake(Ijk c);
  void step_brick(Brick& brick);
  std::uint32_t move(std::uint32_t& from, Ijk to, std::uint32_t most);
  template <class F>
  void in_ball(Vec3 centre_mm, double radius_mm, F&& f);

  const BrickGrid& bone_;
  std::uint32_t capacity_;
  int axis_ = 1, sign_ = 1;  // of gravity
  std::vector<std::unique_ptr<Brick>> bricks_;
  std::unordered_map<std::uint64_t, std::uint32_t> index_;
  std::vector<std::uint32_t> awake_, next_;
  double carry_ = 0;
  std::uint64_t added_ = 0, sucked_ = 0, washed_ = 0, fallen_ = 0;
  std::uint64_t steps_ = 0;
};

}  // namespace osteo
