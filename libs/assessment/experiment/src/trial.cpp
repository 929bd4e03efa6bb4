#include "osteo/assessment/experiment/trial.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/json_document.h"
#include "osteo/session/recording/session_file.h"

namespace osteo::inline assessment::experiment {
namespace {

std::string trial_name(int number) {
  char name[32];
  std::snprintf(name, sizeof name, "trial-%02d", number);
  return name;
}
double rounded_to(double v, double digits = 1e6) {
  return std::round(v * digits) / digits;
}
template <class E>
std::string name_of_enum(E e) {
  return std::string(EnumNames<E>::values[static_cast<std::size_t>(e)]);
}
template <class E>
E enum_of(const JsonFile& json, const JsonValue& value, const char* called) {
  const std::string& text = json.text(value, called);
  for (std::size_t i = 0; i < EnumNames<E>::values.size(); ++i) {
    if (EnumNames<E>::values[i] == text) return static_cast<E>(i);
  }
  throw json.wrong(value, std::string(called) + " is '" + text + "', which there is not");
}

std::vector<double> at_rate(const std::vector<double>& values, double seconds, double rate_hz) {
  std::vector<double> out;
  const auto count = static_cast<std::size_t>(std::floor(seconds * rate_hz)) + 1;
  for (std::size_t k = 0; k < count; ++k) {
    const double at = static_cast<double>(k) / rate_hz / seconds * static_cast<double>(values.size() - 1);
    out.push_back(rounded_to(values[std::min(static_cast<std::size_t>(std::lround(at)), values.size() - 1)], 1e3));
  }
  return out;
}

void write_session(const fs::path& file, const std::string& participant, const TrialRecord& r, double rate_hz) {
  SessionHeader h;
  h.program_version = "osteotome";
  h.bone_hash = "no bone: force-skill training";
  h.rate_hz = rate_hz;
  h.haptics.device = r.traits;
  const fs::path part = file.string() + ".part";
  std::error_code ignored;
  fs::remove(part, ignored);
  SessionWriter writer(part, h);
  std::uint64_t tick = 0;
  const auto note = [&](const char* what, std::uint64_t lead) {
    return Note{tick, "force_skill",
                Json{{"run", what},
                     {"participant", participant},
                     {"trial", r.trial.number},
                     {"training", name_of_enum(r.trial.training)},
                     {"stimulus", r.trial.stimulus},
                     {"path_begins_at_tick", tick + lead},
                     {"by", name_of_enum(r.mover)},
                     {"axes", "x right, y up, z towards the person"}}
                    .dump()};
  };
  for (const auto& [run, what] : {std::pair{&r.training, "training"}, std::pair{&r.test, "test"}}) {
    if (run->empty()) continue;
    SessionBatch batch;
    batch.notes.push_back(note(what, r.lead_ticks));
    for (TickRecord t : *run) {
      t.tick = tick++;
      batch.ticks.push_back(t);
      if (batch.ticks.size() == 1000) {
        writer.append(batch);
        batch = {};
      }
    }
    writer.append(batch);
  }
  SessionEnd end;
  end.ticks = tick;
  end.bone_hash = h.bone_hash;
  writer.finish(end);
  fs::rename(part, file);
}

const std::vector<std::string> kTrialKeys{"osteotome_force_skill_trial",
                                          "participant",
                                          "trial",
                                          "block",
                                          "repetition",
                                          "training",
                                          "stimulus",
                                          "aid",
                                          "by",
                                          "device",
                                          "simulated",
                                          "gains",
                                          "score",
                                          "phase_s",
                                          "lag_s",
                                          "amplitude_n",
                                          "slope_n_per_s",
                                          "plain_rms_n",
                                          "thesis_n",
                                          "saturated",
                                          "aligned_by",
                                          "path_rms_mm",
                                          "path_lag_mm",
                                          "rate_hz",
                                          "target_n",
                                          "applied_n"};

TrialScore read_trial(const fs::path& file) {
  const JsonFile json(read_text(file), file.string(), ExitCode::corrupt);
  json.require_format("osteotome_force_skill_trial");
  const JsonValue& root = json.root();
  json.allow(root, "", kTrialKeys);
  const auto number = [&](const char* key, double lo, double hi) {
    return json.number(json.need(root, "", key), key, lo, hi);
  };
  TrialScore s;
  s.participant = json.text(json.need(root, "", "participant"), "participant");
  s.trial.number = static_cast<int>(number("trial", 1, 1000));
  s.trial.block = static_cast<int>(number("block", 1, 1000));
  s.trial.repetition = static_cast<int>(number("repetition", 1, 100));
  s.trial.training = enum_of<Training>(json, json.need(root, "", "training"), "training");
  s.trial.stimulus = static_cast<std::uint64_t>(number("stimulus", 0, 9.1e15));
  s.trial.aid = number("aid", 0, 1);
  s.mover = enum_of<Mover>(json, json.need(root, "", "by"), "by");
  s.recall.score = number("score", 0, 1e9);
  s.recall.phase_s = number("phase_s", 0, 1e6);
  s.recall.lag_s = number("lag_s", -1e6, 1e6);
  s.recall.amplitude_n = number("amplitude_n", 0, 1e6);
  s.recall.slope_n_per_s = number("slope_n_per_s", 0, 1e9);
  s.recall.plain_rms_n = number("plain_rms_n", 0, 1e6);
  s.recall.thesis_n = number("thesis_n", 0, 1e9);
  s.recall.saturated = number("saturated", 0, 1);
  s.path_rms_mm = number("path_rms_mm", 0, 1e6);
  s.path_lag_mm = number("path_lag_mm", -1e6, 1e6);
  s.rate_hz = number("rate_hz", 0.1, 1e5);
  for (const auto& [key, to] : {std::pair{"target_n", &s.target_n}, std::pair{"applied_n", &s.applied_n}}) {
    for (const JsonValue& v : json.list(json.need(root, "", key), key)) to->push_back(json.number(v, key));
  }
  return s;
}

}  // namespace

TrialScore score_trial(const std::string& participant, const Stimulus& stimulus, const TrialRecord& r,
                       const RecallSettings& settings) {
  const std::size_t n = stimulus.force_n.size();
  if (r.test.size() != r.lead_ticks + n)
    throw Error(ExitCode::usage, "the test has " + std::to_string(r.test.size()) + " ticks instead of " +
                                     std::to_string(r.lead_ticks + n));
  TrialScore s;
  s.participant = participant;
  s.trial = r.trial;
  s.mover = r.mover;
  std::vector<double> applied(n);
  std::vector<bool> saturated = stimulus.saturated;
  double squares = 0, behind = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const TickRecord& t = r.test[r.lead_ticks + i];
    applied[i] = t.normal_force_n;
    saturated[i] = saturated[i] || (t.flags & kForceCapped) != 0;
    const double dx = t.device.position_mm[0] - stimulus.x_mm[i], dz = t.device.position_mm[2] - stimulus.z_mm[i];
    squares += dx * dx + dz * dz;
    behind -= (dx * stimulus.vx_mm_s[i] + dz * stimulus.vz_mm_s[i]) / stimulus.params.speed_mm_s;
  }
  s.path_rms_mm = std::sqrt(squares / static_cast<double>(n));
  s.path_lag_mm = behind / static_cast<double>(n);
  s.recall = score_recall(stimulus.force_n, applied, saturated, stimulus.rate_hz, settings);
  s.target_n = at_rate(s.recall.target_n, s.recall.seconds, s.rate_hz);
  s.applied_n = at_rate(s.recall.applied_n, s.recall.seconds, s.rate_hz);
  return s;
}

fs::path trials_folder(const fs::path& experiment, const std::string& participant, bool retention) {
  return retention ? experiment / participant / "retention" : experiment / participant;
}

TrialScore save_trial(const fs::path& folder, const std::string& participant, const Stimulus& stimulus,
                      const TrialRecord& r) {
  const TrialScore s = score_trial(participant, stimulus, r);
  make_output_folder(folder);
  const std::string name = trial_name(r.trial.number);
  write_session(folder / (name + ".oss"), participant, r, stimulus.rate_hz);
  static constexpr const char* kBy[] = {"band", "matrix"};
  const Json j{{"osteotome_force_skill_trial", 1},
               {"participant", participant},
               {"trial", r.trial.number},
               {"block", r.trial.block},
               {"repetition", r.trial.repetition},
               {"training", name_of_enum(r.trial.training)},
               {"stimulus", r.trial.stimulus},
               {"aid", r.trial.aid},
               {"by", name_of_enum(r.mover)},
               {"device", r.device},
               {"simulated", r.mover == Mover::simulated},
               {"gains", Json{{"path_n_per_mm", rounded_to(r.gains.path_n_per_mm)},
                              {"path_n_s_per_mm", rounded_to(r.gains.path_n_s_per_mm)},
                              {"plane_n_per_mm", rounded_to(r.gains.plane_n_per_mm)},
                              {"plane_n_s_per_mm", rounded_to(r.gains.plane_n_s_per_mm)}}},
               {"score", s.recall.score},
               {"phase_s", s.recall.phase_s},
               {"lag_s", s.recall.lag_s},
               {"amplitude_n", s.recall.amplitude_n},
               {"slope_n_per_s", s.recall.slope_n_per_s},
               {"plain_rms_n", s.recall.plain_rms_n},
               {"thesis_n", s.recall.thesis_n},
               {"saturated", s.recall.saturated},
               {"aligned_by", kBy[static_cast<std::size_t>(s.recall.by)]},
               {"path_rms_mm", s.path_rms_mm},
               {"path_lag_mm", s.path_lag_mm},
               {"rate_hz", s.rate_hz},
               {"target_n", s.target_n},
               {"applied_n", s.applied_n}};
  write_file(folder / (name + ".json"), j.dump() + "\n");
  return s;
}

std::vector<TrialScore> read_trials(const fs::path& folder) {
  std::vector<TrialScore> all;
  if (!fs::is_directory(folder)) return all;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".json" && entry.path().filename().string().starts_with("trial-"))
      all.push_back(read_trial(entry));
  }
  std::sort(all.begin(), all.end(),
            [](const TrialScore& a, const TrialScore& b) { return a.trial.number < b.trial.number; });
  return all;
}

std::size_t first_unfinished(const fs::path& folder, const std::vector<Trial>& trials) {
  for (std::size_t i = 0; i < trials.size(); ++i) {
    if (!fs::exists(folder / (trial_name(trials[i].number) + ".json"))) return i;
  }
  return trials.size();
}

TrialRecord simulate_trial(const Protocol& p, const Trial& trial, const Stimulus& stimulus,
                           SimulatedParticipant& participant) {
  TrialRecord r;
  r.trial = trial;
  r.device = "simulated participant";
  r.traits = participant.traits();
  const double dt = 1 / p.rate_hz;
  for (const RunKind kind : {RunKind::training, RunKind::test}) {
    if (kind == RunKind::training && trial.aid <= 0) continue;
    ForceTask task(stimulus, trial, kind, {}, r.traits, p.peak_n, kLeadS);
    r.lead_ticks = task.lead_ticks();
    participant.begin(stimulus, trial, kind, kLeadS);
    auto& ticks = kind == RunKind::training ? r.training : r.test;
    ticks.reserve(task.ticks());
    Vec3 force;
    for (std::uint64_t t = 0; t < task.ticks(); ++t) {
      ticks.push_back(task.step(t, participant.read(t, dt, force)));
      force = {ticks.back().force_n[0], ticks.back().force_n[1], ticks.back().force_n[2]};
    }
  }
  r.gains = safe_gains({}, r.traits, p.rate_hz);
  return r;
}

std::size_t simulate_participant(const fs::path& experiment, const Protocol& p, std::size_t participant, bool retention,
                                 const ParticipantModel& model, const Context& context,
                                 const std::function<void()>& after_each) {
  const std::string& code = p.participants.at(participant);
  const fs::path folder = trials_folder(experiment, code, retention);
  const std::vector<Trial> trials = retention ? retention_of(p, participant) : trials_of(p, participant);
  std::size_t done = 0;
  for (const Trial& t : trials) {
    if (!fs::exists(folder / (trial_name(t.number) + ".json"))) {
      context.check_cancelled();
      // Each trial of its own: going on after a stop gives what would have come without one.
      SimulatedParticipant person(model, static_cast<std::uint64_t>(p.seed) * 1000 + participant);
      const Stimulus stimulus = stimulus_of(p, t);
      (void)save_trial(folder, code, stimulus, simulate_trial(p, t, stimulus, person));
      ++done;
    }
    if (after_each) after_each();
  }
  return done;
}

}  // namespace osteo::inline assessment::experiment
