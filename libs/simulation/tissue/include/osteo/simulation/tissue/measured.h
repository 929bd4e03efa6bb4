// Constants of the fast model from what was measured of a real body: its deformed surface as points, or markers on it.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/simulation/tissue/calibrate.h"

namespace osteo::inline simulation {

/// What was measured of the body under one load, in LPS mm.
struct MeasuredPoints {
  std::string name;  ///< as reports and errors call it
  std::vector<Vec3> points_mm;
  /// Empty: a cloud, of which nobody knows which point of the body each one is. Else markers: where each of them was at
  /// rest.
  std::vector<Vec3> rest_mm;
  std::vector<double> noise_mm;  ///< empty: all alike; else each point's own, of which only the ratios count
};

/// A load by its number, and a file of it.
struct MeasuredOfLoad {
  std::size_t load = 0;
  MeasuredPoints points;
};

/// A table (CSV): x_mm, y_mm, z_mm; perhaps x0_mm, y0_mm, z0_mm, which make it one of markers; perhaps noise_mm.
/// Errors: usage with the line for a value that is no finite number, a noise not above 0, a column of another name, no
/// line at all.
[[nodiscard]] MeasuredPoints read_measured_csv(std::string_view csv, const std::string& name);

/// A folder of files, or one file, each called like the load that it was measured under: pull.ply, or pull.left.csv and
/// pull.right.csv. .csv as above; .xyz and .txt: a point a line; .ply, .stl, .obj, .vtp: the points, with triangles or
/// without. Hidden files and .prov.json are passed over. Errors: usage with the names there are for a file that is
/// called like no load, for a folder with none; as of the readers.
[[nodiscard]] std::vector<MeasuredOfLoad> read_measured(const std::filesystem::path& path,
                                                        const std::vector<std::string>& load_names);

/// A surface that moves with the points of a model: each of its points is a mixture of four.
struct BodySurface {
  std::vector<std::array<std::uint32_t, 4>> corners;
  std::vector<std::array<double, 4>> weights;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< facing out
};
/// The boundary of the model's own tetrahedra: of voxels, with their steps.
[[nodiscard]] BodySurface boundary_surface(const TissueModel& model);

/// One load, and what was measured under it; several files are several views.
struct MeasuredCase {
  TissueLoad load;
  std::vector<MeasuredPoints> views;
};

struct MeasuredOptions {
  CalibrateOptions
      calibrate;  ///< `starts` and `samples` are not used; `pull` and `smooth` are shares of the surface's RMS movement
  bool find_pose = false;         ///< each view may lie elsewhere by a small rigid motion, which is found too
  std::size_t max_points = 5000;  ///< of a cloud: of more, so many are drawn at random
  /// Of each constraint, which group it is in (-1: none): groups get a mean stiffness with its interval.
  std::vector<int> group_of;
};

/// How far what was measured lies from a shape. Of markers: from where they should be.
struct MeasuredError {
  double rms_mm = 0;        ///< of the points that are within four times what two thirds of them keep to
  double median_mm = 0;     ///< of all
  double moved_rms_mm = 0;  ///< of the surface's points, in the shape
};

struct MeasuredView {
  std::string name;
  std::size_t load = 0;  ///< of the cases
  bool markers = false;
  std::size_t points = 0, drawn = 0;  ///< in the file; used in the fit
  std::size_t rejected = 0;           ///< of those: further than four times the noise from the fitted surface
  MeasuredError before, after;        ///< closed form as the problem has it; fitted
  double noise_mm =
      0;  ///< robust standard deviation along the normal of what is left where it moves (markers: along an axis)
  double correlation =
      0;  ///< of what is left at a point with that at the nearest other one: above 0, it is not noise alone
  /// How much of the surface, as far as it moves by over a tenth of the most, has points near it.
  double seen_share = 0;
  std::array<double, 3> turned_deg{},
      shifted_mm{};  ///< find_pose: what brings it onto the body, turned about its middle, in LPS
};

/// A mean logarithm of stiffness over that of the closed form, and its standard deviation.
struct LogStiffness {
  double log = 0, deviation = 0;
};

struct MeasuredCalibration {
  Calibration fit;  ///< `before` and `after` are left empty: they need the truth; `uncertainty`: deviations, as below
  double level_log = 0;  ///< of the one factor on the closed form that explains most
  int rounds = 0;        ///< of fits, each with the noise that the last one found
  std::vector<MeasuredView> views;
  LogStiffness all;                  ///< over all edges
  std::vector<LogStiffness> groups;  ///< as MeasuredOptions::group_of
  /// Of each point of the grid (or the one): standard deviation of its logarithm; and how much of what nobody knew
  /// before, a factor of 5 either way, the data have settled: 1 all, 0 nothing. Of points that no constraint is near
  /// both are 0.
  std::vector<double> deviation, settled;
  double estimate_s = 0;  ///< what was told before the fit began
};

/// Fits `model` (which is left calibrated) to points measured on surfaces. The distance of each to the model's moved
/// surface, along the normal of what is nearest, is found again for every shape, with its exact derivative through the
/// equilibrium; of markers all three coordinates count. Losses are A. Cauchy's, their width from the median of what is
/// left, so that stray points count little: fit, find the noise, fit again until it stays. It begins at the one factor
/// on the closed form that explains most, from stiff to soft.
///
/// Intervals: noise, as it was found, widened where what is left at neighbours goes together; and what pulling and
/// smoothing put in place of the unknown, taking that stiffness is within a factor of 5 (one standard deviation) of the
/// level, alike over half the body's size.
///
/// Errors: usage with what to do when a view holds under 20 points of a cloud or 4 markers, a coordinate that is not
/// finite, a box ten times larger than the body or ten times smaller (units), or lies further from it than half its
/// size (another frame); for a marker that lies outside the body at rest; when what was measured lies nearest to a body
/// that does not move. As of calibrate().
[[nodiscard]] MeasuredCalibration calibrate_measured(TissueModel& model, const BodySurface& surface,
                                                     std::span<const MeasuredCase> cases,
                                                     const MeasuredOptions& options = {}, const Context& context = {});

/// How far a view lies from a shape of the model: for loads that were not fitted. Errors as of calibrate_measured().
[[nodiscard]] MeasuredError measured_error(const TissueModel& model, const BodySurface& surface,
                                           const MeasuredPoints& view, std::span<const Vec3> shape,
                                           bool find_pose = false);

}  // namespace osteo::inline simulation
