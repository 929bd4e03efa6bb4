#include <string>

#include "osteo/core/rt/loop.h"
#include "osteo/network/wire/stimulator_link.h"
#include "wire_sinks.h"

namespace osteo::inline network {
namespace {

std::string numbered(const char* name, std::size_t hand) {
  return hand == 0 ? name : name + std::to_string(hand + 1);
}

class IgtlSink final : public WireSink {
 public:
  explicit IgtlSink(const StreamTarget& target)
      : stimulator_(target.stimulator), server_(wire_address(target.address), [](std::uint64_t dropped) {
          return igtl_status("Osteotome", 0, IgtlStatus::overflow, static_cast<std::int64_t>(dropped), "dropped",
                             std::to_string(dropped) + " messages were dropped: this listener did not keep up");
        }) {}

  void begin(const WireMonitor& monitor) override {
    server_.greet({igtl_status("Osteotome", 0, IgtlStatus::ok, 0, "", "a rehearsal, for practice; nothing clinical"),
                   igtl_string("NerveSetup", 0, monitor_json(monitor))});
  }
  void tools(double at_s, std::span<const WireTool> tools) override {
    std::vector<IgtlTool> all;
    for (const WireTool& t : tools) {
      const IgtlPose pose = ras_of_lps(IgtlPose{frame_along(t.axis), t.tip_mm});
      all.push_back({numbered("Tool", t.hand), pose});
      server_.send(igtl_transform(all.back().name, at_s, pose));
      const Vec3 f = ras_of_lps(t.force_n);
      server_.send(igtl_sensor(numbered("Force", t.hand), at_s, kIgtlNewton, std::array{f.x, f.y, f.z}));
      server_.send(igtl_sensor(numbered("Rotation", t.hand), at_s, kIgtlHertz, std::array{t.rotation_hz}));
      server_.send(igtl_sensor(numbered("Pedal", t.hand), at_s, 0, std::array{t.pedal}));
    }
    server_.send(igtl_tracking("Tools", at_s, all));
  }
  void camera(double at_s, const WireCamera& c) override {
    // Looks along its -z, its y is up in the picture.
    const Vec3 z = normalized(c.eye_mm - c.target_mm);
    const Vec3 across = cross(c.up, z);
    const Vec3 x = length(across) > 1e-9 ? normalized(across) : any_perpendicular(z);
    server_.send(igtl_transform("Camera", at_s, ras_of_lps(IgtlPose{{{x, cross(z, x), z}}, c.eye_mm})));
  }
  void block(const MonitorBlock& b) override {
    if (b.channels > 0)
      server_.send(igtl_samples("NerveSignal", static_cast<double>(b.first_sample) / MonitorSetup::kRateHz, b.channels,
                                b.values));
  }
  void event(const MonitorEvent& e, const std::string& words) override {
    server_.send(
        igtl_string("NerveEvent", static_cast<double>(e.sample) / MonitorSetup::kRateHz, event_json(e, words)));
  }
  void let_stimulate(const std::shared_ptr<StimulatorEndpoint>& endpoint) override {
    if (!stimulator_) return;
    server_.answer({[endpoint](std::uint64_t client, const IgtlMessage& m) {
                      return endpoint->hear(client, m, static_cast<double>(monotonic_ns()) / 1e9);
                    },
                    [endpoint](std::uint64_t client) { endpoint->gone(client); }});
  }
  void end(double at_s, const std::string& json) override {
    server_.send(igtl_string("SessionEnd", at_s, json));
    server_.send(igtl_status("Osteotome", at_s, IgtlStatus::shut_down, 0, "", "the session has ended"));
    server_.flush(1);
  }
  bool wait(std::size_t listeners, double most_s, const std::function<bool()>& stop) override {
    return server_.wait_for_clients(listeners, most_s, stop);
  }
  [[nodiscard]] std::string reported() const override {
    const WireCounts c = server_.counts();
    return "OpenIGTLink on port " + std::to_string(server_.port()) + ": " + std::to_string(c.accepted) +
           " listeners, " + std::to_string(c.messages) + " messages sent, " + std::to_string(c.dropped) + " dropped" +
           (c.turned_away > 0 ? ", " + std::to_string(c.turned_away) + " turned away" : "");
  }
  [[nodiscard]] std::uint64_t dropped() const override { return server_.counts().dropped; }

 private:
  bool stimulator_;
  WireServer server_;
};

}  // namespace

std::unique_ptr<WireSink> make_igtl_sink(const StreamTarget& target) {
  return std::make_unique<IgtlSink>(target);
}

}  // namespace osteo::inline network
