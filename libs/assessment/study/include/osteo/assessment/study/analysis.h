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
/// Everything the report says is in `json`; what there is too little for is in it under "refused", with the reason.
struct Analysis {
  Json json;
  Sheet sheet;
};
/// Statistics as docs/study.md defines them. Error(no_input) where no session or no participant is there, Error(usage)
/// where what is given is no metric of the study. Same study, same bytes.
[[nodiscard]] Analysis analyse(const Study& study, const AnalysisSettings& settings = {});

}  // namespace osteo::inline assessment::study
