// The nerve monitor of a rehearsal: what drilling does to nerves, as electrodes in muscles hear it.
#pragma once
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "osteo/session/recording/session_reader.h"
#include "osteo/session/scene/heat_reader.h"
#include "osteo/session/scene/reader.h"
#include "osteo/simulation/bone/structure_map.h"
#include "osteo/simulation/nerve/activity.h"
#include "osteo/simulation/nerve/electromyogram.h"
#include "osteo/simulation/nerve/stimulator.h"

namespace osteo::inline session {

/// Of a case: the nerves of a setup that its structures have, with their channels.
struct MonitorWiring {
  std::vector<NerveCourse> courses;
  std::vector<std::uint8_t> structures;           ///< of each course, its value in the label map
  std::vector<Electromyogram::Channel> channels;  ///< `nerve` counts courses
  std::vector<std::string> left_out;  ///< nerves of the setup that the case does not have, by their first names
  [[nodiscard]] std::vector<std::string> labels() const;
};
/// Structures are found by name (letters' case does not count; the first of a setup's names that a structure has).
/// `map` null: none.
[[nodiscard]] MonitorWiring wire_monitor(const MonitorSetup& setup, const StructureMap* map);

struct MonitorOptions {
  MonitorSetup setup;
  bool heat = true;  ///< nerves feel the heat of burrs: costs what HeatReader costs
};

/// Steps of 5 ms of the stream, from it and the stimulator's settings alone: in a replay that is told the same settings
/// at the same ticks (stimulator_notes) signal and events are the same to the bit. Waves are told to sinks as blocks of
/// 5 ms, events behind the block they are found in. Memory: a copy of the bone (two with heat). After ticks were lost
/// nerves and stimulator go on as they were, bone and heat from the scene as it is, and an event tells of it. Cost:
/// docs/validation/monitor.md. In the thread that follows the stream, sinks too.
class MonitorReader final : public Reader {
 public:
  static constexpr double kStepS = 0.005;
  /// `structures` (null: no nerves, and no channels) must outlive it. Error(usage) where more channels are wired than a
  /// monitor has.
  MonitorReader(const MonitorOptions& options, const StructureMap* structures, double rate_hz);
  ~MonitorReader() override;

  /// Before the first tick; they must live as long.
  void add_sink(MonitorSink& sink) { sinks_.push_back(&sink); }

  void resync(const World& world) override;
  void scene_changed(const World& world, const World::Effect& effect) override;
  void action(const SceneAction& action) override;
  void tick(const TickRecord& record, std::span<const VoxelChange> changes) override;

  /// From any thread: from the next step on. The event `stimulator` tells the tick at which that was.
  void stimulate(const StimulatorSetting& setting);
  /// As a session has it: at that tick; rising. Before its first tick.
  void stimulate_at(std::uint64_t tick, const StimulatorSetting& setting) { settings_.emplace_back(tick, setting); }
  /// Nothing more comes: what the last step held is told, and events that go on are closed.
  void end();

  // Under the lock of the scene, or behind its end.
  [[nodiscard]] const MonitorWiring& wiring() const { return wiring_; }
  [[nodiscard]] const MonitorSetup& setup() const { return options_.setup; }
  [[nodiscard]] const NerveModel& model() const { return model_; }
  [[nodiscard]] const StimulatorSetting& stimulator() const { return stimulator_.setting(); }
  [[nodiscard]] std::uint64_t samples() const { return sample_; }
  [[nodiscard]] std::uint64_t restarts() const { return restarts_; }

 private:
  struct Hand {
    TickRecord last;
    Vec3 was_mm;
    double press_n = 0;  // the most in the step
    bool seen = false, turns = false, touches = false;
  };
  struct Nearest {
    std::size_t nerve = 0, point = 0;
    double clearance_mm = 0, bone_mm = 0;
  };
  void step(std::uint64_t until_tick);
  void take_settings();
  void find_nearest(const TickRecord& record, std::vector<Nearest>& all) const;
  [[nodiscard]] double bone_between(Vec3 from_mm, Vec3 to_mm) const;
  void warm_up();
  void pulse(std::uint64_t first, std::size_t samples);
  void notify(MonitorEvent event);
  [[nodiscard]] std::uint64_t sample_of(std::uint64_t tick) const;

  MonitorOptions options_;
  const StructureMap* structures_;
  double rate_hz_;
  std::uint64_t every_;
  MonitorWiring wiring_;
  NerveModel model_;
  Electromyogram signal_;
  ActivityDetector detector_;
  Stimulator stimulator_;
  std::unique_ptr<HeatReader> heat_;
  std::optional<World> world_;
  std::vector<MonitorSink*> sinks_;
  std::array<Hand, kMaxHands> hands_;
  std::array<std::vector<Nearest>, kMaxHands> nearest_;
  std::vector<NerveStress> stresses_;
  std::vector<NerveModel::Warmth> warmth_;
  std::vector<std::vector<ThermalDose>> doses_;
  std::vector<std::int16_t> block_;
  std::deque<std::pair<std::uint64_t, StimulatorSetting>> settings_;
  std::mutex mutex_;
  std::vector<StimulatorSetting> waiting_;
  std::uint64_t sample_ = 0, step_tick_ = 0, next_tick_ = 0, steps_ = 0, restarts_ = 0, applied_early_ = 0,
                pending_ = 0;
  bool begun_ = false;
};

/// In a session's folder: the setup of the monitor that was there, where it was another than the built-in one.
inline constexpr const char* kMonitorFile = "monitor.json";
/// The note that keeps a setting in a session, and its kind.
inline constexpr const char* kStimulatorNote = "stimulator";
[[nodiscard]] std::string stimulator_note(const MonitorEvent& event);
/// The settings in a session, by tick; `unreadable` counts notes that are none.
[[nodiscard]] std::vector<std::pair<std::uint64_t, StimulatorSetting>> stimulator_notes(const SessionReader& session,
                                                                                        std::size_t& unreadable);
/// An event for people and for notes: "burst, orbicularis oris, 180 ms, 340 uV".
[[nodiscard]] std::string words_of(const MonitorEvent& event, const MonitorWiring& wiring);

}  // namespace osteo::inline session
