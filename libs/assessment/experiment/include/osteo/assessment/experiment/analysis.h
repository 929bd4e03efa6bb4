// What an experiment shows: within people, since twelve people times three trainings are not 864 people.
#pragma once
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "osteo/assessment/experiment/trial.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/report/sheet.h"

namespace osteo::inline assessment::experiment {

struct ExperimentData {
  Protocol protocol;
  std::vector<TrialScore> trials, retention;  ///< of all participants, those of each in their order
};
/// Of the folder. Error(usage) where a trial is of another protocol: another training or stimulus than its number has.
[[nodiscard]] ExperimentData read_experiment(const std::filesystem::path& folder);

struct ExperimentAnalysis {
  Json json;
  Sheet sheet;
};
/// People who have not done all of their trials are left out and named. Comparisons need three people. Same data, same
/// bytes.
[[nodiscard]] ExperimentAnalysis analyse(const ExperimentData& data, double level = 0.95);

/// The tests on scores of nobody in particular, many times: `people` with 24 trials each a training, people and what
/// suits them differing as `ParticipantModel` has it, trainings not at all (or by `effect` from one to the next, in
/// share of the mean).
struct NullSettings {
  int experiments = 1000;
  int people = 12;
  int trials = 24;  ///< of each training
  double mean = 0.5, trial_sd = 0.12;
  double person = 0.15, person_by_training = 0.1;  ///< standard deviations, in share of the mean
  double effect = 0;
  double alpha = 0.05;
  std::uint64_t seed = 1;
};
struct NullResult {
  int experiments = 0;
  /// How often each test found something.
  int repeated = 0, repeated_gg = 0, any_pair_holm = 0, pooled = 0;
  int ordered = 0;  ///< means of people in the order V+H < V < H
};
[[nodiscard]] NullResult null_experiments(const NullSettings& settings);

/// The same through the whole chain: simulated participants (`null_model`, or the one given) who recall stimuli on a
/// simulated device, their recorded forces scored, the scores tested. mean, deviations and effect are the participants'
/// own, so those of `settings` count nothing; trials: a multiple of 3. Tests only, at kChainRateHz, since a program
/// learns nothing from a training. About 3 ms of one core a trial. Results do not depend on the number of threads.
/// Error(cancelled).
inline constexpr double kChainRateHz = 250;
[[nodiscard]] NullResult null_chain(const NullSettings& settings, const ParticipantModel& model,
                                    const Context& context = {});

/// What is seen in a run, as lines, areas and words: the path, where one is, the bars of target and own force, the
/// saturation square. The window draws it, and the report. Bars show V and V+H trainings only; `delayed` hides the own
/// force until the run is over.
struct DisplayState {
  Training training = Training::haptic;
  RunKind kind = RunKind::training;
  TaskView view;
  double most_n = 12;  ///< full height of a bar
  double aid = 1;
  double amplification = 1;
  Feedback feedback = Feedback::concurrent;
};
[[nodiscard]] sheet::Drawing run_drawing(const Stimulus& stimulus, const DisplayState& state, double width,
                                         double height);

}  // namespace osteo::inline assessment::experiment
