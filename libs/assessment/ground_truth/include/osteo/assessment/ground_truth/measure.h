// A trajectory through a renderer, and how far from the truth what comes out is.
#pragma once
#include <string>
#include <vector>

#include "osteo/assessment/ground_truth/point_renderer.h"
#include "osteo/assessment/ground_truth/trajectory.h"

namespace osteo::inline assessment::truth {

/// Over the moments after the first tenth of a second, where a renderer finds its place. Forces in N, whatever the
/// unit.
struct Accuracy {
  std::size_t moments = 0;
  double mean_n = 0;  ///< of |rendered - true|: equation 3 of D. Morris 2006, which calls it RMS
  double rms_n = 0, p95_n = 0, max_n = 0;
  double direction_deg = 0;                          ///< mean angle between the two, where both are above 0.05 N
  double position_mean_mm = 0, position_max_mm = 0;  ///< of the contact, where there is one and should be
  std::size_t position_over = 0;                     ///< moments where it is off by more than kPositionLimitMm
  double missed_ms = 0, false_ms = 0;                ///< no force where above 0.05 N is due; force of the air
  std::size_t popped = 0;                            ///< moments where it pushes in instead of out
  double longest_stuck_ms = 0;                       ///< the contact behind by more than kPositionLimitMm at a stretch
  double operations = 0;                             ///< mean
  std::string bits;                                  ///< hash of all forces: equal runs have equal ones
};
inline constexpr double kPositionLimitMm = 0.5;

/// What it took on this machine; not reproducible.
struct Cost {
  double ns_p50 = 0, ns_p99 = 0, ns_max = 0, setup_s = 0, memory_mb = 0;
};
struct Played {
  Accuracy accuracy;
  Cost cost;
  std::vector<Rendered> rendered;  ///< of each moment, in N and mm; empty unless asked for
};

/// The in-trajectory through the renderer, which was made with `settings`.
[[nodiscard]] Played play(const Trajectory& trajectory, PointRenderer& renderer, const RenderSettings& settings,
                          bool keep = false, const Context& context = {});

/// What a closed way gives: the work done on the hand in its second round, mJ, without friction. The truth is 0;
/// positive: the renderer makes energy. `kept` (may be null): the energy that went back and forth in that round, to
/// compare with.
[[nodiscard]] double energy_per_cycle_mj(const Solid& solid, const std::string& what, double rate_hz,
                                         double* kept = nullptr, const Context& context = {});

/// The largest change of force between positions a 1/50 of the renderer's grain apart, over ten grains along the
/// surface at a depth of 1 N of the solid's spring, less the truth's own: N.
[[nodiscard]] double step_n(const Solid& solid, PointRenderer& renderer, double stiffness_n_per_mm);

/// The coefficient of friction with which the renderer comes nearest to the forces, by golden section to 1e-4; and the
/// mean error there.
struct Identified {
  double friction = 0, mean_n = 0;
  int runs = 0;
};
[[nodiscard]] Identified identify_friction(const Trajectory& trajectory, const Solid& solid, const std::string& what,
                                           double lo = 0, double hi = 1, const Context& context = {});

}  // namespace osteo::inline assessment::truth
