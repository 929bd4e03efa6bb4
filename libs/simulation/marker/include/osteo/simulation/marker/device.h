// A pen before a camera, as the hand that holds the drill.
#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "osteo/core/rt/seqlock.h"
#include "osteo/simulation/devices/devices.h"
#include "osteo/simulation/marker/detail/filter.h"
#include "osteo/simulation/marker/detail/pen.h"
#include "osteo/simulation/marker/detail/picture.h"

namespace osteo::inline simulation {

/// Where the camera stands: how its picture lies on the desk.
enum class CameraPlace : int { facing, above, behind };
[[nodiscard]] constexpr std::array<std::string_view, 3> enum_names(CameraPlace) {
  return {"facing", "above", "behind"};
}
/// Columns are the camera's axes (x right, y down, z ahead) on the desk: right, away, up. Facing: on the screen,
/// looking at the user; above: looking down, its picture's top away from the user; behind: over the user's shoulder.
[[nodiscard]] Mat3 controller_from_camera(CameraPlace place);

/// Reads a camera in a thread of its own and follows one pen: sees it, smooths, hands the motion on. A camera that is
/// not there, or goes, is looked for again twice a second; a video ends.
class PenLink {
 public:
  using Open = std::function<std::unique_ptr<PictureSource>()>;
  PenLink(Open open, const CameraModel& camera, const Pen& pen, const PenFilterParams& filter = {});
  ~PenLink();
  PenLink(const PenLink&) = delete;
  PenLink& operator=(const PenLink&) = delete;

  struct State {
    PenMotion motion;        ///< time_s is unused: of_ns counts
    std::int64_t of_ns = 0;  ///< monotonic, of the exposure; 0: the pen is not in sight
    std::uint64_t pictures = 0;
  };
  /// The reader's: false while it is being written.
  [[nodiscard]] bool latest(State& state) const noexcept { return state_.try_load(state); }
  [[nodiscard]] std::uint64_t pictures() const noexcept { return pictures_; }
  [[nodiscard]] std::uint64_t seen() const noexcept { return seen_; }
  [[nodiscard]] bool connected() const noexcept { return connected_; }
  /// In words, for people; empty: the pen is in sight, or was a moment ago.
  [[nodiscard]] std::string trouble() const;

 private:
  void run();
  void read_on();
  void notify(const PenSight& sight, bool live);
  void say(const std::string& what);
  Open open_;
  CameraModel camera_;
  Pen pen_;
  PenFilterParams filter_;
  Seqlock<State> state_;
  std::atomic<std::uint64_t> pictures_{0}, seen_{0};
  std::atomic<bool> connected_{false}, stop_{false};
  mutable std::mutex trouble_mutex_;
  std::string trouble_;
  int unseen_ = 0, odd_ = 0;  // pictures in a row
  std::thread thread_;        // last: it uses all the others
};

/// The pen's tip is the goal of a spring hand, so that the drill rests on bone although nothing holds the pen back: a
/// device of pose only. While the pen is out of sight for longer than two and a half pictures (and the camera's delay)
/// the drill stops, force fades, nothing pulls; seen again, it takes hold where the tool is, and the handle turns to
/// the pen's at no more than 2 rad/s. Bit 1 of a pedal (the middle one) is the clutch: the pen moves alone. pedal_bit()
/// of a pedal is the drill; keys of the window, and other switches, as tuned.
class MarkerDevice final : public Device, public TunedHand {
 public:
  /// `scene_from_camera`: columns are the camera's axes in the scene. `scale`: scene mm for a mm of the hand. `start`:
  /// where the drill waits until the pen is seen. `pedal` may be null.
  MarkerDevice(std::shared_ptr<PenLink> link, const CameraModel& camera, const HandGoal& start,
               const Mat3& scene_from_camera, double scale, const FootPedal* pedal, std::size_t hand = 0);
  DeviceSample read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept override;
  void set_tool(std::uint8_t tool) noexcept override { tool_ = tool; }
  [[nodiscard]] DeviceTraits traits() const override { return SpringHand::traits(); }
  [[nodiscard]] std::string trouble() const override { return link_->trouble(); }
  /// Without a picture for longer than this the pen is out of sight.
  [[nodiscard]] double patience_ms() const { return patience_ms_; }

 private:
  [[nodiscard]] Vec3 towards(Vec3 wanted, double dt_s) noexcept;
  std::shared_ptr<PenLink> link_;
  Mat3 scene_from_camera_;
  double scale_, patience_ms_;
  const FootPedal* pedal_;
  std::atomic<std::uint8_t> tool_;
  // The servo's.
  PenLink::State last_;
  WorkspaceMap map_;
  HandGoal goal_;
  Vec3 axis_;
  SpringHand hand_;
  bool out_of_sight_ = true, turning_ = true;
};

}  // namespace osteo::inline simulation
