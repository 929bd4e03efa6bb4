#include "osteo/assessment/scoring/detail/score_reader.h"

namespace osteo::inline assessment {

ScoreReader::ScoreReader(const World& world, const EvidenceScene& scene) : scene_(scene), keeper_(scene) {
  maker_.emplace(world.copy(), scene.rate_hz, cameras_, [this](const EvidenceFrame& f) { keeper_.frame(f); });
}

void ScoreReader::resync(const World& world) {
  // The first is the scene it was made from.
  if (!begun_) return;
  ++resyncs_;
  maker_->end();
  maker_.emplace(world.copy(), scene_.rate_hz, cameras_, [this](const EvidenceFrame& f) { keeper_.frame(f); });
}

void ScoreReader::action(const SceneAction& action) {
  begun_ = true;
  take_cameras();
  maker_->action(action);
}

void ScoreReader::tick(const TickRecord& record, std::span<const VoxelChange> changes) {
  begun_ = true;
  take_cameras();
  maker_->tick(record, changes);
}

void ScoreReader::camera(const CameraPose& pose) {
  const std::lock_guard lock(mutex_);
  waiting_.push_back(pose);
}

// Only between ticks: a frame that is being made looks at them.
void ScoreReader::take_cameras() {
  const std::lock_guard lock(mutex_);
  cameras_.insert(cameras_.end(), waiting_.begin(), waiting_.end());
  waiting_.clear();
}

void ScoreReader::end() {
  take_cameras();
  maker_->end();
  keeper_.finish(maker_->world());
}

}  // namespace osteo::inline assessment
