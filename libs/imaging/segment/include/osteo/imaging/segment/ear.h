// Structures of the ear and its neighbourhood found in a CT, without a model that was learnt: by what bone, air and
// soft tissue bound.
//
// World is LPS. The external ear canal is found first, from the air outside; the others are looked for by their place
// to its inner end. docs/validation/structures.md says of each what is labelled, how it is found, what its quality means, and how
// far from the truth it is.
#pragma once
#include <array>
#include <cstdint>
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
  std::array<double, 3> labyrinth_mm{0, 0, 0};          ///< a point within the labyrinth, LPS; needed for it
  double min_quality = 0.3;                             ///< what is below is not found
};

struct EarFinding {
  EarStructure what = EarStructure::ear_canal;
  bool found = false;
  double quality = 0;     ///< 0 to 1
  std::string why;        ///< why it was not found, or what is doubtful about it; may be empty
  double volume_mm3 = 0;  ///< of its voxels in the CT
  bool by_canal = false;  ///< not found because the ear canal, by which it is placed, was not; `why` ends in the canal's
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

}  // namespace osteo::inline imaging
