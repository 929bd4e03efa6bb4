// A rehearsal that runs, told over the network.
#pragma once
#include "osteo/network/wire/stimulator_link.h"
#include "osteo/network/wire/stream_feed.h"
#include "osteo/session/scene/monitor_sound.h"
#include "osteo/session/scene/rehearsal.h"

namespace osteo::inline network {

/// Follows it from before it starts until this goes, which is after it has ended. The servo knows nothing of it; the
/// follower's thread waits for no network.
class RehearsalStream {
 public:
  /// `monitor`: of the rehearsal, where it has one, before its first tick; null: one of `options`, of its own. Where a
  /// target has a stimulator, who has the code of invitation() may set it; the settings become notes of the session.
  RehearsalStream(Rehearsal& rehearsal, std::span<const StreamTarget> targets, MonitorReader* monitor,
                  const MonitorOptions& options);
  ~RehearsalStream();
  RehearsalStream(const RehearsalStream&) = delete;
  RehearsalStream& operator=(const RehearsalStream&) = delete;

  [[nodiscard]] StreamFeed& feed() { return *feed_; }
  [[nodiscard]] const MonitorReader& monitor() const { return *monitor_; }
  /// What a console needs to set the stimulator, in a line; empty: nobody may. To be shown, and written nowhere.
  [[nodiscard]] const std::string& invitation() const { return invitation_; }
  /// Of the endpoint; null: none.
  [[nodiscard]] const StimulatorEndpoint* endpoint() const { return endpoint_.get(); }

 private:
  Rehearsal& rehearsal_;
  std::unique_ptr<MonitorReader> own_;
  std::unique_ptr<MonitorNotes> notes_;
  MonitorReader* monitor_;
  std::string invitation_;
  std::shared_ptr<StimulatorEndpoint> endpoint_;
  std::unique_ptr<StreamFeed> feed_;
};

/// Of a rehearsal or replay: the monitor of `setup_file` (empty: the built-in one).
[[nodiscard]] MonitorOptions monitor_options_of(const std::string& setup_file);

}  // namespace osteo::inline network
