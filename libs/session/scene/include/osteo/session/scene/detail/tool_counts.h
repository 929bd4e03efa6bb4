// What the tools did, in numbers for the summary.
#pragma once
#include <deque>
#include <mutex>
#include <numeric>
#include <set>

#include "osteo/session/scene/reader.h"

namespace osteo::inline session {

/// May be told in one thread and asked from others.
class ToolCounts final : public Reader {
 public:
  void scene_changed(const World& world, const World::Effect& effect) override;
  void action(const SceneAction& action) override;
  void tick(const TickRecord& record, std::span<const VoxelChange> changes) override;

  /// By saws alone, as the metric of that name; what was taken back counts too.
  [[nodiscard]] double sawn_mm3() const {
    const std::lock_guard lock(mutex_);
    return std::accumulate(waiting_mm3_.begin(), waiting_mm3_.end(), sawn_mm3_);
  }
  /// Crumbs that went when bone was taken apart; what was taken back counts too.
  [[nodiscard]] double crumbs_mm3() const { return locked(crumbs_mm3_); }
  /// Actions that took something back.
  [[nodiscard]] std::uint64_t undone() const { return locked(undone_); }
  /// Tools that have removed bone.
  [[nodiscard]] std::set<std::uint8_t> burrs_used() const { return locked(burrs_used_); }
  /// Ticks in which bone was left that might have gone (kNoRoom).
  [[nodiscard]] std::uint64_t ticks_without_room() const { return locked(ticks_without_room_); }
  /// Ticks in which the device gave no pose that could be used.
  [[nodiscard]] std::uint64_t unusable_poses() const { return locked(unusable_poses_); }

 private:
  template <class T>
  [[nodiscard]] T locked(const T& value) const {
    const std::lock_guard lock(mutex_);
    return value;
  }
  mutable std::mutex mutex_;
  double sawn_mm3_ = 0, crumbs_mm3_ = 0;
  std::deque<double> waiting_mm3_;  // of changes whose action the stream has yet to tell
  std::set<std::uint8_t> burrs_used_;
  std::uint64_t undone_ = 0, ticks_without_room_ = 0, unusable_poses_ = 0;
};

}  // namespace osteo::inline session
