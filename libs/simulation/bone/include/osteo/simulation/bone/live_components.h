// Which parts of live bone still are connected.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/imaging/image/components.h"

namespace osteo::inline simulation {

/// How a piece's bricks relate to those of the bone it came from.
struct PieceOrigin {
  std::vector<std::uint32_t> brick;  ///< piece's brick -> brick of the whole
  std::vector<std::uint8_t>
      unchanged;  ///< piece's brick -> 1 where it and all bricks around it are as they were in the whole
};

/// Connected parts of the voxels with density of at least a half, kept up to date while bone is removed: labels within
/// each brick, links between bricks, both made again only where voxels changed; then all joined by union-find. About 10
/// us for a changed brick and 1 ms for the joining in a whole head. Reads the bone while the servo writes it; what it
/// misses is marked and seen in the next update. `face`: voxels that share a face are connected (so does the surface's
/// triangle mesh, nearly); `full`: an edge or a corner is enough. Memory: 576 bytes a brick and about 100 a part of a
/// brick.
class LiveComponents {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffU;

  /// Labels everything. The bone must outlive this.
  explicit LiveComponents(const BrickGrid& bone, Connectivity connectivity = Connectivity::face);

  /// A piece of a bone whose labels are known: takes over those of bricks that went to it as they were, which the whole
  /// then counts as empty. Equals the labelling of the piece.
  LiveComponents(const BrickGrid& piece, LiveComponents& whole, const PieceOrigin& origin);
  /// The other way round: a piece is part of the whole again.
  void take_back(LiveComponents& piece, const PieceOrigin& origin);
  /// From now on reads another grid of the same bricks; mark what differs.
  void rebind(const BrickGrid& bone) { bone_ = &bone; }

  /// Notes that a voxel changed. O(1).
  void mark(VoxelKey voxel) { mark_brick(voxel / BrickGrid::kVoxels); }
  void mark_brick(std::uint32_t brick);

  struct Component {
    std::uint64_t voxels = 0;
    VoxelKey first =
        BrickGrid::kNone;  ///< its first voxel in brick order: a name that stays while the part is not cut there
    double mass = 0;       ///< sum of densities; times the voxel's volume: mm3 of bone
    Vec3 centre_mm;        ///< of mass
    std::array<double, 6>
        inertia_mm2{};  ///< about the centre along the world's axes, for mass 1 a voxel: xx, yy, zz, xy, xz, yz
  };
  /// Brings labels up to date; components ascending by first voxel, the same as labelling again. Valid until the next
  /// update.
  std::span<const Component> update();
  /// Index into what update() gave; kNone for a voxel that is not solid.
  [[nodiscard]] std::uint32_t component_of(VoxelKey voxel) const;
  /// As of the last update.
  [[nodiscard]] std::span<const Component> components() const { return components_; }
  /// Of the parts within a brick, in the order of their first voxels.
  [[nodiscard]] std::span<const std::uint32_t> components_of_brick(std::uint32_t brick) const {
    return {component_of_part_.data() + bricks_[brick].first_part, bricks_[brick].parts.size()};
  }
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  // Sums over the voxels of one part of a brick, in the grid's index coordinates.
  struct Part {
    std::uint32_t voxels = 0;
    std::uint16_t first = 0;
    double mass = 0;
    std::array<double, 3> moment{};
    std::array<double, 6> second{};
  };
  struct Link {
    std::uint8_t from, to;
    std::uint32_t brick;
  };
  struct Brick {
    std::array<std::uint64_t, 8> solid{};
    std::array<std::uint8_t, 512> label{};
    std::vector<Part> parts;
    std::vector<Link> links;  // to bricks further on in x, y, z
    std::uint32_t first_part = 0;
  };
  void label(std::uint32_t brick);
  void link(std::uint32_t brick);
  void join_parts();

  const BrickGrid* bone_;
  std::vector<Ijk> steps_;  // to neighbours further on: 3 or 13
  std::vector<Brick> bricks_;
  std::vector<std::uint32_t> dirty_;
  std::vector<std::uint8_t> is_dirty_, relink_;
  std::vector<std::uint32_t> parent_, component_of_part_;
  std::vector<Component> components_;
};

}  // namespace osteo::inline simulation
