// How fast a body's motion dies down, from a measured one: plucked, let go, and watched.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/simulation/tissue/detail/equilibrium.h"
#include "osteo/simulation/tissue/detail/tissue_model.h"

namespace osteo::inline simulation {

/// What was measured: displacements of points of the body along directions, over time.
struct MeasuredMotion {
  struct Channel {
    std::uint32_t point = 0;
    Vec3 along{1, 0, 0};  ///< of length 1
    std::string name;     ///< as reports and errors call it
    std::vector<double> time_s, mm;
  };
  std::vector<Channel> channels;
};

/// Reads a table (CSV): a column time_s; ux_mm, uy_mm, uz_mm (one or more), or u_mm along `along`; perhaps point, the
/// number of a point of the mesh from 0, else all are of `point`. Times rise, of each point by itself. Errors: usage
/// with the line for a value that is no finite number, a time that does not rise, a point of `points` or more, a column
/// of another name.
[[nodiscard]] MeasuredMotion read_motion(std::string_view csv, const std::string& name, std::uint32_t points,
                                         std::uint32_t point, Vec3 along);

/// A single swing that dies down, fitted to channels without any model of the body: exp(-decay t) (a cos wt + b sin wt)
/// + c + d t, with one decay and one frequency for all. The decrement of textbooks is decay / hz.
struct Swing {
  double decay_per_s = 0, hz = 0;
  double residual_share = 0;  ///< RMS of what it leaves over the RMS of the channels without mean and trend
  bool swings = false;        ///< more than by chance, and less than 0.7 of critically damped
};
/// Looks between those frequencies; both above 0. O(values times frequencies).
[[nodiscard]] Swing swing_of(const MeasuredMotion& motion, double least_hz, double most_hz);

enum class Stepping : int { explicit_steps, implicit_steps };

struct DampingOptions {
  double density_kg_m3 = 1000;
  Stepping stepping = Stepping::explicit_steps;
  double step_s = 0.01;       ///< of implicit steps
  bool fit_stiffness = true;  ///< one factor on all of it; else it is taken to be right
  double release_s = 0;       ///< when it was let go, by the table's clock; what was measured before is not used
  bool fit_release = true;    ///< that moment too, within a quarter of a swing
  int iterations = 40;
};

/// A value and the ends of its 95 % confidence interval.
struct Estimate {
  double value = 0, low = 0, high = 0;
};

struct DampingFit {
  bool converged = false;
  std::string why;         ///< not converged: what happened
  Estimate damping_per_s;  ///< as DynamicsOptions and ImplicitOptions have it
  Estimate stiffness_times;
  Estimate release_s;
  double amplitude_times = 1;  ///< how far it was plucked, over the load's own equilibrium
  double step_s = 0;           ///< of the steps it holds for
  double model_hz = 0;         ///< of the body as the problem has it, without damping
  Swing measured, model,
      undamped;  ///< of the table; of the fitted model; and of that without damping: all of its decay is numerical
  bool undamped_swings = true;  ///< `undamped` says something
  double residual_share = 0;    ///< RMS of what the fit leaves over the RMS of the channels without their trends
  double correlation = 0;       ///< of each left residual with the next, by which intervals were widened
  std::vector<double> drift_mm_per_s, drift_error_mm_per_s;  ///< of each channel, and its standard error
  std::vector<double> largest_mm;                            ///< of each channel
  std::vector<std::vector<double>> fitted_mm;                ///< beside used values
  MeasuredMotion used;                                       ///< from the release on
  double span_s = 0, interval_s = 0;  ///< from the release to the last value; median between values
  int simulations = 0;
};

/// Fits damping (and stiffness, moment of release, amplitude, and of each channel where its rest is and how it drifts)
/// by least squares (Ceres), the model being the fast one in the very steps that it is for: what these take away by
/// themselves is not counted as damping. The body begins at rest under `pluck`, whose loads and movements then end;
/// `fixed` and `sliders` hold it throughout. Derivatives by damping and stiffness are central differences of
/// simulations. Intervals assume that what is left is noise without memory, and are widened by its correlation with the
/// next value where there is one. Errors: usage with what to do for fewer than 12 values, nothing that moves, under one
/// and a half swings, fewer than two values a swing (by the model's frequency, since the table's own would be another),
/// motion that does not swing while stiffness is fitted too, steps that take away more than was measured; as of
/// EquilibriumSolver; failed in a build without Ceres.
[[nodiscard]] DampingFit fit_damping(const TissueModel& model, const TissueLoad& pluck,
                                     std::span<const std::uint32_t> fixed, std::span<const Slider> sliders,
                                     const MeasuredMotion& motion, const DampingOptions& options = {},
                                     const Context& context = {});

}  // namespace osteo::inline simulation
