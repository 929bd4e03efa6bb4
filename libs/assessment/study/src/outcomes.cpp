#include "outcomes.h"

#include <algorithm>

namespace osteo::inline assessment::study {

statistics::Ratings ratings_of(const Study& study, const std::string& item) {
  statistics::Ratings r(study.sessions.size(), study.raters.size());
  for (std::size_t t = 0; t < study.sessions.size(); ++t) {
    for (std::size_t k = 0; k < study.raters.size(); ++k) {
      const auto session = study.raters[k].sessions.find(study.sessions[t].blind);
      if (session == study.raters[k].sessions.end()) continue;
      const auto value = session->second.find(item);
      if (value != session->second.end()) r.at(t, k) = value->second;
    }
  }
  return r;
}

std::vector<Outcome> outcomes_of(const Study& study) {
  std::vector<Outcome> all;
  std::vector<double> sum(study.sessions.size()), items(study.sessions.size());
  if (!study.raters.empty()) {
    for (const std::string& item : study.plan.items) {
      const statistics::Ratings r = ratings_of(study, item);
      Outcome o{"rating: " + item, true, {}, {}};
      for (std::size_t t = 0; t < r.targets(); ++t) {
        double total = 0, n = 0;
        for (std::size_t k = 0; k < r.raters(); ++k) {
          total += r.at(t, k).value_or(0);
          n += r.at(t, k) ? 1 : 0;
        }
        if (n == 0) continue;
        o.values.push_back(total / n);
        o.session.push_back(t);
        sum[t] += total / n;
        items[t] += 1;
      }
      all.push_back(std::move(o));
    }
    if (study.plan.items.size() > 1) {
      Outcome o{"rating: mean of items", true, {}, {}};
      for (std::size_t t = 0; t < sum.size(); ++t) {
        // Only where every item was given: other means would be of other things.
        if (items[t] != static_cast<double>(study.plan.items.size())) continue;
        o.values.push_back(sum[t] / items[t]);
        o.session.push_back(t);
      }
      all.push_back(std::move(o));
    }
  }
  for (const std::string& metric : study.metrics) {
    Outcome o{metric, false, {}, {}};
    for (std::size_t t = 0; t < study.sessions.size(); ++t) {
      const auto found = study.sessions[t].metrics.find(metric);
      if (found == study.sessions[t].metrics.end()) continue;
      o.values.push_back(found->second);
      o.session.push_back(t);
    }
    all.push_back(std::move(o));
  }
  return all;
}

std::vector<double> means_of_people(const Study& study, const Outcome& outcome, const std::string& group) {
  std::vector<double> means;
  for (const Participant& p : study.participants) {
    if (p.group != group) continue;
    double sum = 0, n = 0;
    for (std::size_t i = 0; i < outcome.values.size(); ++i) {
      if (study.sessions[outcome.session[i]].participant != p.code) continue;
      sum += outcome.values[i];
      n += 1;
    }
    if (n > 0) means.push_back(sum / n);
  }
  return means;
}

}  // namespace osteo::inline assessment::study
