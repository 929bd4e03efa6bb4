// What is learned from sessions of others: where they took bone, and how hard they pressed near each structure.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/param.h"
#include "osteo/geometry/grid/brick_grid.h"

namespace osteo::inline assessment {

enum class ReferenceGroup : int { expert, novice };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(ReferenceGroup) {
  return {"expert", "novice"};
}
struct ReferenceSession {
  using Params = ReferenceSession;
  std::string session;  ///< folder, relative to the reference's
  std::string subject;  ///< a code, not a name
  ReferenceGroup group = ReferenceGroup::expert;
  static void describe(Params& p, auto& visit) {
    visit({"session", "folder of the session, from here", "", 0, 0, true}, p.session);
    visit({"subject", "who, by a code", "", 0, 0, true}, p.subject);
    visit({"group", "how good", "", 0, 0, true}, p.group);
  }
};
/// FOLDER/reference.json: {"osteotome_reference": 1, "sessions": [{"session", "subject", "group"}, ...]}. Strict, with
/// line. Errors: no_input, usage.
[[nodiscard]] std::vector<ReferenceSession> load_reference(const std::filesystem::path& folder);

/// Which voxels a session took, ascending names.
using RemovedSet = std::vector<VoxelKey>;

/// The score of a removed region after D. Morris 2006, section 3.5.3, put right: p(v) = (n that removed v + 1) / (n +
/// 2) in each group, every voxel that anybody removed counts, kept ones too.
struct RegionScore {
  double log_ratio = 0;  ///< sum over removed of ln(pE/pN) and over kept of ln((1-pE)/(1-pN))
  double per_voxel = 0;  ///< log_ratio / effective_voxels
  double effective_voxels =
      0;              ///< (sum of w)^2 / (sum of w^2), w = what a voxel can decide: |ln(pE/pN) - ln((1-pE)/(1-pN))|
  double thesis = 0;  ///< as printed: removed voxels only
};
/// `experts`, `novices`: one set a session, none of the subject that is scored. Zero where neither group tells them
/// apart.
[[nodiscard]] RegionScore score_region(const RemovedSet& session, std::span<const RemovedSet> experts,
                                       std::span<const RemovedSet> novices);

/// Quantiles of a value conditional on a distance, each rising with it: the fit of least pinball loss among functions
/// that do not fall, one step every kStepMm, the lowest of equally good ones (statistics/isotonic.h).
class IsotonicQuantile {
 public:
  static constexpr double kStepMm = 0.1;
  struct Point {
    double distance_mm = 0, value = 0;
  };
  /// `q` in (0, 1). O(n log n).
  IsotonicQuantile(std::span<const Point> points, double q);
  /// At a distance: of its own step, else of the next nearer one that has points, else of the next farther. 0 where
  /// there are none.
  [[nodiscard]] double at(double distance_mm) const;
  [[nodiscard]] bool empty() const { return steps_.empty(); }
  /// First distance of each step, and its value.
  [[nodiscard]] const std::vector<Point>& steps() const { return steps_; }

 private:
  std::vector<Point> steps_;
};

}  // namespace osteo::inline assessment
