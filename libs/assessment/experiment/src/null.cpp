#include <cmath>

#include "osteo/assessment/experiment/analysis.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/core/statistics/repeated.h"

namespace osteo::inline assessment::experiment {
namespace {

// Scores of an experiment: by training, person by person; and one mean a person and training, those of each person
// together.
struct Scores {
  std::vector<std::vector<double>> pooled = std::vector<std::vector<double>>(kTrainings),
                                   of = std::vector<std::vector<double>>(kTrainings);
  std::vector<double> means;
  void add_person(const std::array<std::vector<double>, kTrainings>& scores) {
    for (std::size_t t = 0; t < kTrainings; ++t) {
      pooled[t].insert(pooled[t].end(), scores[t].begin(), scores[t].end());
      means.push_back(statistics::mean(scores[t]));
      of[t].push_back(means.back());
    }
  }
};

void count(const Scores& s, double alpha, NullResult& r) {
  const statistics::RepeatedAnova a = statistics::repeated_anova(s.means, kTrainings);
  r.repeated += a.p < alpha ? 1 : 0;
  r.repeated_gg += a.p_gg < alpha ? 1 : 0;
  r.pooled += statistics::one_way_anova(s.pooled).p < alpha ? 1 : 0;
  const std::vector<double> pairs{statistics::paired(s.of[0], s.of[1]).p, statistics::paired(s.of[0], s.of[2]).p,
                                  statistics::paired(s.of[1], s.of[2]).p};
  bool any = false;
  for (const double p : statistics::holm(pairs)) any = any || p < alpha;
  r.any_pair_holm += any ? 1 : 0;
  const double h = statistics::mean(s.of[0]), v = statistics::mean(s.of[1]), vh = statistics::mean(s.of[2]);
  r.ordered += vh < v && v < h ? 1 : 0;
}

}  // namespace

NullResult null_experiments(const NullSettings& s) {
  if (s.experiments < 1 || s.people < 2 || s.trials < 1 || !(s.mean > 0))
    throw Error(ExitCode::usage,
                "null experiments need one experiment, two people and a trial at least, and a mean above 0");
  NullResult r;
  r.experiments = s.experiments;
  statistics::Random random(s.seed);
  for (int e = 0; e < s.experiments; ++e) {
    Scores scores;
    for (int p = 0; p < s.people; ++p) {
      const double own = s.person * random.normal();
      std::array<std::vector<double>, kTrainings> drawn;
      for (std::size_t t = 0; t < kTrainings; ++t) {
        // H, V, V+H: each better than the one before by `effect`.
        const double level =
            s.mean * (1 + own + s.person_by_training * random.normal() + s.effect * (1 - static_cast<double>(t)));
        for (int k = 0; k < s.trials; ++k) drawn[t].push_back(level + s.trial_sd * random.normal());
      }
      scores.add_person(drawn);
    }
    count(scores, s.alpha, r);
  }
  return r;
}

NullResult null_chain(const NullSettings& s, const ParticipantModel& model, const Context& context) {
  if (s.experiments < 1 || s.people < 2 || s.trials < 3 || s.trials % 3 != 0)
    throw Error(ExitCode::usage,
                "experiments by simulated people need one experiment, two people, and trials a training in threes");
  std::vector<Scores> all(static_cast<std::size_t>(s.experiments));
  parallel_for(all.size(), 1, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) {
      Protocol p;
      for (int i = 1; i <= s.people; ++i) p.participants.push_back("S" + std::to_string(i));
      p.trials = s.trials * static_cast<int>(kTrainings);
      p.break_after = 0;
      p.rate_hz = kChainRateHz;
      p.seed = static_cast<int>((s.seed * 100003 + e) % 1000000007);
      p.simulated = true;
      check(p);
      for (std::size_t who = 0; who < p.participants.size(); ++who) {
        std::array<std::vector<double>, kTrainings> scores;
        SimulatedParticipant person(model, static_cast<std::uint64_t>(p.seed) * 1000 + who);
        for (Trial t : trials_of(p, who)) {
          context.check_cancelled();
          t.aid = 0;  // no training
          const Stimulus stimulus = stimulus_of(p, t);
          const TrialRecord record = simulate_trial(p, t, stimulus, person);
          scores[static_cast<std::size_t>(t.training)].push_back(
              score_trial(p.participants[who], stimulus, record).recall.score);
        }
        all[e].add_person(scores);
      }
    }
  });
  NullResult r;
  r.experiments = s.experiments;
  for (const Scores& scores : all) count(scores, s.alpha, r);
  return r;
}

}  // namespace osteo::inline assessment::experiment
