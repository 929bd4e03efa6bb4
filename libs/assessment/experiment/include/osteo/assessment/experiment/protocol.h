// An experiment as a folder of plain files: protocol.json, and a folder for each participant with a session and a score
// for each trial.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "osteo/assessment/experiment/stimulus.h"
#include "osteo/core/base/param.h"

namespace osteo::inline assessment::experiment {

/// How a force is shown while it is learned: to the hand, to the eye, to both.
enum class Training : int { haptic, visual, visuohaptic };
inline constexpr std::size_t kTrainings = 3;
/// "H", "V", "V+H"
[[nodiscard]] const char* short_name(Training training);
/// When sight of the own force comes: while it is pressed, or of the whole run behind it.
enum class Feedback : int { concurrent, delayed };
[[nodiscard]] constexpr std::array<std::string_view, 3> enum_names(Training) {
  return {"haptic", "visual", "visuohaptic"};
}
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(Feedback) {
  return {"concurrent", "delayed"};
}

struct Protocol {
  using Params = Protocol;
  std::string title = "Force-skill training";
  std::vector<std::string> participants;  ///< codes: letters, digits, '-', each once
  int trials = 72;       ///< of each participant: blocks times repetitions, all trainings equally often
  int repetitions = 3;   ///< of a block: the same stimulus, the same training
  int break_after = 36;  ///< trials; 0: none
  double break_min = 10;
  int seed = 1;
  double device_n = 8;  ///< what the device can hold for the length of a trial
  double peak_n = 12;   ///< what it gives for a moment; there it is saturated
  bool scale = true;    ///< forces made smaller to that; else as printed, with saturation marked
  double rate_hz = 1000;
  Feedback feedback = Feedback::concurrent;
  double amplification = 1;  ///< of the difference between target and own force, as it is shown
  bool fading = false;       ///< what is shown and felt of the target grows less over the repetitions of a block
  bool simulated = false;    ///< its participants are programs

  static void describe(Protocol& p, auto& visit) {
    visit({"title", "what it is called in the report"}, p.title);
    visit({"trials", "trials of each participant", "", 3, 1000}, p.trials);
    visit({"repetitions", "repetitions of a block: the same stimulus and training", "", 1, 100}, p.repetitions);
    visit({"break_after", "trials before a break (0: none)", "", 0, 1000}, p.break_after);
    visit({"break_min", "length of the break", "min", 0, 120}, p.break_min);
    visit({"seed", "seed of stimuli and orders", "", 0, 1e9}, p.seed);
    visit({"device_n", "force that the device can hold", "N", 0.5, 50}, p.device_n);
    visit({"peak_n", "force that it gives for a moment, where it is saturated", "N", 0.5, 60}, p.peak_n);
    visit({"scale", "make forces smaller to what the device can hold; else as printed, and saturation is marked"},
          p.scale);
    visit({"rate_hz", "rate of the servo and of the recording", "Hz", 100, 5000}, p.rate_hz);
    visit({"feedback", "when the own force is shown: while pressing, or after the run"}, p.feedback);
    visit({"amplification", "amplification of the error as it is shown (1: as it is)", "", 0, 10}, p.amplification);
    visit({"fading", "show less of the target with each repetition"}, p.fading);
    visit({"simulated", "participants are programs"}, p.simulated);
  }
};

/// A training and a test, one after the other.
struct Trial {
  int number = 1;      ///< from 1
  int block = 1;       ///< from 1
  int repetition = 1;  ///< from 1
  Training training = Training::haptic;
  std::uint64_t stimulus = 0;  ///< its seed
  bool pause = false;          ///< a break before it
  double aid = 1;              ///< how much of the target is shown and felt: 1 all of it
};

/// Error(usage): codes that are not, trials that are no whole blocks for each training.
void check(const Protocol& protocol);
[[nodiscard]] Protocol read_protocol(const std::filesystem::path& folder);
/// Error(cannot_write) where the folder holds one already.
void write_protocol(const std::filesystem::path& folder, const Protocol& protocol);

/// What a participant does, in order. Three blocks in a row have all trainings; over six participants each of the six
/// orders stands at each place once, and every stimulus is learned under each training by two of them. Depends on seed
/// and place in the list alone.
[[nodiscard]] std::vector<Trial> trials_of(const Protocol& protocol, std::size_t participant);
/// The stimuli again, once each and without aid: what is left on another day.
[[nodiscard]] std::vector<Trial> retention_of(const Protocol& protocol, std::size_t participant);
[[nodiscard]] Stimulus stimulus_of(const Protocol& protocol, const Trial& trial);
/// Error(usage) names those there are.
[[nodiscard]] std::size_t participant_number(const Protocol& protocol, const std::string& code);

}  // namespace osteo::inline assessment::experiment
