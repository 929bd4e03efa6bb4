// Trials on disk: each a session with every tick of training and test, and a score; and running them.
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "osteo/assessment/experiment/participant.h"
#include "osteo/assessment/experiment/recall.h"
#include "osteo/core/base/context.h"

namespace osteo::inline assessment::experiment {

/// What moved the hand, as data are labelled. By mouse and keys the force is a number that the person sets: it is not
/// felt.
enum class Mover : int { simulated, mouse, keys, device };

/// What was done in a trial. Ticks of the training first, then those of the test; each begins with its lead.
struct TrialRecord {
  Trial trial;
  Mover mover = Mover::simulated;
  std::string device;  ///< its name
  DeviceTraits traits;
  TaskGains gains;  ///< as they were used
  std::vector<TickRecord> training, test;
  std::uint64_t lead_ticks = 0;
};

/// A trial as analysis reads it.
struct TrialScore {
  std::string participant;
  Trial trial;
  Mover mover = Mover::simulated;
  Recall recall;           ///< without its curves and path where it was read
  double path_rms_mm = 0;  ///< of the hand to the path, in the test
  double path_lag_mm = 0;  ///< how far it stayed behind along the path, mean
  double rate_hz = 20;     ///< of the curves
  std::vector<double> target_n, applied_n;
};

/// The test of a trial, scored. Error(usage) as score_recall.
[[nodiscard]] TrialScore score_trial(const std::string& participant, const Stimulus& stimulus,
                                     const TrialRecord& record, const RecallSettings& settings = {});

/// The folder of a participant's trials; `retention`: those of another day.
[[nodiscard]] std::filesystem::path trials_folder(const std::filesystem::path& experiment,
                                                  const std::string& participant, bool retention);
/// Writes trial-NN.oss, and when that is whole trial-NN.json: a trial without the latter was not finished and is done
/// again.
TrialScore save_trial(const std::filesystem::path& folder, const std::string& participant, const Stimulus& stimulus,
                      const TrialRecord& record);
/// Those that are finished, by number. Error(corrupt) for a file that is no such score.
[[nodiscard]] std::vector<TrialScore> read_trials(const std::filesystem::path& folder);
/// The first trial that is not finished: where one goes on. Trials.size() when all are.
[[nodiscard]] std::size_t first_unfinished(const std::filesystem::path& folder, const std::vector<Trial>& trials);

inline constexpr double kLeadS = 1;

/// A whole trial by a program, as fast as the machine can.
[[nodiscard]] TrialRecord simulate_trial(const Protocol& protocol, const Trial& trial, const Stimulus& stimulus,
                                         SimulatedParticipant& participant);
/// All trials of a participant that are not finished yet. Returns how many those were. Error(cancelled) between two of
/// them.
std::size_t simulate_participant(const std::filesystem::path& experiment, const Protocol& protocol,
                                 std::size_t participant, bool retention, const ParticipantModel& model,
                                 const Context& context, const std::function<void()>& after_each = {});

[[nodiscard]] constexpr std::array<std::string_view, 4> enum_names(Mover) {
  return {"simulated", "mouse", "keys", "device"};
}

}  // namespace osteo::inline assessment::experiment
