// What leaves a session over the network: tools, camera, forces and the nerve monitor, to whoever listens.
#pragma once
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "osteo/network/wire/igtl.h"
#include "osteo/session/scene/monitor_reader.h"

namespace osteo::inline network {

class StimulatorEndpoint;

/// One place that a stream goes to.
struct StreamTarget {
  enum class Kind { igtl, cerebus, lsl } kind = Kind::igtl;
  std::string address;          ///< igtl: PORT or HOST:PORT to listen on; cerebus: where packets go; lsl: none
  std::string version = "4.1";  ///< cerebus: 3.11, 4.0, 4.1 or 4.2
  bool stimulator = false;      ///< igtl: who has the code may set the nerve monitor's stimulator
};
/// "igtl:18944, igtl:18945/stimulator, cerebus:127.0.0.1:51002/4.1, lsl". Error(usage) tells what is expected; empty
/// text: none.
[[nodiscard]] std::vector<StreamTarget> stream_targets(const std::string& text);

/// A tool at a tick, in the scene (LPS).
struct WireTool {
  std::size_t hand = 0;
  Vec3 tip_mm, axis{0, 0, 1};  ///< as shown; from tip to handle
  Vec3 force_n;                ///< on the hand
  double rotation_hz = 0;      ///< of its burr
  double pedal = 0;            ///< 0 to 1
};
struct WireCamera {
  Vec3 eye_mm, target_mm, up{0, 0, 1};
};
/// Of a note "camera" of a session; nothing where it is none.
[[nodiscard]] std::optional<WireCamera> camera_in_note(const std::string& json);
/// A right-handed frame whose third axis is `z`; the others are any at right angles.
[[nodiscard]] Mat3 frame_along(Vec3 z);

/// What a monitor needs to be shown somewhere else.
struct WireMonitor {
  std::vector<std::string> labels;  ///< of channels
  double event_uv = 100;
};
[[nodiscard]] std::string monitor_json(const WireMonitor& monitor);
[[nodiscard]] std::optional<WireMonitor> monitor_in(const std::string& json);
/// An event as a line of JSON and back; what a monitor cannot know (MonitorEventKind::cause) is not written: empty.
[[nodiscard]] std::string event_json(const MonitorEvent& event, const std::string& words);
[[nodiscard]] std::optional<MonitorEvent> event_in(const std::string& json);

/// One kind of network. Calls come one at a time; none may wait for the network.
class WireSink {
 public:
  virtual ~WireSink() = default;
  /// Once, before anything else.
  virtual void begin(const WireMonitor& monitor) { static_cast<void>(monitor); }
  virtual void tools(double at_s, std::span<const WireTool> tools) {
    static_cast<void>(at_s);
    static_cast<void>(tools);
  }
  virtual void camera(double at_s, const WireCamera& camera) {
    static_cast<void>(at_s);
    static_cast<void>(camera);
  }
  virtual void block(const MonitorBlock& block) { static_cast<void>(block); }
  virtual void event(const MonitorEvent& event, const std::string& words) {
    static_cast<void>(event);
    static_cast<void>(words);
  }
  virtual void spike(const MonitorSpike& spike) { static_cast<void>(spike); }
  /// From now on who has its code may set the stimulator. Nothing, where this network cannot.
  virtual void let_stimulate(const std::shared_ptr<StimulatorEndpoint>& endpoint) { static_cast<void>(endpoint); }
  /// Nothing more comes; waits until what was told is on its way, a second at most.
  virtual void end(double at_s, const std::string& json) {
    static_cast<void>(at_s);
    static_cast<void>(json);
  }
  /// Until so many listen, at most so long; true where that cannot be known.
  virtual bool wait(std::size_t listeners, double most_s, const std::function<bool()>& stop) {
    static_cast<void>(listeners);
    static_cast<void>(most_s);
    static_cast<void>(stop);
    return true;
  }
  /// In a line, for people: where it is, who listened, what was dropped.
  [[nodiscard]] virtual std::string reported() const = 0;
  [[nodiscard]] virtual std::uint64_t dropped() const { return 0; }
};
/// Error(usage, failed) where it cannot be.
[[nodiscard]] std::unique_ptr<WireSink> make_sink(const StreamTarget& target);

/// Follows a rehearsal or a replay and tells all sinks. Tools at kPoseHz of the session's time, the monitor's blocks
/// as they come. Times are the session's own, from its beginning: no date leaves. Memory: what the sinks hold.
class StreamFeed final : public Reader, public MonitorSink {
 public:
  static constexpr double kPoseHz = 60;
  /// Opens them. `monitor` may have no channels. A reader after the monitor's, if there is one.
  StreamFeed(std::span<const StreamTarget> targets, double rate_hz, std::size_t hands, const MonitorReader* monitor);
  ~StreamFeed() override;

  void tick(const TickRecord& record, std::span<const VoxelChange> changes) override;
  void block(const MonitorBlock& block) override;
  void event(const MonitorEvent& event) override;
  void spike(const MonitorSpike& spike) override;
  /// A note of the session; from any thread.
  void note(const std::string& kind, const std::string& json);
  void end();

  void let_stimulate(const std::shared_ptr<StimulatorEndpoint>& endpoint);
  bool wait_for(std::size_t listeners, double most_s, const std::function<bool()>& stop);
  [[nodiscard]] std::vector<std::string> reported() const;

  struct Counts {
    std::uint64_t samples = 0, tools = 0, events = 0, cameras = 0, spikes = 0;
  };
  [[nodiscard]] const Counts& counts() const { return counts_; }
  /// By sinks, for listeners that did not keep up.
  [[nodiscard]] std::uint64_t dropped() const;

 private:
  std::vector<std::unique_ptr<WireSink>> sinks_;
  double rate_hz_;
  std::uint64_t every_;
  std::vector<WireTool> now_;
  const MonitorReader* monitor_;
  std::mutex mutex_;  // of what note() leaves
  std::optional<WireCamera> camera_;
  std::uint64_t tick_ = 0;
  bool ended_ = false;
  Counts counts_;
};

}  // namespace osteo::inline network
