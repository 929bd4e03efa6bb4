// A tool that somebody else tracks, over OpenIGTLink, as the hand that holds the drill.
#pragma once
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "osteo/core/rt/seqlock.h"
#include "osteo/network/wire/client.h"
#include "osteo/simulation/devices/devices.h"

namespace osteo::inline network {

/// "HOST:PORT" or "HOST:PORT/NAME". Error(usage).
struct TrackerAddress {
  WireAddress server;
  std::string tool;  ///< name of the TRANSFORM; empty: the first that is heard
};
[[nodiscard]] TrackerAddress tracker_address(const std::string& text);

/// Follows one TRANSFORM: in mm, RAS, origin at the tip, third axis from tip to handle; the tracker's side has
/// registered it to the patient. A SENSOR of the same name with "Pedal" behind it is the pedal, 0 to 1. Matrices that
/// are no poses are left out.
class TrackedLink {
 public:
  static constexpr double kStaleMs = 100;  ///< without a pose for so long the tool is out of sight
  explicit TrackedLink(const TrackerAddress& tracker);

  struct State {
    Vec3 tip_mm;  ///< LPS
    Vec3 axis{0, 0, 1};
    std::int64_t heard_ns = 0;  ///< monotonic; 0: never
    double pedal = 0;
    std::int64_t pedal_ns = 0;
  };
  /// The servo's: false while it is being written.
  [[nodiscard]] bool latest(State& state) const noexcept { return state_.try_load(state); }
  [[nodiscard]] std::uint64_t poses() const noexcept { return poses_; }
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }
  [[nodiscard]] bool connected() const { return client_.connected(); }
  /// In words, for people; empty: the tool is in sight.
  [[nodiscard]] std::string trouble() const;

 private:
  void take(const IgtlMessage& message);
  TrackerAddress tracker_;
  State now_;  // its thread's
  Seqlock<State> state_;
  std::atomic<std::uint64_t> poses_{0}, refused_{0}, others_{0};
  mutable std::mutex mutex_;
  std::string follows_;  // name
  WireClient client_;    // last: its thread uses all the others
};

/// The tip is the goal of a spring hand, so that the drill rests on bone although nothing holds the tracked tool back.
/// The first pose puts the tool there; out of sight it rests where it is, the pedal up, and the force fades; in sight
/// again it goes there by the spring, and the pedal counts once it is within kTakesHoldMm.
class TrackedHand final : public Device, public TunedHand {
 public:
  static constexpr double kTakesHoldMm = 3;
  /// `pedal` may be null.
  TrackedHand(std::shared_ptr<TrackedLink> link, const HandGoal& start, const FootPedal* pedal, std::size_t hand = 0);
  DeviceSample read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept override;
  void set_tool(std::uint8_t tool) noexcept override { tool_ = tool; }
  [[nodiscard]] DeviceTraits traits() const override { return SpringHand::traits(); }
  [[nodiscard]] std::string trouble() const override { return link_->trouble(); }

 private:
  std::shared_ptr<TrackedLink> link_;
  const FootPedal* pedal_;
  std::atomic<std::uint8_t> tool_;
  // The servo's.
  TrackedLink::State last_;
  HandGoal goal_;
  SpringHand hand_;
  bool begun_ = false, holds_ = false;
};

}  // namespace osteo::inline network
