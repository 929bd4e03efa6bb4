// What a cut by a plane takes of structures at risk. They need no bone to be cut: a nerve lies in a canal, a sinus
// beneath the bone.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "osteo/simulation/bone/saw.h"
#include "osteo/simulation/bone/structure_map.h"
#include "osteo/simulation/bone/world.h"

namespace osteo::inline simulation {

/// What a blade does to one structure.
struct StructureCut {
  std::uint8_t structure = 0;  ///< value in the label map
  double mm3 = 0;              ///< of the structure, that lies in the blade's path; 0: it is not cut
  double distance_mm = 0;      ///< of the blade's path to it; 0: it is cut
  Vec3 at_mm;  ///< the middle of what is cut; where it is not, the place of the path that is nearest to it
  static constexpr double kReachLessMm = 1.5;  ///< distances are told up to so much less than the map's reach
};

/// The part of a blade that is at work: an endless plane cuts as far as there is bone in it, with all that lies
/// between. `bone_mm`: middles of the voxels that it takes; `margin_mm`: half a voxel. The cut's own length and depth,
/// where it has any, are never exceeded. None where there is no bone.
[[nodiscard]] std::optional<SawCut> blade_at_work(const SawCut& cut, std::span<const Vec3> bone_mm, double margin_mm);
/// The same of a scene in which it has cut or would cut. `voxels`: names of those it takes (World::Effect::dust,
/// VoxelChange). The result is in the frame of the scene's first body, which structures go with.
[[nodiscard]] std::optional<SawCut> blade_at_work(const World& world, const SawCut& cut,
                                                  std::span<const VoxelKey> voxels);
/// The names of the voxels that a cut would take now, of one piece or of all (SceneAction::kNobody): nothing is
/// changed. Cost: as apply_saw().
[[nodiscard]] std::vector<VoxelKey> voxels_sawn(const World& world, const SawCut& cut,
                                                std::uint32_t body = SceneAction::kNobody);

/// What a blade with a length and a depth does to the structures that it cuts or comes within `within_mm` of, in the
/// order of map.values(). `blade`: in the frame of the map. Volumes by cells of 0.15 mm: those of the map's face within
/// 5 % where a nerve of 1 mm is cut across, within 10 % where it is grazed along 18 mm; distances within 0.1 mm. The
/// face is the labels' own, which of a rod of 1 mm radius in labels of 0.4 mm is 0.2 mm within the rod's. Error(usage)
/// where the blade is endless. Cost: milliseconds; 20 ms where the blade lies along a structure of 50 mm.
[[nodiscard]] std::vector<StructureCut> structures_cut(const StructureMap& map, const SawCut& blade,
                                                       double within_mm = 5);

/// "the facial nerve (2.4 mm3) and the sigmoid sinus (31 mm3)"; empty: none is cut.
[[nodiscard]] std::string told_structures_cut(const StructureMap& map, std::span<const StructureCut> cuts);

}  // namespace osteo::inline simulation
