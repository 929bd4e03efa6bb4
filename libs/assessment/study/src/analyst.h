// The analysis of a study, part by part: each adds to the JSON and to the sheet. Private to libs/assessment/study.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>

#include "osteo/assessment/study/analysis.h"
#include "osteo/core/statistics/compare.h"
#include "outcomes.h"

namespace osteo::inline assessment::study {

using namespace statistics;

// Below these nothing is computed, and the report says so.
inline constexpr std::size_t kPeopleToCompare = 3, kPeopleToCorrelate = 5, kPeopleForAMark = 5, kTargetsToAgree = 5;

// So many digits, and all those of a whole number: 2012 seconds, not 2.01e+03.
inline std::string text(double v, int digits = 3) {
  if (!std::isfinite(v)) return "-";
  char out[40];
  const bool whole = std::abs(v) < 1e9 && std::abs(v) >= std::pow(10, digits) - 0.5;
  if (whole) {
    std::snprintf(out, sizeof out, "%.0f", v);
  } else {
    std::snprintf(out, sizeof out, "%.*g", digits, v);
  }
  return out;
}
inline std::string p_text(double p) {
  return !std::isfinite(p) ? "-" : p < 0.0001 ? "< 0.0001" : text(p, 2);
}
inline std::string with(const Estimate& e) {
  return std::isfinite(e.interval.lo) ? text(e.value) + " (" + text(e.interval.lo) + " to " + text(e.interval.hi) + ")"
                                      : text(e.value);
}
inline std::string counted(std::size_t n, const std::string& one, const std::string& more) {
  return std::to_string(n) + " " + (n == 1 ? one : more);
}
inline Json json_of(const Interval& i) {
  return std::isfinite(i.lo) && std::isfinite(i.hi) ? Json{i.lo, i.hi} : Json();
}
inline Json json_of(const Estimate& e) {
  return Json{{"value", e.value}, {"interval", json_of(e.interval)}};
}
inline Json json_of(const Summary& s) {
  return Json{{"people", s.n}, {"mean", s.mean}, {"sd", s.sd},       {"median", s.median},
              {"q1", s.q1},    {"q3", s.q3},     {"least", s.least}, {"most", s.most}};
}

inline constexpr double kAlpha = 0.05, kPower = 0.8;
/// All ways to exchange people up to so many are counted: of 12 and 12 they are 2.7 million.
inline constexpr double kMaxWays = 3'000'000, kMaxWaysOfMany = 200'000;
/// As many as a test that is one of `comparisons` needs: the smallest p that so many draws can give is then a tenth
/// of what the first to be found needs.
[[nodiscard]] PermutationSettings permutations(std::size_t comparisons, bool primary, std::uint64_t seed);

// Of each kind; a table has them all.
inline constexpr std::size_t kMaxCharts = 12;

class Analyst {
 public:
  Analyst(const Study& study, const AnalysisSettings& settings)
      : study_(study),
        settings_(settings),
        outcomes_(outcomes_of(study)),
        resampling_{settings.resamples, settings.level, study.plan.seed} {}
  Analysis run();

 private:
  const Study& study_;
  const AnalysisSettings& settings_;
  std::vector<Outcome> outcomes_;
  Resampling resampling_;
  Json json_;
  Json refused_ = Json::list();
  Sheet sheet_;

  void add(auto block) { sheet_.blocks.push_back({std::move(block)}); }
  void say(const std::string& words, Tone tone = Tone::plain) { add(sheet::Paragraph{words, tone}); }
  void refuse(const std::string& what, const std::string& why) {
    refused_.push_back({{"what", what}, {"why", why}});
    say(what + ": not computed. " + why, Tone::caution);
  }
  [[nodiscard]] const std::string& group_of(const Session& s) const {
    return std::find_if(study_.participants.begin(), study_.participants.end(),
                        [&](const Participant& p) { return p.code == s.participant; })
        ->group;
  }
  [[nodiscard]] std::vector<int> people_of(const Outcome& o) const {
    std::map<std::string, int> number;
    for (const Participant& p : study_.participants) number.emplace(p.code, static_cast<int>(number.size()));
    std::vector<int> people;
    for (const std::size_t s : o.session) people.push_back(number.at(study_.sessions[s].participant));
    return people;
  }

  /// Nothing where there are none.
  void add_charts(std::vector<sheet::Plot> charts, const std::string& legend);

  void check() const;
  void opening();
  void primary();
  void sources();
  /// Whether it is corrected together with others: all are where none is primary.
  [[nodiscard]] bool counts(const Outcome& o) const {
    const auto& names = study_.plan.primary;
    return names.empty() || std::find(names.begin(), names.end(), o.name) != names.end();
  }
  /// How many comparisons that is.
  [[nodiscard]] std::size_t family() const;
  void agreement();
  void compare();
  void compare_two(const Outcome& o, const std::string& first, const std::string& second, std::vector<Json>& rows,
                   std::vector<double>& p, sheet::Table& table, std::set<std::string>& said);
  [[nodiscard]] Json mixed(const Outcome& o, const std::string& first, const std::string& second) const;
  void repeated_table();
  void correlate();
  void hold(const Outcome& metric, const Outcome& rating, std::vector<sheet::Cell>& row);
  void decide();
  void power();
  void not_found();
  void closing();
};

}  // namespace osteo::inline assessment::study
