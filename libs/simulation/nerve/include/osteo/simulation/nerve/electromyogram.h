// The signal of all channels: what nerves do, as electrodes hear it, with all that is no nerve.
#pragma once
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "osteo/simulation/nerve/detail/nerve_model.h"

namespace osteo::inline simulation {

/// Burrs that turn, while a block is made.
struct DrillNoise {
  double rotation_hz = 0;  ///< 0: none turns
  double press_n = 0;      ///< on bone
};

/// Makes samples at MonitorSetup::kRateHz, 0.25 uV a bit, of at most a block at a time. Impulses of a burst are
/// triphasic waves that arrive by conduction and latency; trains are sines that begin at once; an answer to a stimulus
/// is a longer wave behind the artefact. The same calls give the same bits on any machine. About 0.7 % of a core for 16
/// channels (docs/validation/monitor.md).
class Electromyogram {
 public:
  struct Channel {
    std::size_t nerve;
    MonitorChannel electrode;
  };
  static constexpr std::size_t kMaxSamples = 1024;  ///< of a block
  static constexpr int kLargest = 32764;            ///< where the amplifier ends

  Electromyogram(const MonitorConstants& constants, std::vector<Channel> channels, std::uint64_t seed);

  /// A stimulus `at` samples into the next block, and which share of a nerve answers at a point of its course.
  void stimulate(std::size_t at, double current_ma);
  void answer(std::size_t at, const NerveModel& model, std::size_t nerve, std::size_t point, double share);

  /// The next block: `out` holds channel after channel of each sample. Size: samples (at most kMaxSamples) times
  /// channels.
  void render(const NerveModel& model, const DrillNoise& drill, std::span<std::int16_t> out);

  [[nodiscard]] const std::vector<Channel>& channels() const { return channels_; }

 private:
  struct Voice {
    double phase = 0, level = 0;  // train: turns; burst: phase 1 is the next spike
    bool seen = false;
  };
  void add_wave(std::size_t channel, double at, const std::vector<float>& wave, double uv);
  [[nodiscard]] double delay(const Channel& channel, const NerveModel& model, std::size_t point) const;

  MonitorConstants c_;
  std::vector<Channel> channels_;
  std::vector<float> spike_, evoked_, artefact_, mains_, sine_;
  std::vector<std::vector<float>> coming_;  // by channel, in a ring: what was begun
  std::size_t now_ = 0;                     // in the ring
  std::size_t mains_at_ = 0;
  std::map<std::uint64_t, Voice> voices_;  // by discharge
  std::vector<NerveRandom> noise_;
  std::vector<float> filtered_;
  NerveRandom jitter_;
  double drill_phase_ = 0, drill_line_ = 0, drill_noise_ = 0;
  std::vector<float> block_;
};

}  // namespace osteo::inline simulation
