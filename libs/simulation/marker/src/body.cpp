#include "osteo/simulation/marker/body.h"

#include <cmath>
#include <numbers>

#include "aruco.h"
#include "osteo/core/base/error.h"

namespace osteo::inline simulation {

std::vector<MarkerPatch> pen_markers(int pen, double scale) {
  if (pen < 1 || pen > PenBody::kMaxPens)
    throw Error(ExitCode::usage, "there is no pen " + std::to_string(pen),
                "pens are 1 to " + std::to_string(PenBody::kMaxPens));
  std::vector<MarkerPatch> all;
  const int first = (pen - 1) * PenBody::kMarkers;
  for (int row = 0; row < 2; ++row) {
    for (int face = 0; face < 6; ++face) {
      const double a = face * std::numbers::pi / 3;
      const Vec3 out{std::cos(a), std::sin(a), 0}, up{0, 0, 1};
      const double z = (row == 0 ? 0.25 : -0.25) * PenBody::kHeightMm;
      all.push_back({first + 6 * row + face, (out * PenBody::kApothemMm + up * z) * scale, cross(up, out), up,
                     PenBody::kMarkerMm * scale});
    }
  }
  // Folded over from the upper edge of the second face.
  const Vec3 right = all[1].right, up = -all[1].out();
  all.push_back({first + 12, Vec3{0, 0, PenBody::kHeightMm / 2} * scale, right, up, PenBody::kCapMarkerMm * scale});
  return all;
}

int marker_cells_across(MarkerKind kind) {
  return marker::bits_across(kind) + 2;
}

std::vector<std::uint8_t> marker_cells(MarkerKind kind, int id) {
  const int n = marker_cells_across(kind);
  const cv::Mat picture = marker::drawn_marker(kind, id, n);
  std::vector<std::uint8_t> cells;
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) cells.push_back(picture.at<std::uint8_t>(y, x) > 127 ? 1 : 0);
  }
  return cells;
}

std::vector<MarkerPatch> plate_markers() {
  std::vector<MarkerPatch> all;
  for (const marker::PlateMarker& m : marker::markers_of_plate()) {
    const auto at = [&](std::size_t c) {
      const cv::Point3f& p = m.corners_mm[c];
      return Vec3{p.x, p.y, p.z};
    };
    all.push_back(
        {m.id, (at(0) + at(2)) * 0.5, normalized(at(1) - at(0)), normalized(at(0) - at(3)), PlateBody::kMarkerMm});
  }
  return all;
}

bool plate_square_is_black(int across, int down) {
  static const std::vector<MarkerPatch> markers = plate_markers();
  for (const MarkerPatch& m : markers) {
    if (static_cast<int>(m.centre_mm.x / PlateBody::kSquareMm) == across &&
        static_cast<int>(m.centre_mm.y / PlateBody::kSquareMm) == down)
      return false;
  }
  return true;
}

}  // namespace osteo::inline simulation
