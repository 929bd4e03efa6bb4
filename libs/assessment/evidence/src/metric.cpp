#include "osteo/assessment/evidence/metric.h"

#include <algorithm>

namespace osteo::inline assessment {

std::string_view name_of(Better better) {
  return better == Better::higher ? "higher" : better == Better::lower ? "lower" : "neither";
}

Measured measured(MetricName name, double value, std::string of) {
  return {&name.row(), std::move(of), value, {}};
}

Measured not_measured(MetricName name, std::string why, std::string of) {
  return {&name.row(), std::move(of), std::nullopt, std::move(why)};
}

void not_measured_all(std::vector<Measured>& values, MetricPlace place, std::initializer_list<MetricWhen> when,
                      const std::string& why, const std::string& of) {
  for (const MetricRow& row : metric_table()) {
    if (row.place != place || std::find(when.begin(), when.end(), row.when) == when.end()) continue;
    values.push_back({&row, of, std::nullopt, why});
  }
}

}  // namespace osteo::inline assessment
