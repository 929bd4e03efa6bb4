#include "osteo/core/data/frame.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"

namespace osteo {

void require_valid(const Frame& frame) {
  for (std::size_t a = 0; a < 3; ++a) {
    if (frame.dims[a] < 1) throw Error(ExitCode::corrupt, "the volume has no voxels along axis " + std::to_string(a));
    const double s = frame.spacing_mm[a];
    if (!(s > 0) || !std::isfinite(s) || s > 1000) {
      throw Error(ExitCode::corrupt,
                  "the voxel spacing along axis " + std::to_string(a) + " is " + format_number(s) + " mm",
                  "a spacing must be positive and in millimetres");
    }
    if (!std::isfinite(frame.origin_mm[a])) throw Error(ExitCode::corrupt, "the volume's position is not a number");
  }
  if (static_cast<double>(frame.dims[0]) * frame.dims[1] * frame.dims[2] > 1e18)
    throw Error(ExitCode::corrupt,
                "the volume has " + std::to_string(frame.dims[0]) + " x " + std::to_string(frame.dims[1]) + " x " +
                    std::to_string(frame.dims[2]) + " voxels: more than can be counted",
                "voxels far from the rest are mostly a fault of the program that wrote it; make it again");
  const auto& c = frame.direction.column;
  double worst = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    worst = std::max(worst, std::abs(length(c[a]) - 1));
    worst = std::max(worst, std::abs(dot(c[a], c[(a + 1) % 3])));
  }
  if (!(worst < 1e-3)) {
    throw Error(ExitCode::corrupt, "the volume's axes are not at right angles (off by " + format_number(worst) + ")",
                "a sheared volume must be resampled before it can be used");
  }
}

bool same_place(const Frame& a, const Frame& b, double tolerance_mm) {
  if (a.dims != b.dims) return false;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 ijk{(corner & 1) != 0 ? a.dims[0] - 1.0 : 0.0, (corner & 2) != 0 ? a.dims[1] - 1.0 : 0.0,
                   (corner & 4) != 0 ? a.dims[2] - 1.0 : 0.0};
    if (length(a.world_from_index(ijk) - b.world_from_index(ijk)) > tolerance_mm) return false;
  }
  return true;
}

std::string orientation_code(const Frame& frame) {
  static constexpr char kPositive[] = "LPS";
  static constexpr char kNegative[] = "RAI";
  std::string code;
  for (std::size_t a = 0; a < 3; ++a) {
    const Vec3 v = frame.direction.column[a];
    std::size_t main = 0;
    for (std::size_t b = 1; b < 3; ++b) {
      if (std::abs(v[b]) > std::abs(v[main])) main = b;
    }
    code += v[main] > 0 ? kPositive[main] : kNegative[main];
  }
  return code;
}

}  // namespace osteo
