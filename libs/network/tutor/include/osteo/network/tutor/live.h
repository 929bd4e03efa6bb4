// Live tutoring: one session, run by a host, that others take part in or watch. What travels is poses and actions with
// their ticks, never forces: each side has the same bone and feels it without delay. No socket and no clock here:
// whoever has them gives packets and time.
#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "osteo/core/rt/ring.h"
#include "osteo/core/rt/seqlock.h"
#include "osteo/network/tutor/pairing.h"
#include "osteo/network/tutor/secure.h"
#include "osteo/network/tutor/wire.h"
#include "osteo/session/scene/reader.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/simulation/haptics/device.h"
#include "osteo/simulation/haptics/guide.h"

namespace osteo::inline network {

/// Delay and difference of two clocks by NTP's exchange: of the last 64 the one with the shortest way counts. Drift by
/// the offsets of ten seconds and more.
class ClockSync {
 public:
  /// A packet has come.
  void heard(const WireTimes& times, std::int64_t now_us);
  /// For a packet that goes out now.
  [[nodiscard]] WireTimes stamp(std::int64_t now_us) const;
  [[nodiscard]] bool known() const { return count_ > 0; }
  [[nodiscard]] double rtt_ms() const { return rtt_us_ / 1000; }  ///< there and back, the shortest lately
  [[nodiscard]] double offset_ms() const {
    return offset_us_ / 1000;
  }  ///< their clock less ours; known within half of the way's asymmetry
  [[nodiscard]] double drift_ppm() const { return drift_ppm_; }

 private:
  struct Exchange {
    double rtt_us = 0, offset_us = 0;
  };
  std::array<Exchange, 64> last_{};
  std::size_t count_ = 0;
  double rtt_us_ = 0, offset_us_ = 0, drift_ppm_ = 0;
  std::int64_t last_sent_us_ = 0, last_heard_us_ = 0, first_us_ = 0;
  double first_offset_us_ = 0;
};

/// A sample of a hand far away, by the ticks of its own machine.
struct FarSample {
  std::uint64_t tick = 0;
  DeviceSample sample;
};

/// Samples that come late, twice, out of order or not at all, as a hand that moves evenly: each is played a fixed time
/// after it was made, which is what all but a hundredth of them need, and changes by a tick in twenty. When nothing was
/// heard for kSilenceTicks the strength of the pull goes to 0 within another 30, and the pose is told as old as it is.
/// It comes back as soon when it was but a moment (kMomentTicks), else within kRampTicks. No allocation.
class JitterBuffer {
 public:
  static constexpr std::uint64_t kSilenceTicks = 20, kFadeTicks = 30, kMomentTicks = 250, kRampTicks = 500;
  /// `newest`: the last of its packet, by which delay is measured.
  void put(const FarSample& s, std::uint64_t now_tick, bool newest) noexcept;
  /// For this tick. Before anything was heard: far away, silent. `pulls` false: the strength fades within kFadeTicks,
  /// whoever is heard.
  [[nodiscard]] DeviceSample read(std::uint64_t now_tick, bool pulls = true) noexcept;
  [[nodiscard]] std::uint64_t played_tick() const { return played_; }  ///< of the sender's, last read
  [[nodiscard]] int buffer_ticks() const {
    return static_cast<int>(delay_ - least_);
  }  ///< held beyond the quickest way

 private:
  static constexpr std::size_t kSlots = 512, kDelays = 256;
  std::array<FarSample, kSlots> slots_{};
  std::array<std::int64_t, kDelays> delays_{};
  std::size_t delays_known_ = 0;
  std::int64_t delay_ = 0, target_ = 0, least_ = 0;
  std::uint64_t last_heard_ = 0, played_ = 0, newest_ = 0;
  int slew_ = 0;
  double strength_ = 0, heard_ = 1;
  bool any_ = false;
  DeviceSample held_;
};

/// A hand far away as one of the session's. put() from one other thread, read() the servo's: at most 64 samples a tick
/// are taken, whatever comes.
class FarDevice final : public Device {
 public:
  void put(const FarSample& s, bool newest) noexcept { inbox_.push({s, newest}); }
  DeviceSample read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept override;
  [[nodiscard]] DeviceTraits traits() const override { return SpringHand::traits(); }
  [[nodiscard]] bool active(std::uint64_t) const noexcept override { return false; }
  [[nodiscard]] double strength() const noexcept { return strength_.load(std::memory_order_relaxed); }
  [[nodiscard]] int buffer_ms() const noexcept { return buffer_.load(std::memory_order_relaxed); }
  /// From any thread: what read() gave last.
  [[nodiscard]] DeviceSample shown() const noexcept { return shown_.load(); }
  /// From any thread: whether it may pull; off it fades softly.
  void pull(bool on) noexcept { pulls_.store(on, std::memory_order_relaxed); }
  [[nodiscard]] bool pulls() const noexcept { return pulls_.load(std::memory_order_relaxed); }

 private:
  struct Item {
    FarSample sample;
    bool newest = false;
  };
  Ring<Item> inbox_{1024};
  JitterBuffer jitter_buffer_;
  std::atomic<double> strength_{0};
  std::atomic<int> buffer_{0};
  std::atomic<bool> pulls_{true};
  Seqlock<DeviceSample> shown_;
};

/// How stiff a spring to a hand that is heard of late may be: two equal devices of `mass_kg` with damping B each,
/// spring K on the other's delayed position, m s2 + B s + K (1 + e^-st) = 0. For every delay stable up to B2 / 2m; for
/// delays up to tau, up to about B / tau, of which half is taken. The larger of both. N/mm.
[[nodiscard]] double delayed_stiffness_n_per_mm(double damping_n_s_per_m, double mass_kg, double delay_s);
/// A guide that bears any delay: a brake of kFarBrake besides the device's own damping, and the stiffness that goes
/// with it for hands of kFarMassKg and less. Apart at a speed v: the brake's v kFarBrake / K, the grip's force / K, and
/// v times how old the other's place is.
inline constexpr double kFarBrake = 18, kFarMassKg = 0.25;
[[nodiscard]] HandGuide far_guide(std::uint32_t hand, std::uint32_t leader, const DeviceTraits& device,
                                  double wanted_n_per_mm, double most_n);

/// Adds a change of bone to a running hash of all of them.
[[nodiscard]] std::uint64_t mixed(std::uint64_t hash, std::uint64_t tick,
                                  std::span<const VoxelChange> changes) noexcept;

struct OutgoingPacket {
  UdpPeer to;  ///< as receive() was told
  Bytes bytes;
};

struct PeerStatus {
  JoinRole role{};
  double rtt_ms = 0, offset_ms = 0, drift_ppm = 0;
  double lost = 0;     ///< share of its packets that did not come
  bool heard = false;  ///< within a second
  bool ready = false;  ///< its copy is made
  std::uint64_t behind_ticks = 0;
  std::uint64_t bone_differs_since = 0;  ///< tick of a mark that differed; 0: none did
  std::uint64_t marks_same = 0;          ///< compared, and the same
};

/// The side that runs the session. As a reader of its stream it keeps all ticks, in 28 bytes a hand, and gives them to
/// whoever has joined. After kMaxTicks (half an hour at 1 kHz) there is no room for more: lost(), all who have joined
/// are told that there is no more of it, and each keeps the copy that it has. receive(), poll() and status() from one
/// thread each; memory is bounded whatever comes in.
///
/// Who joins is found out by PairingHost. Seats: one trainee and at most kMaxPeers in all. Whoever comes back from the
/// same address takes its own seat again; one that has been silent for a second gives its seat to who has proved to
/// know the code, and whether it is silent is waited for. While a trainee's seat waits for one that has dropped,
/// watchers are let in 2 s later: the trainee comes first.
class LiveHost final : public Reader, private PairingSeats {
 public:
  static constexpr std::size_t kMaxPeers = 9, kMaxTicks = 1'800'000;

  /// `settings`: what a copy needs before the first tick. `hands` of the session.
  LiveHost(std::string_view tidy_code, Bytes settings, std::size_t hands, std::shared_ptr<FarDevice> far);
  void receive(const UdpPeer& from, std::span<const std::uint8_t> packet, std::int64_t now_us);
  [[nodiscard]] std::vector<OutgoingPacket> poll(std::int64_t now_us);
  [[nodiscard]] std::vector<PeerStatus> status(std::int64_t now_us) const;
  [[nodiscard]] int tries_left() const;
  /// Packets that were not understood: forged, repeated, cut, of others.
  [[nodiscard]] std::uint64_t refused() const;

  void action(const SceneAction& action) override;
  /// Where ticks are missing, no copy can be made from there on: lost(), and all are told.
  void tick(const TickRecord& record, std::span<const VoxelChange> changes) override;
  [[nodiscard]] BoneMark mark() const;
  /// It had so many ticks, all of which were told: who has them all knows that it is over.
  void over(std::uint64_t ticks);
  [[nodiscard]] bool lost() const;
  /// Somebody who may still be there lacks a part.
  [[nodiscard]] bool waited_for(std::int64_t now_us) const;

 private:
  struct Peer {
    UdpPeer from;
    JoinRole role{};
    std::unique_ptr<SecureChannel> channel;
    ClockSync clock;
    std::int64_t last_heard_us = 0, last_sent_us = 0;
    std::int64_t told_us = 0;  // by the peer's clock: when it sent what the rest here goes by
    std::uint64_t next_tick = 0, sent_to = 0, newest_hand = 0;
    struct Sent {
      std::uint64_t end = 0;
      std::int64_t at_us = 0;
    };
    std::uint64_t resent_to = 0;                  // what was sent again last ends there
    int burst = 1;                                // packets at once, while what follows is missing too
    std::map<std::uint64_t, Sent> on_way;         // packets of ticks by their first, that may still come or be lost
    std::uint32_t blob_bytes = 0, blob_sent = 0;  // of the settings: it has, are on their way
    std::int64_t blob_moved_us = 0;
    bool ready = false;
    std::uint64_t differs = 0, compared = 0, same = 0;
  };
  [[nodiscard]] Answer seat(const UdpPeer& from, JoinRole role, std::int64_t proved_us, std::int64_t now_us) override;
  [[nodiscard]] std::uint32_t take(const UdpPeer& from, JoinRole role, const PairKeys& keys,
                                   std::int64_t now_us) override;
  void hear(Peer& peer, const HandPacket& p, std::int64_t now_us);
  void hear_progress(Peer& peer, const HandPacket& p, std::int64_t now_us);
  [[nodiscard]] LogPacket log_from(std::uint64_t tick) const;
  [[nodiscard]] static bool overdue(const Peer& peer, std::int64_t patience_us, std::int64_t now_us);

  mutable std::mutex mutex_;
  PairingHost pairing_;
  const Bytes settings_;
  const std::size_t hands_;
  std::shared_ptr<FarDevice> far_;
  std::vector<std::unique_ptr<Peer>> peers_;
  std::vector<OutgoingPacket> out_;
  std::uint32_t next_connection_ = 1;
  std::optional<std::int64_t> trainee_heard_us_;  // one that had joined
  std::uint64_t refused_ = 0;
  std::vector<DeviceSample> log_;  // of each tick all hands
  std::deque<SceneAction> actions_;
  const std::uint64_t session_;
  LogState state_ = LogState::runs;
  std::uint64_t hash_ = 0;
  std::map<std::uint64_t, std::uint64_t> marks_;  // each kMarkTicks, the last of them
};
/// Bone is compared so often.
inline constexpr std::uint64_t kMarkTicks = 1000;

/// A tick of the session, as the host had it.
struct LiveTick {
  std::uint64_t tick = 0;
  std::array<DeviceSample, kMaxHands> hands;
  std::vector<SceneAction> actions;
};

enum class JoinState { asking, joined, refused, lost };

/// The side that joins. One thread; `own` hand samples come from its servo through put().
class LiveGuest {
 public:
  LiveGuest(std::string_view tidy_code, JoinRole role, std::shared_ptr<FarDevice> host_hand);
  void receive(std::span<const std::uint8_t> packet, std::int64_t now_us);
  [[nodiscard]] std::vector<Bytes> poll(std::int64_t now_us);
  /// Of the own hand, each tick, from one other thread.
  void put(const FarSample& own) noexcept { own_.push(own); }

  [[nodiscard]] JoinState state() const { return state_; }
  [[nodiscard]] const std::string& why() const { return pairing_.why(); }  ///< rejected: in words
  [[nodiscard]] bool answered() const { return pairing_.answered(); }      ///< a host has been heard of, joined or not
  [[nodiscard]] const ClockSync& clock() const { return clock_; }
  /// Whole settings of the session; empty until they are here.
  [[nodiscard]] const Bytes& settings() const { return settings_whole_ ? settings_ : none_; }
  [[nodiscard]] std::size_t settings_here() const { return settings_.size(); }  ///< bytes of them
  /// The next tick of the session, where it is here.
  [[nodiscard]] std::optional<LiveTick> next();
  [[nodiscard]] std::uint64_t next_tick() const { return next_tick_; }
  [[nodiscard]] std::uint64_t host_tick() const { return host_tick_; }
  /// 0: none heard of. When it is another than before, settings and all ticks are asked for again.
  [[nodiscard]] std::uint64_t session() const { return session_; }
  /// The host's session has ended, and next() has given all of it.
  [[nodiscard]] bool over() const { return host_state_ == LogState::over && taken_ == host_tick_; }
  /// What was done behind its last tick, where it is over.
  [[nodiscard]] const std::vector<SceneAction>& behind() const { return behind_; }
  /// The host has lost ticks itself: there will be no more.
  [[nodiscard]] bool host_lost() const { return host_state_ == LogState::lost; }
  /// The copy is made: a host that waits for it may begin.
  void be_ready() { ready_ = true; }
  [[nodiscard]] std::uint64_t marks_same() const { return same_; }        ///< compared with the host's, and the same
  [[nodiscard]] std::int64_t heard_us() const { return last_heard_us_; }  ///< when the host was heard of last
  [[nodiscard]] double lost() const { return channel_ ? channel_->lost() : 0; }
  /// What the copy has become; where the host's mark differs, differs() says since when, and begin_again() asks for all
  /// ticks once more.
  void mark(const BoneMark& mine);
  [[nodiscard]] std::uint64_t differs() const { return differs_; }
  void begin_again();
  [[nodiscard]] std::uint64_t refused() const { return refused_; }

 private:
  void hear(const LogPacket& p, std::int64_t now_us);
  void hear(const BlobPacket& p);
  void take_session(std::uint64_t session);
  static constexpr std::size_t kMaxWaiting = 8192;
  const JoinRole role_;
  std::shared_ptr<FarDevice> host_hand_;
  JoinState state_ = JoinState::asking;
  PairingGuest pairing_;
  std::unique_ptr<SecureChannel> channel_;
  ClockSync clock_;
  std::int64_t last_sent_us_ = 0, last_heard_us_ = 0;
  Bytes settings_, none_;
  std::map<std::size_t, Bytes> pieces_;  // of the settings, that came before one that belongs in front of them
  bool settings_whole_ = false;
  std::map<std::uint64_t, LiveTick> waiting_;
  std::uint64_t next_tick_ = 0, taken_ = 0, host_tick_ = 0, newest_shown_ = 0, differs_ = 0, refused_ = 0;
  std::uint64_t session_ = 0, compared_ = 0, same_ = 0;
  LogState host_state_ = LogState::runs;
  std::vector<SceneAction> behind_;
  bool ready_ = false;
  std::map<std::uint64_t, std::uint64_t> my_marks_;  // the last of them
  BoneMark my_mark_;
  Ring<FarSample> own_{1024};
  std::deque<FarSample> recent_;
};

/// The session once more, from its ticks: the same bone to the bit, in a Rehearsal that can be looked at, followed and
/// recorded.
class LiveCopy {
 public:
  /// `begin` and `options` (haptics, anatomy, rate) as the host's; its actions come with the ticks.
  LiveCopy(World begin, const RehearsalOptions& options, const Context& context);
  /// From one thread. At each kMarkTicks: what the bone has become.
  std::optional<BoneMark> step(const LiveTick& tick);
  /// What was done behind the last tick.
  void end(std::span<const SceneAction> behind) { rehearsal_->end_elsewhere(behind); }
  /// From the thread of step().
  [[nodiscard]] BoneMark mark();
  [[nodiscard]] std::string bone_hash();
  /// Whoever keeps it may stop it when step() is not called any more.
  [[nodiscard]] const std::shared_ptr<Rehearsal>& rehearsal() const { return rehearsal_; }

 private:
  class Hand final : public Device {
   public:
    DeviceSample read(std::uint64_t, double, Vec3) noexcept override { return sample; }
    DeviceSample sample;
  };
  class Hash final : public Reader {
   public:
    void tick(const TickRecord& record, std::span<const VoxelChange> changes) override;
    std::uint64_t hash = 0;
  };
  std::vector<Hand*> hands_;  // the rehearsal's
  std::shared_ptr<Hash> hash_ = std::make_shared<Hash>();
  std::shared_ptr<Rehearsal> rehearsal_;
  std::uint64_t ticks_ = 0;
};

/// What the own hand feels of the copy, without delay: bone as it is there, the brake, the spring to the host's hand.
/// Takes no bone: that happens when the host has heard of it. Made again when the copy's pieces change.
class LiveFeel {
 public:
  LiveFeel(const World& copy, const HapticSetup& session, const Anatomy& anatomy, const DeviceTraits& own,
           const HandGuide& guide, double rate_hz);
  /// A tick: own pose, the host's hand as far as heard.
  [[nodiscard]] TickRecord step(const DeviceSample& own, const DeviceSample& host) noexcept;
  /// What Device::feel() is told.
  [[nodiscard]] Vec3 normal() const { return renderer_.contact(0).normal; }
  [[nodiscard]] double stiffness_n_per_mm() const { return renderer_.stiffness_n_per_mm(0); }

 private:
  static HapticSetup setup_of(const HapticSetup& session, const DeviceTraits& own);
  HapticRenderer renderer_;
  HapticScene scene_;
};

}  // namespace osteo::inline network
