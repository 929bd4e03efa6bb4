#include "osteo/assessment/experiment/analysis.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "figures.h"
#include "osteo/core/base/files.h"
#include "osteo/core/statistics/curves.h"
#include "osteo/core/statistics/repeated.h"

namespace osteo::inline assessment::experiment {
namespace {

using namespace statistics;

std::string text(double v, int digits = 3) {
  if (!std::isfinite(v)) return "-";
  char out[40];
  std::snprintf(out, sizeof out, "%.*g", digits, v);
  return out;
}
std::string p_text(double p) {
  return !std::isfinite(p) ? "-" : p < 0.0001 ? "< 0.0001" : text(p, 2);
}
std::string with(const Estimate& e) {
  return std::isfinite(e.interval.lo) ? text(e.value) + " (" + text(e.interval.lo) + " to " + text(e.interval.hi) + ")"
                                      : text(e.value);
}
Json json_of(const Estimate& e) {
  return Json{{"value", e.value}, {"interval", Json{e.interval.lo, e.interval.hi}}};
}

constexpr std::size_t kPeopleNeeded = 3;
// From worst to best as printed.
constexpr std::array<Training, 3> kTrainingOrder{Training::haptic, Training::visual, Training::visuohaptic};
constexpr std::array<std::pair<std::size_t, std::size_t>, 3> kPairs{{{0, 1}, {1, 2}, {0, 2}}};

struct People {
  std::vector<std::string> codes, left_out;
  std::array<std::vector<double>, kTrainings> means;   // of each person, by training
  std::array<std::vector<double>, kTrainings> pooled;  // of all trials
  [[nodiscard]] std::vector<double> table() const {
    std::vector<double> t;
    for (std::size_t p = 0; p < codes.size(); ++p) {
      for (const auto& m : means) t.push_back(m[p]);
    }
    return t;
  }
};

template <class F>
People people_of(const ExperimentData& data, const std::vector<TrialScore>& trials, int wanted, F&& value) {
  People people;
  for (const std::string& code : data.protocol.participants) {
    std::array<std::vector<double>, kTrainings> of;
    int done = 0;
    for (const TrialScore& t : trials) {
      if (t.participant != code) continue;
      of[static_cast<std::size_t>(t.trial.training)].push_back(value(t));
      ++done;
    }
    if (done < wanted) {
      people.left_out.push_back(code + " (" + std::to_string(done) + " of " + std::to_string(wanted) + " trials)");
      continue;
    }
    people.codes.push_back(code);
    for (std::size_t t = 0; t < kTrainings; ++t) {
      people.means[t].push_back(mean(of[t]));
      people.pooled[t].insert(people.pooled[t].end(), of[t].begin(), of[t].end());
    }
  }
  return people;
}

class Analyst {
 public:
  Analyst(const ExperimentData& data, double level) : data_(data), level_(level) {}

  ExperimentAnalysis run() {
    sheet_.title = data_.protocol.title;
    sheet_.code = "force-skill";
    sheet_.pages = 6;
    sheet_.footer = data_.protocol.simulated ? "SIMULATED participants: programs, not people" : "Force-skill training";
    json_ = Json{{"osteotome_force_skill_report", 1}, {"simulated", data_.protocol.simulated}};
    people_ = people_of(data_, data_.trials, data_.protocol.trials, [](const TrialScore& t) { return t.recall.score; });
    opening();
    if (people_.codes.size() < kPeopleNeeded) {
      refuse("Comparison of trainings", std::to_string(people_.codes.size()) +
                                            " people have done all of their trials; " + std::to_string(kPeopleNeeded) +
                                            " are needed.");
    } else {
      compare();
      table_one();
    }
    stimulus_figures();
    recall_figures();
    parts();
    retention();
    closing();
    json_["refused"] = refused_;
    return {std::move(json_), std::move(sheet_)};
  }

 private:
  void add(auto block) { sheet_.blocks.push_back({std::move(block)}); }
  void say(const std::string& words, Tone tone = Tone::plain) { add(sheet::Paragraph{words, tone}); }
  void refuse(const std::string& what, const std::string& why) {
    refused_.push_back({{"what", what}, {"why", why}});
    say(what + ": not computed. " + why, Tone::caution);
  }

  void opening() {
    if (data_.protocol.simulated)
      add(sheet::Band{"SIMULATED", "Participants are programs of known memory and noise. Nothing here is about people.",
                      Tone::caution});
    std::size_t by_hand = 0;
    double saturated = 0, lag = 0, off = 0;
    for (const TrialScore& t : data_.trials) {
      by_hand += t.mover == Mover::mouse || t.mover == Mover::keys ? 1 : 0;
      saturated += t.recall.saturated;
      lag += t.path_lag_mm;
      off += t.path_rms_mm;
    }
    const double n = std::max<double>(1, static_cast<double>(data_.trials.size()));
    if (by_hand > 0)
      say(std::to_string(by_hand) +
              " trials were done by mouse or keys: their force was set, not pressed, and nothing was felt.",
          Tone::caution);
    add(sheet::Facts{{{"participants with all trials", std::to_string(people_.codes.size()) + " of " +
                                                           std::to_string(data_.protocol.participants.size())},
                      {"trials", std::to_string(data_.trials.size())},
                      {"each", std::to_string(data_.protocol.trials) + " in blocks of " +
                                   std::to_string(data_.protocol.repetitions)},
                      {"seed", std::to_string(data_.protocol.seed)},
                      {"samples kept out as saturated", text(100 * saturated / n) + " %"},
                      {"hand behind the path, mean", text(lag / n) + " mm"},
                      {"hand off the path, RMS", text(off / n) + " mm"},
                      {"feedback", data_.protocol.feedback == Feedback::delayed ? "delayed" : "concurrent"}},
                     2});
    for (const std::string& who : people_.left_out) say("Left out: " + who + ".", Tone::caution);
    json_["people"] = people_.codes;
    json_["left_out"] = people_.left_out;
    json_["saturated_share"] = saturated / n;
    json_["path_lag_mm"] = lag / n;
  }

  void compare() {
    add(sheet::Heading{"Trainings compared (figure 28)"});
    compare_means();
    compare_all(repeated_anova(people_.table(), kTrainings), one_way_anova(people_.pooled));
    compare_pairs();
  }

  void compare_means() {
    sheet::Columns row;
    row.columns.push_back({{means_plot(people_.means, level_)}});
    sheet::Table means{{"training", "mean score", "interval over people"}, {}, {}};
    Json levels = Json::list();
    for (std::size_t t = 0; t < kTrainings; ++t) {
      const Interval i = mean_interval(people_.means[t], level_);
      means.rows.push_back(
          {{short_name(kTrainingOrder[t])}, {text(mean(people_.means[t]))}, {text(i.lo) + " to " + text(i.hi)}});
      levels.push_back({{"training", short_name(kTrainingOrder[t])},
                        {"mean", mean(people_.means[t])},
                        {"interval", Json{i.lo, i.hi}}});
    }
    row.columns.push_back(
        {{std::move(means)},
         {sheet::Paragraph{"Score: 0 is a perfect recall, 1 no force at all. One value a person and training. "
                           "The dissertation's figure 28 has relative units and intervals over pooled trials.",
                           Tone::quiet}}});
    add(std::move(row));
    json_["means"] = levels;
  }

  void compare_all(const RepeatedAnova& a, const OneWayAnova& pooled) {
    sheet::Table tests{{"test", "statistic", "df", "p", "effect"}, {}, {3, 1.4, 1.4, 1.2, 2}};
    const auto df = [](double x, double y) { return text(x) + ", " + text(y, 4); };
    tests.rows.push_back({{"repeated measures, no correction"},
                          {"F " + text(a.f)},
                          {df(a.df_conditions, a.df_error)},
                          {p_text(a.p)},
                          {"partial eta2 " + text(a.partial_eta2) + ", generalised " + text(a.generalised_eta2)}});
    tests.rows.push_back({{"repeated measures, Greenhouse and Geisser"},
                          {"epsilon " + text(a.epsilon_gg)},
                          {df(a.epsilon_gg * a.df_conditions, a.epsilon_gg * a.df_error)},
                          {p_text(a.p_gg)},
                          {""}});
    tests.rows.push_back({{"repeated measures, Huynh and Feldt"},
                          {"epsilon " + text(a.epsilon_hf)},
                          {df(a.epsilon_hf * a.df_conditions, a.epsilon_hf * a.df_error)},
                          {p_text(a.p_hf)},
                          {""}});
    tests.rows.push_back({{"AS PRINTED, INVALID: pooled one-way ANOVA over trials", Tone::caution},
                          {"F " + text(pooled.f), Tone::caution},
                          {df(pooled.df_groups, pooled.df_error), Tone::caution},
                          {p_text(pooled.p) + " (printed: < 0.001)", Tone::caution},
                          {"takes trials for people", Tone::caution}});
    add(std::move(tests));
    json_["repeated_anova"] = Json{{"people", a.people},
                                   {"f", a.f},
                                   {"df", Json{a.df_conditions, a.df_error}},
                                   {"p", a.p},
                                   {"epsilon_gg", a.epsilon_gg},
                                   {"p_gg", a.p_gg},
                                   {"epsilon_hf", a.epsilon_hf},
                                   {"p_hf", a.p_hf},
                                   {"partial_eta2", a.partial_eta2},
                                   {"generalised_eta2", a.generalised_eta2}};
    json_["pooled_anova_as_printed"] = Json{{"valid", false},
                                            {"f", pooled.f},
                                            {"df", Json{pooled.df_groups, pooled.df_error}},
                                            {"p", pooled.p},
                                            {"printed_p_below", 0.001}};
  }

  void compare_pairs() {
    std::vector<double> p;
    std::vector<Paired> pairs;
    std::vector<Permutation> exact;
    for (const auto& [x, y] : kPairs) {
      pairs.push_back(paired(people_.means[x], people_.means[y], level_));
      std::vector<double> values;
      std::vector<int> person, condition;
      for (std::size_t k = 0; k < people_.codes.size(); ++k) {
        for (const int c : {1, 0}) {
          values.push_back(people_.means[c == 1 ? x : y][k]);
          person.push_back(static_cast<int>(k));
          condition.push_back(c);
        }
      }
      exact.push_back(permutation_within_people(values, person, condition,
                                                {200000, 20000, static_cast<std::uint64_t>(data_.protocol.seed)}));
      p.push_back(exact.back().p);
    }
    const std::vector<double> adjusted = holm(p);
    sheet::Table table{
        {"pair", "difference", "paired t: p", "sign flips: p", "Holm", "dz", "g (av)", "power", "printed"},
        {},
        {1.1, 2.4, 1.1, 1.1, 1.1, 2.2, 2.2, 0.9, 1.4}};
    static constexpr std::array<const char*, 3> kPrinted{"one-tailed 0.002", "one-tailed 0.01", "-"};
    Json rows = Json::list();
    for (std::size_t k = 0; k < kPairs.size(); ++k) {
      const std::string name = std::string(short_name(kTrainingOrder[kPairs[k].first])) + " - " +
                               short_name(kTrainingOrder[kPairs[k].second]);
      const Paired& d = pairs[k];
      const double power = std::isfinite(d.dz.value) ? power_paired(people_.codes.size(), d.dz.value) : kUndefined;
      table.rows.push_back({{name},
                            {with({d.difference, d.interval})},
                            {p_text(d.p)},
                            {p_text(exact[k].p)},
                            {p_text(adjusted[k])},
                            {with(d.dz)},
                            {with(d.g_av)},
                            {text(power, 2)},
                            {kPrinted[k]}});
      rows.push_back({{"pair", name},
                      {"difference", json_of({d.difference, d.interval})},
                      {"t", d.t},
                      {"df", d.df},
                      {"p_t", d.p},
                      {"p_permutation", exact[k].p},
                      {"p_holm", adjusted[k]},
                      {"permutation_ways", exact[k].ways},
                      {"smallest_p", exact[k].smallest_p},
                      {"dz", json_of(d.dz)},
                      {"g_av", json_of(d.g_av)},
                      {"power_if_true", power}});
    }
    json_["pairs"] = rows;
    add(std::move(table));
    say("One value a person: the mean of that person's trials of a training. Sign flips: exact, of people's means. "
        "Holm: of those, for the "
        "three pairs together. Power: to find an effect as large as this one again, which is no evidence of its own. "
        "With " +
            std::to_string(people_.codes.size()) + " people a paired test finds dz of " +
            text(detectable_dz(people_.codes.size())) +
            " or more in four of five experiments; no sign flips could give a p below " + text(exact[0].smallest_p, 2) +
            ".",
        Tone::quiet);
    json_["detectable_dz"] = detectable_dz(people_.codes.size());
  }

  void table_one() {
    add(sheet::Heading{"Best and worst training of each person (table 1)"});
    static constexpr std::array<std::pair<const char*, const char*>, 12> kThesis{{{"V+H", "V"},
                                                                                  {"V+H", "H"},
                                                                                  {"V", "H"},
                                                                                  {"V+H", "V"},
                                                                                  {"V+H", "H"},
                                                                                  {"V", "V+H"},
                                                                                  {"V+H", "H"},
                                                                                  {"H", "V"},
                                                                                  {"V+H", "H"},
                                                                                  {"V+H", "H"},
                                                                                  {"V+H", "H"},
                                                                                  {"V+H", "H"}}};
    sheet::Table table{{"person", "best", "worst", "H", "V", "V+H", "printed for its subject of this number"},
                       {},
                       {1, 1, 1, 1, 1, 1, 2.6}};
    Json rows = Json::list();
    int best_vh = 0, worst_vh = 0;
    for (std::size_t k = 0; k < people_.codes.size(); ++k) {
      std::size_t best = 0, worst = 0;
      for (std::size_t t = 1; t < kTrainings; ++t) {
        if (people_.means[t][k] < people_.means[best][k]) best = t;
        if (people_.means[t][k] > people_.means[worst][k]) worst = t;
      }
      best_vh += best == 2 ? 1 : 0;
      worst_vh += worst == 2 ? 1 : 0;
      const std::string printed = k < kThesis.size() ? std::string(kThesis[k].first) + ", " + kThesis[k].second : "-";
      table.rows.push_back({{people_.codes[k]},
                            {short_name(kTrainingOrder[best])},
                            {short_name(kTrainingOrder[worst])},
                            {text(people_.means[0][k])},
                            {text(people_.means[1][k])},
                            {text(people_.means[2][k])},
                            {printed}});
      rows.push_back({{"person", people_.codes[k]},
                      {"best", short_name(kTrainingOrder[best])},
                      {"worst", short_name(kTrainingOrder[worst])}});
    }
    add(std::move(table));
    say("V+H is best for " + std::to_string(best_vh) + " of " + std::to_string(people_.codes.size()) +
        " and worst for " + std::to_string(worst_vh) + "; printed: best for 9 of 12, worst for 1.");
    json_["table_1"] = Json{
        {"rows", rows}, {"best_vh", best_vh}, {"worst_vh", worst_vh}, {"printed_best_vh", 9}, {"printed_worst_vh", 1}};
  }

  void stimulus_figures() {
    const Trial first = trials_of(data_.protocol, 0).front();
    const Stimulus s = stimulus_of(data_.protocol, first);
    add(sheet::Heading{"Stimuli and what is seen (figures 22, 23, 24)"});
    sheet::Columns row;
    row.columns = {{{path_plot(s)}}, {{force_plot(s)}}};
    add(std::move(row));
    sheet::Columns views;
    for (const Training t : kTrainingOrder)
      views.columns.push_back({{display_of(s, t, RunKind::training, data_.protocol)}});
    views.columns.push_back({{display_of(s, Training::haptic, RunKind::test, data_.protocol)}});
    add(std::move(views));
    if (s.scale < 1)
      say("Forces are " + text(100 * s.scale) + " % of those printed, so that their 12 N are the " +
              text(data_.protocol.device_n) + " N that the device can hold.",
          Tone::quiet);
  }

  void recall_figures() {
    if (data_.trials.empty()) return;
    add(sheet::Heading{"Alignment (figures 25, 26, 27)"});
    sheet::Columns row;
    row.columns.push_back({{synthetic_plot()}});
    // The trial of middle score, of all.
    std::vector<const TrialScore*> sorted;
    for (const TrialScore& t : data_.trials) sorted.push_back(&t);
    std::sort(sorted.begin(), sorted.end(), [](const TrialScore* a, const TrialScore* b) {
      return std::tie(a->recall.score, a->participant, a->trial.number) <
             std::tie(b->recall.score, b->participant, b->trial.number);
    });
    const TrialScore& middle = *sorted[sorted.size() / 2];
    const Recall r = score_recall(middle.target_n, middle.applied_n, {}, middle.rate_hz);
    row.columns.push_back({{alignment_plot(r)}});
    row.columns.push_back({{warped_plot(r)}});
    add(std::move(row));
    say(synthetic_text() + " Figures 26 and 27 are the trial of middle score: " + middle.participant + ", trial " +
            std::to_string(middle.trial.number) + " (" + short_name(middle.trial.training) + "), score " +
            text(middle.recall.score) + ".",
        Tone::quiet);
  }

  void parts() {
    if (people_.codes.size() < kPeopleNeeded) return;
    add(sheet::Heading{"Parts of the error"});
    sheet::Table table{{"measure", "H", "V", "V+H", "GG p"}, {}, {3, 1, 1, 1, 1}};
    Json rows = Json::list();
    const std::vector<std::pair<std::string, double (*)(const TrialScore&)>> measures{
        {"score (0 perfect, 1 no force)", [](const TrialScore& t) { return t.recall.score; }},
        {"time: partners apart, s", [](const TrialScore& t) { return t.recall.phase_s; }},
        {"force: partners apart, N", [](const TrialScore& t) { return t.recall.amplitude_n; }},
        {"slope: partners apart, N/s", [](const TrialScore& t) { return t.recall.slope_n_per_s; }},
        {"the dissertation's score (weights not printed), N", [](const TrialScore& t) { return t.recall.thesis_n; }},
        {"RMS without alignment, N", [](const TrialScore& t) { return t.recall.plain_rms_n; }},
    };
    for (const auto& [name, value] : measures) {
      const People p = people_of(data_, data_.trials, data_.protocol.trials, value);
      const RepeatedAnova a = repeated_anova(p.table(), kTrainings);
      table.rows.push_back(
          {{name}, {text(mean(p.means[0]))}, {text(mean(p.means[1]))}, {text(mean(p.means[2]))}, {p_text(a.p_gg)}});
      rows.push_back({{"measure", name},
                      {"h", mean(p.means[0])},
                      {"v", mean(p.means[1])},
                      {"vh", mean(p.means[2])},
                      {"p_gg", a.p_gg}});
    }
    add(std::move(table));
    json_["measures"] = rows;
    say("Only the first was planned; p values of the others stand for themselves and are not corrected for being many.",
        Tone::quiet);
  }

  void retention() {
    const int wanted = data_.protocol.trials / data_.protocol.repetitions;
    if (data_.retention.empty()) return;
    add(sheet::Heading{"On another day, without aid"});
    const People p = people_of(data_, data_.retention, wanted, [](const TrialScore& t) { return t.recall.score; });
    if (p.codes.size() < kPeopleNeeded) {
      refuse("Retention", std::to_string(p.codes.size()) + " people have done it; " + std::to_string(kPeopleNeeded) +
                              " are needed.");
      return;
    }
    const RepeatedAnova a = repeated_anova(p.table(), kTrainings);
    say("Mean scores H " + text(mean(p.means[0])) + ", V " + text(mean(p.means[1])) + ", V+H " +
        text(mean(p.means[2])) + " of " + std::to_string(p.codes.size()) +
        " people; repeated measures, Greenhouse and Geisser: p " + p_text(a.p_gg) + ".");
    json_["retention"] = Json{{"people", p.codes.size()},
                              {"h", mean(p.means[0])},
                              {"v", mean(p.means[1])},
                              {"vh", mean(p.means[2])},
                              {"p_gg", a.p_gg}};
  }

  void closing() {
    add(sheet::Heading{"What the pooled test would find in nothing"});
    const NullSettings settings;
    const NullResult n = null_experiments(settings);
    const auto rate = [&](int found) {
      const Interval i = wilson(found, n.experiments);
      return text(100.0 * found / n.experiments) + " % (" + text(100 * i.lo) + " to " + text(100 * i.hi) + ")";
    };
    sheet::Table table{
        {"test at 5 %", "found something in " + std::to_string(n.experiments) + " experiments with nothing in them"},
        {},
        {}};
    table.rows = {{{"repeated measures"}, {rate(n.repeated)}},
                  {{"repeated measures, Greenhouse and Geisser"}, {rate(n.repeated_gg)}},
                  {{"any pair, paired t with Holm"}, {rate(n.any_pair_holm)}},
                  {{"pooled one-way ANOVA over trials, as printed", Tone::caution}, {rate(n.pooled), Tone::caution}}};
    add(std::move(table));
    say("Simulated scores: 12 people, 24 trials a training, no difference of trainings; people differ by 15 % and in "
        "what suits them by 10 "
        "%. "
        "The last is what a pooled test takes for an effect of the training.",
        Tone::quiet);
    json_["null_experiments"] = Json{{"experiments", n.experiments},
                                     {"repeated", n.repeated},
                                     {"repeated_gg", n.repeated_gg},
                                     {"any_pair_holm", n.any_pair_holm},
                                     {"pooled", n.pooled}};
  }

  const ExperimentData& data_;
  double level_;
  People people_;
  Json json_, refused_ = Json::list();
  Sheet sheet_;
};

}  // namespace

ExperimentData read_experiment(const fs::path& folder) {
  ExperimentData d;
  d.protocol = read_protocol(folder);
  for (std::size_t i = 0; i < d.protocol.participants.size(); ++i) {
    const std::string& code = d.protocol.participants[i];
    for (const bool retention : {false, true}) {
      const std::vector<Trial> wanted = retention ? retention_of(d.protocol, i) : trials_of(d.protocol, i);
      for (TrialScore& t : read_trials(trials_folder(folder, code, retention))) {
        const auto n = static_cast<std::size_t>(t.trial.number);
        if (t.participant != code || n > wanted.size() || wanted[n - 1].training != t.trial.training ||
            wanted[n - 1].stimulus != t.trial.stimulus)
          throw Error(ExitCode::usage, code + ", trial " + std::to_string(n) + " is of another protocol",
                      "its file lies in the wrong folder, or protocol.json was changed after it was done");
        (retention ? d.retention : d.trials).push_back(std::move(t));
      }
    }
  }
  return d;
}

ExperimentAnalysis analyse(const ExperimentData& data, double level) {
  return Analyst(data, level).run();
}

}  // namespace osteo::inline assessment::experiment
