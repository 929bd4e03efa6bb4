// How far each structure of a network may be trusted: from its own probabilities, calibrated, and from its volume.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "osteo/imaging/neural/detail/predict.h"

namespace osteo::inline imaging {

struct StructureCalibration {
  int value = 0;
  std::string name;
  double least_mm3 = 0, most_mm3 = 0;  ///< volumes that are plausible
  double least_dice = 0;               ///< an expected Dice below it is rarer than one in twenty where all is well
};

/// A model folder's calibration.json, which the training door writes; nnU-Net's own folders have none.
struct NetworkCalibration {
  double temperature = 1;  ///< logits are divided by it
  std::vector<StructureCalibration> structures;
};

/// Error(corrupt): damaged, or of a structure that the network has not.
[[nodiscard]] NetworkCalibration read_network_calibration(std::string_view text, const NetworkModel& model);

struct StructureTrust {
  std::string name;
  double volume_mm3 = 0;
  double expected_dice = 0;  ///< with the truth, as the calibrated probabilities have it
  std::string doubt;         ///< why it is not to be trusted here; empty: no reason is known
};

/// One row a structure of the calibration. With p the probability of a structure by logits over the temperature, V its
/// voxels on the network's grid and S the sum of p over all: expected Dice = 2 (sum of p over V) / (|V| + S), which is
/// Dice's expectation where V and S are large. Same bits for any number of threads.
[[nodiscard]] std::vector<StructureTrust> trust_in(const NetworkLogits& logits, const NetworkModel& model,
                                                   const NetworkCalibration& calibration, const Context& context);

}  // namespace osteo::inline imaging
