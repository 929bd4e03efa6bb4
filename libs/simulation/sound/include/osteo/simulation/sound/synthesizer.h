// Makes samples of what happens.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "osteo/simulation/sound/detail/sound_model.h"

namespace osteo::inline simulation {

/// Keeps what one hears over minutes below a level, and every sample below 1. A loudspeaker's own volume is not known
/// to a program. For head-phones EN 50332-1 measures players with a programme of -10 dB of full scale, which may reach
/// 100 dBA: the same pair then gives 85 dBA at -25 dB, which is where long sounds are held.
struct SafeLevel {
  double most_db = -25;  ///< of full scale, root mean square over `over_s`
  double over_s = 10;
};

/// From the states, one after the other, to samples: the same states, lengths and seed give the same samples, on any
/// machine. Allocates in its constructor only; render() takes no lock and throws nothing, and takes about 1 % of a core
/// for one burr. What changes is faded from one state to the next over the samples asked for, phases go on: nothing
/// clicks. Sound of burrs: lines at multiples of rotation and teeth, noise that the rotation modulates (D. Morris 2006,
/// section 3.2.9: noisy harmonics whose frequency follows the force), levels by SoundModel.
class Synthesizer {
 public:
  static constexpr int kRateHz = 48000;
  static constexpr std::size_t kBlock = 240;  ///< 5 ms: how far apart states are in files

  explicit Synthesizer(const SoundModel& model = {}, std::uint64_t seed = 1, const SafeLevel& safe = {});

  /// The next samples, -1 to 1. `volume`: 0 to 1.
  void render(const SoundState& to, double volume, std::span<float> out) noexcept;

  /// By how much SafeLevel holds it down now, in dB: 0 or less.
  [[nodiscard]] double held_down_db() const noexcept;

 private:
  // Second-order sections, one after the other.
  struct Filter {
    struct Section {
      double b0 = 1, b1 = 0, b2 = 0, a1 = 0, a2 = 0, z1 = 0, z2 = 0;
    };
    std::array<Section, 5> sections;
    std::size_t count = 0;
    double gain = 1;  // so that white noise of unit power comes out with unit power
    void low_pass(double hz, int order);
    void high_pass(double hz, int order);
    void settle();
    double operator()(double x) noexcept;
  };
  // A value that goes to its next over the samples of a call.
  struct Ramp {
    double now = 0, goal = 0, step = 0;
    void to(double next_goal, double samples) noexcept {
      now = goal;  // exactly, whatever the steps added up to
      goal = next_goal;
      step = (goal - now) / samples;
    }
    double next() noexcept { return now += step; }
  };
  struct Burr {
    double phase = 0;  // turns
    Ramp hz;
    std::array<Ramp, BurrSpectrum::kLines> lines;
    Ramp bright, dull;
    Filter bright_filter, dull_filter;
    bool sounds = false;
  };
  struct Water {
    Ramp level;
    Filter filter;
  };
  struct Ring {  // a decaying, maybe rising tone: gurgles, metal
    double phase = 0, hz = 0, rise = 1, level = 0, decay = 0, attack = 0;
  };
  struct Beep {
    std::uint64_t sample = 0;
    Ramp level, hz;
    double phase = 0;
  };

  [[nodiscard]] double amplitude(double db) const noexcept;  // root mean square
  double noise() noexcept;                                   // unit power
  double uniform() noexcept;
  void start_ring(double hz, double rise, double level, double decay_s) noexcept;
  void plan(const SoundState& to, double samples) noexcept;
  [[nodiscard]] double burr(Burr& b) noexcept;

  SoundModel model_;
  SafeLevel safe_;
  std::uint64_t random_;
  std::array<Burr, SoundState::kMaxVoices> burrs_;
  std::array<Water, SoundState::kMaxVoices> suckers_, irrigators_;
  std::array<Ring, 12> rings_;
  std::size_t next_ring_ = 0;
  double gurgles_per_sample_ = 0, gurgle_level_ = 0, metal_n_ = 0, water_ = 0;
  std::uint64_t sample_ = 0, metal_sample_ = 0;
  Beep beep_;
  SoundAlarm alarm_ = SoundAlarm::none;
  Ramp volume_;
  double power_ = 0;  // of what went out before it was held down, over safe_.over_s
};

}  // namespace osteo::inline simulation
