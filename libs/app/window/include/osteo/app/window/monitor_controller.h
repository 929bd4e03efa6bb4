// The nerve monitor in a window: reader, screen, sound and notes together.
#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "osteo/session/scene/monitor_reader.h"
#include "osteo/session/scene/monitor_sound.h"
#include "osteo/session/scene/rehearsal.h"

namespace osteo::inline app {

class MonitorScreen;

/// A stimulator that is set over the network.
struct RemoteStimulator {
  std::function<bool()> there;  ///< who is here may set it
  std::function<void(const StimulatorSetting&)> set;
  std::function<StimulatorSetting()> now;
  std::function<std::size_t()> hands;  ///< of the rehearsal there
};

/// Follows one rehearsal: events become notes of its session ("monitor"; settings of the stimulator as `osteo
/// nerve-monitor` reads them). Or shows what is told of a monitor that runs somewhere else.
class MonitorController {
 public:
  /// Before it starts; it must outlive this.
  MonitorController(Rehearsal& rehearsal, const MonitorOptions& options);
  /// Of one elsewhere, with these channels: whoever hears of it tells the sinks. It stimulates with what it is lent.
  MonitorController(const std::vector<std::string>& labels, double event_uv);
  /// Leaves it.
  ~MonitorController();
  MonitorController(const MonitorController&) = delete;
  MonitorController& operator=(const MonitorController&) = delete;

  [[nodiscard]] MonitorScreen& screen();
  [[nodiscard]] MonitorSound& sound();
  /// For sinks of others, before the rehearsal starts. Of a rehearsal only.
  [[nodiscard]] MonitorReader& reader();
  [[nodiscard]] std::vector<MonitorSink*> sinks();
  /// Of a monitor elsewhere, before it is shown.
  void lend(RemoteStimulator stimulator);
  /// What a console elsewhere needs to set the stimulator: shown, and written nowhere.
  void invite(std::string words);
  [[nodiscard]] const std::string& invitation() const;
  /// Whether there is a stimulator; without, the next three do nothing.
  [[nodiscard]] bool stimulates() const;
  [[nodiscard]] const MonitorWiring& wiring() const;
  [[nodiscard]] std::size_t hands() const;
  /// From the next step on.
  void stimulate(const StimulatorSetting& setting);
  /// As it is now: a search turns it off by itself.
  [[nodiscard]] StimulatorSetting stimulator() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace osteo::inline app
