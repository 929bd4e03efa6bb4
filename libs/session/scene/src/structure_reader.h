// The judge of what steps take of critical structures, as one of the readers of a rehearsal.
#pragma once
#include <array>
#include <mutex>
#include <vector>

#include "osteo/session/scene/reader.h"
#include "osteo/simulation/haptics/structure_judge.h"

namespace osteo::inline session {

/// Reported in one thread, asked in others. After a loss there is nothing to make again: where the first body is,
/// scene_changed() always tells.
class StructureReader final : public Reader {
 public:
  StructureReader(const StructureMap& map, const World& world, double rate_hz) : judge_(map, rate_hz) {
    place(world);
    for (std::uint32_t hand = 0; hand < guides_.size(); ++hand) guides_[hand] = world.cutting_guide(hand);
  }
  void scene_changed(const World& world, const World::Effect& /*effect*/) override {
    const std::lock_guard lock(mutex_);
    place(world);
  }
  void action(const SceneAction& action) override {
    if (!action.is(ActionKind::cutting_guide) || action.hand >= guides_.size()) return;
    const std::lock_guard lock(mutex_);
    guides_[action.hand] = action.guide();
  }
  void tick(const TickRecord& record, std::span<const VoxelChange> /*changes*/) override {
    if (record.hand >= guides_.size()) return;
    const std::lock_guard lock(mutex_);
    judge_.tick(record, own_from_world_, guides_[record.hand]);
  }
  /// From the thread that changes the scene: see StructureJudge.
  std::vector<StructureCut> saw(std::uint64_t tick, const World& world, const SawCut& cut,
                                std::span<const VoxelKey> voxels) {
    const std::lock_guard lock(mutex_);
    return judge_.saw(tick, world, cut, voxels);
  }
  std::vector<StructureCut> attach(std::uint64_t tick, const World& world, const SceneAction& action) {
    const std::lock_guard lock(mutex_);
    return judge_.attach(tick, world, action);
  }
  [[nodiscard]] std::vector<StructureCutEvent> events() const {
    const std::lock_guard lock(mutex_);
    return judge_.events();
  }

 private:
  void place(const World& world) { own_from_world_ = world.bodies().front().world_from_body.inverse(); }

  mutable std::mutex mutex_;
  StructureJudge judge_;
  RigidTransform own_from_world_;
  std::array<CuttingGuide, kMaxHands> guides_{};
};

}  // namespace osteo::inline session
