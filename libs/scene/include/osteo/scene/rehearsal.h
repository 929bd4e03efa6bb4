// A rehearsal put together: bone, device, servo, and the readers of its stream.
#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>

#include "osteo/bone/dust.h"
#include "osteo/bone/live_components.h"
#include "osteo/bone/live_surface.h"
#include "osteo/haptics/servo.h"
#include "osteo/rt/loop.h"
#include "osteo/session/recorder.h"

namespace osteo {

struct RehearsalOptions {
  double rate_hz = 1000;
  HapticSetup haptics;
  Anatomy anatomy;  ///< hardness where haptics.hardness is set; structures at risk where the case has them
  std::filesystem::path session_file;  ///< empty: not recorded
  bool follow_surface = true;
  bool dust = false;           ///< bone dust: falls, piles, is pushed by the burr, can be sucked off
  bool follow_pieces = false;  ///< watch whether the bone still hangs together
};

struct RehearsalSummary {
  std::uint64_t ticks = 0;
  double removed_mm3 = 0;
  std::string bone_hash, surface_hash;
  std::uint64_t dropped = 0;  ///< ticks that a reader lost
  std::uint64_t session_bytes = 0;
  /// What the burr did near structures at risk, by their value; empty where the scene has none.
  struct StructureEvents {
    double least_clearance_mm = 0;
    std::uint64_t ticks_touched = 0, ticks_injured = 0;
  };
  std::map<std::uint32_t, StructureEvents> structures;
  std::optional<Dust::Totals> dust;  ///< where the scene has dust
  double voxel_mm3 = 0;  ///< turns the mass of a piece into a volume
  std::vector<LiveComponents::Component> pieces;  ///< of at least kLeastPieceMm3, largest first; empty unless they were followed
  std::optional<LoopStats> loop;  ///< only when it ran by the clock
};

/// Owns the bone while it runs. The servo thread writes it; the recorder, the surface follower and whoever asks for a
/// reader are told through the stream.
class Rehearsal {
 public:
  Rehearsal(BrickGrid bone, std::unique_ptr<Device> device, const RehearsalOptions& options, const Context& context);
  ~Rehearsal();

  /// By the clock, in threads of its own.
  void start();
  [[nodiscard]] bool running() const;
  /// Ends the threads, takes the rest of the stream, closes the session file. Error(cannot_write) when it could not be
  /// recorded to the end.
  RehearsalSummary stop();

  /// As fast as possible in this thread, up to the device's end. Same bone, surface and session as by the clock.
  RehearsalSummary run_to_end(const Context& context);

  /// Latest tick, for display.
  [[nodiscard]] TickRecord latest() const { return latest_.load(); }
  [[nodiscard]] double removed_mm3() const;
  [[nodiscard]] bool realtime() const { return loop_ && loop_->realtime(); }
  [[nodiscard]] const BrickGrid& bone() const { return bone_; }
  /// Parts of the bone that hang together, of at least kLeastPieceMm3, as last seen; 0 unless they are followed.
  [[nodiscard]] int pieces() const { return pieces_; }
  static constexpr double kLeastPieceMm3 = 50;
  /// Null where the scene has none.
  [[nodiscard]] const StructureMap* structures() const { return options_.anatomy.structures.get(); }
  [[nodiscard]] double rate_hz() const { return options_.rate_hz; }
  [[nodiscard]] double stiffness_n_per_mm() const { return renderer_.stiffness_n_per_mm(); }
  [[nodiscard]] Device& device() { return *device_; }
  /// Calls f(surface, bricks changed since the last call) under the lock that keeps the follower away.
  void with_surface(const std::function<void(const LiveSurface&, std::span<const std::uint32_t>)>& f);

  /// Calls f(dust) under the lock that keeps the follower away; not at all where the scene has none.
  void with_dust(const std::function<void(Dust&)>& f);

 private:
  void follow();
  void dust_tick(const TickRecord& tick, std::span<const VoxelChange> changes);
  std::size_t drain_surface();
  std::vector<LiveComponents::Component> large_pieces();
  RehearsalSummary finish();

  BrickGrid bone_;
  std::unique_ptr<Device> device_;
  RehearsalOptions options_;
  HapticRenderer renderer_;
  Stream stream_;
  std::unique_ptr<Recorder> recorder_;
  StreamReader* surface_reader_ = nullptr;
  Servo servo_;
  Seqlock<TickRecord> latest_;
  std::atomic<double> removed_mm3_{0};
  std::map<std::uint32_t, RehearsalSummary::StructureEvents> structure_events_;  // of the follower
  std::unique_ptr<FixedRateLoop> loop_;
  std::mutex surface_mutex_;
  std::unique_ptr<LiveSurface> surface_;
  std::unique_ptr<LiveComponents> components_;
  std::atomic<int> pieces_{0};
  BrickGrid dust_bone_;  // as of the tick that the dust has reached, so that it does not depend on how far the servo is
  std::unique_ptr<Dust> dust_;
  std::set<std::uint32_t> changed_bricks_;
  std::vector<TickRecord> tick_buffer_;
  std::vector<VoxelChange> change_buffer_;
  std::atomic<bool> stop_{false};
  std::thread follower_;
};

/// What a replay found.
struct ReplayResult {
  std::uint64_t ticks = 0;
  bool complete = false;   ///< the session was closed properly
  bool identical = false;  ///< every tick, and (when complete) bone and surface, came out bit for bit the same
  std::string difference;  ///< the first one
  std::string bone_hash, surface_hash;
  double removed_mm3 = 0;
  double seconds = 0;
};

/// Runs the recorded poses through the same servo on `bone`, which is left as the session left it.
/// Error(corrupt) when the session belongs to another bone.
/// `anatomy` as the session had it. Error(corrupt), Error(usage) when it is not.
[[nodiscard]] ReplayResult replay(const Session& session, BrickGrid& bone, const Anatomy& anatomy, const Context& context);

/// A drilling that fits most heads: from behind and below the middle of the bone outwards to the patient's left (or right)
/// until the outside is reached, there a cavity in circles, deeper with time. Error(failed) when no bone is met.
[[nodiscard]] Script make_default_script(const BrickGrid& bone, bool left, int tool, double seconds);

}  // namespace osteo
