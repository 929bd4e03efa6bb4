// Critical structures: how far a tool is from nerves, vessels and membranes.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/tri_mesh.h"
#include "osteo/core/data/volume.h"
#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/geometry/mesh/soup.h"
#include "osteo/simulation/bone/round_cone.h"
#include "osteo/simulation/bone/saw.h"
#include "osteo/simulation/bone/world.h"

namespace osteo::inline geometry {
class TriangleTree;
}

namespace osteo::inline simulation {

/// Signed distances to the face of each structure of a label map, structure by structure: at any depth inside, and
/// outside as far as `reach_mm` beyond the surface of any burr of the library. The face lies between the voxels of the
/// structure and the others, smoothed so that it does not follow their steps, but never across a voxel's centre: what
/// the map names is inside, however thin. Distances to it are exact at the points of two lattices, as fine as the
/// labels within two voxels of the face, else twice as coarse (at least 0.3 mm), and linear between them.
/// Error outside planes, balls and cylinders, in label voxels: mean below 0.08, 0.12 rms, 0.36 at most; of a nerve one
/// voxel thin 0.12, 0.16, 0.6. Inside up to a lattice step where distances have their ridge. Memory: 4 bytes a point,
/// so about 4 a label voxel near the face and 4 / 8 elsewhere; made in O(voxels of the map). Immutable.
class StructureMap {
 public:
  /// `opened`: names of those that the operation enters, a canal or cells, which therefore are not at risk; names that
  /// the map has not are left out. Error(failed) when the map holds no structure.
  explicit StructureMap(const Labels& labels, double reach_mm = 8, const Context& context = {},
                        std::span<const std::string> opened = {});

  struct Answer {
    double distance_mm = 0;      ///< negative inside; reach_mm() where nothing is near
    std::uint8_t structure = 0;  ///< value in the label map; 0: none within reach
  };
  /// The nearest structure, also of those that are opened. 0.05 us for each that is near.
  [[nodiscard]] Answer at(Vec3 world_mm) const noexcept;
  /// The nearest of those at risk.
  [[nodiscard]] Answer at_risk(Vec3 world_mm) const noexcept;
  /// To one structure, by its number in values(): as at(), whatever else is near; reach_mm() where it is farther.
  [[nodiscard]] double distance_mm(std::size_t number, Vec3 world_mm) const noexcept;
  /// Between a tool's surface and the nearest structure at risk; negative when it reaches into one. `each`, where not
  /// empty, gets the same for every structure in the order of values(), reach_mm() where it is farther. Cost: an at()
  /// for each half radius along the tool's axis and eight more; one for a ball.
  Answer clearance(const RoundCone& tool, Vec3 start_mm, Vec3 axis, std::span<double> each = {}) const noexcept;

  [[nodiscard]] double reach_mm() const { return reach_mm_; }
  /// Whether the operation enters it, by its number in values().
  [[nodiscard]] bool opened(std::size_t number) const { return parts_[number].opened; }
  /// Of the structures that have voxels, ascending.
  [[nodiscard]] const std::vector<std::uint8_t>& values() const { return values_; }
  [[nodiscard]] const std::vector<Structure>& structures() const { return structures_; }
  /// The face that distances are measured from, closed; `number` in values(). What is drawn is smoother
  /// (view/structures_view.h).
  [[nodiscard]] const TriMesh& face(std::size_t number) const { return parts_[number].face; }
  /// Of the labels, the finest and the coarsest of the three.
  [[nodiscard]] std::array<double, 2> label_spacing_mm() const { return spacing_mm_; }
  /// Red, green, blue, 0 to 1: the map's own, or one of a fixed row.
  [[nodiscard]] std::array<double, 3> colour_of(std::uint8_t structure) const;
  [[nodiscard]] std::string name_of(std::uint8_t structure) const;  ///< "structure 3" where the map has no name
  [[nodiscard]] std::size_t memory_bytes() const;
  [[nodiscard]] std::string hash() const;

 private:
  // Signed distances; not a number where none is kept.
  struct Field {
    BrickGrid values;
    Mat3 index_from_mm;
    [[nodiscard]] double at(Vec3 world_mm) const noexcept;
  };
  struct Part {
    TriMesh face;
    BoxMm box;  // of the face
    bool opened = false;
    Field near, whole;
    [[nodiscard]] double at(Vec3 world_mm) const noexcept;
    [[nodiscard]] double clearance(const RoundCone& tool, Vec3 start_mm, Vec3 axis) const noexcept;
  };
  Answer nearest(const RoundCone& tool, Vec3 start_mm, Vec3 axis, std::span<double> each,
                 bool with_opened) const noexcept;
  [[nodiscard]] static Part part_of(const Labels& labels, std::uint8_t value, std::array<std::array<int, 2>, 3> box,
                                    double far_mm, const Context& context);
  static Field field_of(const TriangleSoup& face, const TriangleTree& tree, const Frame& frame, double inside_mm,
                        double outside_mm, const Context& context);
  std::vector<Part> parts_;  // in the order of values_
  std::vector<std::uint8_t> values_;
  double reach_mm_;
  std::array<double, 2> spacing_mm_;
  std::vector<Structure> structures_;
};

// -- What a cut by a plane takes of critical structures. They need no bone to be cut: a nerve lies in a canal, a sinus
// beneath the bone.

/// What a blade does to one structure.
struct StructureCut {
  std::uint8_t structure = 0;  ///< value in the label map
  double mm3 = 0;              ///< of the structure, that lies in the blade's path, at least kMinMm3; 0: it is not cut
  double distance_mm = 0;      ///< of the blade's path to it; 0: it is cut, or where mm3 is 0 touched
  Vec3 at_mm;  ///< the middle of what is cut; where it is not, the place of the path that is nearest to it
  static constexpr double kMinMm3 = 0.01;      ///< less is below what labels and cells tell: contact, no cut
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
/// order of map.values(); those that the operation opens are left out. `blade`: in the frame of the map. Volumes by
/// cells of 0.15 mm: those of the map's face within 5 % where a nerve of 1 mm is cut across, within 10 % where it is
/// grazed along 18 mm; distances within 0.1 mm. The face is the labels' own, which of a rod of 1 mm radius in labels of
/// 0.4 mm is 0.2 mm within the rod's. Error(usage) where the blade is endless. Cost: milliseconds; 20 ms where the
/// blade lies along a structure of 50 mm.
[[nodiscard]] std::vector<StructureCut> structures_cut(const StructureMap& map, const SawCut& blade,
                                                       double within_mm = 5);

/// "the facial nerve (2.4 mm³) and the sigmoid sinus (31 mm³)"; empty: none is cut.
[[nodiscard]] std::string reported_structures_cut(const StructureMap& map, std::span<const StructureCut> cuts);

}  // namespace osteo::inline simulation
