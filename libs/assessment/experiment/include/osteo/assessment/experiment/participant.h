// A simulated participant: what it learns, how it recalls it, and the hand that presses. A model, not a person.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "osteo/assessment/experiment/task.h"
#include "osteo/simulation/haptics/simulated_device.h"

namespace osteo::inline assessment::experiment {

/// Of people in general. Noise of memory: standard deviation of what is recalled, in share of the stimulus' mean force,
/// after the first training; guesses, chosen so that the order of the dissertation's figure 28 is put in. Noise of
/// force: L. Jones 2000 (10.5 % by feel alone, 6 % with sight of it).
struct ParticipantModel {
  std::array<double, kTrainings> memory{0.44, 0.38, 0.32};  ///< H, V, V+H
  double timing_s = 0.25;                         ///< standard deviation of when a moment of the pattern is recalled
  double learning = 0.85;                         ///< of both, with each repetition
  double person = 0.15;                           ///< how people differ in both: standard deviation of the logarithm
  double person_by_training = 0.1;                ///< and how what suits them differs, likewise
  double force_blind = 0.105, force_seen = 0.06;  ///< of the force pressed
  double reaction_s = 0.2;
  double most_n = 40;  ///< a person's own limit
};
/// Nothing put in: all trainings alike.
[[nodiscard]] ParticipantModel null_model();

/// One of them. Presses down on a simulated device (mass and damping of arm and hand) that the task pulls. Not a
/// thread's.
class SimulatedParticipant {
 public:
  SimulatedParticipant(const ParticipantModel& model, std::uint64_t seed);
  /// A run begins: its stimulus must outlive it.
  void begin(const Stimulus& stimulus, const Trial& trial, RunKind kind, double lead_s);
  /// The tick's pose, after the force of the tick before.
  DeviceSample read(std::uint64_t tick, double dt_s, Vec3 force_n);
  [[nodiscard]] DeviceTraits traits() const;
  /// Standard deviation of memory in this trial.
  [[nodiscard]] double memory_of(const Trial& trial) const;

 private:
  /// Smooth and of standard deviation 1: sinusoids of random phase up to `highest` Hz.
  struct Wander {
    std::vector<std::array<double, 2>> waves;
    [[nodiscard]] double at(double t_s) const;
    [[nodiscard]] static Wander made(std::uint64_t seed, int count, double highest_hz);
  };

  ParticipantModel model_;
  std::uint64_t seed_;
  double skill_ = 1;
  std::array<double, kTrainings> suits_{1, 1, 1};
  SimulatedDevice device_;
  const Stimulus* stimulus_ = nullptr;
  Trial trial_;
  RunKind kind_ = RunKind::training;
  double lead_s_ = 0, mean_n_ = 0, sigma_ = 0, shift_s_ = 0;
  Wander memory_, timing_, tremor_;
  std::vector<double> plan_n_;
};

}  // namespace osteo::inline assessment::experiment
