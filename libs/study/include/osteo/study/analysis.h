// What a study shows, and what it does not.
#pragma once
#include "osteo/base/json_document.h"
#include "osteo/report/sheet.h"
#include "osteo/study/study.h"

namespace osteo::study {

struct AnalysisSettings {
  double level = 0.95;
  int resamples = 2000;
};
/// Everything the report says is in `json`; what there is too little for is in it under "refused", with the reason.
struct Analysis {
  Json json;
  Sheet sheet;
};
/// Statistics as docs/study.md defines them. Error(no_input) where no session or no participant is there. Same study, same bytes.
[[nodiscard]] Analysis analyse(const Study& study, const AnalysisSettings& settings = {});

}  // namespace osteo::study
