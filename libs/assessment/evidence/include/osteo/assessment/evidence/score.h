// A session scored: all metrics, the items of a scale, and the moments they come from; as JSON, a row of CSV, or lines.
#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "osteo/assessment/evidence/detail/planned_sawing.h"
#include "osteo/assessment/evidence/detail/process.h"
#include "osteo/assessment/evidence/detail/product.h"
#include "osteo/assessment/evidence/detail/progress.h"
#include "osteo/assessment/evidence/detail/reference.h"
#include "osteo/assessment/evidence/detail/saw_cuts.h"
#include "osteo/assessment/evidence/frames.h"
#include "osteo/assessment/evidence/metric.h"
#include "osteo/assessment/evidence/visibility.h"
#include "osteo/core/base/json_document.h"

namespace osteo::inline assessment {

/// Sessions of others on the same bone, read.
struct Reference {
  struct One {
    std::string subject;
    ReferenceGroup group = ReferenceGroup::expert;
    RemovedSet removed;
    std::map<std::uint8_t, std::vector<NearMetric::Sample>> near;
  };
  std::vector<One> sessions;
};

/// What is scored, taken in frame by frame: the readers, together.
class ScoreKeeper {
 public:
  /// What the scene refers to must outlive this.
  explicit ScoreKeeper(const EvidenceScene& scene);
  void frame(const EvidenceFrame& frame);
  /// Ends it. `end`: the scene as the session left it.
  void finish(const World& end);

  /// Live during the session; whole after finish().
  [[nodiscard]] const std::vector<Measured>& values() const { return values_; }
  [[nodiscard]] const std::vector<Moment>& moments() const { return moments_; }
  [[nodiscard]] const VisibilityMetric& visibility() const { return visibility_; }
  [[nodiscard]] const NearMetric& near() const { return near_; }
  /// Voxels gone, by name: with the burr or the saw, not put back since.
  [[nodiscard]] const std::map<VoxelKey, RemovedVoxel>& removed() const { return removed_; }
  [[nodiscard]] RemovedSet removed_set() const;
  /// Mean of the axes of burrs while they removed, weighted by what they removed; zero where nothing was.
  [[nodiscard]] Vec3 approach() const;

 private:
  EvidenceScene scene_;
  ProcessMetric process_;
  NearMetric near_;
  VisibilityMetric visibility_;
  CutMetric cuts_;
  std::map<VoxelKey, RemovedVoxel> removed_;
  Vec3 axes_;
  std::vector<Measured> values_;
  std::vector<Moment> moments_;
};

/// What a score is of: by it a row of a table is held against others. Hashes are their first 16 digits.
struct ScoreSource {
  std::string stream;                  ///< of the session's file; empty where whoever scores does not set it
  std::string bone;                    ///< World::hash() before the first tick
  std::string procedure;               ///< Procedure::hash, or "none"
  std::string recorded_by, scored_by;  ///< versions of the program; the second is set by whoever scores
  /// `cut_short`: or something of it is lost. `guided` is set by whoever scores.
  bool simulated = false, guided = false, cut_short = false;
  /// The words of those that are, with spaces: "simulated cut-short".
  [[nodiscard]] std::string marks() const;
};

struct Score {
  std::string procedure;  ///< its name; empty: none
  ScoreSource source;
  std::vector<std::string> words;  ///< what limits it, each a sentence
  std::vector<Measured> values;
  std::vector<Product::Result> items;
  std::vector<Moment> moments;
  std::vector<std::pair<std::string, std::string>> steps;            ///< name, "done", "not done" or "not judged"
  std::vector<std::pair<VoxelKey, VisibilityMetric::Voxel>> hidden;  ///< what was removed unseen
  double seconds_frames = 0, seconds_product = 0;                    ///< it took; not in the JSON

  [[nodiscard]] std::size_t passed() const;
  [[nodiscard]] std::size_t judged() const;
};

/// What score_session sees on the way, for whoever shows it.
struct ScoreDetail {
  std::function<void(const EvidenceFrame&)> frame;     ///< told each frame, where set
  std::map<VoxelKey, VisibilityMetric::Voxel> voxels;  ///< by burrs, what is gone
  RemovedSet removed;                                  ///< by saws too
  std::map<std::uint8_t, std::vector<NearMetric::Sample>> near;
  Vec3 approach;  ///< ScoreKeeper::approach()
  std::optional<World> end;
};

/// All of it. `procedure` may be null; `structures` may be null; `subject`: sessions of the reference by this one are
/// left out (as is one that removed exactly the same voxels). Errors: corrupt (another bone), usage (a procedure that
/// needs structures which the case does not have: says which; unless none of its structures is there, that is the
/// procedure of another case).
[[nodiscard]] Score score_session(const SessionReader& session, World begin, const StructureMap* structures,
                                  const Procedure* procedure, const Reference* reference, const std::string& subject,
                                  const Context& context = {}, ScoreDetail* detail = nullptr);
/// A session of a reference, read. The bone has to be the same.
[[nodiscard]] Reference::One read_reference(const SessionReader& session, World begin, const StructureMap* structures,
                                            const ReferenceSession& which, const Context& context = {});

/// "osteotome_score": 1. `evidence`: with the places of each item and the hidden voxels.
[[nodiscard]] Json score_json(const Score& score, bool evidence);
/// A header and a row: the session's name, the source, then the names of all values and items there are, empty where
/// not measured. A name that a spreadsheet would take for a formula has an apostrophe before it.
[[nodiscard]] std::string score_csv(const Score& score, const std::string& session);
/// One line a metric, with its word where it has no value.
[[nodiscard]] std::string score_lines(const Score& score);
/// All metrics with unit, direction, needs, source: docs/validation/evidence.md has this table.
[[nodiscard]] std::string metric_table_markdown();

}  // namespace osteo::inline assessment
