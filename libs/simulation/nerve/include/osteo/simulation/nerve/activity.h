// What a monitor makes of its signal: events and responses, from samples alone.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "osteo/simulation/nerve/detail/nerve_model.h"

namespace osteo::inline simulation {

enum class MonitorEventKind : std::uint8_t {
  activity,     ///< a channel has crossed its threshold after quiet: the alarm
  burst,        ///< and is quiet again, in less than train_from_s
  train,        ///< or goes on for that long
  stimulus,     ///< a pulse
  response,     ///< that was answered
  no_response,  ///< or was not
  threshold,    ///< what a search found
  no_threshold,
  stimulator,  ///< was set
  cause,       ///< of the model, which a monitor cannot know: why a nerve fires, or what it lost
  lost,        ///< time that is missing
};
[[nodiscard]] std::string_view name_of(MonitorEventKind kind);

struct MonitorEvent {
  MonitorEventKind kind = MonitorEventKind::activity;
  std::uint64_t sample = 0;               ///< when, from the session's beginning
  int channel = -1;                       ///< activity, burst, train; response: where it was largest
  int nerve = -1;                         ///< cause: number in the monitor's nerves
  double seconds = 0;                     ///< burst: how long; train: so far; lost: how long
  double uv = 0;                          ///< largest, of burst, train, response
  double ms = 0;                          ///< response: from the pulse to where it crosses response_uv
  double ma = 0;                          ///< of the pulse, the setting, the threshold
  double width_ms = 0, pulses_per_s = 0;  ///< of the setting
  std::uint32_t hand = 0;                 ///< of the setting
  bool search = false;                    ///< of the setting
  std::uint64_t tick = 0;                 ///< of the setting: from which it holds
  NerveCause cause = NerveCause::none;
  double integrity = 1;     ///< cause: of the nerve there
  double to_distal_mm = 0;  ///< cause: where along the nerve, from its far end
};

/// A threshold crossing as spike files keep it.
struct MonitorSpike {
  static constexpr std::size_t kBefore = 10, kLength = 48;
  int channel = 0;
  std::uint64_t sample = 0;  ///< of the crossing, at wave[kBefore]
  std::array<std::int16_t, kLength> wave{};
};

/// Looks at blocks as they come, 1.3 ms behind them. Memory does not grow.
class ActivityDetector {
 public:
  ActivityDetector(const MonitorConstants& constants, std::size_t channels);

  /// Before the block that holds it; rising.
  void stimulus(std::uint64_t sample, double current_ma);
  /// The next samples, channel after channel; `first` is where they lie. What was found is in events() and spikes()
  /// until the next call.
  void take(std::uint64_t first, std::span<const std::int16_t> block);
  /// Nothing more comes: events that go on are closed.
  void end();

  [[nodiscard]] std::span<const MonitorEvent> events() const { return events_; }
  [[nodiscard]] std::span<const MonitorSpike> spikes() const { return spikes_; }
  /// Whether the last pulse looked at was answered; each once.
  std::optional<bool> take_answer();

 private:
  struct State {
    bool active = false, train = false;
    std::uint64_t first = 0, last = 0, deaf_until = 0;
    int largest = 0;
  };
  struct Pulse {
    std::uint64_t sample = 0;
    double ma = 0;
  };
  void frame(std::uint64_t sample, const std::int16_t* values);
  void conclude();
  void close(std::size_t channel);

  MonitorConstants c_;
  std::size_t channels_;
  int event_bits_, response_bits_;
  std::uint64_t gap_, train_, from_, to_;  // in samples
  std::vector<std::int16_t> buffer_;       // kBefore frames behind the next to look at, and all that came
  std::uint64_t next_ = 0;                 // to look at
  bool begun_ = false;
  std::vector<State> states_;
  std::vector<Pulse> pulses_;   // to come
  std::optional<Pulse> pulse_;  // whose answer is waited for
  int answer_bits_ = 0, answer_channel_ = -1;
  std::uint64_t answer_sample_ = 0;
  std::optional<bool> answer_;
  std::vector<MonitorEvent> events_;
  std::vector<MonitorSpike> spikes_;
};

/// Samples of all channels, channel after channel.
struct MonitorBlock {
  std::uint64_t first_sample = 0;
  std::size_t channels = 0;
  std::span<const std::int16_t> values;
  [[nodiscard]] std::size_t samples() const { return channels == 0 ? 0 : values.size() / channels; }
};

/// Who wants to know what a monitor has: a file, a picture, a loudspeaker. All calls from one thread, in order.
class MonitorSink {
 public:
  virtual ~MonitorSink() = default;
  virtual void block(const MonitorBlock& block) { static_cast<void>(block); }
  virtual void event(const MonitorEvent& event) { static_cast<void>(event); }
  virtual void spike(const MonitorSpike& spike) { static_cast<void>(spike); }
};

}  // namespace osteo::inline simulation
