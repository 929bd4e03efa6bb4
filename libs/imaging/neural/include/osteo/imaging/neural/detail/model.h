// What plans.json and dataset.json of nnU-Net v2 say of a network: how its input is made and what its output means.
#pragma once
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/imaging/neural/detail/network.h"

namespace osteo::inline imaging {

enum class Normalisation { ct, z_score, rescale_to_01, none };

struct NetworkModel {
  UnetPlan unet;
  Axes patch{1, 1, 1};                    ///< of a flat network the first is 1
  std::vector<double> spacing_mm;         ///< of the grid it works on, after the transpose; two numbers of a flat one
  std::array<int, 3> transpose{0, 1, 2};  ///< axis of the image (z, y, x) that each of the grid's axes is
  Normalisation normalisation = Normalisation::ct;
  double mean = 0, deviation = 1, lower = 0, upper = 0;  ///< of the training's intensities, for `ct`
  bool regions = false;                                  ///< each class by itself, drawn in this order
  std::vector<int> values;                               ///< label of each class; of labels 0, 1, 2, ...
  std::vector<std::pair<int, std::string>>
      names;                         ///< label and what it is called; of a region of several the drawn one's
  std::string previous_stage;        ///< of a cascade: the configuration whose labels come in as well; else empty
  std::vector<int> previous_labels;  ///< of a cascade: which labels of it, one channel each
};

/// Reads both texts for one configuration. Error(corrupt) names what is damaged or not supported.
[[nodiscard]] NetworkModel read_network_model(std::string_view plans, std::string_view dataset,
                                              const std::string& configuration);

}  // namespace osteo::inline imaging
