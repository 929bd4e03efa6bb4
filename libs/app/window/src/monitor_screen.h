// What a nerve monitor's screen shows: sweeps, answers to pulses, a log. Private to libs/app/window; no ImGui, no
// screen.
#pragma once
#include <array>
#include <deque>
#include <mutex>
#include <string>
#include <vector>

#include "osteo/session/scene/monitor_reader.h"

namespace osteo::inline app {

/// Keeps what the monitor tells, from the thread that follows the stream; copied out by the window's. Memory: fixed.
class MonitorScreen final : public MonitorSink {
 public:
  static constexpr std::size_t kBins = 800;          ///< of a sweep, each a block of the monitor: 4 s
  static constexpr std::size_t kTraceSamples = 600;  ///< of an answer: 20 ms
  static constexpr std::size_t kTraces = 5, kLines = 100;
  static constexpr double kAlarmS = 1;
  static constexpr std::array<int, 7> kGains{20,  50,   100, 200,
                                             500, 1000, 2000};  ///< uV from the middle of a lane to its edge

  /// `setup` and `wiring` are copied.
  MonitorScreen(const MonitorSetup& setup, const MonitorWiring& wiring);
  void block(const MonitorBlock& block) override;
  void event(const MonitorEvent& event) override;

  struct Bin {
    float least_uv = 0, most_uv = 0;
  };
  struct Trace {
    double ma = 0;
    bool answered = false, judged = false;
    std::vector<float> uv;  ///< sample after sample of one channel; fewer than kTraceSamples while they come
  };
  struct Line {
    double at_s = 0;
    std::string words;
    bool alarm = false;
  };
  /// As it is now, or as it was when it was frozen.
  struct View {
    std::vector<std::string> labels;
    std::vector<std::vector<Bin>> sweep;  ///< by channel, a place in the sweep each; `at` is where it is written next
    std::size_t at = 0;
    std::vector<std::vector<Trace>> traces;  ///< by channel, the newest last
    double now_s = 0, event_uv = 0;
    bool frozen = false;
  };
  [[nodiscard]] View view() const;
  /// The newest last; goes on while it is frozen.
  [[nodiscard]] std::vector<Line> log() const;
  [[nodiscard]] bool alarm() const;
  [[nodiscard]] std::size_t events() const;                  ///< lines so far
  [[nodiscard]] std::optional<double> threshold_ma() const;  ///< the last found

  // From the window's thread.
  void freeze(bool on);
  [[nodiscard]] bool frozen() const;
  void change_gain(std::size_t channel, int steps);
  [[nodiscard]] int gain_uv(std::size_t channel) const { return kGains[gains_[channel]]; }

 private:
  void write(double at_s, std::string words, bool alarm);

  MonitorWiring wiring_;
  mutable std::mutex mutex_;
  View now_, kept_;
  std::deque<Line> log_;
  std::vector<std::size_t> gains_;
  std::vector<std::uint64_t> pulses_;  // whose traces are not whole
  std::size_t lines_ = 0;
  double alarm_until_s_ = -1, burst_s_ = -1, burst_uv_ = 0;
  std::optional<double> threshold_ma_;
};

}  // namespace osteo::inline app
