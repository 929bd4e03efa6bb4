// What is measured of a case for its report. Private to libs/assessment/case_report.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/tri_mesh.h"
#include "osteo/core/data/volume.h"
#include "osteo/geometry/grid/brick_grid.h"

namespace osteo::inline assessment::case_report {

struct StructureMeasure {
  Structure structure;
  double volume_mm3 = 0;
  int parts = 0;                 ///< of at least 0.5 mm3, or the largest; voxels that touch by a corner are joined
  int specks = 0;                ///< smaller ones
  Vec3 lo_mm, hi_mm, middle_mm;  ///< middle: the voxel of the largest part that is nearest to the part's mean
  double length_mm =
      0;  ///< of the largest part along itself, from end to end; 0 where it is no tube or too large to measure
  struct Gap {
    std::uint8_t other = 0;
    double mm = 0;  ///< between the nearest faces of voxels; 0: they touch
  };
  std::vector<Gap> gaps;                                                       ///< to all others, nearest first
  [[nodiscard]] bool on_both_sides() const { return hi_mm.x - lo_mm.x > 55; }  ///< an ear is not that wide
};

/// In the order of the map's structures. Distances to half a voxel; lengths 0 to 8 % long (a path over voxels), ends
/// included.
[[nodiscard]] std::vector<StructureMeasure> measure_structures(const Labels& labels, const Context& context);

struct Plausibility {
  bool known = false, fits = true, has_length = false;
  std::string expected;  ///< "33 mm (29 to 50), one piece"
  std::string doubt;     ///< why it does not fit
  std::string source;
};
/// Beside what is published for structures of that name.
[[nodiscard]] Plausibility plausibility_of(const StructureMeasure& m);

/// For each point of a surface the bone beneath it, at most `reach_mm`.
[[nodiscard]] std::vector<float> thickness_below(const TriMesh& mesh, const BrickGrid& bone, double reach_mm,
                                                 const Context& context);

}  // namespace osteo::inline assessment::case_report
