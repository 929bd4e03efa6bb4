// What is printed: a prism of markers around a pen, and a plate of squares to calibrate a camera by.
#pragma once
#include <cstdint>
#include <vector>

#include "osteo/core/data/vec.h"

namespace osteo::inline simulation {

/// A square marker in the frame of its body, as it is seen from outside. right x up points out of the body.
struct MarkerPatch {
  int id = 0;
  Vec3 centre_mm, right, up;  ///< right, up: unit
  double size_mm = 0;         ///< edge of the black square
  [[nodiscard]] Vec3 out() const { return cross(right, up); }
  /// Clockwise from the top left, as detectors give them.
  [[nodiscard]] Vec3 corner_mm(std::size_t i) const {
    return centre_mm + (right * (i == 1 || i == 2 ? 1.0 : -1.0) + up * (i < 2 ? 1.0 : -1.0)) * (size_mm / 2);
  }
};

/// A hexagonal prism that a pen goes through: two rows of six markers and one on the upper end. From every side but
/// below at least two faces that are 60 degrees apart are seen, so that one flat marker's two possible poses never have
/// to be distinguished for long. Origin in its middle, z along the pen away from the tip.
struct PenBody {
  static constexpr double kFaceMm = 28, kHeightMm = 56, kMarkerMm = 24, kCapMarkerMm = 28;
  static constexpr int kMarkers = 13, kMaxPens = 3;
  /// From the axis to a face.
  static constexpr double kApothemMm = kFaceMm * 0.8660254037844386;
  /// Where the tip is unless it was found by turning the pen on it.
  static constexpr Vec3 kUsualTipMm{0, 0, -100};
};

/// The markers of pen 1, 2 or 3. `scale`: printed mm for a drawn one. Error(usage) for another pen.
[[nodiscard]] std::vector<MarkerPatch> pen_markers(int pen, double scale = 1);

/// Which set of ids: both have some of their own, so that a plate is never taken for a pen.
enum class MarkerKind { pen, plate };
/// Cells across a marker, its black border included: 6 or 7.
[[nodiscard]] int marker_cells_across(MarkerKind kind);
/// Row by row from the top, 1 is white.
[[nodiscard]] std::vector<std::uint8_t> marker_cells(MarkerKind kind, int id);

/// A chess board with markers in its white squares (ChArUco): x right, y down from its upper left corner.
struct PlateBody {
  static constexpr int kAcross = 5, kDown = 7;
  static constexpr double kSquareMm = 35, kMarkerMm = 28;
};
[[nodiscard]] std::vector<MarkerPatch> plate_markers();
/// Whether the square holds no marker.
[[nodiscard]] bool plate_square_is_black(int across, int down);

}  // namespace osteo::inline simulation
