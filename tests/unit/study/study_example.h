// A study of people of unlike skill, for tests of what is kept and of what is made of it.
#pragma once
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "osteo/assessment/study/analysis.h"
#include "osteo/assessment/study/study.h"
#include "osteo/core/statistics/basics.h"

namespace osteo::study {

inline Plan plan_of(std::vector<std::string> groups = {"novice", "expert"}) {
  Plan p;
  p.title = "Facial recess";
  p.procedure = "cortical mastoidectomy";
  p.competent = groups.back();
  p.groups = std::move(groups);
  p.cases = {"left", "right"};
  p.attempts = 2;
  p.items = {"overall"};
  p.seed = 7;
  return p;
}

// People of unlike skill, sessions whose seconds fall and whose ratings rise with it.
inline Study example(int each = 7, int raters = 3, Plan plan = plan_of()) {
  Study s;
  s.plan = std::move(plan);
  s.metrics = {"seconds", "noise"};
  statistics::Random random(3);
  for (std::size_t g = 0; g < s.plan.groups.size(); ++g) {
    for (int i = 0; i < each; ++i)
      s.participants.push_back({s.plan.groups[g].substr(0, 1) + std::to_string(i), s.plan.groups[g]});
  }
  for (int r = 0; r < raters; ++r) s.raters.push_back({"R" + std::to_string(r + 1), {}});
  for (const Participant& p : s.participants) {
    const double skill = (p.group == s.plan.competent ? 1.5 : 0) + 0.4 * random.normal();
    for (const std::string& c : s.plan.cases) {
      Session one{"B" + std::to_string(s.sessions.size()), p.code, c, 1, {}, {}};
      const double now = skill + 0.3 * random.normal();
      one.metrics["seconds"] = 600 - 100 * now + 10 * random.normal();
      one.metrics["noise"] = random.normal();
      for (RaterSheet& r : s.raters)
        r.sessions[one.blind]["overall"] = std::clamp(std::round(2.2 + now + 0.4 * random.normal()), 1.0, 5.0);
      s.sessions.push_back(std::move(one));
    }
  }
  return s;
}

inline std::string message_of(const auto& call) {
  try {
    call();
  } catch (const Error& e) {
    return e.what();
  }
  return "no error";
}

}  // namespace osteo::study
