// Bone dust and water: what the burr leaves behind, dry or as slurry, until it is sucked off.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/simulation/bone/round_cone.h"

namespace osteo::inline simulation {

struct DustParams {
  Vec3 gravity{0, 1, 0};  ///< LPS; a patient on the back: towards the back (down_of() of others)
  double packing = 0.35;  ///< mm3 of bone that a mm3 of loose chips holds
};

/// Raise it whenever the same calls come to lie elsewhere: sessions keep it, and a replay compares dust of its own
/// model only.
inline constexpr int kDustModel = 2;

/// Density of dust on cells as large as the bone's voxels, in hashed bricks, not particles (D. Morris 2006,
/// section 3.2.8): a step lets it fall by a cell along gravity, whose direction no axis need follow, slide to
/// neighbours that lie steeper than 40 degrees below, and spread where a cell is too full. Water falls faster into any
/// lower neighbour, takes dust along (slurry, up to kMaxSolid of its volume), leaves a film where it ran, which dries
/// within kDrySeconds and drops what it carried, and stands level where it collects: ten times a second what hangs
/// together and rests on something is filled again from below. Tools go through water without displacing it. Amounts
/// are whole numbers of a 65,536th of a voxel, so nothing is lost or made: bone that was added lies there, is in
/// slurry, was sucked off or ran out of reach; water likewise. Bricks in which nothing moves sleep and cost nothing.
/// The same calls give the same dust. Reads the bone while the servo writes it. Cost: about 15 ns a cell of bricks that
/// are awake, 130 where all of them are water in motion; suck and push a few ns a cell of the bricks they meet, however
/// large their radius. Memory: 2 KB a brick that holds dust, 6 with water.
class Dust {
 public:
  static constexpr double kMaxSolid = 0.3;      ///< bone in slurry, by volume: above it no longer pours (a guess)
  static constexpr double kFilm = 1.0 / 16;     ///< of a cell, that stays on wet bone: 0.03 mm at 0.5 mm
  static constexpr double kDrySeconds = 90;     ///< of a hundred steps, until a film is gone (a guess)
  static constexpr double kLiquidForDust = 25;  ///< a sucker takes so many times as much liquid as dry dust (a guess)

  /// The bone must outlive this.
  explicit Dust(const BrickGrid& bone, const DustParams& params = {});

  /// Another direction: all of it looks again. The zero vector and what is not finite: nothing changes.
  void set_gravity(Vec3 direction);
  /// Dust where bone was removed; what is no whole unit waits for the next call.
  void add(VoxelKey voxel, double mm3) { add(bone_.coordinate(voxel), mm3); }
  void add_at(Vec3 world_mm, double mm3);
  /// Bone went or came in this brick by other means: what lies there and beside it looks again.
  void bone_changed(std::uint32_t brick);
  /// Moves all by one cell at most; call it as often as a second has cells: 100 a second are 50 mm/s at 0.5 mm.
  void step();
  /// Dust out of the tool's way, along its surface's normals.
  void push(const RoundCone& tool, Vec3 start_mm, Vec3 axis);
  /// Takes up to `mm3` of dry dust and kLiquidForDust times as much of slurry from within the radius, nearest cells
  /// first; returns how much bone that was.
  double suck(Vec3 nozzle_mm, double radius_mm, double mm3);
  /// A jet of water from the nozzle: onto the first bone in this direction (unit; zero: gravity's), or down from where
  /// it ends.
  void irrigate(Vec3 nozzle_mm, Vec3 direction, double reach_mm, double mm3);

  struct Totals {
    /// Bone. added = the sum of the others, exactly.
    double added_mm3 = 0, present_mm3 = 0, slurry_mm3 = 0, sucked_mm3 = 0, fallen_mm3 = 0;
    /// Water without the bone in it. poured = the sum of the others, exactly.
    double poured_mm3 = 0, water_mm3 = 0, water_sucked_mm3 = 0, dried_mm3 = 0, run_off_mm3 = 0;
  };
  [[nodiscard]] Totals totals() const;
  /// Of all that lies where.
  [[nodiscard]] std::string hash() const;
  /// Cells that hold dry dust, in a fixed order: middle of the cell in mm and how full it is (1: packed).
  void visit(const std::function<void(Vec3, double)>& cell) const;
  /// Whether dust of this cell falls freely: for so many cells along gravity there is neither bone nor packed dust.
  /// Where nothing moves nothing falls. Cost: some ten ns a cell looked at.
  [[nodiscard]] bool falls(Ijk cell, int cells) const;
  /// Cells that hold water: place in the bone's grid, how full (1: to the brim), and how much of that is bone (0 to
  /// kMaxSolid, more only in a film that dries).
  void visit_liquid(const std::function<void(Ijk, double, double)>& cell) const;
  /// Grows whenever anything moved, came or went.
  [[nodiscard]] std::uint64_t version() const { return version_; }
  [[nodiscard]] const BrickGrid& bone() const { return bone_; }
  [[nodiscard]] Vec3 gravity() const { return gravity_; }
  [[nodiscard]] std::size_t awake_bricks() const { return awake_.size(); }
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  static constexpr double kUnitsAVoxel = 65536;
  static constexpr std::uint32_t kFull = 65536, kFilmUnits = static_cast<std::uint32_t>(kFull * kFilm);
  static constexpr int kReach = 8;  // bricks beyond the bone's box
  struct Water {
    std::array<std::uint32_t, 512> units{};  // of liquid, the bone in it included
    std::array<std::uint32_t, 512> solid{};  // of bone in it
  };
  struct Brick {
    Ijk at;  // in bricks
    std::array<std::uint32_t, 512> units{};
    std::unique_ptr<Water> water;
    std::array<Brick*, 6> beside{};         // -x, +x, -y, +y, -z, +z; null where there is none
    std::array<std::uint64_t, 8> marked{};  // cells that the level's search has met
    std::uint32_t bone = BrickGrid::kNone;
    bool awake = false;
    bool stirred = false;  // water moved in it since pools were levelled
  };
  struct Offset {
    Ijk by;
    double slope;  // tangent of its angle below the horizontal; large: straight down
  };
  // A brick's 26 neighbours, looked up once: nothing reaches farther in a step.
  struct Hood;
  class Flow;   // the water of a brick, in a step
  class Pools;  // water that stands
  [[nodiscard]] static std::uint64_t key(int bi, int bj, int bk) {
    return (static_cast<std::uint64_t>(bi + 0x8000) << 32) | (static_cast<std::uint64_t>(bj + 0x8000) << 16) |
           static_cast<std::uint64_t>(bk + 0x8000);
  }
  [[nodiscard]] bool solid(Ijk c) const { return bone_.at(c.i, c.j, c.k) >= 0.5F; }
  [[nodiscard]] static std::uint32_t room_of(float density) {
    return density >= 0.5F ? 0 : static_cast<std::uint32_t>((1.0F - density) * 65536.0F);
  }
  [[nodiscard]] bool in_reach(Ijk c) const;
  void add(Ijk cell, double mm3);
  Brick* brick_at(Ijk c, bool make);
  std::uint32_t* cell(Ijk c, bool make);
  void wake(Ijk c);
  void step_brick(Brick& brick);
  void step_water(Brick& brick, Hood& hood, Ijk down);
  void level_pools();
  void dry();
  bool rests(Brick& brick, std::uint32_t at) const;
  std::uint32_t move(std::uint32_t& from, Ijk to, std::uint32_t most);
  template <class F>
  void in_ball(Vec3 centre_mm, double radius_mm, F&& f);
  [[nodiscard]] std::vector<const Brick*> in_order() const;

  const BrickGrid& bone_;
  std::uint32_t capacity_;
  Vec3 gravity_{}, pull_{};             // LPS; along the grid's axes
  int axis_ = 1, sign_ = 1;             // the nearest grid axis
  std::vector<Offset> slides_, lower_;  // steepest first
  std::vector<std::unique_ptr<Brick>> bricks_;
  std::unordered_map<std::uint64_t, std::uint32_t> index_;
  std::vector<std::uint32_t> awake_, next_;
  double carry_ = 0, water_carry_ = 0;
  std::uint64_t added_ = 0, sucked_ = 0, fallen_ = 0;                      // bone
  std::uint64_t poured_ = 0, water_sucked_ = 0, dried_ = 0, run_off_ = 0;  // water
  std::uint64_t steps_ = 0, version_ = 0;
  bool wet_ = false;
};

}  // namespace osteo::inline simulation
