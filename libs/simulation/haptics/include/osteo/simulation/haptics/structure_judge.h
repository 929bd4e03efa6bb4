// What a step takes of critical structures: burrs, saws by their plane and by hand, shafts, the screws of plates. The
// one judge: the session's summary, the score and the page at the end have their volumes from here.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "osteo/geometry/mesh/soup.h"
#include "osteo/simulation/bone/structure_map.h"
#include "osteo/simulation/haptics/stream.h"

namespace osteo::inline simulation {

enum class CutBy : int {
  saw,           ///< by its plane
  burr,          ///< turning
  hand_saw,      ///< running, in the hand
  shaft,         ///< of any instrument, whether it turns or not
  plate_screws,  ///< as long as they are drawn
};
[[nodiscard]] constexpr std::array<std::string_view, 5> enum_names(CutBy) {
  return {"saw", "burr", "hand saw", "shaft", "plate screws"};
}
[[nodiscard]] std::string_view name_of(CutBy by);

/// Something went through a critical structure or touched it: one for each time and place.
struct StructureCutEvent {
  std::uint64_t tick = 0;  ///< at which it began
  StructureCut cut;        ///< where, in the frame of the first body; mm3 0: contact, nothing was taken
  CutBy by = CutBy::saw;
  std::uint32_t hand = 0;  ///< whose; 0 for saws by their plane and screws
};

/// "the shaft went through the facial nerve (2.4 mm³)", "the saw cut through ..."; what was only touched
/// comes behind it: "contact of the shaft with the chorda tympani". Empty: none was met.
[[nodiscard]] std::string reported_cut(const StructureMap& map, CutBy by, std::span<const StructureCut> cuts);

/// Follows all hands; structures that the operation opens (StructureMap::opened) are left out. What of a structure lay
/// in a running burr or saw, or in a shaft, counts cell by cell (kCellMm) by the share of the cell that was inside
/// both; each share once, for whoever took it first, so that a shaft in the bore of its own burr takes nothing. Volumes
/// within 5 % where a structure of 1 mm is cut across or a burr is half a millimetre deep in one; a touch that comes to
/// less than StructureCut::kMinMm3 is a contact. What a hand does within kSameS and kSameMm of what it did before is
/// the same event. Saws by their plane are counted by themselves (structures_cut()). Cost: of a tick in which nothing
/// is near 0.1 us for each structure; 0.1 ms where a burr of 4 mm moves in one. Memory: 1 KB for each 4 mm3 that tools
/// came to. The same ticks give the same events.
class StructureJudge {
 public:
  static constexpr double kCellMm = 0.2;
  static constexpr double kSameS = 1, kSameMm = 5;
  static constexpr double kTurnsRpm = 1;  ///< below it a burr stands
  /// Of a plate's screws, below its underside, in their diameters.
  static constexpr double kScrewDiameters = 3;

  /// `map` must outlive this.
  StructureJudge(const StructureMap& map, double rate_hz);

  /// A tick of a hand. `own_from_world`: into the frame of the scene's first body, which structures go with. `guide`:
  /// of that hand (tool_axis()).
  void tick(const TickRecord& record, const RigidTransform& own_from_world, const CuttingGuide& guide);
  /// A saw by its plane that was done: `voxels` it took. Those that it came within 5 mm of too (structures_cut()).
  std::vector<StructureCut> saw(std::uint64_t tick, const World& world, const SawCut& cut,
                                std::span<const VoxelKey> voxels);
  /// A plate that was fixed (ActionKind::attach), by what its screws take.
  std::vector<StructureCut> attach(std::uint64_t tick, const World& world, const SceneAction& action);
  /// In the order in which they began.
  [[nodiscard]] std::vector<StructureCutEvent> events() const;

 private:
  static constexpr int kEdge = 8;  // cells of a block
  // What of each cell the structure fills, and how much of that tools have been in: shares, of 255.
  struct Block {
    std::array<std::uint8_t, kEdge * kEdge * kEdge> filled, taken;
    std::uint32_t open = 0;  // cells with some of the structure that are not taken whole
  };
  struct Part {
    BoxMm box;
    std::unordered_map<std::uint64_t, Block> blocks;
  };
  struct Taken {
    double mm3 = 0;
    Vec3 moment;
  };
  struct Kept {
    StructureCutEvent event;
    std::size_t part = 0;
    std::uint64_t last_tick = 0;
    Vec3 last_mm;
    Taken taken;
  };
  struct Last {
    Vec3 at_mm{1e30, 0, 0}, end_mm;
    std::uint8_t tool = 0;
    bool turning = false;
  };
  struct Shape {
    const RoundCone* cone;
    Vec3 at_mm, axis;
    [[nodiscard]] double distance_mm(Vec3 p) const;
  };
  void meet(CutBy by, std::uint32_t hand, std::uint64_t tick, const Shape& shape);
  [[nodiscard]] bool may_meet(const Part& part, const Shape& shape) const;
  void take(std::size_t part, const Shape& shape, std::array<int, 3> from, int size, Taken& taken);
  void take_block(std::size_t part, Block& block, const Shape& shape, std::array<int, 3> from, Taken& taken);
  Block& block_at(std::size_t part, std::array<int, 3> from);
  void keep(CutBy by, std::uint32_t hand, std::uint64_t tick, std::size_t part, Vec3 at_mm, const Taken& taken);
  [[nodiscard]] StructureCut cut_of(std::size_t part, const Taken& taken, Vec3 at_mm) const;

  const StructureMap& map_;
  std::uint64_t same_ticks_;
  std::vector<Part> parts_;  // as map_.values()
  std::vector<double> each_;
  std::array<Last, kMaxHands> last_{};
  std::vector<Kept> kept_;
};

}  // namespace osteo::inline simulation
