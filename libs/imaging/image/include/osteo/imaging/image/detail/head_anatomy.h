// The anatomy of the phantom: a head as smooth solids whose every surface, centre line and wall is known at any point.
//
// Sizes are means of published anatomy; docs/validation/phantom.md has the table with sources. In short (mm): cranium 180 x 142,
// vault 6.5 of cortex, diploe, cortex; bony ear canal 16 long, 7 x 9 wide; tympanic cavity 15 high, 2 to 6 deep; facial
// nerve's labyrinthine, tympanic and mastoid segments 4, 11 and 14 long; canals of the labyrinth 3 in radius, cochlea
// of 2.5 turns, 9 at its base; sigmoid sinus 10 wide, 13.7 behind the canal; nerve 7 before the sinus and 3.7 behind
// the canal's wall; tegmen and sinus plate about 1.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "osteo/core/data/vec.h"

namespace osteo::inline imaging {

/// Label values of the phantom. Bone is `is_bone(label)`.
enum class Tissue : std::uint8_t {
  air = 0,
  soft = 1,
  cortical = 2,  ///< skull but the jaw: tables, plates, walls of canals, dense petrous bone
  cellular = 3,  ///< the walls between the air cells of the mastoid
  mandible = 4,  ///< cortex of the lower jaw
  ossicle = 5,
  facial_nerve = 6,
  sigmoid_sinus = 7,  ///< transverse and sigmoid sinus, jugular bulb and vein
  left_marker = 8,    ///< a bead on the patient's left side only: tells left from right
  diploe = 9,         ///< cancellous bone of the skull
  jaw_marrow = 10,    ///< cancellous bone of the lower jaw
  tooth = 11,
  labyrinth = 12,  ///< cochlea, vestibule and semicircular canals: what is within the bone
  chorda_tympani = 13,
  alveolar_nerve = 14,  ///< inferior alveolar nerve
  carotid = 15,         ///< internal carotid artery
  dura = 16,            ///< 0.8 mm on the inside of the skull
  air_cells = 17,       ///< air of the mastoid's cells
  ear_canal = 18,       ///< air of the external canal
  tympanic_cavity = 19  ///< air of the middle ear, antrum and auditory tube
};
inline constexpr int kTissueCount = 20;
[[nodiscard]] std::string_view tissue_name(Tissue tissue);
/// HU of the phantom's CT.
[[nodiscard]] double tissue_hu(Tissue tissue);
[[nodiscard]] constexpr bool is_bone(Tissue t) {
  switch (t) {
    case Tissue::cortical:
    case Tissue::cellular:
    case Tissue::mandible:
    case Tissue::ossicle:
    case Tissue::left_marker:
    case Tissue::diploe:
    case Tissue::jaw_marrow:
    case Tissue::tooth:
      return true;
    default:
      return false;
  }
}

/// A point of a centre line and the radius of the tube around it. Between two points both change linearly.
struct TubePoint {
  Vec3 at_mm;
  double radius_mm = 0;
};

/// A cell of the mastoid: a ball that the cell fills until it meets the walls to its neighbours, half as far from the
/// one as from the other.
struct AirCell {
  Vec3 centre_mm;
  double radius_mm = 0;
  double wall_mm = 0;  ///< to its neighbours
};

/// One head. Both sides are mirror images of each other but for the bead; what is given as a line is the left one.
/// Immutable; copies share the data; safe from any thread.
class HeadAnatomy {
 public:
  /// `individual` 0 has mean sizes; another number varies them within the published spread and places other air cells.
  /// About 50 ms.
  explicit HeadAnatomy(std::uint64_t individual = 0);

  struct Sample {
    Tissue tissue = Tissue::air;
    double margin_mm = 0;  ///< every point nearer than this has the same tissue
  };
  /// Exact. LPS mm, the head's centre is the origin, the Frankfurt plane level. 0.1 us in the brain, 3 us among air
  /// cells.
  [[nodiscard]] Sample sample(Vec3 lps_mm) const;
  [[nodiscard]] Tissue tissue(Vec3 lps_mm) const { return sample(lps_mm).tissue; }

  /// From the brain's side of the internal auditory canal, by the geniculate ganglion and the second genu, to the
  /// parotid gland.
  [[nodiscard]] std::span<const TubePoint> facial_nerve() const;
  /// Arc length in mm along `facial_nerve()` where a segment ends: fundus, geniculate ganglion, second genu,
  /// stylomastoid foramen.
  struct NerveMarks {
    double fundus_mm, geniculate_mm, second_genu_mm, foramen_mm;
  };
  [[nodiscard]] NerveMarks facial_nerve_marks() const;
  [[nodiscard]] std::span<const TubePoint> chorda_tympani() const;
  /// From the torcula to the jugular vein.
  [[nodiscard]] std::span<const TubePoint> sigmoid_sinus() const;
  /// From the mandibular to the mental foramen.
  [[nodiscard]] std::span<const TubePoint> alveolar_nerve() const;
  [[nodiscard]] std::span<const AirCell> air_cells() const;

  struct Model;

 private:
  std::shared_ptr<const Model> model_;
};

}  // namespace osteo::inline imaging
