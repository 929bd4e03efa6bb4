// Structures of the ear and its neighbourhood found in a CT, without a model that was learnt: by what bone, air and
// soft tissue bound.
//
// World is LPS. The external ear canal is found first, from the air outside; the others are looked for by their place
// to its inner end. docs/validation/structures.md says of each what is labelled, how it is found, what its quality
// means, and how far from the truth it is.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline imaging {

/// The patient's.
enum class Side : int { left, right };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(Side) {
  return {"left", "right"};
}

enum class EarStructure : int { ear_canal, air_cells, sigmoid_sinus, tegmen, dura, labyrinth };
[[nodiscard]] constexpr std::array<std::string_view, 6> enum_names(EarStructure) {
  return {"ear_canal", "air_cells", "sigmoid_sinus", "tegmen", "dura", "labyrinth"};
}
inline constexpr int kEarStructures = 6;

struct EarParams {
  Side side = Side::left;
  std::string what =
      "ear_canal,air_cells,sigmoid_sinus,tegmen,dura";  ///< names of EarStructure, with commas; "all" for all
  std::optional<std::array<double, 3>> labyrinth_mm;    ///< a point within the labyrinth, LPS; needed for it
  double min_quality = 0.3;                             ///< what is below is not found
};

struct EarFinding {
  EarStructure what = EarStructure::ear_canal;
  bool found = false;
  double quality = 0;     ///< 0 to 1
  std::string why;        ///< why it was not found, or what is doubtful about it; may be empty
  double volume_mm3 = 0;  ///< of its voxels in the CT
  bool by_canal =
      false;  ///< not found because the ear canal, by which it is placed, was not; `why` ends in the canal's
};

struct EarFindings {
  Labels labels;                     ///< value 1 + EarStructure; in the CT's frame; structures of what was found
  std::vector<EarFinding> findings;  ///< one for each that was asked for, in the order of EarStructure
  Vec3 drum_mm;                      ///< inner end of the ear canal; meaningless when no canal was found
};

/// Time and memory go by the volume around the ear (80 x 105 x 87 mm at most), not by the CT's; a whole head is first
/// searched at 1 mm. What is not there, or cannot be told, is a finding with found = false and a reason. Errors: usage
/// for names that do not exist, a labyrinth without its point or with one outside the CT.
[[nodiscard]] EarFindings find_ear_structures(const Image& ct, const EarParams& params, const Context& context = {});

/// Where two outlines of one structure lie apart.
struct DifferingPlace {
  Vec3 at_mm;           ///< of the place, where they are farthest apart
  double apart_mm = 0;  ///< there
  double along_mm = 0;  ///< how far the place reaches
};

/// A structure of a label map beside what is found of it in the CT without training.
struct ComparedStructure {
  std::string name;                    ///< the label map's; of two that are one here, "air cells and tympanic cavity"
  std::vector<std::uint8_t> values;    ///< the label map's
  bool labelled = false;               ///< the label map has voxels of it
  bool found = false;                  ///< in the CT
  std::string why;                     ///< it was not found in the CT
  double dice = 0;                     ///< of both; the rest also where both are there
  double within_mm = 0;                ///< 95 % of the label map's boundary lie so near to the other
  std::vector<DifferingPlace> places;  ///< where they differ by more than such outlines do, the largest first
};

struct EarComparison {
  std::vector<ComparedStructure> structures;  ///< those of the label map whose names are known
  Labels fused;                               ///< the label map, and what it has none of as it was found in the CT
  /// One a voxel, at boundaries of the label map that were compared: 1 + tenths of a mm between both, at most 254; 255
  /// in a place that differs. 0: not compared.
  std::vector<std::uint8_t> apart;
};

/// Holds a label map of an ear (by names: sigmoid sinus, ear canal, labyrinth, air cells with the tympanic cavity)
/// against find_ear_structures(). Which ear it is tells the canal, which lies outward of what else is labelled; else
/// both are tried. Where both ears are labelled, both are compared. Where a vessel or a canal ends, each method decides
/// for itself: beyond an end nothing is compared. docs/how-to/segment-network.md has how often it is right. Cost: that
/// of find_ear_structures(), once for each ear, and as much again. Errors: usage when the label map is on another grid,
/// cancelled.
[[nodiscard]] EarComparison compare_with_ear(const Image& ct, const Labels& labels, const Context& context = {});

}  // namespace osteo::inline imaging
