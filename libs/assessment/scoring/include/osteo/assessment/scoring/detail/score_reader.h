// A score that is kept while a session runs.
#pragma once
#include <mutex>
#include <optional>

#include "osteo/assessment/evidence/score.h"
#include "osteo/session/scene/reader.h"

namespace osteo::inline assessment {

/// Makes the same frames as the session's file will have, and keeps the score of them: what it tells after end() is
/// what `osteo score` tells of the file, to the bit, where it joined before the first tick and nothing was lost. Takes
/// a copy of the bone. After ticks were lost it goes on from the scene as it is.
class ScoreReader final : public Reader {
 public:
  /// What `scene` refers to must outlive this.
  ScoreReader(const World& world, const EvidenceScene& scene);
  void resync(const World& world) override;
  void action(const SceneAction& action) override;
  void tick(const TickRecord& record, std::span<const VoxelChange> changes) override;

  /// From any thread: where one looks from since a tick; in the order of ticks. The same as the "camera" notes of the
  /// session.
  void camera(const CameraPose& pose);
  /// The session is over.
  void end();
  /// After end().
  [[nodiscard]] const ScoreKeeper& keeper() const { return keeper_; }
  [[nodiscard]] std::uint64_t resyncs() const { return resyncs_; }

 private:
  void take_cameras();
  EvidenceScene scene_;
  ScoreKeeper keeper_;
  std::vector<CameraPose> cameras_;
  std::optional<FrameMaker> maker_;
  std::uint64_t resyncs_ = 0;
  bool begun_ = false;
  std::mutex mutex_;
  std::vector<CameraPose> waiting_;
};

}  // namespace osteo::inline assessment
