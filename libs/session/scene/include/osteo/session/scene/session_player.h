// A recorded session in memory, to be looked at as of any time.
#pragma once
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "osteo/session/scene/session_scene.h"

namespace osteo::inline session {

/// Times are of the session, in seconds; bone is known to the tenth of a second, hands to the fiftieth. Dust is left
/// out. Memory: two copies of the bone, 12 bytes a voxel for each tenth of a second in which it changed, 7 KB a second
/// for each hand.
class SessionPlayer {
 public:
  static constexpr double kHandRateHz = 50;

  /// Reads all of it, up to where its bone is known, and is at its end. Error(corrupt) when the session is of another
  /// bone.
  SessionPlayer(const SessionReader& session, World begin, const Context& context = {});

  [[nodiscard]] double end_s() const { return end_s_; }
  [[nodiscard]] double now_s() const { return now_s_; }
  /// Cost: that of the voxels that changed in between, either way. Where an action that changes the world lies in
  /// between (undo, a saw cut, a piece that is moved), all is told again from the beginning: seconds in a long session.
  /// Clamped to the session.
  void go_to(double t_s);

  [[nodiscard]] SessionScene& scene() { return scene_; }
  [[nodiscard]] std::size_t hands() const { return hands_.size(); }
  [[nodiscard]] double rate_hz() const { return rate_hz_; }
  /// The record of a hand as of now; null before it is to be drawn (SessionScene::in_use).
  [[nodiscard]] const TickRecord* hand(std::size_t number) const;
  /// The value of the last "camera" note before now; null where there is none.
  [[nodiscard]] const std::string* camera() const;

 private:
  // What a frame of the file did, all of it at its end.
  struct Step {
    double end_s = 0;
    bool remakes = false;  // an action in it changes the world
    std::vector<SceneAction> actions;
    std::vector<VoxelChange> changes;  // with the densities before
    TickRecord last;
  };
  void notify(const Step& step);
  void go_to_step(std::size_t steps);

  World begin_;
  SessionScene scene_;
  std::vector<Step> steps_;
  std::vector<std::vector<TickRecord>> hands_;  // from where they are in use
  std::vector<std::pair<double, std::string>> cameras_;
  double rate_hz_, end_s_ = 0, now_s_ = 0;
  std::size_t done_ = 0;  // steps
};

}  // namespace osteo::inline session
