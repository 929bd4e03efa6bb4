// How well a force was recalled (D. Morris 2006, section 4.3), its parts apart.
#pragma once
#include <span>
#include <vector>

#include "osteo/assessment/experiment/alignment.h"

namespace osteo::inline assessment::experiment {

struct RecallSettings {
  std::size_t samples = 1000;  ///< both curves are put on so many
  double box_s = 0.1;          ///< over which the applied force is averaged
  AlignCosts costs;
  double alignment = 1, after_force = 1,
         after_slope_s = 0.25;  ///< parts of the dissertation's score; their weights are not printed
};

/// Of one trial. Samples in which target or applied force were saturated count nothing; `saturated` is their share.
struct Recall {
  double score =
      0;  ///< cost of the alignment by that of no force at all: 0 perfect, 1 as bad as no force, above 1 worse
  double phase_s = 0;      ///< mean of how far partners are apart in time
  double lag_s = 0;        ///< the same with its sign: positive, the applied force came late
  double amplitude_n = 0;  ///< mean difference of partners' forces
  double slope_n_per_s = 0;
  double plain_rms_n = 0;  ///< without alignment: what the dissertation's figure 25 is about
  double thesis_n = 0;     ///< weighted mean of cost a sample, RMS force and RMS slope after warping; in N
  double saturated = 0;
  AlignBy by = AlignBy::band;
  double seconds = 0;
  std::vector<double> target_n, applied_n, warped_n;  ///< `samples` each; warped: the applied on the target's time
  std::vector<Pairing> path;
};

/// Both sampled at `rate_hz` from the same moment, of the same length. `saturated`: empty, or as long. Error(usage) for
/// fewer than two samples, what is not finite, or a target without force where it counts: there nothing can be
/// recalled.
[[nodiscard]] Recall score_recall(std::span<const double> target_n, std::span<const double> applied_n,
                                  const std::vector<bool>& saturated, double rate_hz,
                                  const RecallSettings& settings = {});

/// Mean over `width` samples around each, of those there are. O(n).
[[nodiscard]] std::vector<double> box_filtered(std::span<const double> values, std::size_t width);

}  // namespace osteo::inline assessment::experiment
