// Where a pen's tip is: found by turning the pen on it.
#pragma once
#include <filesystem>
#include <span>
#include <string>

#include "osteo/core/data/rigid_transform.h"
#include "osteo/simulation/marker/body.h"

namespace osteo::inline simulation {

/// A pen with its print.
struct Pen {
  int pen = 1;                         ///< which of the prints
  double scale = 1;                    ///< printed mm for a drawn one, by the ruler line on the page
  Vec3 tip_mm = PenBody::kUsualTipMm;  ///< in the body's frame
  double rms_mm = -1;  ///< how far the tip seemed to wander while the pen was turned on it; below 0: it was not
};
/// Error(no_input), Error(usage) with the line.
[[nodiscard]] Pen load_pen(const std::filesystem::path& path);
[[nodiscard]] std::string pen_json(const Pen& pen);

/// The point that stays where it is under all poses: linear least squares for both it and its place, as in Z. Yaniv,
/// SPIE Medical Imaging 2015 ("algebraic one step"). Poses that are three times farther off than the median are left
/// out once.
struct PivotFit {
  Vec3 tip_mm;    ///< in the body's frame
  Vec3 pivot_mm;  ///< in the camera's
  double rms_mm = 0, worst_mm = 0;
  int poses = 0, left_out = 0;
  double tilt_deg = 0;  ///< between the two poses whose axes differ most
};
/// Error(failed), saying what to do, with fewer than 20 poses, with axes that differ by less than 20 degrees, or with
/// an RMS above `most_rms_mm`: the tip slipped.
[[nodiscard]] PivotFit fit_pivot(std::span<const RigidTransform> camera_from_body, double most_rms_mm = 2);

}  // namespace osteo::inline simulation
