// The dissertation's figures from the data. Private to libs/assessment/experiment.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "osteo/assessment/experiment/protocol.h"
#include "osteo/assessment/experiment/recall.h"
#include "osteo/assessment/experiment/task.h"
#include "osteo/core/report/sheet.h"

namespace osteo::inline assessment::experiment {

[[nodiscard]] sheet::Plot path_plot(const Stimulus& stimulus);   // 22
[[nodiscard]] sheet::Plot force_plot(const Stimulus& stimulus);  // 23
[[nodiscard]] sheet::Drawing display_of(const Stimulus& stimulus, Training training, RunKind kind,
                                        const Protocol&);  // 24
[[nodiscard]] sheet::Plot synthetic_plot();                // 25
[[nodiscard]] std::string synthetic_text();
[[nodiscard]] sheet::Plot alignment_plot(const Recall& recall);                                                // 26
[[nodiscard]] sheet::Plot warped_plot(const Recall& recall);                                                   // 27
[[nodiscard]] sheet::Plot means_plot(const std::array<std::vector<double>, kTrainings>& means, double level);  // 28

}  // namespace osteo::inline assessment::experiment
