// How far each structure of a network may be trusted: from its own probabilities, calibrated, and from its volume.
// And how far each place of its boundary may be off, in mm.
#pragma once
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/imaging/neural/detail/predict.h"

namespace osteo::inline imaging {

struct StructureCalibration {
  int value = 0;
  std::string name;
  double least_mm3 = 0, most_mm3 = 0;  ///< volumes that are plausible
  double least_dice = 0;               ///< an expected Dice below it was never met where all was well
  /// Width of a boundary in its probabilities, and the error that 95 % of such boundaries do not exceed; both in mm,
  /// both ascending, linear between. Empty: nothing is known of its boundary.
  std::vector<std::array<double, 2>> boundary_mm;
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

/// Classes of uncertainty: the boundary lies within so many mm of where it was drawn, in 95 % of places. The last class
/// is what is known to none of these.
inline constexpr std::array<double, 3> kUncertaintyMm{0.3, 0.6, 1.2};
inline constexpr double kWidestMm = 6;  ///< of a boundary in its probabilities; wider ones count as this

/// Of a structure whose boundary is calibrated.
struct StructureBoundary {
  std::string name;
  std::array<std::size_t, kUncertaintyMm.size() + 1> voxels{};  ///< at its boundary, by class
  double within_mm = 0;  ///< the uncertainty that 95 % of them do not exceed, in tenths; infinite from 6 mm on
};
struct BoundaryUncertainty {
  Labels classes;  ///< in the frame of the labels: 1 to 4 in voxels of calibrated structures that touch another label
  std::vector<StructureBoundary> structures;
};

/// The classes with their names and colours, in no voxel.
[[nodiscard]] Labels no_uncertainty(const Frame& frame);

/// At each voxel of a calibrated structure that touches another label: the way outwards, against the gradient of the
/// structure's probability, to where it is at most 0.1, and inwards to where it is at least 0.9; together the
/// boundary's width, at most kWidestMm. The calibration turns it into mm of error. Nothing where the model has regions,
/// or where no structure's boundary is calibrated. Same bits for any number of threads; 4 bytes a voxel of the
/// network's grid, twice.
[[nodiscard]] std::optional<BoundaryUncertainty> boundary_uncertainty(const Labels& labels, const NetworkLogits& logits,
                                                                      const NetworkModel& model,
                                                                      const NetworkCalibration& calibration,
                                                                      const Context& context);

}  // namespace osteo::inline imaging
