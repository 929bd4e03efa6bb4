// A place in a session that runs on another machine: for 'osteo join' and for the window.
#pragma once
#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "osteo/core/rt/loop.h"
#include "osteo/network/tutor/live_run.h"
#include "osteo/simulation/haptics/simulated_device.h"

namespace osteo::inline network {

/// A hand without a will that is led from where the instructor's is when it is first heard of: it holds a device of 0.1
/// kg, and its grip (N/m) gives way within 0.1 s.
class YieldingHand final : public Device {
 public:
  YieldingHand(double stiffness_n_per_m, std::shared_ptr<const FarDevice> leader);
  /// Until then: age_ms 255.
  DeviceSample read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept override;
  [[nodiscard]] DeviceTraits traits() const override { return device_.traits(); }

 private:
  SimulatedDevice device_;
  double stiffness_n_per_mm_;
  std::shared_ptr<const FarDevice> leader_;
  Vec3 place_;
  bool begun_ = false;
};

/// Words for session.json of who has joined.
[[nodiscard]] std::string joined_text(JoinRole role);

/// How someone takes part.
struct SeatOptions {
  UdpPeer host;
  std::string tidy_code;
  JoinRole role = JoinRole::watcher;
  double stiffness_n_per_mm = 1, most_n = 3;  ///< of the trainee's pull to the instructor's hand
};

struct SeatStatus {
  JoinState state = JoinState::asking;
  std::string why;  ///< it was rejected
  double rtt_ms = 0, offset_ms = 0, drift_ppm = 0, lost = 0;
  std::uint64_t ticks = 0, behind_ticks = 0;  ///< done here; known of beyond that
  bool over = false;                          ///< the host's session has ended, and all of it is here
  bool host_lost = false;                     ///< the host could not follow its own session: there is no more of it
  bool another = false;                       ///< it has begun another session than the one that was begun here
  std::uint64_t marks_same = 0;               ///< comparisons of the bone, one a second, that came out the same
  std::uint64_t bone_differs_since =
      0;  ///< tick; 0: it does not. The copy is worth nothing from there: begin() once more
  std::uint64_t packets_refused = 0;
  double apart_mm = 0, strength = 0;  ///< trainee: from the instructor's hand as heard of; of the pull, 0 to 1
  double apart_rms_mm = 0, apart_most_mm = 0, led_s = 0;  ///< while it was led
};

/// Threads: one for packets; one that does the session's ticks on the copy; the trainee's hand in one at the session's
/// rate, which feels the copy without delay, whatever the others do. All functions from one thread.
class LiveSeat {
 public:
  /// Asks from now on. Errors: of UdpSocket.
  explicit LiveSeat(const SeatOptions& options);
  ~LiveSeat();
  LiveSeat(const LiveSeat&) = delete;
  LiveSeat& operator=(const LiveSeat&) = delete;

  /// What the session is. Waits at most `most_s` for an answer, and as long again while no more of it comes. Errors:
  /// failed, where it is rejected or nobody answers; corrupt; cancelled.
  [[nodiscard]] SessionHeader wait_for_session(double most_s, const Context& context);
  /// After that: what the session goes on from (live_past.h); empty: nothing.
  [[nodiscard]] Bytes past() const;
  /// The instructor's hand as it is heard of.
  [[nodiscard]] const std::shared_ptr<FarDevice>& leader() const { return leader_; }

  /// Takes part from the session's first tick; again: all of it once more, or another session. `begin`: the bone it
  /// began with. What is recorded (`options.session_file`) is the session as it is there. `own`: the trainee's hand;
  /// null: none. `context` lives as long. Errors: usage, where that bone is another than the host's; of Rehearsal.
  std::shared_ptr<Rehearsal> begin(const SessionHeader& header, World begin, RehearsalOptions options,
                                   std::unique_ptr<Device> own, const Context& context);
  /// No tick is done any more; before the rehearsal is stopped. Throws what ended the copy, where something did.
  void leave();
  /// Since the host was heard of.
  [[nodiscard]] double silent_s() const;
  [[nodiscard]] SeatStatus status() const;
  [[nodiscard]] std::string bone_hash() { return copy_->bone_hash(); }

 private:
  class Feeling;
  void exchange();
  void do_ticks();
  bool own_tick();
  const SeatOptions options_;
  const std::shared_ptr<FarDevice> leader_ = std::make_shared<FarDevice>();
  mutable std::mutex mutex_;  // of guest_ but for what it says itself
  LiveGuest guest_;
  UdpSocket socket_;
  SessionHeader header_;
  std::uint64_t session_ = 0;
  std::unique_ptr<LiveCopy> copy_;
  std::unique_ptr<Device> own_;
  std::unique_ptr<Feeling> feeling_;
  Seqlock<TickRecord> own_now_;
  std::unique_ptr<FixedRateLoop> loop_;
  std::uint64_t own_ticks_ = 0;
  Vec3 felt_;
  std::atomic<bool> stop_packets_{false}, stop_ticks_{false};
  std::atomic<std::uint64_t> ticks_{0};
  std::atomic<double> apart_mm_{0}, squares_{0}, most_mm_{0};
  std::atomic<std::uint64_t> counted_{0};
  std::exception_ptr failure_;  // of copying_
  std::atomic<bool> failed_{false};
  std::thread packets_, copying_;
};

}  // namespace osteo::inline network
