// Constants of the fast model from what finite elements say the body does.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "osteo/simulation/tissue/detail/equilibrium.h"
#include "osteo/simulation/tissue/detail/tissue_model.h"

namespace osteo::inline simulation {

/// A load, and where the points of the model truly come to rest under it.
struct CalibrationCase {
  TissueLoad load;             ///< all cases fix the same points
  std::vector<Vec3> truth_mm;  ///< one a point of the model
};

/// How far a shape is from the truth, relative to how far the truth has moved: RMS over all points of both.
/// `free_of_rigid`: after the rigid motion that fits best (W. Kabsch 1976) is taken out of the difference.
struct CalibrationError {
  double nrms = 0;
  double nrms_free_of_rigid = 0;
  double rms_mm = 0, truth_rms_mm = 0;
};
[[nodiscard]] CalibrationError calibration_error(std::span<const Vec3> rest, std::span<const Vec3> shape,
                                                 std::span<const Vec3> truth);

/// How much stiffer the body feels than it should: the load's work in the truth over that in the shape, minus 1. For
/// small movements this is the error of the force that is needed to move the loaded points as far. (Forces point by
/// point differ between kinds of elements however fine they are, so they say nothing.)
[[nodiscard]] double force_error(std::span<const Vec3> rest, std::span<const Vec3> shape, std::span<const Vec3> truth,
                                 const TissueLoad& load);

struct CalibrateOptions {
  /// Factors on the closed form, one for each class of constraint; or, with grid above 1 x 1 x 1, on each point of a
  /// coarse grid over the body's box, interpolated (their logarithms, linearly). Points of the grid that no constraint
  /// is near are left out.
  std::array<int, 3> grid{1, 1, 1};
  /// The grid scales all classes alike (a map of stiffness), and one factor a class scales them everywhere; otherwise
  /// each class has a grid of its own: many more factors, which a few loads do not determine.
  bool shared_grid = true;
  double least_log = -7, most_log = 7;  ///< bounds of the logarithms
  /// Towards the closed form, as a share of the truth's RMS for a factor of e in all of a family of factors: settles
  /// what the loads do not determine. A shared map is pulled towards the one factor with which the closed form moves as
  /// far as the truth, and starts from it.
  double pull = 0.02;
  /// Of a shared map, differences between neighbouring points of its grid cost this, as a share of the truth's RMS for
  /// a factor of e: small ones by their square, large ones (a border between tissues) only by their size.
  double smooth = 0.05;
  int starts = 1;  ///< more (at most 3): from other mixtures of classes too; the best counts
  int samples =
      0;  ///< so many mixtures spread over two factors of e^2 each (J. Halton 1960) are tried; the best is a start too
  int iterations = 60;
  double tolerance = 1e-3;  ///< ends when a step lowers the cost by less than this share
  EquilibriumOptions equilibrium{1e-10, 60, 1};
};

struct Calibration {
  bool converged = false;
  std::string why;
  std::vector<double> log_factors;    ///< by grid point (x fastest) and class: what each class is scaled by there
  std::vector<double> log_stiffness;  ///< shared_grid: the map alone, by grid point
  int parameters = 0;
  int solves = 0;  ///< of an equilibrium, one for each case and evaluation
  int jacobians = 0;
  int failed_solves = 0;  ///< that did not come to rest: the step was shortened
  double seconds = 0;
  std::vector<CalibrationError> before, after;  ///< of each case: closed form, calibrated
  std::vector<double> cost;  ///< after each accepted step of the best start, the first being the start itself
  std::vector<std::vector<double>> course;  ///< parameters' logarithms there: of the map's points, then of the classes
  /// Standard deviation of each parameter's logarithm for an error of one percent of the truth's RMS in every
  /// coordinate; large: the loads do not determine it.
  std::vector<double> uncertainty;  ///< shared_grid: of the map's points, then of the classes; else as log_factors
};

/// Fits `model` (which is left calibrated) by a trust region (Ceres: Levenberg and Marquardt, for many factors dogleg):
/// residuals over all points and cases, exact Jacobians through the equilibrium (implicit function theorem: one
/// factorisation, one back-solve a parameter). Equilibria start from the last ones. A step to factors with no
/// equilibrium is not taken. Errors: usage when cases fix different points, or none is given; failed in a build without
/// Ceres.
Calibration calibrate(TissueModel& model, std::span<const CalibrationCase> cases, const CalibrateOptions& options = {},
                      const Context& context = {});

/// Whether this build can calibrate.
[[nodiscard]] bool has_ceres();

/// The model with factors as Calibration::log_factors has them for that grid. Error(usage) when there are not as many
/// as the grid needs.
[[nodiscard]] TissueModel with_log_factors(const TissueModel& model, const std::array<int, 3>& grid,
                                           std::span<const double> log_factors);

}  // namespace osteo::inline simulation
