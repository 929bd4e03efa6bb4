// A session as frames: from its file, or tick by tick while it runs.
#pragma once
#include <functional>
#include <unordered_map>
#include <vector>

#include "osteo/assessment/evidence/metric.h"
#include "osteo/session/recording/session_reader.h"

namespace osteo::inline assessment {

/// Keeps the bone as of the frame reached, and makes frames of what a session tells. Memory: a copy of the bone.
class FrameMaker {
 public:
  using Sink = std::function<void(const EvidenceFrame&)>;
  /// `cameras` by tick; may grow while it is used (live). Both must outlive this.
  FrameMaker(World begin, double rate_hz, const std::vector<CameraPose>& cameras, Sink sink);

  /// A part of a session file, in order.
  void part(const SessionPart& part);
  /// Live: what a reader is told (docs/developer/readers.md), with densities as they were before and after each change.
  void action(const SceneAction& action);
  void tick(const TickRecord& record, std::span<const VoxelChange> changes);
  /// The last frame is whole.
  void end();

  [[nodiscard]] const World& world() const { return world_; }

 private:
  void flush();
  void begin_frame_at(std::uint64_t tick);
  void take(const TickRecord& record);
  [[nodiscard]] bool take(const VoxelChange& change);

  World world_;
  double rate_hz_;
  std::uint64_t frame_ticks_;
  const std::vector<CameraPose>& cameras_;
  Sink sink_;
  std::vector<SceneAction> actions_;
  std::vector<TickRecord> ticks_;
  std::vector<VoxelChange> changes_, sawn_;
  std::unordered_map<VoxelKey, std::size_t> in_frame_;  // voxel -> place in changes_
  std::uint64_t next_tick_ = 0, lost_ = 0;
};

/// Tells the frames of a whole session up to where its bone is known. `begin`: the scene it began with (Error(corrupt)
/// when it is another). Returns the scene as it was left.
World report_frames(const SessionReader& session, World begin, const FrameMaker::Sink& sink,
                    const Context& context = {});
/// The notes of a session that say where the camera was.
[[nodiscard]] std::vector<CameraPose> cameras_of(const SessionReader& session, std::size_t& unreadable);

}  // namespace osteo::inline assessment
