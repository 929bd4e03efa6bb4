// A nerve monitor that runs somewhere else, as OpenIGTLink tells it.
#pragma once
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "osteo/network/wire/client.h"
#include "osteo/network/wire/stimulator_link.h"
#include "osteo/network/wire/stream_feed.h"

namespace osteo::inline network {

/// Listens to a server that StreamFeed fills. Sinks are made when it has said which channels there are, and again when
/// it says otherwise or another session begins; they are told in the client's thread. What the network lost between two
/// blocks is told as an event `lost`.
class RemoteMonitor {
 public:
  /// What a monitor that begins is shown by.
  using Begin = std::function<std::vector<MonitorSink*>(const WireMonitor& monitor)>;
  /// `tidy_code`: that the rehearsal shows, to set its stimulator; empty: nothing is set from here.
  RemoteMonitor(const WireAddress& server, Begin begin, std::string_view tidy_code = {});

  [[nodiscard]] bool connected() const { return client_.connected(); }
  [[nodiscard]] bool ended() const { return ended_; }  ///< the session has said so
  [[nodiscard]] std::uint64_t samples() const { return samples_; }
  [[nodiscard]] std::uint64_t lost() const { return lost_; }  ///< samples
  [[nodiscard]] std::uint64_t events() const { return events_; }
  [[nodiscard]] WireClient::Counts counts() const { return client_.counts(); }
  /// Who is here may set the stimulator; what it is set to, as it was told; hands it may be in.
  [[nodiscard]] StimulatorLink::State stimulator() const {
    StimulatorLink::State state = link_ ? link_->state() : StimulatorLink::State{};
    state.paired = state.paired && client_.connected();
    return state;
  }
  /// Nothing happens where it may not.
  void stimulate(const StimulatorSetting& setting);
  /// In words, for people; empty: all well.
  [[nodiscard]] std::string trouble() const;

 private:
  void take(const IgtlMessage& message);
  Begin begin_;
  std::unique_ptr<StimulatorLink> link_;
  std::mutex link_mutex_;  // of link_
  std::uint64_t connection_ = 0;
  std::vector<MonitorSink*> sinks_;  // its thread's, as what follows
  std::string setup_;
  std::optional<WireMonitor> monitor_;
  std::uint64_t next_sample_ = 0;
  bool any_ = false;
  std::atomic<std::uint64_t> samples_{0}, lost_{0}, events_{0};
  std::atomic<bool> ended_{false}, understood_{false};
  WireClient client_;  // last: its thread uses all the others
};

}  // namespace osteo::inline network
