// What is drawn of a case for its report. Private to libs/assessment/case_report.
#pragma once
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "measures.h"
#include "osteo/assessment/case_report/case_report.h"
#include "osteo/core/base/context.h"
#include "osteo/core/data/data.h"
#include "osteo/geometry/grid/brick_grid.h"

namespace osteo::inline assessment::case_report {

struct Subject {
  const BrickGrid* bone = nullptr;
  std::shared_ptr<const TriMesh> surface;  ///< for pictures; null: none in the case
  const Labels* structures = nullptr;      ///< null: none
  const CaseScan* scan = nullptr;          ///< null: not at hand
  const SparseGrid* hu = nullptr;          ///< of bone only; null: not kept
  std::vector<StructureMeasure> measures;
  Vec3 lo_mm, hi_mm;  ///< of the bone
  double lower_hu = 0, upper_hu = 32767;
};

/// The box of voxels that are at least half bone.
[[nodiscard]] std::pair<Vec3, Vec3> bounds_of_bone(const BrickGrid& bone);
/// Through the middle of the bone, or of its first structure.
[[nodiscard]] Vec3 cut_point(const Subject& s);

using Pictures = std::map<std::string, Picture>;
/// "soft-axial", ..., "bone-sagittal": with the bone's outline and the structures'. With the scan, or of bone alone
/// where only HU are known.
void draw_cuts(const Subject& s, Pictures& into, const Context& context);
/// "slice-1" to "slice-8", from the feet up.
void draw_slices(const Subject& s, Pictures& into);
/// "side-front", ..., and "thin-left-front", "thin-below": the surface coloured by the bone beneath it, which is known
/// for each of its points up to kPaleMm.
inline constexpr double kPaleMm = 2;
void draw_bone(const Subject& s, std::span<const float> below_mm, Pictures& into);
/// Where there are structures, "structures": in clear bone.
void draw_structures(const Subject& s, Pictures& into, const Context& context);
/// "removed-axial", ...: the mask in grey, what was taken off in colours, seen through. With the scan only.
void draw_removed(const Subject& s, Pictures& into);
/// Voxels by HU: shares on a logarithmic scale from kHistogramFrom in steps of kHistogramStep.
inline constexpr double kHistogramFrom = -1200, kHistogramTo = 3000, kHistogramStep = 40;
[[nodiscard]] std::vector<double> histogram_of(const Image& ct);

}  // namespace osteo::inline assessment::case_report
