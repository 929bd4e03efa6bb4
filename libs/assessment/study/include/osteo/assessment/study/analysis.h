// What a study shows, and what it does not.
#pragma once
#include <string>
#include <vector>

#include "osteo/assessment/study/study.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/report/sheet.h"

namespace osteo::inline assessment::study {

struct AnalysisSettings {
  double level = 0.95;
  int resamples = 2000;
  std::vector<std::string> given{};  ///< metrics that correlations are also told without: partial ones
};
/// Everything the report says is in `json`; what there is too little for is in it under "rejected", with the reason.
struct Analysis {
  Json json;
  Sheet sheet;
};
/// What two groups can find at all. `comparisons`: that are corrected together (primary outcomes times pairs of
/// groups that can be compared; all outcomes where none is primary), so that the first to be found needs p of `alpha` /
/// `comparisons`.
struct Reach {
  std::string a, b;
  std::size_t people_a = 0, people_b = 0, comparisons = 1;
  double alpha = 0.05, power = 0.8;
  double smallest_p = 1;         ///< that exchanging people could give, however they differ
  double detectable_effect = 0;  ///< in SDs of people, by Welch's test, simulated; NaN: none, however large
};
/// For each pair of groups, of all people with sessions, or, before there are sessions, of all participants.
/// `outcomes`: how many there are where none is primary.
[[nodiscard]] std::vector<Reach> reach_of(const Study& study, std::size_t outcomes = 1);
[[nodiscard]] std::string reported(const Reach& reach);
[[nodiscard]] Json json_of(const Reach& reach);

/// Statistics as docs/guides/study.md defines them. Error(no_input) where no session or no participant is there,
/// Error(usage) where what is given is no metric of the study. Same study, same bytes.
[[nodiscard]] Analysis analyse(const Study& study, const AnalysisSettings& settings = {});

}  // namespace osteo::inline assessment::study
