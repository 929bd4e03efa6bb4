// Protocol, runs, trials on disk, the controller and the analysis: by what they do.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "osteo/assessment/experiment/analysis.h"
#include "osteo/assessment/experiment/force_skill_controller.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/statistics/basics.h"
#include "osteo/session/recording/session_reader.h"

namespace osteo::experiment {
namespace {

Protocol small(int people = 3, int trials = 9) {
  Protocol p;
  for (int i = 1; i <= people; ++i) p.participants.push_back("S" + std::to_string(i));
  p.trials = trials;
  p.break_after = 0;
  p.rate_hz = 200;
  p.simulated = true;
  return p;
}

TEST(Protocol, OrdersAreBalancedOverSixPeople) {
  Protocol p;
  for (int i = 1; i <= 12; ++i) p.participants.push_back("P" + std::to_string(i));
  std::map<std::pair<std::uint64_t, int>, int> learned_under;  // stimulus and training: people
  std::vector<std::map<std::string, int>> orders(8);
  for (std::size_t who = 0; who < 12; ++who) {
    const auto trials = trials_of(p, who);
    ASSERT_EQ(trials.size(), 72U);
    std::map<int, int> of_training;
    for (std::size_t i = 0; i < trials.size(); ++i) {
      const Trial& t = trials[i];
      EXPECT_EQ(t.number, static_cast<int>(i) + 1);
      EXPECT_EQ(t.pause, t.number == 37);
      ++of_training[static_cast<int>(t.training)];
      // A block keeps stimulus and training.
      if (t.repetition > 1) {
        EXPECT_EQ(t.training, trials[i - 1].training);
        EXPECT_EQ(t.stimulus, trials[i - 1].stimulus);
      } else {
        ++learned_under[{t.stimulus, static_cast<int>(t.training)}];
      }
    }
    for (int t = 0; t < 3; ++t) EXPECT_EQ(of_training[t], 24);
    for (std::size_t three = 0; three < 8; ++three) {
      std::string order;
      for (std::size_t b = 0; b < 3; ++b) order += short_name(trials[three * 9 + b * 3].training) + std::string(" ");
      ++orders[three][order];
    }
  }
  EXPECT_EQ(learned_under.size(), 24U * 3);
  for (const auto& [what, people] : learned_under) EXPECT_EQ(people, 4);
  for (const auto& place : orders) {
    EXPECT_EQ(place.size(), 6U);
    for (const auto& [order, people] : place) EXPECT_EQ(people, 2) << order;
  }
  EXPECT_EQ(retention_of(p, 0).size(), 24U);
  EXPECT_EQ(retention_of(p, 0)[3].aid, 0);
}

TEST(Protocol, FilesAreReadAsWrittenAndStrictly) {
  const TemporaryFolder folder;
  Protocol p = small();
  p.title = "what \"we\" do";
  p.feedback = Feedback::delayed;
  p.amplification = 2;
  p.fading = true;
  write_protocol(folder.path() / "a", p);
  const Protocol back = read_protocol(folder.path() / "a");
  EXPECT_EQ(back.title, p.title);
  EXPECT_EQ(back.participants, p.participants);
  EXPECT_EQ(back.feedback, Feedback::delayed);
  EXPECT_EQ(back.amplification, 2);
  EXPECT_TRUE(back.fading && back.simulated);
  EXPECT_EQ(back.rate_hz, 200);
  EXPECT_THROW(write_protocol(folder.path() / "a", p), Error);
  const std::string good = read_text(folder.path() / "a" / "protocol.json");
  const auto refused = [&](const std::string& from, const std::string& to, const std::string& said) {
    std::string bad = good;
    bad.replace(bad.find(from), from.size(), to);
    write_file(folder.path() / "a" / "protocol.json", bad);
    try {
      (void)read_protocol(folder.path() / "a");
      ADD_FAILURE() << to << " was taken";
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find(said), std::string::npos) << e.what();
    }
  };
  refused("\"trials\": 9", "\"trials\": 10", "multiple of 9");
  refused("\"S2\"", "\"S1\"", "there twice");
  refused("\"S2\"", "\"Anna Meier\"", "no code");
  refused("\"break_min\"", "\"brake_min\"", "brake_min");
  refused("\"peak_n\": 12", "\"peak_n\": 5", "peak_n");
  EXPECT_THROW((void)participant_number(back, "S9"), Error);
}

// A hand that does nothing is led along the path; one that presses is held in the plane by as much.
TEST(Task, LeadsTheHandAndHoldsItInThePlane) {
  Protocol p = small();
  p.rate_hz = 1000;
  const Trial t = trials_of(p, 0)[0];
  const Stimulus s = stimulus_of(p, t);
  SimulatedDeviceParams arm;
  arm.mass_kg = 0.25;
  arm.damping_n_s_per_m = 12;
  SimulatedDevice device(arm, {10, 0, 20});
  device.set_hand({0, -5, 0});
  ForceTask task(s, t, RunKind::test, {}, device.traits(), 12);
  Vec3 force;
  double worst = 0, pressed = 0;
  for (std::uint64_t tick = 0; tick < task.ticks(); ++tick) {
    const TickRecord r = task.step(tick, device.read(tick, 1e-3, force));
    force = {r.force_n[0], r.force_n[1], r.force_n[2]};
    ASSERT_LE(length(force), 12 + 1e-6);
    if (tick < task.lead_ticks() + 500) continue;
    const std::size_t i = tick - task.lead_ticks();
    worst = std::max(worst, std::hypot(r.device.position_mm[0] - s.x_mm[i], r.device.position_mm[2] - s.z_mm[i]));
    pressed = r.normal_force_n;
  }
  EXPECT_TRUE(task.done());
  EXPECT_LT(worst, 2);
  EXPECT_NEAR(pressed, 5, 0.1);
}

TEST(Task, HapticTrainingPushesWithTheTarget) {
  Protocol p = small();
  Trial t = trials_of(p, 0)[0];
  t.training = Training::haptic;
  const Stimulus s = stimulus_of(p, t);
  ForceTask task(s, t, RunKind::training, {}, {.damping_n_s_per_m = 12}, 12);
  DeviceSample sample;
  for (std::uint64_t tick = 0; tick < task.ticks(); ++tick) {
    const std::size_t i = tick < task.lead_ticks() ? 0 : tick - task.lead_ticks();
    sample.position_mm = {static_cast<float>(s.x_mm[i]), 0, static_cast<float>(s.z_mm[i])};
    const TickRecord r = task.step(tick, sample);
    if (tick >= task.lead_ticks()) {
      ASSERT_NEAR(r.force_n[1], s.force_n[i], 1e-3 + 0.02 * s.force_n[i]);
    }
    ASSERT_EQ(r.normal_force_n, 0);
  }
}

// What the device cannot bear is not asked of it; what comes from it may be anything.
TEST(Task, StaysWithinTheDevice) {
  const TaskGains weak = safe_gains({}, {.damping_n_s_per_m = 1, .delay_s = 0.02}, 1000);
  EXPECT_LT(weak.plane_n_per_mm, 1);
  EXPECT_LT(weak.plane_n_s_per_mm, 0.02);
  Protocol p = small();
  const Trial t = trials_of(p, 0)[0];
  const Stimulus s = stimulus_of(p, t);
  ForceTask task(s, t, RunKind::test, {}, {}, 3);
  DeviceSample sample;
  bool capped = false;
  for (std::uint64_t tick = 0; tick < 600; ++tick) {
    sample.position_mm = {0, tick > 300 ? -50.F : 0.F, 0};
    if (tick % 50 == 7) sample.position_mm[1] = std::numeric_limits<float>::quiet_NaN();
    const TickRecord r = task.step(tick, sample);
    const Vec3 f{r.force_n[0], r.force_n[1], r.force_n[2]};
    ASSERT_TRUE(std::isfinite(length(f)));
    ASSERT_LE(length(f), 3 + 1e-5);
    capped = capped || (r.flags & kForceCapped) != 0;
  }
  EXPECT_TRUE(capped);
}

// Who presses more than the device holds sinks, but is still led along the path, and the square is seen.
TEST(Task, KeepsThePathAtTheDevicesLimit) {
  Protocol p = small();
  p.rate_hz = 1000;
  const Trial t = trials_of(p, 0)[0];
  const Stimulus s = stimulus_of(p, t);
  SimulatedDeviceParams arm;
  arm.mass_kg = 0.25;
  arm.damping_n_s_per_m = 12;
  SimulatedDevice device(arm, {s.x_mm[0], 0, s.z_mm[0]});
  device.set_hand({0, -9, 0});
  ForceTask task(s, t, RunKind::test, {}, device.traits(), 8);
  Vec3 force;
  double worst = 0, most = 0;
  std::size_t capped = 0;
  for (std::uint64_t tick = 0; tick < task.ticks(); ++tick) {
    const TickRecord r = task.step(tick, device.read(tick, 1e-3, force));
    force = {r.force_n[0], r.force_n[1], r.force_n[2]};
    most = std::max(most, length(force));
    capped += task.view().saturated ? 1 : 0;
    if (tick < task.lead_ticks() + 500) continue;
    const std::size_t i = tick - task.lead_ticks();
    worst = std::max(worst, std::hypot(r.device.position_mm[0] - s.x_mm[i], r.device.position_mm[2] - s.z_mm[i]));
  }
  EXPECT_GT(capped, task.ticks() / 2);
  EXPECT_LE(most, 8 + 1e-5);
  EXPECT_LT(worst, 2);
}

TEST(Trials, GoOnWhereTheyStoppedWithTheSameBytes) {
  const TemporaryFolder folder;
  const Protocol p = small(1);
  const Context context;
  const fs::path whole = folder.path() / "whole", cut = folder.path() / "cut";
  EXPECT_EQ(simulate_participant(whole, p, 0, false, {}, context), 9U);
  (void)simulate_participant(cut, p, 0, false, {}, context);
  // As a crash leaves it: a session without its score.
  fs::remove(cut / "S1" / "trial-04.json");
  fs::resize_file(cut / "S1" / "trial-04.oss", 1000);
  EXPECT_EQ(first_unfinished(cut / "S1", trials_of(p, 0)), 3U);
  EXPECT_EQ(simulate_participant(cut, p, 0, false, {}, context), 1U);
  for (const char* const file : {"trial-04.json", "trial-04.oss", "trial-09.json"})
    EXPECT_EQ(hash_path(cut / "S1" / file), hash_path(whole / "S1" / file)) << file;
  // All ticks are there, and what they were is said.
  const Session session = read_session(whole / "S1" / "trial-04.oss");
  const Stimulus s = stimulus_of(p, trials_of(p, 0)[3]);
  EXPECT_EQ(session.ticks.size(), 2 * (s.force_n.size() + static_cast<std::size_t>(kLeadS * p.rate_hz)));
  ASSERT_EQ(session.notes.size(), 2U);
  EXPECT_NE(session.notes[1].json.find("\"run\":\"test\""), std::string::npos);
  EXPECT_TRUE(session.end.has_value());
  const auto scores = read_trials(whole / "S1");
  ASSERT_EQ(scores.size(), 9U);
  for (const TrialScore& t : scores) {
    EXPECT_GT(t.recall.score, 0.02);
    EXPECT_LT(t.recall.score, 1.5);
    EXPECT_LT(t.path_rms_mm, 2);
    EXPECT_EQ(t.mover, Mover::simulated);
  }
  write_file(whole / "S1" / "trial-02.json", "{\"osteotome_force_skill_trial\": 1, \"score\": \"good\"}");
  EXPECT_THROW((void)read_trials(whole / "S1"), Error);
}

TEST(Participant, MemoryIsWhatIsScored) {
  // Half of the noise of memory: a better recall; none of it, and hardly any error is left.
  Protocol p = small(1);
  const Trial t = trials_of(p, 0)[0];
  const Stimulus s = stimulus_of(p, t);
  double last = 1e9;
  for (const double share : {1.0, 0.5, 0.0}) {
    ParticipantModel m;
    for (double& v : m.memory) v *= share;
    m.person = m.person_by_training = 0;
    double score = 0;
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      SimulatedParticipant person(m, seed);
      score += score_trial("S1", s, simulate_trial(p, t, s, person)).recall.score / 4;
    }
    EXPECT_LT(score, last);
    last = score;
  }
  EXPECT_LT(last, 0.3);
}

TEST(Controller, GoesThroughATrialAndSavesIt) {
  const TemporaryFolder folder;
  Protocol p = small(1);
  p.simulated = false;
  p.feedback = Feedback::delayed;
  // The first block that is not by hand alone has feedback behind its training.
  ForceSkillController controller(folder.path(), p, 0, false, Mover::keys, "keys", {.damping_n_s_per_m = 12});
  const bool sees = controller.trial().training != Training::haptic;
  EXPECT_EQ(controller.page(), RunPage::before_training);
  EXPECT_EQ(length(controller.step({})), 0);
  controller.update();
  EXPECT_EQ(controller.page(), RunPage::before_training);
  const auto run = [&] {
    SimulatedDeviceParams arm;
    arm.mass_kg = 0.25;
    arm.damping_n_s_per_m = 12;
    SimulatedDevice device(arm, Vec3{});
    device.set_hand({0, -2, 0});
    Vec3 force;
    for (std::uint64_t tick = 0; controller.running(); ++tick) {
      force = controller.step(device.read(tick, 1 / p.rate_hz, force));
      if (tick == 700) {
        EXPECT_FALSE(controller.drawing(800, 600).marks.empty());
      }
      controller.go_on();  // in a run the space bar does nothing
    }
    controller.update();
  };
  controller.go_on();
  EXPECT_EQ(controller.page(), RunPage::training);
  run();
  if (sees) {
    EXPECT_EQ(controller.page(), RunPage::feedback);
    EXPECT_EQ(controller.last_training().first.size(), controller.last_training().second.size());
    controller.go_on();
  }
  EXPECT_EQ(controller.page(), RunPage::before_test);
  controller.go_on();
  run();
  EXPECT_EQ(controller.done(), 1U);
  const auto scores = read_trials(folder.path() / "S1");
  ASSERT_EQ(scores.size(), 1U);
  EXPECT_EQ(scores[0].mover, Mover::keys);
  // Another controller goes on there.
  const ForceSkillController again(folder.path(), p, 0, false, Mover::keys, "keys", {});
  EXPECT_EQ(again.done(), 1U);
}

TEST(Display, ShowsBarsWhereTheyBelong) {
  Protocol p = small();
  const Stimulus s = stimulus_of(p, trials_of(p, 0)[0]);
  const auto areas = [&](Training training, RunKind kind, bool saturated = false,
                         Feedback feedback = Feedback::concurrent) {
    DisplayState state;
    state.training = training;
    state.kind = kind;
    state.view.target_n = 4;
    state.view.applied_n = 2;
    state.view.saturated = saturated;
    state.feedback = feedback;
    std::map<std::string, double> height;
    for (const auto& mark : run_drawing(s, state, 1000, 800).marks) {
      const auto* const path = std::get_if<sheet::Drawing::Path>(&mark);
      if (path == nullptr || !path->fill) continue;
      double lo = 1e9, hi = -1e9;
      for (const auto& at : path->points) {
        lo = std::min(lo, at[1]);
        hi = std::max(hi, at[1]);
      }
      const auto& c = *path->fill;
      height[c[2] > 180 && c[0] < 100   ? "blue"
             : c[1] > 120 && c[0] < 100 ? "green"
             : c[0] > 180 && c[1] < 60  ? "red"
                                        : "other"] = hi - lo;
    }
    return height;
  };
  EXPECT_EQ(areas(Training::haptic, RunKind::training).count("blue"), 0U);
  EXPECT_EQ(areas(Training::visuohaptic, RunKind::test).count("blue"), 0U);
  EXPECT_EQ(areas(Training::visuohaptic, RunKind::test).count("green"), 0U);
  EXPECT_EQ(areas(Training::visual, RunKind::training).count("green"), 0U);
  auto both = areas(Training::visuohaptic, RunKind::training);
  EXPECT_NEAR(both["blue"], 2 * both["green"], 1e-6);
  EXPECT_EQ(areas(Training::visuohaptic, RunKind::training, false, Feedback::delayed).count("green"), 0U);
  EXPECT_EQ(areas(Training::haptic, RunKind::test, true).count("red"), 1U);
  EXPECT_EQ(areas(Training::haptic, RunKind::test).count("red"), 0U);
}

// The error is shown larger by the set factor, to its own side; the target is not touched.
TEST(Display, AmplifiesTheErrorAsSet) {
  Protocol p = small();
  const Stimulus s = stimulus_of(p, trials_of(p, 0)[0]);
  const auto bars = [&](double amplification, double applied) {
    DisplayState state;
    state.training = Training::visuohaptic;
    state.kind = RunKind::training;
    state.view.target_n = 4;
    state.view.applied_n = applied;
    state.amplification = amplification;
    std::vector<double> heights;  // blue, green
    for (const auto& mark : run_drawing(s, state, 1000, 800).marks) {
      const auto* const path = std::get_if<sheet::Drawing::Path>(&mark);
      if (path == nullptr || !path->fill) continue;
      const auto& c = *path->fill;
      const bool blue = c[2] > 180 && c[0]<100, green = c[1]> 120 && c[2] < 100 && c[0] < 100;
      double lo = 1e9, hi = -1e9;
      for (const auto& at : path->points) {
        lo = std::min(lo, at[1]);
        hi = std::max(hi, at[1]);
      }
      if (blue || green) heights.push_back(hi - lo);
    }
    return heights;
  };
  for (const double applied : {3.5, 4.0, 4.75}) {
    const auto plain = bars(1, applied), more = bars(3, applied);
    ASSERT_EQ(plain.size(), 2U);
    ASSERT_EQ(more.size(), 2U);
    EXPECT_NEAR(plain[0], more[0], 1e-9);
    EXPECT_NEAR(more[1] - more[0], 3 * (plain[1] - plain[0]), 1e-9) << applied;
  }
}

// What was pressed with fading, as it was recorded: the target times 1, 2/3, 1/3 over the repetitions of a block.
TEST(Task, FadesOverTheRepetitions) {
  Protocol p = small();
  p.fading = true;
  p.rate_hz = 1000;
  std::vector<Trial> block;
  for (const Trial& t : trials_of(p, 0))
    if (t.training == Training::haptic && block.size() < 3) block.push_back(t);
  ASSERT_EQ(block.size(), 3U);
  const Stimulus s = stimulus_of(p, block[0]);
  for (std::size_t k = 0; k < 3; ++k) {
    const double share = 1 - static_cast<double>(k) / 3;
    EXPECT_NEAR(block[k].aid, share, 1e-12);
    SimulatedParticipant person(ParticipantModel{}, 4);
    const TrialRecord r = simulate_trial(p, block[k], s, person);
    double pushed = 0, target = 0;
    for (std::size_t i = 1000; i + 1000 < s.force_n.size(); ++i) {
      pushed += r.training[r.lead_ticks + i].force_n[1];
      target += s.force_n[i];
    }
    EXPECT_NEAR(pushed / target, share, 0.02) << k;
  }
}

// Scores made up: the analysis finds what is in them, and says what it cannot.
ExperimentData made_up(int people, double effect, std::uint64_t seed) {
  ExperimentData d;
  d.protocol = small(people, 9);
  statistics::Random random(seed);
  for (std::size_t who = 0; who < d.protocol.participants.size(); ++who) {
    const double own = 0.05 * random.normal();
    for (const Trial& t : trials_of(d.protocol, who)) {
      TrialScore s;
      s.participant = d.protocol.participants[who];
      s.trial = t;
      s.recall.score = 0.5 + own - effect * static_cast<double>(t.training) + 0.03 * random.normal();
      s.target_n = {0, 1, 3, 1, 0};
      s.applied_n = {0, 1, 2, 1, 0};
      d.trials.push_back(s);
    }
  }
  return d;
}

TEST(ForceAnalysis, FindsWhatIsThere) {
  const ExperimentAnalysis a = analyse(made_up(12, 0.08, 3));
  EXPECT_LT(*a.json.find("repeated_anova")->find("p_gg")->number(), 1e-6);
  EXPECT_EQ(*a.json.find("table_1")->find("best_vh")->number(), 12);
  for (const Json& pair : a.json.find("pairs")->items()) {
    EXPECT_LT(*pair.find("p_holm")->number(), 0.01);
    EXPECT_GT(*pair.find("difference")->find("value")->number(), 0.05);
  }
  EXPECT_TRUE(a.json.find("refused")->empty());
  const std::string html = sheet_html(a.sheet);
  for (const char* const said : {"SIMULATED", "INVALID", "figure-22", "figure-23", "figure-24-a", "figure-25",
                                 "figure-26", "figure-27", "figure-28", "table 1"})
    EXPECT_NE(html.find(said), std::string::npos) << said;
}

TEST(ForceAnalysis, SaysWhatItCannot) {
  ExperimentData few = made_up(2, 0.1, 3);
  const ExperimentAnalysis a = analyse(few);
  EXPECT_EQ(a.json.find("repeated_anova"), nullptr);
  EXPECT_EQ(a.json.find("refused")->items().size(), 1U);
  ExperimentData half = made_up(4, 0.1, 3);
  half.trials.pop_back();
  const ExperimentAnalysis b = analyse(half);
  EXPECT_EQ(b.json.find("left_out")->items().size(), 1U);
  EXPECT_EQ(*b.json.find("repeated_anova")->find("people")->number(), 3);
}

TEST(NullExperiments, HoldTheirFivePercentAndThePooledOneDoesNot) {
  NullSettings s;
  const NullResult n = null_experiments(s);
  // Four standard deviations of a share of 5 % among 1,000.
  for (const int found : {n.repeated, n.repeated_gg, n.any_pair_holm}) {
    EXPECT_GT(found, 22);
    EXPECT_LT(found, 78);
  }
  EXPECT_GT(n.pooled, 200);
  s.experiments = 200;
  s.effect = 0.15;
  EXPECT_GT(null_experiments(s).repeated_gg, 150);
  EXPECT_GT(null_experiments(s).ordered, 150);
  s.people = 1;
  EXPECT_THROW((void)null_experiments(s), Error);
}

TEST(NullExperiments, GoThroughTheWholeChain) {
  NullSettings s;
  s.experiments = 3;
  s.people = 3;
  s.trials = 3;
  s.alpha = 1;  // everything counts
  Context two;
  two.threads = 2;
  const NullResult n = null_chain(s, null_model(), two);
  EXPECT_EQ(n.repeated, 3);
  EXPECT_EQ(n.pooled, 3);
  // What was put in is found: memory that differs by a factor of four.
  ParticipantModel apart;
  apart.memory = {0.8, 0.4, 0.1};
  s.experiments = 2;
  s.people = 4;
  s.alpha = 0.05;
  const NullResult found = null_chain(s, apart);
  EXPECT_EQ(found.repeated_gg, 2);
  EXPECT_EQ(found.ordered, 2);
  s.trials = 4;
  EXPECT_THROW((void)null_chain(s, null_model()), Error);
}

}  // namespace
}  // namespace osteo::experiment
