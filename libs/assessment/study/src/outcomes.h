// What was measured of each session, ratings and metrics alike, ready to be compared.
#pragma once
#include <string>
#include <vector>

#include "osteo/assessment/study/study.h"
#include "osteo/core/statistics/agreement.h"

namespace osteo::inline assessment::study {

struct Outcome {
  std::string name;
  bool rating = false;
  std::vector<double> values;        ///< of the sessions that have it
  std::vector<std::size_t> session;  ///< which they are
};

/// One for each item (the mean of raters who gave it), of several items their mean too, then each metric.
[[nodiscard]] std::vector<Outcome> outcomes_of(const Study& study);

/// Sessions by raters.
[[nodiscard]] statistics::Ratings ratings_of(const Study& study, const std::string& item);

/// Of each person of a group the mean of that person's sessions; people without any are not in it.
[[nodiscard]] std::vector<double> means_of_people(const Study& study, const Outcome& outcome, const std::string& group);

}  // namespace osteo::inline assessment::study
